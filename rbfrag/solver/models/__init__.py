"""The response models, one small file each; `rbfrag.solver.kinds` finds them."""
