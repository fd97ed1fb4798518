"""The response models, one small file each; `rbfrag.solver.response_models` finds them."""
