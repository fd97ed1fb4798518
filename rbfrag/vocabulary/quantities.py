"""The quantities, each declared once, in groups in the order of the help, with their names.

One module, because each start of the program loads all of it.
"""

from __future__ import annotations

from rbfrag.vocabulary.quantity import NOT_NEGATIVE, POSITIVE, Input, Limits, Measure, Quantity
from rbfrag.vocabulary.spectral import (
    BY_PERIOD,
    SpectralMapping,
    SpectralNames,
    input_of,
    period_of,
    spectral_inputs,
)

TYPE_CHECKING = False  # that of `typing` would load it
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

_SLOPE, _FRICTION = Limits(above=-90.0, below=90.0), Limits(least=0.0, below=90.0)
_STEEP = "steeper than 78°: it is the tangent of an angle, not degrees"
_SIGMA = "a standard deviation of a logarithm, 0 or more"
_SAMPLES = "missing where the database was upgraded without the samples"

MECHANISMS = ("unspecified", "strike-slip", "normal", "reverse")
"""Fault mechanisms, in the order of their numbers."""


def _block_scatter(name: str, logarithm: str) -> Quantity:
    return Quantity(
        name, f"Standard deviation of {logarithm} (block uncertainty)", range=NOT_NEGATIVE,
        input=Input(),
        prompt=f"the standard deviation of ln {name.removesuffix('_sigma')}, 0 or more",
    )  # fmt: skip


def _measured(name: str, noun: str, unit: str, *aliases: str) -> Quantity:
    per_cent = "" if unit == "deg" else ", or in per cent (5%)"
    detail = (
        f"of repeated measurements{per_cent}: two of three lie within ± this; if ± is a limit that "
        "is never exceeded, divide by 1.7; if it holds in 95 %, by 2"
    )
    label = f"Standard deviation of the {noun}"
    prompt = f"the standard deviation of the measured {noun} in {unit}, 0 or more"
    return Quantity(
        name, label, unit, range=NOT_NEGATIVE, input=Input(detail, aliases), prompt=prompt
    )


def _deviation(name: str, measure: str) -> Quantity:
    detail = Input("about its median")
    label = f"Standard deviation of ln {measure}"
    return Quantity(name, label, range=NOT_NEGATIVE, input=detail, prompt=_SIGMA)


def _stored_spectral(name: str, period_s: float) -> Quantity:
    meaning = f"pseudo-spectral acceleration at {period_s:g} s, 5 % damping; {_SAMPLES}"
    label, symbol = f"Spectral acceleration at {period_s:.1f} s", f"SA({period_s:g} s)"
    return Quantity(name, label, "g", symbol, measure=Measure(period_s=period_s), stored=meaning)


def _spectral(name: str) -> Quantity:
    """Return a spectral acceleration at any period, or the standard deviation of its logarithm."""
    period_s = period_of(name.removesuffix("_sigma"))
    assert period_s is not None
    if name.endswith("_sigma"):
        return _deviation(name, f"SA({period_s:g} s)")
    largest = 10.0 if period_s < 3.0 else 5.0
    return Quantity(
        name, f"Spectral acceleration at {period_s:g} s", "g", f"SA({period_s:g} s)", NOT_NEGATIVE,
        Input("5 % damping", (f"SA({period_s:g} s)",)),
        credible=(0.0, largest, "larger than ever recorded (it is in g): is it in g?"),
        prompt=f"the spectral acceleration at {period_s:g} s and 5 % damping in g, 0 or more",
        measure=Measure(
            axis=f"spectral acceleration, SA({period_s:g} s), 5 % damping", power=1,
            period_s=period_s, imt=f"SA({period_s})", uncertain=True, top=10.0, largest=10.0,
        ),
    )  # fmt: skip


# fmt: off
GROUPS: dict[str, tuple[Quantity, ...]] = {
    "numbers": (
        Quantity("p2", "Frequency parameter p²", "1/s²", "p²", POSITIVE,
            Input(" of the block", ("p²", "p^2"), column="p2_1_s2"),
            prompt="p² = m g r/I of the block, 0.1 to 30 1/s² for blocks of 74 m to 0.25 m",
            stored="frequency parameter p² of the block, m g r3 over the inertia about the toe"),
        Quantity("kr", "Uplift acceleration coefficient k_r", "", "k_r",
            input=Input(" = tan(critical angle), with {p2}", ("k_r",)),
            credible=(
                0.0, 5.0, "steeper than 78°: it is the tangent of the critical angle, not degrees",
            ),
            prompt="the uplift acceleration coefficient of the block, tan(critical angle) (a block "
            "with k_r <= 0 topples at rest)",
            stored="rocking acceleration coefficient k_r = tan(critical angle)"),
        Quantity("ky", "Yield acceleration coefficient of sliding k_y, tan(phi - beta)", "", "k_y",
            input=Input("with {beta_deg}", ("k_y",)), credible=(0.0, 5.0, _STEEP),
            prompt="the yield acceleration coefficient of sliding, tan(phi - beta) (a block with "
            "k_y <= 0 slides at rest)"),
        Quantity("ks", "Yield acceleration coefficient of slumping k_s", "", "k_s",
            input=Input("with {ps2}", ("k_s",)), credible=(0.0, 5.0, _STEEP),
            prompt="the yield acceleration coefficient of slumping (a block with k_s <= 0 slumps "
            "at rest)"),
        Quantity("ps2", "Frequency parameter of slumping p_s² at rest", "1/s²", "p_s²", POSITIVE,
            Input(column="ps2_1_s2"),
            prompt="the frequency parameter of slumping p_s² at rest in 1/s², above 0"),
        Quantity("kct", "Yield acceleration coefficient of confined toppling k_ct", "", "k_ct",
            input=Input("with {pct2}", ("k_ct",)), credible=(0.0, 5.0, _STEEP),
            prompt="the yield acceleration coefficient of confined toppling (a block with k_ct <= "
            "0 topples at rest)"),
        Quantity("pct2", "Frequency parameter of confined toppling p_ct² at rest", "1/s²", "p_ct²",
            POSITIVE, Input(column="pct2_1_s2"), prompt="the frequency parameter of confined "
            "toppling p_ct² at rest in 1/s², above 0"),
    ),
    "failure": (
        Quantity("displacement_m", "Displacement limit", "m", range=POSITIVE,
            input=Input(" of a sliding block", ("displacement",)),
            prompt="the displacement limit in m, above 0"),
        Quantity("restitution", "Coefficient of restitution", "", "e",
            Limits(above=0.0, most=1.0),
            Input(" of a rocking block, 0–1", default="from conservation of angular momentum"),
            prompt="the coefficient of restitution, above 0 and up to 1"),
    ),
    "shape": (
        Quantity("height_m", "Height", "m", range=POSITIVE,
            input=Input(" of a rectangle, perpendicular to its base, with {width_m}",
            ("height", "h"))),
        Quantity("width_m", "Width", "m", range=POSITIVE,
            input=Input(" of a rectangle along its base, with {height_m}", ("width", "w", "b"))),
        Quantity("alpha1_deg", "Angle of the heel", "deg", "α₁", _SLOPE,
            Input("from the normal of the base to the line centroid-heel, with {alpha3_deg} and "
            "{r3_m}", ("alpha1", "α1"))),
        Quantity("alpha3_deg", "Angle of the toe", "deg", "α₃", _SLOPE,
            Input("from the normal of the base to the line centroid-toe", ("alpha3", "α3"))),
        Quantity("r3_m", "Distance from centroid to toe", "m", "r₃", POSITIVE,
            Input(aliases=("r3",))),
        Quantity("s1_m", "Spacing of the base fractures", "m", "S₁", POSITIVE,
            Input("with {s2_m} and {gamma_deg}", ("s1",))),
        Quantity("s2_m", "Spacing of the back fractures", "m", "S₂", POSITIVE,
            Input(aliases=("s2",))),
        Quantity("gamma_deg", "Angle between base and back plane", "deg", "γ",
            Limits(above=0.0, below=180.0),
            Input(": dip of the back plane less dip of the base", ("gamma",))),
    ),
    "planes": (
        Quantity("beta_deg", "Dip of the base", "deg", "β", _SLOPE,
            Input("positive out of the slope",
            ("beta", "dip", "dip_deg", "dip_angle", "β", "base_dip"), column="dip_deg",
            default="0 for a rectangle"),
            prompt="the dip of the base in degrees, out of the slope positive"),
        Quantity("phi_deg", "Friction angle of the base", "deg", "φ", _FRICTION,
            Input("required except for a rectangle, which is assumed to topple",
            ("phi", "φ", "friction", "friction_angle"))),
        Quantity("phi_back_deg", "Friction angle of the back plane", "deg", range=_FRICTION,
            input=Input(aliases=("phi_back",), default="that of the base")),
    ),
    "joint": (
        Quantity("water_m", "Height of the water", "m", range=NOT_NEGATIVE,
            input=Input(" in the back fracture above the heel, with {density_kg_m3}",
            ("water", "water_level"))),
        Quantity(
            "jrc", "Joint roughness coefficient of the base", range=Limits(least=0.0, most=20.0),
            input=Input("for a joint length of 10 cm, with {jcs_mpa} and {density_kg_m3}; "
            "{phi_deg} is "
            "then the residual friction angle")),
        Quantity("jcs_mpa", "Compressive strength of the walls of the base", "MPa", range=POSITIVE,
            input=Input("for a joint length of 10 cm", ("jcs",), word="jcs")),
        Quantity("joint_length_m", "Joint length for the scale effect of roughness", "m",
            range=POSITIVE,
            input=Input(aliases=("joint_length",), default="that of the base")),
        Quantity("phi_residual_deg", "Residual friction angle of base and back plane", "deg",
            range=_FRICTION,
            input=Input("after the first slip, which ends cohesion and roughness",
            ("phi_residual",))),
    ),
    "block scatter": (
        _block_scatter("p2_sigma", "ln p²"),
        _block_scatter("kr_sigma", "ln k_r"),
        _block_scatter("ky_sigma", "ln k_y"),
        _block_scatter("ks_sigma", "ln k_s"),
        _block_scatter("ps2_sigma", "ln p_s²"),
        _block_scatter("kct_sigma", "ln k_ct"),
        _block_scatter("pct2_sigma", "ln p_ct²"),
        Quantity(
            "restitution_sigma", "Standard deviation of the coefficient of restitution (block "
            "uncertainty)", range=NOT_NEGATIVE, input=Input(),
            prompt="the standard deviation of the coefficient of restitution, 0 or more"),
    ),
    "measurement": (
        _measured("height_sigma_m", "height", "m"),
        _measured("width_sigma_m", "width", "m"),
        _measured("alpha1_sigma_deg", "angle of the heel", "deg"),
        _measured("alpha3_sigma_deg", "angle of the toe", "deg"),
        _measured("r3_sigma_m", "distance from centroid to toe", "m"),
        _measured("s1_sigma_m", "spacing of the base fractures", "m"),
        _measured("s2_sigma_m", "spacing of the back fractures", "m"),
        _measured("gamma_sigma_deg", "angle between base and back plane", "deg"),
        _measured("beta_sigma_deg", "dip of the base", "deg", "dip_sigma", "dip_sigma_deg"),
        _measured("phi_sigma_deg", "friction angle of the base", "deg"),
        _measured("phi_back_sigma_deg", "friction angle of the back plane", "deg"),
        _measured("base_sigma_deg", "base in space, on its dip in the section", "deg"),
        _measured("back_sigma_deg", "back plane in space, on its dip in the section", "deg"),
        _measured("water_sigma_m", "height of the water", "m"),
        _measured("cohesion_sigma_pa", "cohesion of the base", "Pa"),
        _measured("density_sigma_kg_m3", "density of the rock", "kg/m³"),
        Quantity(
            "gmm_sigma", "Standard deviation of the logarithm of the median of ground-motion "
            "models", range=NOT_NEGATIVE, input=Input("between models and regions; 0 for none",
            default="0.20 with {magnitude} and {rjb_km}"), prompt=_SIGMA),
    ),
    "space": (
        Quantity("base", "Orientation of the base as dip/dip direction in degrees",
            input=Input("such as 25/102, with {face}, instead of {beta_deg}", type=str)),
        Quantity("back", "Orientation of the back plane as dip/dip direction in degrees",
            input=Input("with {s1_m} and {s2_m} along the normals of the planes, instead of "
            "{gamma_deg}", type=str)),
        Quantity("face", "Orientation of the slope face as dip/dip direction in degrees",
            input=Input("whose dip direction is the direction of the section", type=str)),
    ),
    "whole": (
        Quantity("block", "Geometry of the block", input=Input("a rbfrag.Block")),
        Quantity("back_fracture", "No fracture behind the block",
            input=Input(word="no_back", type=bool)),
        Quantity("drainage", "Drainage of the water in the back fracture",
            input=Input(": undrained (water pressure acts while the block moves) or drained (water "
            "pressure vanishes), with {water_m}", default="undrained", type=str)),
        Quantity("cohesion_pa", "Cohesion of the base", "Pa", range=NOT_NEGATIVE,
            input=Input("with {density_kg_m3}")),
        Quantity("density_kg_m3", "Density of the rock", "kg/m³", range=POSITIVE,
            input=Input(aliases=("density",), default="2650")),
        Quantity(
            "kind", "Kind of failure", input=Input(": toppling (backed by a rock face), rocking "
            "(free-standing), slumping, confined_toppling or sliding",
            default="from the geometry or the parameters of the block", type=str)),
    ),
    "measures": (
        Quantity("pgv_m_s", "Peak ground velocity", "m/s", "PGV", NOT_NEGATIVE,
            Input(aliases=("pgv", "peak_ground_velocity")),
            credible=(0.0, 5.0, "larger than ever recorded (it is in m/s): did you mean cm/s?"),
            measure=Measure(axis="peak ground velocity, PGV", power=1, imt="PGV", imt_factor=0.01,
            uncertain=True, top=5.0, largest=20.0),
            stored="peak ground velocity, extreme of the exact integral"),
        Quantity("pga_g", "Peak ground acceleration", "g", "PGA", NOT_NEGATIVE,
            Input(aliases=("pga", "peak_ground_acceleration")),
            credible=(
                0.0, 5.0, "larger than ever recorded (it is in g): did you mean cm/s² or m/s²?",
            ),
            measure=Measure(axis="peak ground acceleration, PGA", power=1, imt="PGA",
            uncertain=True, top=5.0, largest=10.0),
            stored="peak ground acceleration, max |a| over both signs"),
        Quantity("tm_s", "Mean period", "s", "T_m", POSITIVE, Input(aliases=("tm", "mean_period")),
            credible=(
                0.02, 10.0, "not the mean period of an earthquake (it is in s): is it a frequency?",
            ),
            measure=Measure("Tm"), stored="mean period of Rathje, Abrahamson and Bray (1998), "
            "0.25 to 20 Hz; missing where it is not defined"),
        Quantity("pgd_m", "Peak ground displacement", "m", "PGD", NOT_NEGATIVE,
            Input(aliases=("pgd", "peak_ground_displacement")),
            credible=(0.0, 20.0, "larger than ever recorded (it is in m): did you mean cm?"),
            measure=Measure(axis="peak ground displacement, PGD", power=1),
            stored="peak ground displacement, extreme of the exact double integral"),
        Quantity("sa_g", "Spectral accelerations at oscillator periods T from 0.01 to 10 s", "g",
            input=Input("5 % damping", column="sa(T)", type=dict)),
        Quantity(
            "arias_m_s", "Arias intensity", "m/s", "I_a", NOT_NEGATIVE, Input("π/(2g) ∫a² dt",
            ("arias", "ia", "arias_intensity")),
            credible=(0.0, 50.0, "larger than ever recorded (it is in m/s): is it in cm/s?"),
            prompt="the Arias intensity in m/s, 0 or more",
            measure=Measure("Arias intensity", power=2),
            stored=f"Arias intensity, pi/(2 g) integral of a² (Arias 1970); {_SAMPLES}"),
        Quantity("magnitude", "Magnitude of the earthquake", "", "M", Limits(above=0.0, most=10.0),
            Input(aliases=("mag", "mw", "moment_magnitude")),
            credible=(3.0, 9.6, "not the magnitude of an earthquake that models are fitted to"),
            prompt="the magnitude of the earthquake, above 0", measure=Measure("magnitude"),
            stored="magnitude as the source gives it, scales not harmonised"),
    ),
    "scenario": (
        _deviation("pgv_sigma", "PGV"),
        _deviation("pga_sigma", "PGA"),
        Quantity("sa_sigma", "Standard deviations of ln SA at oscillator periods T",
            input=Input("about its median", column="sa(T)_sigma", type=dict)),
        Quantity("pgv_tau", "Between-event standard deviation of ln PGV",
            range=NOT_NEGATIVE,
            input=Input("part of {pgv_sigma}, for the prediction interval of {sites}"),
            prompt=_SIGMA),
        Quantity("rjb_km", "Distance R_JB to the surface projection of the rupture", "km",
            "R_JB", range=NOT_NEGATIVE,
            input=Input("with {magnitude} and {vs30_m_s}, instead of intensity measures",
            ("rjb", "r_jb", "joyner_boore_distance")),
            stored="distance R_JB of the station to the surface projection of the rupture"),
        Quantity(
            "vs30_m_s", "Time-averaged shear-wave velocity in the upper 30 m", "m/s",
            "Vs30", range=POSITIVE, input=Input(aliases=("vs30",)),
            stored="time-averaged shear-wave velocity of the site in the upper 30 m"),
        Quantity(
            "amplification", "Topographic amplification factor of all intensity measures",
            range=POSITIVE, input=Input()),
        Quantity(
            "amplification_sigma", "Standard deviation of the logarithm of {amplification}",
            range=NOT_NEGATIVE, input=Input(), prompt=_SIGMA),
    ),
    "record": (
        Quantity("motion", "Accelerogram or its file",
            input=Input("instead of intensity measures")),
        Quantity(
            "polarity", "Polarity of the accelerogram relative to the slope",
            input=Input(": forward, reverse or both (mean of the two)", type=str)),
    ),
    "answering": (
        Quantity(
            "model", "Fitted model", input=Input("by name", default="the default model of the "
            "database if the intensity measures suffice for it, else the best model that they "
            "suffice for", type=str)),
        Quantity("level", "Confidence level", range=Limits(above=0.0, below=1.0),
            input=Input("also that of the prediction interval for a single earthquake",
            default="0.95")),
        Quantity("db", "Database path or SQLAlchemy URL",
            input=Input(default="RBFRAG_DB, else rbfrag.db in the current folder, else the "
            "built-in data set", type=str)),
    ),
    "sites": (
        Quantity("sites", "Number of sites", range=Limits(least=1.0, most=10_000.0),
            input=Input(" with such shaking in one earthquake: adds the prediction interval of "
            "the fraction of blocks that fail, facing all directions", default="1")),
    ),
    "source": (
        Quantity("mechanism", "Fault mechanism",
            input=Input(": strike-slip, normal, reverse or unspecified, with {rjb_km}",
            default="unspecified", type=str),
            stored=f"fault mechanism: {', '.join(MECHANISMS)}"),
        Quantity("gmm", "CSV table of medians and sigmas of another ground-motion model",
            input=Input("with columns rjb_km, pgv_m_s, pgv_sigma, pgv_tau etc., one row per "
            "distance", type=str)),
    ),
    "component": (
        Quantity("component", "Horizontal component of the intensity measures",
            input=Input(": single, geometric_mean, rotd50, rotd100 or larger", default="single",
            type=str)),
    ),
    "request": (
        Quantity("rotation_deg", "Rotation limit of slumping", "deg",
            input=Input("one for which a fragility model exists",
            default="failure past recovery")),
    ),
    "inverse": (
        Quantity("target_probability", "Probability to solve for", "", "P",
            Limits(above=0.0, below=1.0), Input("with {solve_for}")),
        Quantity("solve_for", "Quantity that is changed until P is {target_probability}",
            input=Input(": width, height, dip, phi or kr", type=str)),
    ),
    "arrays": (
        Quantity("nan", "Handling of invalid elements of arrays",
            input=Input(": propagate (NaN with its reason) or raise (the arrays are rejected)",
            default="propagate", type=str)),
        Quantity("interval", "Computation of confidence and prediction intervals",
            input=Input(": False leaves their limits NaN and takes less time", default="True")),
        Quantity("sensitivity", "P at usual errors of measurement, by field",
            input=Input("for blocks given by their geometry", default="False")),
        Quantity("weights", "Weights of the draws of one uncertain block",
            input=Input("1 for equal weights; the arrays of the block are then its draws, with one "
            "answer for all")),
    ),
    "at rest": (
        Quantity("kv", "Vertical ground acceleration", "g", range=Limits(above=-1.0),
            input=Input("positive upward")),
    ),
    "names": (
        Quantity("block_id", "Name of the block",
            input=Input(aliases=("block", "name", "id"), type=str)),
        Quantity("site_id", "Name of the site of the block",
            input=Input(aliases=("site",), type=str)),
    ),
    "rows": (
        Quantity("mode", "Failure mode of the block",
            input=Input(aliases=("failure_mode",), type=str)),
        Quantity("lon", "Longitude", "deg", input=Input(aliases=("longitude",)),
            stored="longitude of the station, east positive"),
        Quantity("lat", "Latitude", "deg", input=Input(aliases=("latitude",)),
            stored="latitude of the station, north positive"),
        Quantity(
            "x", "Easting of the block in {crs}", input=Input(aliases=("easting", "x_m"))),
        Quantity("y", "Northing of the block in {crs}", input=Input(aliases=("northing", "y_m"))),
        Quantity("z", "Elevation of the block in {crs}", input=Input(aliases=("elevation", "z_m"))),
        Quantity("crs", "Coordinate reference system", input=Input("such as EPSG:2056", type=str)),
        Quantity("strike_length_m", "Length of the block along strike", "m", range=POSITIVE,
            input=Input("for its volume", ("strike_length",))),
        Quantity("count", "Number of identical blocks", input=Input()),
        Quantity("weight", "Weight of a failure", input=Input()),
        Quantity("loss", "Loss if the block fails", input=Input()),
        Quantity("loss_sigma", "Standard deviation of the logarithm of the loss", input=Input()),
    ),
    "stored measures": (
        _stored_spectral("sa03_g", 0.3),
        _stored_spectral("sa05_g", 0.5),
        _stored_spectral("sa10_g", 1.0),
        _stored_spectral("sa20_g", 2.0),
        _stored_spectral("sa30_g", 3.0),
        Quantity("cav_m_s", "Cumulative absolute velocity", "m/s", "CAV", measure=Measure(),
            stored=f"cumulative absolute velocity, integral of |a| (EPRI 1988); {_SAMPLES}"),
        Quantity("d5_95_s", "Significant duration", "s", "D_5-95", measure=Measure(),
            stored="significant duration, from 5 to 95 % of the Arias intensity (Trifunac and "
            "Brady 1975); missing where the ground is at rest, and as the measures before it"),
        Quantity("d5_75_s", "Significant duration to 75 %", "s", "D_5-75", measure=Measure(),
            stored="significant duration, from 5 to 75 % of the Arias intensity (Somerville et "
            "al. 1997); missing as that to 95 %"),
        Quantity("housner_m", "Housner intensity", "m", "SI", measure=Measure(),
            stored="Housner intensity, integral of PSV from 0.1 to 2.5 s in steps of 0.05 s, 5 % "
            f"damping (Housner 1952); {_SAMPLES}"),
    ),
    "stored metadata": (
        Quantity("rrup_km", "Distance to the rupture", "km", "R_rup", NOT_NEGATIVE,
            stored="shortest distance of the station to the rupture"),
        Quantity("repi_km", "Distance to the epicentre", "km", "R_epi", NOT_NEGATIVE,
            stored="distance of the station to the epicentre"),
        Quantity("depth_km", "Depth of the hypocentre", "km", "", Limits(least=-10.0, most=800.0),
            stored="depth of the hypocentre below sea level"),
    ),
    "derived": (
        Quantity("xp_m_s", "Toppling spectrum at the block's size", "m/s", "X(p)",
            prompt="the toppling spectrum X(p) in m/s, 0 or more",
            measure=Measure("toppling spectrum", "toppling spectrum at the block's size, $X(p)$")),
        Quantity("intensity_m_s", "Intensity of the shaking", "m/s"),
        Quantity("y_m_s", "Toppling velocity k_r g/p", "m/s", "y",
            stored="critical toppling velocity k_r g/p; missing unless found"),
        Quantity("k_over_pga", "Yield acceleration over peak ground acceleration"),
        Quantity("pgv_over_pga_s", "Peak ground velocity over peak ground acceleration", "s",
            credible=(
                0.005, 2.0, "not that of an earthquake (PGV in m/s over 9.81 times PGA in g lies "
                "between 0.005 and 2 s): is PGV in m/s and PGA in g?",
            )),
    ),
}
# fmt: on

QUANTITIES = SpectralMapping(
    {quantity.name: quantity for group in GROUPS.values() for quantity in group},
    _spectral, *BY_PERIOD,
)  # fmt: skip
INPUTS = SpectralMapping(
    {name: q.input for name, q in QUANTITIES.items() if q.input is not None},
    lambda name: _spectral(name).input, *BY_PERIOD,
)  # fmt: skip
MEASURES = SpectralMapping(
    {name: q.measure for name, q in QUANTITIES.items() if q.measure is not None},
    lambda name: _spectral(name).measure, "sa_g",
)  # fmt: skip
"""The quantities, those that can be given, and the intensity measures, by name; spectral
accelerations at any period are made on demand."""


def _names(*groups: str) -> SpectralNames:
    return SpectralNames(quantity.name for group in groups for quantity in GROUPS[group])


NUMBERS = _names("numbers")
"""What a model of its kind reads of the shape of a block."""
FAILURE = _names("failure")
"""What a model reads of a block in addition to its numbers or its shape."""
SHAPE = _names("shape")
PLANES = _names("planes")
JOINT = _names("joint")
"""What ends with the first slip of a block, and what is left then."""
SCATTER = _names("block scatter")
"""Standard deviations of uncertain block parameters, whose medians are given: P is the mean."""
BLOCK = (*NUMBERS, *FAILURE, *SHAPE, *PLANES, *JOINT, *SCATTER)
MEASURED = _names("measurement")
"""How well a shape is measured, and the ground-motion model: only predictions integrate it."""
SPACE = _names("space")
"""Planes in space, as dip/dip direction."""
COMMON = _names("space", "whole")
"""What holds for all blocks of a question."""
BY_ROW = ("back_fracture", "cohesion_pa", "density_kg_m3")
"""Those of them that a table may give row by row."""
BLOCKS = (*BLOCK, *COMMON)
"""What the blocks of a question are."""
INTENSITY = _names("measures")
"""Intensity measures of one horizontal component."""
SCENE = _names("scenario")
"""How well measures are known, and what stands for them: the scenario and the site."""
SCENARIO = frozenset({"rjb_km", "vs30_m_s", "amplification"})
"""What is turned into measures before a model is asked."""
SHAKING = SpectralNames((*INTENSITY, *SCENE))
RECORD = _names("record")
ANSWERING = _names("answering")
"""Which model answers, and how wide its interval is."""
RANGE = (*ANSWERING, *_names("sites"))
SOURCE = _names("source")
COMPONENT = _names("component")
REQUEST = (*RANGE, *SOURCE, *COMPONENT, *_names("request"))
INVERSE = _names("inverse")
"""Which probability is asked for, and what is changed until a block has it."""
ARRAYS = _names("arrays")
QUESTION = (*BLOCKS, *MEASURED, *SHAKING, *RECORD, *REQUEST, *INVERSE, *ARRAYS)
"""What :func:`rbfrag.predict` may be asked."""
AT_REST = _names("at rest")
ROW = (*_names("names"), "kind", *_names("rows"))
"""What a row of a table holds in addition to its block and its shaking."""
_OF_ROWS = (*ROW, *SPACE, *BY_ROW, "mechanism", "drainage")
COLUMNS = tuple(dict.fromkeys((*BLOCK, *MEASURED, *SHAKING, *COMPONENT, *_OF_ROWS)))
"""What may be a column of a table; for ``sa_g`` and ``sa_sigma`` columns by period, ``sa(0.5)``."""

PANELS = {
    "Block and shaking": ("height_m", "width_m", "beta_deg", "phi_deg", "kind", "pgv_m_s"),
    "Block parameters": (*NUMBERS, *FAILURE),
    "Block geometry": ("block", *SHAPE, *SPACE),
    "Joint properties": (*PLANES, *JOINT, *COMMON, *AT_REST),
    "Block uncertainty": (*SCATTER, *MEASURED[:-1]),
    "Other intensity measures": (*INTENSITY, *COMPONENT, *RECORD),
    "Scenario and ground-motion uncertainty": (*SCENE, *SOURCE, *MEASURED[-1:]),
    "Model and confidence level": (*REQUEST, *INVERSE),
}
"""Inputs by the headings of the help; an input belongs to the first group that holds it."""

OTHER_WORDS = {"dip": "beta_deg", "dip_sigma": "beta_sigma_deg"}
"""Further words for inputs, which shell and requests accept, too."""

_UNITS = ("_kg_m3", "_deg", "_m_s", "_pa", "_km", "_m", "_g", "_s")


ONLY_PREDICT = (
    "{}: only predictions (predict) and responses of draws (respond) integrate errors of "
    "measurement; rates and portfolios use the values as stated: omit it"
)
"""Why another answer does not take a standard deviation of :data:`MEASURED`."""


def measured_by(sigma: str) -> str:
    """Return the field that a standard deviation of :data:`MEASURED` belongs to."""
    planes = {"base_sigma_deg": "base", "back_sigma_deg": "back", "gmm_sigma": "amplification"}
    return planes.get(sigma) or sigma.replace("_sigma", "")


def column_of(name: str) -> str:
    """Return the column name of an input in written tables."""
    return INPUTS[name].column or name


def word_of(name: str) -> str:
    """Return the short name of an input with its unit in the name: ``beta`` for ``beta_deg``."""
    if name in INPUTS and INPUTS[name].word:
        return INPUTS[name].word
    return name.removesuffix(next((unit for unit in _UNITS if name.endswith(unit)), ""))


def option_of(name: str) -> str:
    """Return the command-line option of an input; of a spectral acceleration with its period."""
    if (of := input_of(name)) != name:
        return f"{option_of(of)} {name.partition(')')[0].removeprefix('sa(')}"
    return "--" + word_of(name).replace("_", "-")


def parameter_of(name: str) -> str:
    """Return the request parameter of an input."""
    return word_of(name)


_BY_WORD = {parameter_of(name): name for name in INPUTS} | {
    **{word_of(name): name for name in INPUTS},
    **OTHER_WORDS,
}


def name_of(word: str) -> str:
    """Return the input with this short name; the word itself if there is none."""
    return _BY_WORD.get(word, word)


def inputs_from(words: Mapping[str, Any]) -> dict[str, Any]:
    """Return inputs by name from the words of shell or requests, without None and False.

    Raises:
        InputError: two words for one input.
    """
    from rbfrag.errors import InputError

    inputs: dict[str, Any] = {}
    words_of: dict[str, str] = {}
    for word, value in words.items():
        name = name_of(word)
        if value is None or value == () or (value is False and word != name):
            continue
        if name in BY_PERIOD:
            inputs |= spectral_inputs(name, value, word)
            continue
        if name in inputs:
            raise InputError(
                f"{word} cannot be combined with {words_of[name]}: both give the same input",
                fields=(word, words_of[name]),
            )
        words_of[name] = word
        inputs[name] = False if INPUTS[name].type is bool and word != name else value
    return inputs
