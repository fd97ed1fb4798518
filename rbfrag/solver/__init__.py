"""Response of rigid blocks to recorded shaking, their stability, and critical strengths.

Each kind of failure is one file of physics in `models`, run by the kernels of `integrator`. The
solver knows no database, no campaign and no fragility model.
"""
