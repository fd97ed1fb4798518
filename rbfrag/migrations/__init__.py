"""Alembic migrations, shipped in the wheel so that an installed rbfrag can upgrade."""
