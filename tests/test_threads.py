"""Linear algebra has one thread inside, and afterwards as many as before."""

from __future__ import annotations

from threadpoolctl import threadpool_info, threadpool_limits

from rbfrag.campaign.add_motions import add_motions
from rbfrag.fragility.fit.fitting import fit_source
from rbfrag.threads import with_one_thread


def threads() -> set[int]:
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_the_limit_ends_with_the_function() -> None:
    with threadpool_limits(limits=2, user_api="blas"):
        assert threads() == {2}
        assert with_one_thread(threads)() == {1}
        assert threads() == {2}


def test_fits_and_additions_of_motions_are_limited() -> None:
    for function in (add_motions, fit_source):
        assert getattr(function, "__wrapped__", None) is not None
