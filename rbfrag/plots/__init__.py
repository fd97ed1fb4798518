"""Every figure, one function each. The only room that imports matplotlib."""
