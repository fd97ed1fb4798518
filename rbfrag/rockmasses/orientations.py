"""Sets of measured planes: their mean and scatter, and what they are in the section of a face.

Poles scatter as of Fisher (1953) about the axis of the greatest moment of the poles.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rbfrag.errors import InputError
from rbfrag.files import csv_rows, source_text
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import percent
from rbfrag.solver.block.planes import STRIKE_DEG, Plane, plane_of, section_of
from rbfrag.solver.results import FloatArray

_DRAWS, _SEED = 100_000, 1
_WIDE_K = 30.0
_LARGEST_BYTES = 10_000_000


class OrientationSet(NamedTuple):
    """A set of planes.

    Args:
        mean: the mean plane.
        resultant: length R of the sum of their unit poles.
        fisher_k: concentration K = (N - 1)/(N - R).
        alpha95_deg: half-angle of the cone that holds the true mean with 95 % [deg].
        size: number N of planes.
    """

    mean: Plane
    resultant: float
    fisher_k: float
    alpha95_deg: float
    size: int

    def share_off(self, face: Plane) -> float:
        """Return the share of such planes that strike more than 20 deg off a face."""
        random = np.random.default_rng(_SEED)
        spread = 1.0 - math.exp(-2.0 * self.fisher_k)
        cosine = 1.0 + np.log1p(-random.random(_DRAWS) * spread) / self.fisher_k
        around = 2.0 * math.pi * random.random(_DRAWS)
        sine = np.sqrt(1.0 - cosine**2)
        pole = np.array(self.mean.pole)
        azimuth = math.radians(self.mean.direction_deg)
        strike = np.array([math.cos(azimuth), -math.sin(azimuth), 0.0])
        aside = np.cross(pole, strike)
        drawn = np.outer(cosine, pole) + np.outer(sine * np.cos(around), strike)
        drawn += np.outer(sine * np.sin(around), aside)
        off = np.degrees(np.arctan2(drawn[:, 0], drawn[:, 1])) - face.direction_deg
        off = np.abs((off + 90.0) % 180.0 - 90.0)
        return float(np.mean(off > STRIKE_DEG))


def orientation_set(planes: Sequence[Plane]) -> OrientationSet:
    """Return the mean and the scatter of planes.

    Raises:
        InputError: fewer than three planes, or all alike.
    """
    if len(planes) < 3:
        raise InputError(f"a set of {len(planes)} planes has no dispersion: give three or more")
    poles: FloatArray = np.array([plane.pole for plane in planes])
    axis = np.linalg.eigh(poles.T @ poles)[1][:, -1]
    poles[poles @ axis < 0.0] *= -1.0
    total = poles.sum(axis=0)
    total = -total if total[2] < 0.0 else total
    length, count = float(np.linalg.norm(total)), len(planes)
    if count - length < 1e-9:
        raise InputError("all planes of the set are identical: give one plane")
    east, north, up = (total / length).tolist()
    mean = Plane(
        math.degrees(math.acos(min(up, 1.0))), math.degrees(math.atan2(east, north)) % 360.0
    )
    cosine = 1.0 - (count - length) / length * (20.0 ** (1.0 / (count - 1)) - 1.0)
    return OrientationSet(
        mean, length, (count - 1) / (count - length), math.degrees(math.acos(max(cosine, -1.0))),
        count,
    )  # fmt: skip


def read_planes(path: str | os.PathLike[str]) -> list[str]:
    """Return the planes of a CSV of dip and dip direction [deg], as texts dip/direction.

    Raises:
        InputError: the file cannot be read, or a row is no plane; the line is named.
    """
    source = Path(path)
    planes: list[str] = []
    for line, cells in csv_rows(source_text(source, "planes", _LARGEST_BYTES)):
        row = [cell.strip() for cell in cells]
        if not any(row) or row[0].startswith("#") or (not planes and not _is_number(row[0])):
            continue
        try:
            planes.append("/".join(row[:2]))
            plane_of(planes[-1], "plane")
        except InputError as error:
            raise InputError(f"{source}: line {line}: {error}") from None
    return planes


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def in_section(description: Mapping[str, object]) -> tuple[dict[str, object], tuple[str, ...]]:
    """Return the description of a rock mass in the section across its face, and warnings.

    Args:
        description: as of a rock mass; ``face.plane`` with ``base.plane`` and ``back.plane``, each
            a text dip/dip direction or a list of such, stand for the dips; spacings are those
            along the normals.

    Raises:
        InputError: a plane is missing or cannot be read, or no section does.
    """
    converted = dict(description)
    plane_values = {name: converted.pop(f"{name}.plane", None) for name in ("face", "base", "back")}
    if all(value is None for value in plane_values.values()):
        return converted, ()
    planes: dict[str, Plane] = {}
    sets: dict[str, OrientationSet] = {}
    for name, value in plane_values.items():
        if value is None:
            raise InputError(f"{name}.plane is missing: give face, base and back as 25/102")
        if isinstance(value, list):
            sets[name] = orientation_set([plane_of(text, f"{name}.plane") for text in value])
            planes[name] = sets[name].mean
        else:
            planes[name] = plane_of(value, f"{name}.plane")
    face = planes["face"]
    section = section_of(face, planes["base"], planes["back"])
    notes: list[str] = []
    assert section.gamma_deg is not None
    dips = {"base": section.beta_deg, "back": section.beta_deg + section.gamma_deg}
    factors = {"base": section.base_factor, "back": section.back_factor}
    for name, dip in dips.items():
        if f"{name}.dip_deg" in converted:
            raise InputError(f"{name}.dip_deg and {name}.plane both give the dip: give one of them")
        converted[f"{name}.dip_deg"] = dip
        spacing = f"{name}.spacing_m"
        if spacing in converted:
            converted[spacing] = _scaled(converted[spacing], factors[name])
        if name not in sets:
            continue
        joints = sets[name]
        kappa = joints.fisher_k / factors[name] ** 2
        converted[f"{name}.dip_deg"] = {"distribution": "von_mises", "mean": dip, "kappa": kappa}
        notes.append(
            f"{name}: {joints.size} planes, mean {joints.mean}, Fisher K {joints.fisher_k:.4g}, "
            f"alpha95 {joints.alpha95_deg:.3g} deg; {percent(joints.share_off(face))} of such "
            f"planes strike more than {STRIKE_DEG:g} deg off the face, which the section leaves out"
        )
        if joints.fisher_k < _WIDE_K:
            notes.append(
                f"{name}: with K below {_WIDE_K:g} the dips in the section scatter a little more "
                "than the von Mises law drawn from (at K 10 by 3.3 %)"
            )
    coded = (Diagnostic(note, "plane_sets") for note in notes)
    return converted, (*section.remarks, *coded)


def _scaled(law: Any, factor: float) -> Any:
    """Return the distribution of a length multiplied by a factor."""
    if isinstance(law, dict):
        return {
            key: value if key in ("distribution", "sd_ln", "kappa") else _scaled(value, factor)
            for key, value in law.items()
        }
    if isinstance(law, list):
        return [_scaled(item, factor) for item in law]
    return law * factor if isinstance(law, int | float) and not isinstance(law, bool) else law
