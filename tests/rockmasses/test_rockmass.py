"""Blocks drawn from a rock mass: streams, counting, modes, and Example 3 of the dissertation."""

from __future__ import annotations

import contextlib
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbfrag.errors import InputError
from rbfrag.rockmasses.counts import crossings, cumulative_counts, mode_counts, sorted_yields
from rbfrag.rockmasses.distributions import LAWS
from rbfrag.rockmasses.joint_sets import IMPOSSIBLE, VARIABLES, RockMass
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.modes import MODES
from rbfrag.solver.stability.single import stability


def normal(mean: float, sd: float, **ends: float) -> dict[str, object]:
    return {"distribution": "normal", "mean": mean, "sd": sd, **ends}


TABLE_3_4: dict[str, object] = {
    "base.dip_deg": normal(20.0, 5.0),
    "base.spacing_m": normal(1.0, 0.1),
    "back.dip_deg": normal(45.0, 5.0),
    "back.spacing_m": normal(0.6, 0.1),
    "friction.phi_deg": 40.0,
}

# Steep backs, slender and stocky blocks, weak and strong friction: every mode and state.
WILD: dict[str, object] = {
    "base.dip_deg": {"distribution": "uniform", "low": -20.0, "high": 35.0},
    "base.spacing_m": {"distribution": "lognormal", "median": 1.0, "sd_ln": 0.7},
    "back.dip_deg": {"distribution": "uniform", "low": 25.0, "high": 175.0},
    "back.spacing_m": {"distribution": "lognormal", "median": 1.0, "sd_ln": 0.7},
    "friction.phi_deg": {"distribution": "uniform", "low": 15.0, "high": 50.0},
    "friction.phi_back_deg": {"distribution": "uniform", "low": 10.0, "high": 50.0},
}


def mass(**changes: object) -> RockMass:
    return RockMass.of({**TABLE_3_4, **{k.replace("__", "."): v for k, v in changes.items()}})


class TestExample3:
    """Table 3.4, 20,000 samples: 61.5 % slides, 38.5 % slumps, counts equal at 0.415 g."""

    def test_shares_and_crossing_within_sampling_error(self) -> None:
        result = mass().realise(20_000, 1)
        counts = mode_counts(result)
        assert counts["topple"].count == counts["confined_topple"].count == 0
        for mode, published in (("slide", 0.615), ("slump", 0.385)):
            answer = counts[mode]  # type: ignore[index]
            assert answer.share_error == pytest.approx(0.0034, abs=1e-4)
            # both numbers carry the error of their own 20,000 samples
            assert abs(answer.share - published) < 2.0 * math.sqrt(2.0) * answer.share_error
        (crossing,) = crossings(result)
        assert (crossing.below, crossing.above) == ("slump", "slide")
        assert crossing.standard_error_g == pytest.approx(0.003, abs=5e-4)
        assert abs(crossing.pga_g - 0.415) < 2.0 * math.sqrt(2.0) * crossing.standard_error_g
        medians = [counts[m].yield_quantiles_g[0.5] for m in ("slide", "slump")]  # type: ignore[index]
        assert medians == pytest.approx([0.398, 0.289], abs=0.004)

    def test_the_stated_errors_are_those_of_repeated_samples(self) -> None:
        samples = [mass().realise(4_000, seed) for seed in range(40)]
        shares = [mode_counts(result)["slide"] for result in samples]
        met = [crossings(result) for result in samples]
        assert {len(answer) for answer in met} == {1}
        for values, errors in (
            ([s.share for s in shares], [s.share_error for s in shares]),
            ([c[0].pga_g for c in met], [c[0].standard_error_g for c in met]),
        ):
            # a standard deviation of 40 numbers is known to 11 %
            assert np.mean(errors) == pytest.approx(np.std(values, ddof=1), rel=0.35)


class TestStreams:
    def test_a_seed_gives_the_same_blocks_and_another_one_others(self) -> None:
        first, again, other = (mass().realise(500, seed) for seed in (3, 3, 4))
        assert np.array_equal(first.s1_m, again.s1_m)
        assert np.array_equal(
            first.stability.yield_acceleration, again.stability.yield_acceleration, equal_nan=True
        )
        assert not np.any(first.s1_m == other.s1_m)

    @pytest.mark.parametrize("key", sorted(VARIABLES))
    def test_changing_one_variable_leaves_the_others(self, key: str) -> None:
        names = {
            "base.dip_deg": "beta_deg",
            "base.spacing_m": "s1_m",
            "friction.phi_deg": "phi_deg",
            "friction.phi_back_deg": "phi_back_deg",
            "block.kv": "kv",
            "friction.cohesion_pa": "cohesion_pa",
            "back.spacing_m": "s2_m",
            "back.water_m": "water_m",
            "friction.jrc": "jrc",
        }
        base = {**TABLE_3_4, "friction.phi_back_deg": 35.0, "block.density_kg_m3": 2700.0}
        if key.startswith("friction.j"):
            base |= {"friction.jrc": 8.0, "friction.jcs_mpa": 60.0}
        before = RockMass.of(base).realise(200, 9)
        low = 50.0 if key == "back.dip_deg" else 0.3
        changed = {"distribution": "uniform", "low": low, "high": low + 0.5}
        after = RockMass.of({**base, key: changed}).realise(200, 9)
        scaled = ("base.spacing_m", "back.spacing_m") if key == "block.size_factor" else (key,)
        for other, name in names.items():
            same = np.array_equal(getattr(before, name), getattr(after, name))
            assert same == (other not in scaled), other

    def test_variables_are_independent(self) -> None:
        law = {"distribution": "uniform", "low": 1.0, "high": 2.0}
        result = RockMass.of({**dict.fromkeys(TABLE_3_4, law), "friction.phi_back_deg": law}).draw(
            20_000, 1
        )
        values = np.array([result[key] for key in (*TABLE_3_4, "friction.phi_back_deg")])
        correlation = np.corrcoef(values) - np.eye(len(values))
        assert np.abs(correlation).max() < 4.0 / math.sqrt(20_000)

    def test_streams_have_numbers_of_their_own(self) -> None:
        assert len({variable.stream for variable in VARIABLES.values()}) == len(VARIABLES)


class TestBlocks:
    def test_every_block_is_the_one_that_its_numbers_make(self) -> None:
        result = RockMass.of(WILD).realise(400, 2)
        for i in np.flatnonzero(result.is_block):
            block = Block.from_fractures(result.s1_m[i], result.s2_m[i], result.gamma_deg[i])
            answer = stability(
                block,
                beta_deg=result.beta_deg[i],
                phi_deg=result.phi_deg[i],
                phi_back_deg=result.phi_back_deg[i],
            )
            assert result.stability.mode[i] == answer.mode
            assert result.stability.state[i] == answer.state
            assert result.stability.yield_acceleration[i] == answer.yield_acceleration
            assert result.stability.p2[i] == block.p2

    def test_counts_add_up_with_every_mode_and_state(self) -> None:
        result = RockMass.of(WILD).realise(20_000, 2)
        counts = mode_counts(result)
        assert tuple(counts) == MODES
        assert sum(c.count for c in counts.values()) == result.n_blocks
        assert result.n_blocks + sum(result.impossible.values()) == result.n == 20_000
        assert sum(c.share for c in counts.values()) == pytest.approx(1.0, abs=1e-12)
        states: dict[str, int] = {}
        for count in counts.values():
            assert count.count > 0
            assert sum(count.states.values()) == count.count
            for state, number in count.states.items():
                states[state] = states.get(state, 0) + number
            quantiles = list(count.yield_quantiles_g.values())
            assert quantiles == sorted(quantiles)
        assert min(states.values()) > 0

    def test_cumulative_counts_are_counts(self) -> None:
        result = RockMass.of(WILD).realise(5_000, 2)
        answer = result.stability
        pga = np.array([0.0, 0.1, 0.35, 1.0, 50.0])
        for mode in MODES:
            brute = [
                int(
                    np.sum(
                        result.is_block & (answer.mode == mode) & (answer.yield_acceleration <= a)
                    )
                )
                for a in pga
            ]
            assert cumulative_counts(result, mode, pga).tolist() == brute
            locked = mode_counts(result)[mode].states["locked"]
            assert sorted_yields(result, mode).size == mode_counts(result)[mode].count - locked

    def test_size_scales_the_spacings_and_nothing_else(self) -> None:
        small, large = mass().realise(300, 1), mass(block__size_factor=2.0).realise(300, 1)
        assert np.allclose(large.s1_m, 2.0 * small.s1_m, rtol=1e-15)
        assert np.array_equal(large.stability.mode_code, small.stability.mode_code)
        fine = small.is_block
        assert np.allclose(large.stability.p2[fine], 0.5 * small.stability.p2[fine], rtol=1e-14)

    def test_vertical_acceleration_scales_the_yield_and_not_kr_at_rest(self) -> None:
        still, lifted = RockMass.of(WILD), RockMass.of({**WILD, "block.kv": 0.25})
        a, b = still.realise(2_000, 3), lifted.realise(2_000, 3)
        k, k_lifted = a.stability.yield_acceleration, b.stability.yield_acceleration
        finite = np.isfinite(k) & a.is_block
        assert np.allclose(k_lifted[finite], 1.25 * k[finite], rtol=1e-12)
        both = np.isfinite(a.kr_at_rest)
        assert both.any()
        assert np.allclose(b.kr_at_rest[both], a.kr_at_rest[both], rtol=1e-12)

    def test_without_back_fracture_nothing_slumps_or_is_confined(self) -> None:
        result = RockMass.of({**WILD, "block.back_fracture": False}).realise(5_000, 2)
        counts = mode_counts(result)
        assert counts["confined_topple"].count == 0
        assert counts["slump"].states["stable"] == counts["slump"].states["locked"] == 0
        assert counts["topple"].count > 0


class TestImpossible:
    CASES: tuple[tuple[dict[str, Any], int], ...] = (
        ({"base__spacing_m": normal(0.1, 0.1)}, 1),
        ({"back__spacing_m": normal(0.1, 0.1)}, 2),
        ({"base__dip_deg": normal(80.0, 10.0), "back__dip_deg": 170.0}, 3),
        ({"back__dip_deg": normal(22.0, 5.0)}, 4),
        ({"friction__phi_deg": normal(5.0, 5.0)}, 5),
        ({"friction__phi_back_deg": normal(85.0, 5.0)}, 5),
        ({"block__size_factor": normal(1.0, 1.0)}, 6),
        ({"block__kv": normal(-0.5, 0.5)}, 7),
        ({"friction__cohesion_pa": normal(9.0, 9.0), "block__density_kg_m3": 2700.0}, 8),
        ({"block__density_kg_m3": normal(9.0, 9.0)}, 9),
        ({"back__water_m": normal(0.1, 0.1), "block__density_kg_m3": 2650.0}, 10),
        ({"back__water_m": 9.0, "block__density_kg_m3": 2650.0}, 11),
    )

    @pytest.mark.parametrize(("changes", "code"), CASES)
    def test_they_are_counted_with_their_reason(self, changes: dict[str, Any], code: int) -> None:
        result = mass(**changes).realise(2_000, 1)
        share = result.impossible[IMPOSSIBLE[code]] / 2_000
        assert 0.1 < share < 0.6
        bad = ~result.is_block
        assert set(result.reason[bad]) == set(result.impossible)
        assert set(result.reason[~bad]) == {""}
        assert sum(c.count for c in mode_counts(result).values()) == result.n_blocks

    def test_every_reason_but_slivers_is_met_above(self) -> None:
        assert {code for _, code in self.CASES} == set(range(1, len(IMPOSSIBLE) - 1))

    def test_slivers(self) -> None:
        result = mass(back__spacing_m={"distribution": "measured", "values": [1e-20, 0.6]})
        answer = result.realise(400, 1)
        sliver = answer.reason_code == len(IMPOSSIBLE) - 1
        assert 100 < int(sliver.sum()) < 300
        assert np.all(answer.s2_m[sliver] == 1e-20)

    def test_no_block_at_all_is_rejected_with_the_reasons(self) -> None:
        with pytest.raises(InputError, match=r"none of 50 realisations is a block: 50 times gamma"):
            mass(back__dip_deg=10.0, base__dip_deg=15.0).realise(50)


class TestRefusals:
    @pytest.mark.parametrize(
        ("key", "value", "words"),
        [
            ("base.spacing_m", 0.0, "base.spacing_m: 0 is out of range: give above 0"),
            ("base.spacing_m", normal(-1.0, 0.1), "base.spacing_m: -1 is out of range"),
            ("friction.phi_deg", 90.0, "friction.phi_deg: 90 is out of range: give from 0"),
            ("friction.phi_deg", -1.0, "friction.phi_deg: -1 is out of range"),
            ("friction.phi_deg", math.nan, "friction.phi_deg: nan is not finite"),
            ("friction.phi_back_deg", normal(95.0, 2.0), "friction.phi_back_deg: 95"),
            ("base.dip_deg", 90.0, "base.dip_deg: 90 is out of range: give between -90 and 90"),
            ("back.dip_deg", {"distribution": "measured", "values": [45.0, 300.0]}, "300"),
            ("back.spacing_m", {"distribution": "uniform", "low": -1.0, "high": 1.0}, "-1 is out"),
            ("block.kv", -1.0, "block.kv: -1 is out of range: give above -1"),
            ("block.size_factor", 0.0, "block.size_factor: 0"),
            ("block.back_fracture", 1, "block.back_fracture = 1: use true or false"),
            ("block.cohesion_pa", 5.0, "unknown key block.cohesion_pa"),
            ("realisations", 0, "realisations = 0"),
            ("realisations", -3, "realisations = -3"),
            ("realisations", 1e3, "realisations = 1000.0"),
            ("realisations", True, "realisations = True"),
            ("seed", -1, "seed = -1"),
            ("base.dip_deg", {"distribution": "gumbel"}, "base.dip_deg: distribution = 'gumbel'"),
        ],
    )
    def test_values(self, key: str, value: object, words: str) -> None:
        with pytest.raises(InputError, match=words):
            RockMass.of({**TABLE_3_4, key: value})

    @given(
        key=st.sampled_from([*VARIABLES, "block.back_fracture", "realisations", "seed"]),
        value=st.recursive(
            st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
            lambda inner: (
                st.lists(inner, max_size=3)
                | st.dictionaries(
                    st.sampled_from(["distribution", *(k for keys in LAWS.values() for k in keys)]),
                    inner | st.sampled_from(sorted(LAWS)),
                    max_size=4,
                )
            ),
            max_leaves=6,
        ),
    )
    def test_anything_else_is_rejected_in_words(self, key: str, value: object) -> None:
        with contextlib.suppress(InputError):
            mass = RockMass.of({**TABLE_3_4, key: value})
            assert mass.realise(20).n == 20

    @pytest.mark.parametrize("key", TABLE_3_4)
    def test_missing_keys_are_named(self, key: str) -> None:
        with pytest.raises(InputError, match=f"{key} is missing"):
            RockMass.of({k: v for k, v in TABLE_3_4.items() if k != key})

    @pytest.mark.parametrize("n", [0, -1, 10**9, 1.5])
    def test_numbers_of_realisations(self, n: Any) -> None:
        with pytest.raises(InputError, match="whole number of realisations"):
            mass().realise(n)
