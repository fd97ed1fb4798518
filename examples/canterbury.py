"""A fractured face under recorded motions of the Canterbury earthquakes.

    python examples/canterbury.py RECORDS --out FIGURE

RECORDS is a folder with horizontal records: of the Christchurch earthquake of February 2011 those
of HVSC and LPCC as the NGA-West2 archive has them, of an aftershock and of Darfield those of HVSC,
PARS and DFHS (public, GeoNet).
For every toppling block of canterbury-face.toml and every record the outcome is simulated in both
polarities and predicted three ways: from the record itself (its toppling spectrum), from PGV, PGA
and mean period, and from PGV alone, by the reference models that rbfrag ships.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

import rbfrag
from rbfrag.rockmasses.file import read_rock_mass
from rbfrag.rockmasses.report import toppling_blocks
from rbfrag.solver.excitation import excitation
from rbfrag.solver.integrator.batch import simulate_many
from rbfrag.solver.integrator.toppling_kernel import TOPPLED

FOLDER = Path(__file__).parent
FILES = {
    "HVSC Feb 2011": "*CCHURCH_HVSC*.AT2",
    "LPCC Feb 2011": "*CCHURCH_LPCC*.AT2",
    "HVSC": "*HVSC*.0[09]0",
    "PARS": "*PARS*.0[09]0",
    "DFHS": "*DFHS*.0[09]0",
}
ANSWERS = ("simulated", "from the record", "from PGV, PGA, Tm", "from PGV")


def shares(motion: rbfrag.GroundMotion, p2: np.ndarray, kr: np.ndarray) -> dict[str, float]:
    """Return the mean share of blocks that topple, simulated and by three predictions."""
    toppled = [
        simulate_many(excitation(motion, polarity=way), p2=p2, kr=kr).outcome == TOPPLED
        for way in ("forward", "reverse")
    ]
    pgv_only = {"pgv_m_s": motion.pgv_m_s}
    more = {**pgv_only, "pga_g": motion.pga_g, "tm_s": motion.tm_s}
    by_record = [rbfrag.predict(a, b, motion=motion).probability
                 for a, b in zip(p2.tolist(), kr.tolist(), strict=True)]  # fmt: skip
    fractions = {"simulated": float(np.mean(toppled)), "from the record": float(np.mean(by_record))}
    for name, measures in (("from PGV, PGA, Tm", more), ("from PGV", pgv_only)):
        answer = rbfrag.predict(p2, kr, **measures)
        fractions[name] = float(np.mean(answer.probability))
        fractions[f"{name}, low"] = float(np.mean(answer.ci_low))
        fractions[f"{name}, high"] = float(np.mean(answer.ci_high))
    return fractions


def study(records: Path) -> pd.DataFrame:
    """Return one row a record."""
    p2, kr, share = toppling_blocks(read_rock_mass(FOLDER / "canterbury-face.toml").realise())
    print(f"{p2.size} stable toppling blocks, {100 * share:.3g} % of the face; "
          f"p² {np.quantile(p2, 0.05):.3g} to {np.quantile(p2, 0.95):.3g} 1/s², "
          f"k_r {np.quantile(kr, 0.05):.2g} to {np.quantile(kr, 0.95):.2g}")  # fmt: skip
    rows = []
    for station, pattern in FILES.items():
        for path in sorted(records.rglob(pattern)):
            motion = rbfrag.read_motions(path, units="g")[0]
            rows.append(
                {
                    "station": station,
                    "component": path.stem[-4:] if path.suffix == ".AT2" else path.suffix[1:],
                    "pga_g": motion.pga_g,
                    "pgv_m_s": motion.pgv_m_s,
                    "tm_s": motion.tm_s,
                    **shares(motion, p2, kr),
                }
            )
    return pd.DataFrame(rows)


def draw(table: pd.DataFrame, path: str) -> None:
    """Draw the shares beside each other, with the intervals of the models."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.2, 4.4), layout="constrained")
    axes = figure.add_subplot()
    place = np.arange(len(table))
    colours = ("#333333", "#b2182b", "#2166ac", "#92c5de")
    for i, (name, colour) in enumerate(zip(ANSWERS, colours, strict=True)):
        errors = None
        if f"{name}, low" in table:
            errors = np.array([table[name] - table[f"{name}, low"],
                               table[f"{name}, high"] - table[name]]) * 100.0  # fmt: skip
        axes.bar(place + 0.2 * (i - 1.5), 100.0 * table[name], width=0.19, color=colour, label=name,
                 yerr=errors, capsize=2.5, error_kw={"lw": 1.0})  # fmt: skip
    words = [f"{r.station}\n{r.component}\n{r.pgv_m_s:.2f}\u00a0m/s" for r in table.itertuples()]
    axes.set_xticks(place, [word.replace(" ", "\n", 1) for word in words], fontsize=8)
    axes.set_xlabel("record and its PGV")
    axes.set_ylabel("blocks that topple [%]")
    figure.legend(loc="outside upper center", fontsize=9, frameon=False, ncols=4)
    axes.grid(True, axis="y", color="#dddddd", lw=0.6)
    axes.set_axisbelow(True)
    figure.savefig(path, dpi=160)


def main() -> None:
    """Print the table; draw it if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("records", type=Path)
    parser.add_argument("--out", help="figure to write (.png, .svg)")
    options = parser.parse_args()
    table = study(options.records)
    shown = ["station", "component", "pga_g", "pgv_m_s", "tm_s", *ANSWERS]
    print(table[shown].to_string(index=False, float_format=lambda value: f"{value:.3f}"))
    if options.out:
        draw(table, options.out)


if __name__ == "__main__":
    main()
