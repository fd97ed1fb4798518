"""Questions about blocks and their shaking: from inputs of any interface to the model that answers.

Blocks are classified (shape, contacts, mode, numbers), grouped by kind, answered and put back in
order. Inputs are declared in `vocabulary`; integration over hazard is in `hazards`.
"""
