"""Comparison of speed and error with general ODE solvers, for `rbfrag bench`.

Cases are recorded motions with seeded blocks; every method runs them in turns, against an extended-
precision reference. Longer studies are in the folder `benchmarks`, not here.
"""
