"""Closed surface meshes of blocks from photogrammetry and laser scanning: OBJ, PLY, STL."""

from __future__ import annotations

import io
import logging
import os
import warnings
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, MissingExtraError
from rbfrag.files import MOST_BYTES, as_path, bounded_bytes, reading
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.block.mesh_block import CONTACT_MM, MeshBlock, mesh_block

if TYPE_CHECKING:
    from trimesh import Trimesh

SUFFIXES = (".obj", ".ply", ".stl")
"""File types of a mesh."""

_BEYOND_ARITHMETIC_M = 1e15
_CLOSE_IT = "close it where it was made (Close Holes in MeshLab, Make Manifold in Blender)"


def block_from_mesh(
    path: str | os.PathLike[str],
    *,
    up: str = "z",
    contact_mm: float = CONTACT_MM,
    density_kg_m3: float | None = None,
) -> MeshBlock:
    """Return a free-standing block from a closed mesh in metres, in its measured resting pose.

    The ground is level. Contacts are the vertices within `contact_mm` of the lowest one; along
    each azimuth the block rocks about the outermost of them on either side. Flipped faces are
    turned and holes of three or four edges closed, with a warning; what else is not one closed
    surface is rejected.

    Args:
        path: file ending in ``.obj``, ``.ply`` or ``.stl``.
        up: the axis of the file that points up: ``x``, ``y`` or ``z``.
        contact_mm: height above the lowest vertex up to which vertices are contacts [mm].
        density_kg_m3: density [kg/m³]; only the mass needs it.

    Raises:
        InputError: the file holds no closed mesh, a value is outside its range, or the centre
            of mass does not lie above the contacts.
        MissingExtraError: trimesh is not installed.
    """
    source = as_path(path, "path", "a mesh")
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            mesh, middle, notes = _closed_surface(source)
    except (ValueError, OverflowError, IndexError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{source}: not the mesh of a block ({str(error)[:120]}): export it again"
        ) from None
    volume = float(mesh.volume)
    try:
        return mesh_block(
            source.stem,
            np.asarray(mesh.vertices, dtype=np.float64) + middle,
            volume_m3=volume,
            centre_m=np.asarray(mesh.center_mass, dtype=np.float64) + middle,
            inertia_m2=np.asarray(mesh.moment_inertia, dtype=np.float64) / volume + 0.0,  # no -0
            up=up,
            contact_mm=contact_mm,
            density_kg_m3=density_kg_m3,
            warnings=[Diagnostic(note, "mesh_quality") for note in notes],
        )
    except InputError as error:
        raise InputError(f"{source}: {str(error).removeprefix(f'{source.stem}: ')}") from None


def _closed_surface(source: Path) -> tuple[Trimesh, NDArray[np.float64], list[str]]:
    """Return a closed surface relative to its centre, that centre [m], and the repairs."""
    mesh = _triangles(source)
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    if not np.all(np.abs(vertices) < _BEYOND_ARITHMETIC_M):
        raise InputError(
            f"{source}: a vertex is not finite or beyond arithmetic: give coordinates in metres"
        )
    notes = []
    single = vertices.astype(np.float32)
    step_m = float(np.spacing(np.abs(single).max()))
    if step_m > 1e-3 and np.array_equal(single, vertices):
        notes.append(
            f"coordinates of up to {np.abs(vertices).max():.7g} m are stored in single precision, "
            f"in steps of {1e3 * step_m:.3g} mm: export the mesh with its origin near the block"
        )
    # from its own middle, a block in map coordinates loses no digits
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    mesh.vertices = vertices - middle
    # corners that a file repeats, for a texture or for each triangle, become one
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    faces = np.sort(np.asarray(mesh.faces), axis=1)
    mesh.update_faces((faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]))
    before = len(mesh.faces)
    mesh.update_faces(mesh.unique_faces())
    if len(mesh.faces) < before:
        notes.append(f"{before - len(mesh.faces)} faces were there twice and count once")
    mesh.remove_unreferenced_vertices()
    _close(source, mesh, notes)
    if (bodies := int(mesh.body_count)) > 1:
        raise InputError(f"{source} has {bodies} separate closed surfaces: keep one")
    _turn_outwards(source, mesh, notes)
    if not mesh.volume > 1e-9 * float(np.ptp(vertices, axis=0).max()) ** 3:
        raise InputError(
            f"{source}: the mesh encloses no volume: it must be the closed surface of a block"
        )
    return mesh, middle, notes


def _triangles(source: Path) -> Trimesh:
    """Return the triangles of a file, as stored."""
    if source.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"{source}: unsupported mesh: use {', '.join(SUFFIXES)}, not {source.suffix!r}"
        )
    for library in ("trimesh", "networkx"):  # with the second, trimesh finds holes
        if find_spec(library) is None:
            raise MissingExtraError(f"Meshes require {library}", "mesh")
    from trimesh.exchange.load import load_mesh

    with reading(source, "a mesh"):
        content = bounded_bytes(source, MOST_BYTES)
    if content is None:
        raise InputError(
            f"{source} has more than {MOST_BYTES} bytes: too large for a mesh of a block"
        )
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)  # what it warns of is said here
    try:
        mesh = load_mesh(
            io.BytesIO(content), file_type=source.suffix.lower()[1:], process=False,
            skip_materials=True,
        )  # fmt: skip
        faces = np.asarray(mesh.faces)
        is_whole = faces.size == 0 or 0 <= faces.min() <= faces.max() < len(mesh.vertices)
    except Exception as error:  # noqa: BLE001  # a damaged file can raise anything in there
        raise InputError(
            f"{source}: not a valid mesh ({type(error).__name__}: {str(error)[:120]}): export it "
            "again"
        ) from None
    if faces.size == 0 or not is_whole:
        reason = "has no triangles" if faces.size == 0 else "names vertices that it does not have"
        raise InputError(
            f"{source} {reason}: export the closed surface of the block as OBJ, PLY or STL"
        )
    return mesh


def _close(source: Path, mesh: Trimesh, notes: list[str]) -> None:
    if mesh.is_watertight:
        return
    before = len(mesh.faces)
    if mesh.fill_holes():
        notes.append(
            f"the mesh had holes of three or four edges: they were closed with "
            f"{len(mesh.faces) - before} triangles"
        )
        return
    edges = np.unique(mesh.edges_sorted, axis=0, return_counts=True)[1]
    border, shared = int((edges == 1).sum()), int((edges > 2).sum())
    if border:
        reason = f"not closed: {border} edges have a face on one side only"
    else:
        reason = f"no surface of one body: {shared} edges are shared by more than two faces"
    raise InputError(f"{source}: the mesh is {reason}; an open surface has no volume: {_CLOSE_IT}")


def _turn_outwards(source: Path, mesh: Trimesh, notes: list[str]) -> None:
    before = np.array(mesh.faces)
    turned_over = _turned_over(mesh)
    mesh.faces = np.where(turned_over[:, None], before[:, ::-1], before)
    if mesh.volume < 0.0:
        mesh.invert()
    turned = int((before != np.asarray(mesh.faces)).any(axis=1).sum())
    if turned:
        notes.append(f"{turned} of {len(before)} faces pointed inwards and were turned")
    if not mesh.is_winding_consistent:
        raise InputError(
            f"{source}: the faces have no inside and outside, as on a Möbius strip: {_CLOSE_IT}"
        )


def _turned_over(mesh: Trimesh) -> NDArray[np.bool_]:
    """Return the faces to reverse so that all are consistent with the first one, shape (n,).

    Two neighbours agree if they run along their edge in opposite senses. trimesh's own
    fix_winding walks from face to face in Python, 19 s for 80,000 of them.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order

    faces, pairs = np.asarray(mesh.faces), np.asarray(mesh.face_adjacency)
    starts = np.asarray(mesh.face_adjacency_edges)[:, 0]
    ends = np.asarray(mesh.face_adjacency_edges)[:, 1]
    runs_along = [
        (np.roll(faces[pairs[:, side]], -1, axis=1) == ends[:, None])[
            faces[pairs[:, side]] == starts[:, None]
        ]
        for side in (0, 1)
    ]
    step = np.where(runs_along[0] == runs_along[1], 2, 1)  # 2: one of them is to be turned over
    count = len(faces)
    graph = coo_array((step, (pairs[:, 0], pairs[:, 1])), shape=(count, count)).tocsr()
    graph = graph + graph.T
    order, before = breadth_first_order(graph, 0, directed=False)
    turns = np.asarray(graph[before[order[1:]], order[1:]]).ravel() == 2
    over = np.zeros(count, dtype=np.bool_)
    for face, origin, turn in zip(order[1:], before[order[1:]], turns, strict=True):
        over[face] = over[origin] ^ turn
    return over
