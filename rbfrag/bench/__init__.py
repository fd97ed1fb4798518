"""Comparison of speed and error with general ODE solvers, for `rbfrag bench`.

Cases are recorded motions with seeded blocks; every method runs them in turns. Errors are measured
from rbfrag's solution in finer steps, which `benchmarks` compares with extended precision; longer
studies and the solvers of other packages are there, too.
"""
