"""Rock masses: random joint sets, their blocks, how many fail."""
