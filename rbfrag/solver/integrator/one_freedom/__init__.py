"""Motion with one degree of freedom: the engine that the response models share."""
