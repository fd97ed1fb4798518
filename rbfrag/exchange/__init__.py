"""Files of other tools, and our own tables of blocks."""
