"""Writers of made-up record files in the spellings that real ones use."""

from __future__ import annotations

from collections.abc import Sequence


def peak(tokens: Sequence[str], factor: float = 1.0, decimals: int = 3) -> str:
    """The largest of printed numbers, of either sign, as headers state it."""
    return f"{factor * max(map(float, tokens), key=abs):.{decimals}f}"


AT2_SAMPLING = (
    "NPTS= {npts:6d}, DT= {dt:.5f} SEC",
    "NPTS=   {npts}, DT=   {dt:.4f} SEC,                                             ",
    "NPTS=   {npts}, DT=   {dt:.4f} SEC,   0 POLE @    13.90000 HZ,  -5 POLE @      .10000",
    "NPTS=   {npts}, dt=   {dt:.4f} SEC",
    "NPTS=   {npts}, dt=  {dt:.5f}",
    "{npts:7d}    {dt:.4f}    NPTS, DT",
)


def at2(
    samples: Sequence[str],
    dt_s: float,
    *,
    sampling: str = AT2_SAMPLING[0],
    names: str = "CHI-CHI 09/20/99, TCU068, N",
    quantity: str = "ACCELERATION TIME HISTORY IN UNITS OF G. FILTER POINTS: HP=0.03 Hz",
    npts: int | None = None,
    per_line: int = 5,
) -> str:
    """Text of an AT2 file; `samples` as printed."""
    line = sampling.format(npts=len(samples) if npts is None else npts, dt=dt_s)
    if dt_s < 1.0 and "  0." not in line:
        line = line.replace(" 0.", "  .")
    lines = ["PEER STRONG MOTION DATABASE RECORD. PROCESSING BY PACIFIC ENGINEERING.", names]
    lines += [quantity, line]
    lines += ["  ".join(samples[i : i + per_line]) for i in range(0, len(samples), per_line)]
    return "\n".join(lines) + "\n"


def two_columns(
    times: Sequence[str], samples: Sequence[str], *, mark: str = ",", header: str = ""
) -> str:
    """Text of two columns as printed."""
    rows = [f"{t}{mark}{a}" for t, a in zip(times, samples, strict=True)]
    return header + "\n".join(rows) + "\n"


def v2a(components: Sequence[tuple[str, Sequence[str]]], dt_s: float) -> str:
    """Text of a GeoNet V2A file from (name, printed accelerations of at most 8 characters)."""
    return "".join(_v2a_component(name, samples, dt_s) for name, samples in components)


def _v2a_component(name: str, samples: Sequence[str], dt_s: float) -> str:
    npts = len(samples)
    text = [
        "Corrected accelerogram 20161113_110256_ABCD_20 GNS Science",
        "Site ABCD      42 37 10S  173 03 13E     Cusp file:  20161113_110259_ABCD",
        "Somewhere Farm",
        "Instrument Cusp_10462",
        "Resolution: 18-bit   Instr Period: 0.0050 s   Damping: 0.700",
        "Accelerogram 20161113_110256_ABCD_20                 Processed 2016 December 09",
        "5 km south-west of Somewhere",
        "2016 November 13         11:02:56 UT",
        "Epicentre  42 41 33S 173 01 19E  Bearing S18W  Dist    9km  Depth   15km Mw 7.82",
        f"Number of points  {npts}    Duration {npts * dt_s:.2f} sec",
        f"Instrument corrected data at {dt_s:.3f} sec intervals",
        "Band-pass filter transition bands are .10-.25 Hz and 24.50-25.50 Hz",
        f"Component {name}  Longitudinal Accelerometer Axis",
        f"Acceleration:  peak  {peak(samples)} mm/s/s at  44.88 sec     rms    719.0 mm/s/s",
        "Velocity:      peak -1016.55 mm/s   at  46.58 sec     rms    96.10 mm/s",
        "Displacement:  peak  234.852 mm     at  46.36 sec     rms   38.013 mm",
    ]
    numbers = ["      0." * 10] * 10
    series = [
        "".join(f"{token:>8}" for token in tokens[i : i + 10])
        for tokens in (samples, ["1.0"] * npts, ["2.0"] * npts)
        for i in range(0, npts, 10)
    ]
    return "\n".join([*text, *numbers, *series]) + "\n"
