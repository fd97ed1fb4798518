import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from rbfrag.db.location import REFERENCE
from rbfrag.service.app import make_app
from rbfrag.service.settings import ServiceSettings
from tests.cli.conftest import shell as shell


@pytest.fixture
def database(tmp_path: Path) -> Path:
    """A copy of the shipped reference: models of every kind, and nothing of it is shared."""
    return Path(shutil.copyfile(REFERENCE, tmp_path / "models.db"))


@pytest.fixture
def client(database: Path) -> Iterator[TestClient]:
    with TestClient(
        make_app(ServiceSettings(db=str(database))), raise_server_exceptions=False
    ) as result:
        yield result
