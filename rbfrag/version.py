"""The version number, in its own file so that `--version` loads nothing else."""

__version__ = "0.1.0"
