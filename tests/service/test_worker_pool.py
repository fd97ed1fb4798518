"""Long work is done elsewhere, and ended when nobody can wait for it."""

import asyncio
import time

import pytest

from rbfrag.errors import InputError
from rbfrag.service.problem import RequestRefusedError
from rbfrag.service.work import WorkerPool
from tests.service import slow_work


class Waiting:
    """A request whose client waits, or leaves after a while."""

    def __init__(self, leaves_after_s=1e6):
        self.leaves_after_s = leaves_after_s

    async def receive(self):
        await asyncio.sleep(self.leaves_after_s)
        return {"type": "http.disconnect"}


@pytest.fixture(scope="module")
def pool():
    result = WorkerPool(1, 3.0)
    ready(result)
    yield result
    result.close()


def ready(pool):
    """Wait until a process is there, which takes longer than the limit of these tests."""
    pool.open().schedule(slow_work.answer, args=("",)).result(120)


def do(pool, *inputs, request=None):
    return asyncio.run(pool.run(request or Waiting(), *inputs))


def test_work_is_answered(pool):
    assert do(pool, slow_work.answer, "done") == b"done"


def test_an_error_on_purpose_comes_back(pool):
    with pytest.raises(InputError, match="kr = -1"):
        do(pool, slow_work.reject, "kr = -1 is not above zero")


def test_work_beyond_the_limit_is_ended(pool):
    start = time.monotonic()
    with pytest.raises(RequestRefusedError, match="longer than the limit of 3 s") as rejected:
        do(pool, slow_work.sleep, 1000.0)
    assert rejected.value.status_code == 422
    ready(pool)  # the next piece of work is not kept waiting by it
    assert time.monotonic() - start < 120
    assert do(pool, slow_work.answer, "next") == b"next"


def test_work_for_a_client_that_has_gone_is_ended(pool):
    with pytest.raises(RequestRefusedError, match="closed"):
        do(pool, slow_work.sleep, 1000.0, request=Waiting(0.5))
    ready(pool)
    assert do(pool, slow_work.answer, "next") == b"next"


def test_work_that_waits_too_long_may_be_asked_again(pool):
    async def both():
        return await asyncio.gather(
            pool.run(Waiting(), slow_work.sleep, 1000.0),
            pool.run(Waiting(), slow_work.answer, "waits"),
            return_exceptions=True,
        )

    long, waited = asyncio.run(both())
    assert long.status_code == 422
    assert waited.status_code == 503
    assert waited.headers["retry-after"]
    ready(pool)


def test_a_process_that_dies_is_replaced(pool):
    with pytest.raises(RequestRefusedError) as rejected:
        do(pool, slow_work.die)
    assert rejected.value.status_code == 503
    ready(pool)
    assert do(pool, slow_work.answer, "again") == b"again"
