"""A closed mesh is a block: closed forms to rounding, trends of refined meshes, damaged files."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import rbfrag
from rbfrag.errors import InputError, MissingExtraError
from rbfrag.exchange import mesh_file
from rbfrag.solver.block.mesh_block import LINES_DEG
from tests.meshes import Surface, box, cut_ellipsoid, prism, turned, write_obj

G = 9.80665
W, D, H = 0.4, 0.5, 1.1
EXACT = {"rel": 1e-9, "abs": 1e-12}


def expected_box(azimuth_deg: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """k_r, p² and restitution of the box of sides W, D, H along azimuths in its own axes."""
    turn = np.radians(azimuth_deg)
    x = 0.5 * (W * np.abs(np.cos(turn)) + D * np.abs(np.sin(turn)))
    inertia = ((D * D + H * H) * np.sin(turn) ** 2 + (W * W + H * H) * np.cos(turn) ** 2) / 12
    half = 0.5 * H
    total = inertia + x * x + half * half
    return x / half, G * np.hypot(x, half) / total, (inertia + half * half - x * x) / total


@pytest.mark.parametrize("up", ["z", "y", "x"])
@pytest.mark.parametrize("yaw_deg", [0.0, 17.3])
def test_a_box_in_every_direction(up: str, yaw_deg: float, tmp_path: Path) -> None:
    vertices, faces = turned(box(W, D, H), "z", yaw_deg)
    vertices = vertices + np.array([3.0, -2.0, 5.0])
    # what was up goes to the axis that is up in the file, the plan axes to those after it
    shift = "zxy".index(up)
    path = write_obj(tmp_path / "box.obj", (np.roll(vertices, shift, axis=1), faces))
    block = rbfrag.block_from_mesh(path, up=up, density_kg_m3=2700.0)

    assert block.volume_m3 == pytest.approx(W * D * H, **EXACT)
    assert block.mass_kg == pytest.approx(2700.0 * W * D * H, **EXACT)
    centre = np.roll((3.0, -2.0, 5.0 + 0.5 * H), shift)
    np.testing.assert_allclose(block.centre_m, centre, rtol=1e-9)
    about_up = block.inertia_m2["xyz".index(up), "xyz".index(up)]
    assert about_up == pytest.approx((W * W + D * D) / 12.0, **EXACT)
    assert np.trace(block.inertia_m2) == pytest.approx((W * W + D * D + H * H) / 6.0, **EXACT)

    kr, p2, restitution = expected_box(LINES_DEG - yaw_deg)
    rocking = block.rocking()
    for sense in ("forward", "backward"):
        np.testing.assert_allclose(getattr(rocking, f"kr_{sense}"), kr, rtol=1e-9)
        np.testing.assert_allclose(getattr(rocking, f"p2_{sense}"), p2, rtol=1e-9)
        np.testing.assert_allclose(getattr(rocking, f"restitution_{sense}"), restitution, rtol=1e-9)
    np.testing.assert_allclose(rocking.restitution, restitution, rtol=1e-9)

    weakest = block.hull.weakest()
    side = rbfrag.Block.rectangle(H, W)
    alpha = math.atan(W / H)
    assert weakest.azimuth_deg == pytest.approx(yaw_deg, abs=1e-9)
    assert weakest.kr == pytest.approx(W / H, **EXACT)
    assert weakest.p2 == pytest.approx(side.p2, **EXACT)
    assert weakest.restitution == pytest.approx(1.0 - 1.5 * math.sin(alpha) ** 2, **EXACT)
    assert block.warnings == ()


def test_a_tilted_box_rests_on_an_edge_and_a_raised_one(tmp_path: Path) -> None:
    tilt = math.radians(1.0)
    c, s = math.cos(tilt), math.sin(tilt)
    assert W * s < 0.010
    path = write_obj(tmp_path / "box.obj", turned(box(W, D, H), "y", -1.0))
    block = rbfrag.block_from_mesh(path)
    # from the edge that stays down
    x, height = 0.5 * (W * c - H * s), 0.5 * (W * s + H * c)
    forward, backward = W * c - x, x
    inertia = (W * W + H * H) / 12.0
    retained = inertia + height**2 - forward * backward
    rocking = block.hull.rocking(np.zeros(1))
    assert block.hull.height_m == pytest.approx(height, **EXACT)
    assert rocking.kr_forward[0] == pytest.approx(forward / height, **EXACT)
    assert rocking.kr_backward[0] == pytest.approx(backward / height, **EXACT)
    for result, arm in ((rocking.p2_forward, forward), (rocking.p2_backward, backward)):
        r2 = arm * arm + height * height
        assert result[0] == pytest.approx(G * math.sqrt(r2) / (inertia + r2), **EXACT)
    e31 = retained / (inertia + backward**2 + height**2)
    e13 = retained / (inertia + forward**2 + height**2)
    assert rocking.restitution_forward[0] == pytest.approx(e31, **EXACT)
    assert rocking.restitution_backward[0] == pytest.approx(e13, **EXACT)
    assert rocking.restitution[0] == pytest.approx(math.sqrt(e31 * e13), **EXACT)
    weakest = block.hull.weakest()
    assert (weakest.azimuth_deg, weakest.kr) == pytest.approx((180.0, backward / height), **EXACT)
    # within 5 mm the raised edge is no contact, and nothing holds the box
    assert [row["contacts"] for row in block.sensitivity()] == [2, 4, 4, 4]
    assert [row["kr_least"] is None for row in block.sensitivity()] == [True, False, False, False]
    assert any("within 5 mm" in text for text in block.warnings)
    with pytest.raises(InputError, match=r"not its resting pose.*stands within 10, 20, 30 mm"):
        rbfrag.block_from_mesh(path, contact_mm=5.0)


@pytest.mark.parametrize(
    ("angles", "r3", "p2", "restitution"),
    [
        ((-6.1, 8.0), 2.0, (3.681253, 3.688810), (0.9804137, 0.9744006)),
        ((-5.4, 7.0), 0.5, (14.721107, 14.743454), (0.9847415, 0.9802703)),
        ((-15.6, 15.6), 1.0, (7.354988, 7.354988), (0.8915232, 0.8915232)),
    ],
)
def test_asymmetric_prisms(
    angles: tuple[float, float],
    r3: float,
    p2: tuple[float, float],
    restitution: tuple[float, float],
    tmp_path: Path,
) -> None:
    # values of an independent integration of parallelogram blocks (p² of toe and heel, e31, e13)
    t1, t3 = (math.tan(math.radians(angle)) for angle in angles)
    half = r3 * math.cos(math.radians(angles[1]))
    outline = half * np.array([(t1, -1.0), (t3, -1.0), (-t1, 1.0), (-t3, 1.0)])
    path = write_obj(tmp_path / "prism.obj", prism(outline, 0.7))
    rocking = rbfrag.block_from_mesh(path).hull.rocking(np.zeros(1))
    assert (rocking.kr_forward[0], rocking.kr_backward[0]) == pytest.approx((t3, -t1), **EXACT)
    assert (rocking.p2_forward[0], rocking.p2_backward[0]) == pytest.approx(p2, abs=5.1e-7)
    result = rocking.restitution_forward[0], rocking.restitution_backward[0]
    assert result == pytest.approx(restitution, abs=5.1e-8)


def test_a_refined_ellipsoid_cut_flat_converges(tmp_path: Path) -> None:
    axes, cut = (0.35, 0.45, 0.6), 0.8
    t = np.polynomial.Polynomial([0.0, 1.0])

    def over_slices(value: np.polynomial.Polynomial) -> float:
        complete = value.integ()
        return math.pi * float(complete(1.0) - complete(-cut))

    area = 1.0 - t * t
    unit_volume = over_slices(area)
    volume = unit_volume * math.prod(axes)
    middle = over_slices(t * area) / unit_volume
    across = over_slices(0.25 * area * area) / unit_volume
    upright = over_slices(t * t * area) / unit_volume - middle**2
    height = axes[2] * (middle + cut)
    azimuths = np.arange(0.0, 180.0, 0.1)
    turn = np.radians(azimuths)
    edge = math.sqrt(1.0 - cut * cut)
    along = (axes[0] * np.cos(turn)) ** 2 + (axes[1] * np.sin(turn)) ** 2
    x = edge * np.sqrt(along)
    inertia = across * along + upright * axes[2] ** 2
    kr = x / height
    p2 = G * np.hypot(x, height) / (inertia + x * x + height * height)
    errors = []
    for rings in (6, 12, 24, 48):
        path = write_obj(tmp_path / "egg.obj", cut_ellipsoid(axes, cut, rings))
        block = rbfrag.block_from_mesh(path, contact_mm=0.01)
        rocking = block.hull.rocking(azimuths)
        errors.append(
            (
                abs(block.volume_m3 / volume - 1.0),
                np.abs(rocking.kr / kr - 1.0).max(),
                np.abs(rocking.p2 / p2 - 1.0).max(),
            )
        )
    # facets leave out a part that falls with the square of their size
    ratios = np.array(errors)[:-1] / np.array(errors)[1:]
    assert np.all((ratios > 3.5) & (ratios < 4.5)), ratios
    assert np.all(np.array(errors)[-1] < 1e-3)


def without_triangles(surface: Surface, *dropped: int) -> Surface:
    vertices, faces = surface
    return vertices, np.delete(faces, dropped, axis=0)


BOX = box(W, D, H)
EGG = cut_ellipsoid((0.35, 0.45, 0.6), 0.8, 6)


def test_small_holes_are_closed_and_said(tmp_path: Path) -> None:
    complete = rbfrag.block_from_mesh(write_obj(tmp_path / "a.obj", BOX))
    for dropped, triangles in (((3,), 1), ((0, 1), 2)):  # a triangle; a side of two
        block = rbfrag.block_from_mesh(
            write_obj(tmp_path / "b.obj", without_triangles(BOX, *dropped))
        )
        assert block.volume_m3 == pytest.approx(complete.volume_m3, rel=1e-12)
        np.testing.assert_allclose(block.rocking(), complete.rocking(), rtol=1e-12)
        (text,) = block.warnings
        assert f"closed with {triangles} triangles" in text


def test_large_holes_are_rejected(tmp_path: Path) -> None:
    vertices, faces = EGG
    open_below = faces[(faces != 0).all(axis=1)]  # without the flat base
    with pytest.raises(InputError, match="not closed: 24 edges have a face on one side only"):
        rbfrag.block_from_mesh(write_obj(tmp_path / "a.obj", (vertices, open_below)))


def test_flipped_faces_are_turned_and_said(tmp_path: Path) -> None:
    vertices, faces = EGG
    complete = rbfrag.block_from_mesh(write_obj(tmp_path / "a.obj", EGG))
    subset = faces.copy()
    subset[[3, 40, 77]] = subset[[3, 40, 77], ::-1]
    for flipped, count in ((subset, 3), (faces[:, ::-1], len(faces))):
        block = rbfrag.block_from_mesh(write_obj(tmp_path / "b.obj", (vertices, flipped)))
        assert block.volume_m3 == pytest.approx(complete.volume_m3, rel=1e-12)
        np.testing.assert_allclose(block.rocking(), complete.rocking(), rtol=1e-12)
        assert any(f"{count} of {len(faces)} faces pointed inwards" in w for w in block.warnings)


def test_faces_there_twice_or_without_area_and_loose_vertices(tmp_path: Path) -> None:
    vertices, faces = BOX
    complete = rbfrag.block_from_mesh(write_obj(tmp_path / "a.obj", BOX))
    vertices = np.vstack([vertices, (0.0, 0.0, -1.0)])  # no face has it: no contact
    faces = np.vstack([faces, faces[2, [1, 2, 0]], (0, 0, 1)])
    block = rbfrag.block_from_mesh(write_obj(tmp_path / "b.obj", (vertices, faces)))
    np.testing.assert_allclose(block.rocking(), complete.rocking(), rtol=1e-12)
    assert block.warnings == ("1 faces were there twice and count once",)


def test_two_bodies_and_a_surface_without_inside_are_rejected(tmp_path: Path) -> None:
    vertices, faces = BOX
    both = np.vstack([vertices, vertices + 2.0]), np.vstack([faces, faces + len(vertices)])
    with pytest.raises(InputError, match="2 separate closed surfaces"):
        rbfrag.block_from_mesh(write_obj(tmp_path / "a.obj", both))
    touching = np.vstack([vertices, vertices + np.array([W, 0.0, H])]), both[1]  # along an edge
    with pytest.raises(InputError, match="shared by more than two faces"):
        rbfrag.block_from_mesh(write_obj(tmp_path / "b.obj", touching))
    m, n = 8, 6  # a Klein bottle: closed, and its two sides are one

    def at(i: int, j: int) -> int:
        return (i % m) * n + (j if i < m else -j) % n

    grid = [(i, j) for i in range(m) for j in range(n)]
    klein = [(at(i, j), at(i + 1, j), at(i + 1, j + 1)) for i, j in grid]
    klein += [(at(i, j), at(i + 1, j + 1), at(i, j + 1)) for i, j in grid]
    positions = np.random.default_rng(1).uniform(size=(m * n, 3))
    with pytest.raises(InputError, match="no inside and outside"):
        rbfrag.block_from_mesh(write_obj(tmp_path / "c.obj", (positions, np.array(klein))))
    flat = box(1000.0, 1e-7, 1000.0)
    with pytest.raises(InputError, match="encloses no volume"):
        rbfrag.block_from_mesh(write_obj(tmp_path / "d.obj", flat))


@pytest.mark.parametrize(("scale", "size"), [(2000.0 / H, "2000 m"), (0.002 / H, "0.002 m")])
def test_sizes_of_another_unit_are_doubted(scale: float, size: str, tmp_path: Path) -> None:
    vertices, faces = BOX
    block = rbfrag.block_from_mesh(
        write_obj(tmp_path / "a.obj", (scale * vertices, faces)), contact_mm=1e-3
    )
    assert any(f"{size} across" in text and "metres" in text for text in block.warnings)
    assert not rbfrag.block_from_mesh(write_obj(tmp_path / "b.obj", BOX)).warnings


def test_contacts_that_reach_up_the_sides_are_doubted(tmp_path: Path) -> None:
    block = rbfrag.block_from_mesh(write_obj(tmp_path / "a.obj", BOX), contact_mm=80.0)
    assert any("above a tenth of the height" in text for text in block.warnings)
    assert [row["contact_mm"] for row in block.sensitivity()] == [5.0, 10.0, 20.0, 30.0, 80.0]


def test_a_stocky_block_comes_to_rest_at_once(tmp_path: Path) -> None:
    block = rbfrag.block_from_mesh(write_obj(tmp_path / "a.obj", box(1.0, 1.0, 0.4)))
    assert block.hull.weakest().restitution == 0.0
    assert any("restitution 0" in text for text in block.warnings)


@pytest.mark.parametrize(
    ("suffix", "is_text"),
    [("stl", True), ("stl", False), ("ply", True), ("ply", False), ("obj", True)],
)
def test_every_file_type_holds_the_same_block(suffix: str, is_text: bool, tmp_path: Path) -> None:
    mesh = trimesh.Trimesh(*EGG, process=False)
    options = {"ply": {"encoding": "ascii" if is_text else "binary"}}
    kind = "stl_ascii" if suffix == "stl" and is_text else suffix
    content = mesh.export(file_type=kind, **options.get(suffix, {}))
    path = tmp_path / f"egg.{suffix.upper()}"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    expected = rbfrag.block_from_mesh(write_obj(tmp_path / "b.obj", EGG))
    block = rbfrag.block_from_mesh(path)
    assert len(block.hull.points_m) == len(expected.hull.points_m)
    np.testing.assert_allclose(block.rocking().kr, expected.rocking().kr, rtol=1e-5)


def test_corners_repeated_for_a_texture_are_one(tmp_path: Path) -> None:
    vertices, faces = BOX
    lines = ["mtllib nowhere.mtl", *(f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist())]
    lines += ["vt 0 0", "vt 1 0", "vt 0 1"]
    for number, (i, j, k) in enumerate((faces + 1).tolist()):
        if number == 6:
            lines.append("usemtl other")
        lines.append(f"f {i}/1 {j}/2 {k}/3")
    (tmp_path / "a.obj").write_text("\n".join(lines))
    block = rbfrag.block_from_mesh(tmp_path / "a.obj")
    assert block.warnings == ()
    assert block.volume_m3 == pytest.approx(W * D * H, rel=1e-12)


def test_map_coordinates(tmp_path: Path) -> None:
    vertices, faces = EGG
    offset = np.array([453_000.0, 4_112_000.0, 812.0])
    near = rbfrag.block_from_mesh(write_obj(tmp_path / "a.obj", EGG))
    far = rbfrag.block_from_mesh(write_obj(tmp_path / "b.obj", (vertices + offset, faces)))
    np.testing.assert_allclose(far.rocking(), near.rocking(), rtol=1e-6)
    coarse = (1000.0 * vertices + offset).astype(np.float32).astype(float), faces
    block = rbfrag.block_from_mesh(write_obj(tmp_path / "c.obj", coarse), contact_mm=1000.0)
    assert any("single precision, in steps of 250 mm" in text for text in block.warnings)


CUBE = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.txt", "v 0 0 0", "use .obj, .ply, .stl, not '.txt'"),
        ("a.obj", "", "has no triangles"),
        ("a.stl", "", "has no triangles"),
        ("a.ply", "", "not a valid mesh"),
        ("a.obj", CUBE, "has no triangles"),
        ("a.obj", CUBE + "f 1 2 99\n", "a.obj"),
        ("a.obj", CUBE.replace("1 1 1", "1 1 nan") + "f 6 7 8\n", "not finite"),
        ("a.obj", CUBE.replace("1 1 1", "1 1 1e200") + "f 6 7 8\n", "beyond arithmetic"),
        ("a.obj", CUBE + "f 1 2 3\n", "not closed|resting|no volume"),
        ("a.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", "a.obj"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 9\n", "not a valid mesh"),
    ],
)
def test_files_that_hold_no_mesh(name: str, content: str, words: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=words) as caught:
        rbfrag.block_from_mesh(tmp_path / name)
    assert name in str(caught.value)
    assert len(str(caught.value)) < 500


def test_a_missing_file_and_a_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        rbfrag.block_from_mesh(tmp_path / "a.obj")
    (tmp_path / "b.obj").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        rbfrag.block_from_mesh(tmp_path / "b.obj")


COMPLETE = {
    suffix: content.encode() if isinstance(content, str) else content
    for suffix in ("stl", "ply", "obj")
    for content in [trimesh.Trimesh(*BOX, process=False).export(file_type=suffix)]
}


@pytest.mark.parametrize("suffix", list(COMPLETE))
@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_damaged_files_are_rejected_or_answered(
    suffix: str, data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    content = bytearray(COMPLETE[suffix])
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    if data.draw(st.booleans()):
        content = content[: data.draw(st.integers(0, len(content)))]
    path = tmp_path_factory.mktemp("damaged") / f"a.{suffix}"
    path.write_bytes(bytes(content))
    message = ""
    try:
        block = rbfrag.block_from_mesh(path)
    except InputError as error:
        message = str(error)
    if message:
        assert message.startswith(("a:", str(path)))
        assert len(message) < 500 + len(str(path))
    else:
        assert block.volume_m3 > 0.0
        assert block.hull.weakest().kr > 0.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"up": "w"}, "up = 'w'"),
        ({"contact_mm": 0.0}, "contact_mm = 0 is not above zero"),
        ({"contact_mm": math.nan}, "contact_mm = nan"),
        ({"density_kg_m3": -1.0}, "density_kg_m3 = -1"),
        ({"up": "x"}, "not its resting pose"),
    ],
)
def test_options_out_of_range(options: dict, words: str, tmp_path: Path) -> None:
    path = write_obj(tmp_path / "a.obj", turned(EGG, "x", 30.0))
    with pytest.raises(InputError, match=words):
        rbfrag.block_from_mesh(path, **options)


@pytest.mark.parametrize("library", ["trimesh", "networkx"])
def test_the_extra_is_named(library: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_obj(tmp_path / "a.obj", BOX)
    monkeypatch.setattr(
        mesh_file,
        "find_spec",
        lambda name: None if name == library else importlib.util.find_spec(name),
    )
    with pytest.raises(MissingExtraError, match=r"rbfrag\[mesh\]"):
        rbfrag.block_from_mesh(path)
