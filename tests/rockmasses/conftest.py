"""Fixtures shared with the tests of models."""

from tests.fragility.conftest import model as model
from tests.fragility.conftest import row as row
