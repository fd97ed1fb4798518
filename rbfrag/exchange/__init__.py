"""Files of other tools, and tables of blocks.

Public functions that accept a path live here; they read, call the package that computes, and write.
No statistics and no physics.
"""
