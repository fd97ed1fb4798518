"""One file a format: the pattern that recognises it, and its parse."""
