"""Seismic fragility of rock blocks.

Accelerations are in g, velocities in m/s, displacements in m, times in s, p2 in 1/s²,
angles in degrees wherever a name ends in ``_deg``. Names are loaded when first used, so
that ``import rbfrag`` itself costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rbfrag.campaign.add_motions import add_motions as add_motions
    from rbfrag.campaign.simulate import simulate as simulate
    from rbfrag.errors import DatabaseError as DatabaseError
    from rbfrag.errors import FitError as FitError
    from rbfrag.errors import InputError as InputError
    from rbfrag.errors import MotionFileError as MotionFileError
    from rbfrag.errors import RbfragError as RbfragError
    from rbfrag.errors import UnknownModelError as UnknownModelError
    from rbfrag.errors import WorkFailedError as WorkFailedError
    from rbfrag.exchange.database_tables import read_table as read_table
    from rbfrag.exchange.hazard_curves import read_hazard_curves as read_hazard_curves
    from rbfrag.fragility.fit.fitting import fit as fit
    from rbfrag.fragility.predict import predict as predict
    from rbfrag.hazards.answer import HazardAnswer as HazardAnswer
    from rbfrag.hazards.answer import hazard as hazard
    from rbfrag.hazards.curve import HazardCurve as HazardCurve
    from rbfrag.motions.ground_motion import GroundMotion as GroundMotion
    from rbfrag.motions.recognise import read_motions as read_motions
    from rbfrag.motions.toppling_spectrum import toppling_spectrum as toppling_spectrum
    from rbfrag.solver.block.arrays import BlockArray as BlockArray
    from rbfrag.solver.block.geometry import Block as Block
    from rbfrag.solver.critical import critical as critical
    from rbfrag.solver.models.sliding import sliding_displacements as sliding_displacements
    from rbfrag.solver.respond import respond as respond
    from rbfrag.solver.results import CriticalResult as CriticalResult
    from rbfrag.solver.results import Outcome as Outcome
    from rbfrag.solver.results import Response as Response
    from rbfrag.solver.stability.arrays import StabilityArray as StabilityArray
    from rbfrag.solver.stability.arrays import stability_arrays as stability_arrays
    from rbfrag.solver.stability.single import Stability as Stability
    from rbfrag.solver.stability.single import stability as stability
    from rbfrag.version import __version__ as __version__

_HOME = {
    "__version__": "rbfrag.version",
    "Block": "rbfrag.solver.block.geometry",
    "BlockArray": "rbfrag.solver.block.arrays",
    "CriticalResult": "rbfrag.solver.results",
    "DatabaseError": "rbfrag.errors",
    "FitError": "rbfrag.errors",
    "GroundMotion": "rbfrag.motions.ground_motion",
    "HazardAnswer": "rbfrag.hazards.answer",
    "HazardCurve": "rbfrag.hazards.curve",
    "InputError": "rbfrag.errors",
    "MotionFileError": "rbfrag.errors",
    "Outcome": "rbfrag.solver.results",
    "RbfragError": "rbfrag.errors",
    "Response": "rbfrag.solver.results",
    "Stability": "rbfrag.solver.stability.single",
    "StabilityArray": "rbfrag.solver.stability.arrays",
    "UnknownModelError": "rbfrag.errors",
    "WorkFailedError": "rbfrag.errors",
    "add_motions": "rbfrag.campaign.add_motions",
    "critical": "rbfrag.solver.critical",
    "fit": "rbfrag.fragility.fit.fitting",
    "hazard": "rbfrag.hazards.answer",
    "predict": "rbfrag.fragility.predict",
    "read_hazard_curves": "rbfrag.exchange.hazard_curves",
    "read_motions": "rbfrag.motions.recognise",
    "read_table": "rbfrag.exchange.database_tables",
    "respond": "rbfrag.solver.respond",
    "simulate": "rbfrag.campaign.simulate",
    "sliding_displacements": "rbfrag.solver.models.sliding",
    "stability": "rbfrag.solver.stability.single",
    "stability_arrays": "rbfrag.solver.stability.arrays",
    "toppling_spectrum": "rbfrag.motions.toppling_spectrum",
}

__all__ = [*sorted(_HOME)]


def __getattr__(name: str) -> object:
    """Load a public name when it is first used (PEP 562)."""
    try:
        home = _HOME[name]
    except KeyError:
        raise AttributeError(f"module 'rbfrag' has no attribute {name!r}") from None
    value = getattr(import_module(home), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return __all__
