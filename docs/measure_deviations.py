"""Print the deviations that the verification page quotes.

Pulses, closed forms and the independent integrator are those of the tests; the tests set
bounds, this tells how far below the bounds the solver stays. The comparison on real records
is left out where there are none (RBFRAG_TEST_RECORDS, default ../shared/motions).
"""

from __future__ import annotations

import math
import os
import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.search.critical import critical
from tests.physics import test_closed_forms as closed
from tests.physics import test_reversal_pulses as reversal
from tests.physics.pulses import sine_lobes
from tests.solver import test_against_reference as reference

ROOT = Path(__file__).resolve().parent.parent


def deviation(motion: GroundMotion, expected: float) -> float:
    """Return the relative deviation of the linear critical value from the closed form."""
    critical = closed.critical_angle(motion).kr_over_pga
    assert critical is not None
    return abs(critical / expected - 1.0)


def main() -> None:
    print("Largest relative deviation of the linear critical k_r/PGA, f = 0.1 ... 5")
    for name, (make, closed_form) in closed.EXACT.items():
        worst = max(
            deviation(make(f / closed.P, closed.AMPLITUDE_G), closed_form(f)) for f in closed.F
        )
        print(f"  {name:<28} {worst:.1e}")
    a = closed.AMPLITUDE_G
    for name, pulses, samples, closed_form in (
        ("half-sine, 2000 samples", (a,), 2000, closed.half_sine),
        ("sine cycle, 6000 samples", (a, -a), 3000, closed.full_sine),
    ):
        worst = max(
            deviation(sine_lobes(f / closed.P, pulses, samples), closed_form(f)) for f in closed.F
        )
        print(f"  {name:<28} {worst:.1e}")
    print("Half-sine of f = 1 by the number of samples")
    for samples in (50, 100, 200, 400):
        pulse = sine_lobes(1.0 / closed.P, (a,), samples)
        print(f"  {samples:<28} {deviation(pulse, closed.half_sine(1.0)):.1e}")
    print("Critical k_r of reversal pulses, non-linear, p2 = 2, pulses of 0.25 s, 1 g and -r g")
    for r in (0.0, 0.35, 0.65, 1.0, 1.25):
        print(f"  r = {r:<24g} {critical(reversal.reversal(r), p2=2.0).kr:.7f}")
    print("Peak over the critical angle of the weakest block that stays")
    for r in (0.88, 0.9, 1.0):
        print(f"  r = {r:<24g} {reversal.boundary_peak(r):.5f}")
    print("Rectangular full cycle, 1 g, pulses of 1/6 s: linear theta_c, non-linear k_r/PGA")
    for p2 in (1.0, 4.6, 21.5, 100.0):
        wave = closed.rectangular_cycle(1.0 / 6.0, 1.0)
        linear = critical(wave, p2=p2, linear=True).kr
        assert linear is not None
        exact = math.expm1(-math.sqrt(p2) / 6.0) ** 2
        kr = critical(wave, p2=p2).kr_over_pga
        print(f"  p2 = {p2:<23g} {linear:.6f} (closed form {exact:.6f})   {kr:.6f}")
    records = Path(os.environ.get("RBFRAG_TEST_RECORDS") or ROOT / "../shared/motions")
    if records.is_dir():
        against_the_reference(records)


def against_the_reference(records: Path) -> None:
    """Run the test on real records and tell what it saw."""
    seen = []
    compare = reference.compare

    def watched(*arguments: object) -> tuple[str, float]:
        seen.append(compare(*arguments))  # type: ignore[arg-type]
        return seen[-1]

    reference.compare = watched
    reference.test_same_outcome_and_peak_on_real_records(records)
    outcomes = Counter(str(outcome) for outcome, _ in seen)
    print("Against scipy's DOP853 on real records")
    print(f"  motions {len(reference.motions(records))}, runs {len(seen)}: {dict(outcomes)}")
    print(f"  largest relative deviation of the peak rotation {max(d for _, d in seen):.1e}")


if __name__ == "__main__":
    main()
