"""Record formats, one file each: the pattern that identifies a format, and its parser."""
