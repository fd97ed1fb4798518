"""Rock masses: joint sets that scatter, their blocks, and how many fail."""
