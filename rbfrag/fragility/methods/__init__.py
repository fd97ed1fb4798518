"""One file a method of fitting."""
