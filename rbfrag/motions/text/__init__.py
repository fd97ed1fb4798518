"""Fields, columns and times in text files."""
