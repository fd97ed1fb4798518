"""Every reader that the package has, with sound files for it: the list that damage is done to.

A reader is a function that makes something of a file from outside. `tests/benchmarks` proves that
the list is complete: a function of rbfrag that opens a file is called by one of these readers on
its sound files, or named there with the reason why it is none.
"""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from unittest.mock import patch

import numpy as np

from rbfrag.db.engine import opened_database
from rbfrag.db.location import reference_file
from rbfrag.db.model_file import read_models
from rbfrag.db.models import save_model
from rbfrag.exchange.block_rows import read_blocks, read_draws
from rbfrag.exchange.fragility_function import (
    FragilityFunction,
    discrete_function,
    lognormal_function,
)
from rbfrag.exchange.mesh_file import block_from_mesh
from rbfrag.exchange.nrml import nrml_text, read_nrml
from rbfrag.exchange.openquake_events import FILES, job_files, read_events
from rbfrag.exchange.pelicun_table import pelicun_text, read_pelicun
from rbfrag.exchange.shakemap import read_shakemap
from rbfrag.exchange.table_answers import predict_table
from rbfrag.exchange.tables import files
from rbfrag.exchange.tables.critical_values import import_critical_values
from rbfrag.exchange.tables.files import write_block_table
from rbfrag.hazards.branches import realization_weights
from rbfrag.hazards.curve import IntensityType, hazard_curve
from rbfrag.hazards.curve_file import read_hazard_curves
from rbfrag.hazards.disaggregation import Disaggregation
from rbfrag.motions.formats.delimited_text import INDEX
from rbfrag.motions.metadata import read_metadata
from rbfrag.motions.readers import read_motions
from rbfrag.motions.station_xml import sensitivities
from rbfrag.question.gmm_table import read_gmm_table
from rbfrag.rockmasses.file import read_planes, read_rock_mass
from rbfrag.service.settings import read_token
from rbfrag.solver.block.file import read_block
from tests.exchange.openquake_job import write_job
from tests.meshes import box, write_obj
from tests.motions.written_by_networks import csmip_v2, esm_asc


@dataclass(frozen=True)
class Reader:
    """A reader of one kind of file.

    Args:
        name: what tables call it.
        suffix: what the names of such files end in.
        sound: the contents of sound files.
        read: reads a file; whatever it raises besides RbfragError is a failure.
    """

    name: str
    suffix: str
    sound: Callable[[], Sequence[bytes]]
    read: Callable[[Path], object]


STATION_XML = (
    b'<FDSNStationXML xmlns="http://www.fdsn.org/xml/station/1"><Network code="CE">'
    b'<Station code="79435"><Channel code="HNE" locationCode="10"><Response>'
    b"<InstrumentSensitivity><Value>214580.7</Value><InputUnits><Name>M/S**2</Name></InputUnits>"
    b"</InstrumentSensitivity></Response></Channel></Station></Network></FDSNStationXML>",
)

BLOCKS_TOML = (
    b"alpha1_deg = -10.0\nalpha3_deg = 25.0\nr3_m = 1.5\nbeta_deg = 10.0\nphi_deg = 35.0\n",
    b"s1_m = 1.2\ns2_m = 0.6\ngamma_deg = 70.0\nback_fracture = true\n",
    b"vertices_m = [[0, 0], [1, 0], [1, 2], [0, 2]]\nheel = 0\ntoe = 1\nback = 3\n"
    b"gamma_deg = 90.0\n",
)

BLOCK_CSV = (b"# gamma_deg = 90\nx_m,y_m,contact\n0,0,heel\n1,0,toe\n1,2,\n0,2,back\n",)

ROCK_MASS_TOML = (
    b'realisations = 200\nseed = 1\n[base]\ndip_deg = { distribution = "normal", mean = 20.0, sd = '
    b'5.0 }\nspacing_m = { distribution = "lognormal", median = 1.0, sd_ln = 0.1, low = 0.5 }\n'
    b'[back]\ndip_deg = { distribution = "measured", values = [41.0, 44.5] }\nspacing_m = 0.6\n'
    b"[friction]\nphi_deg = 40.0\n[block]\nback_fracture = true\n",
)

ROCK_MASS_CSV = (
    b"variable,distribution,value,mean,sd,values\nbase.dip_deg,normal,,20,5,\n"
    b"base.spacing_m,,1.0,,,\nback.dip_deg,measured,,,,41 44.5 47\nback.spacing_m,,0.6,,,\n"
    b"friction.phi_deg,,40,,,\nseed,,1,,,\n",
)

HAZARD_CSV = (
    b"#,,,,,\"generated_by='OpenQuake engine 3.16', kind='mean', investigation_time=50.0, "
    b"imt='PGV'\"\nlon,lat,depth,poe-10.0,poe-20.0,poe-40.0\n10.5,45.0,0.0,0.5,0.1,0.01\n",
    b"pgv_m_s,annual_rate\n0.05,0.05\n0.1,0.02\n0.2,0.006\n",
    b"sa(1.0)_g,poe_50_years\n0.05,0.5\n0.1,0.2\n0.2,0.06\n",
)

HAZARD_JSON = (
    b'{"Peak Ground Acceleration": {"xs": [-5.0, -3.0, -1.0], "ys": [0.1, 0.01, 0.001]},\n'
    b' "1.0 Second Spectral Acceleration": {"xs": [-5.0, -3.0], "ys": [0.1, 0.01]}}\n',
)

REALIZATIONS = (
    b"#,,\"generated_by='OpenQuake engine 3.16'\"\nrlz_id,branch_path,weight\n"
    b"0,A~A,2.500000E-01\n1,B~A,7.500000E-01\n",
)

PLANES = (b"dip_deg,dip_direction_deg\n22,85\n18,97\n25,90\n",)
CRITICAL_MAP = (
    b'search_limit = 0.01\n[columns]\nmotion = "name"\nevent = "event"\npga_g = { column = "pga", '
    b'unit = "cm/s2" }\npgv_m_s = { column = "pgv", unit = "cm/s" }\npgd_m = { column = "pgd", '
    b'unit = "cm" }\ntm_s = "tm"\np2 = "p2"\nkr = "kr"\n',
)
CRITICAL_TABLE = (
    b"name,event,pga,pgv,pgd,tm,p2,kr\na,e1,300,40,10,0.6,3,0.1\nb,e1,250,30,8,0.5,3,0.08\n",
)
DISAGGREGATION = (
    b"#,,,,\"generated_by='OpenQuake engine 3.26.2', investigation_time=50.0, lon=174.776, "
    b'lat=-41.279"\nimt,iml,poe,mag,mean\nPGA,4.0E-01,7.0E-02,5.25,1.0E-02\n'
    b"PGA,4.0E-01,7.0E-02,7.25,6.0E-02\nPGA,2.0E-02,4.5E-01,5.25,3.0E-01\n",
)
GMM_TABLE = (b"rjb_km,PGV [cm/s],pgv_sigma,pgv_tau\n5,40,0.6,0.3\n20,20,0.65,0.35\n",)

METADATA = (
    b"file,trace_index,event_id,units,is_vertical,companion_group,magnitude,processing,dt_s\n"
    b'a.txt,0,e1,g,0,g1,6.5,"raw, as supplied",0.01\na.txt,1,e1,g,1,g1,6.5,,0.01\n'
    b"b.txt,,e2,,,,,,\n",
)

SHAKEMAP = (
    b'<?xml version="1.0"?>\n<shakemap_grid xmlns="http://earthquake.usgs.gov/eqcenter/shakemap" '
    b'event_id="e1" code_version="4">\n<event event_id="e1" magnitude="6.5" depth="10" lat="40.5" '
    b'lon="20.5" event_timestamp="t" />\n<grid_specification nlon="3" nlat="2" />\n'
    b'<grid_field index="1" name="LON" units="dd" />\n<grid_field index="2" name="LAT" units="dd" '
    b'/>\n<grid_field index="3" name="PGV" units="cm/s" />\n<grid_field index="4" name="PGA" '
    b'units="%g" />\n<grid_data>\n20.0 41.0 10 5\n20.5 41.0 20 10\n21.0 41.0 40 20\n'
    b"20.0 40.0 10 5\n20.5 40.0 20 10\n21.0 40.0 40 20\n</grid_data></shakemap_grid>\n",
)

UNCERTAINTY = tuple(
    grid.replace(b'"PGV" units="cm/s"', b'"STDPGV" units="ln(cm/s)"')
    .replace(b'"PGA" units="%g"', b'"STDPGA" units="ln(%g)"')
    .replace(b" 10 5", b" 0.5 0.4").replace(b" 20 10", b" 0.6 0.5").replace(b" 40 20", b" 0.7 0.6")
    for grid in SHAKEMAP
)  # fmt: skip

BLOCKS = (
    b"block_id,p2_1_s2,kr,count,lon,lat,mode\na,3.0,0.1,1,20.1,40.1,topple\n"
    b'"b, 2",1.5,0.2,2,20.2,40.2,\nc,0.3,0.05,1,20.3,40.3,topple\n',
    b"block_id,height_m,width_m,dip_deg\na,3.0,0.5,5\nb,2.0,0.4,0\n",
    b"\xef\xbb\xbfblock_id;height_m;width_m\na;3,0;0,5\nb;2,0;0,4\n",
)

GEOJSON = (
    b'{"type": "FeatureCollection", "features": [\n{"type": "Feature", "geometry": {"type": '
    b'"Point", "coordinates": [20.1, 40.1]}, "properties": {"block_id": "a", "p2_1_s2": 3.0, '
    b'"kr": 0.1}},\n{"type": "Feature", "geometry": {"type": "Point", "coordinates": [20.2, 40.2]},'
    b' "properties": {"block_id": 2, "p2_1_s2": 1.5, "kr": 0.2}}]}\n',
)


def _functions() -> list[FragilityFunction]:
    pgv, levels = IntensityType("pgv_m_s", 1.0), np.array([0.1, 0.2, 0.4])
    return [
        lognormal_function("a", "failed", pgv, 0.5, 0.4, "a"),
        discrete_function("b", "failed", pgv, levels, np.array([0.1, 0.5, 0.9]), "b"),
    ]


def _written(suffix: str, write: Callable[[Path], object]) -> bytes:
    """Return the content of a file that a function writes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"made{suffix}"
        write(path)
        return path.read_bytes()


@cache
def _blocks(suffix: str) -> tuple[bytes, ...]:
    names = np.array([f"block {i}" for i in range(40)], dtype=object)
    columns = {"block_id": names, "p2_1_s2": np.linspace(0.3, 30.0, 40), "kr": np.full(40, 0.1)}
    return (_written(suffix, lambda path: write_block_table(columns, path)),)


@cache
def _meshes(suffix: str) -> tuple[bytes, ...]:
    vertices, faces = box(0.4, 0.5, 1.1)
    if suffix == ".obj":
        return (_written(suffix, lambda path: write_obj(path, (vertices, faces))),)
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    forms = [mesh.export(file_type=suffix[1:])]
    if suffix == ".stl":
        forms.append(mesh.export(file_type="stl_ascii"))
    return tuple(form.encode() if isinstance(form, str) else form for form in forms)


@cache
def _zips() -> tuple[bytes, ...]:
    series = [f"{0.5 * (-1) ** i * i:.3f}" for i in range(60)]
    members = {"chan001.v2": csmip_v2([("Up", series)], 0.01), "sub/b.asc": esm_asc(series, 0.01)}
    zips = []
    for method in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        content = io.BytesIO()
        with zipfile.ZipFile(content, "w", method) as file:
            for name, text in members.items():
                file.writestr(zipfile.ZipInfo(name), text, method)
        zips.append(content.getvalue())
    return tuple(zips)


@cache
def _database() -> tuple[bytes, ...]:
    def write(path: Path) -> None:
        shipped = reference_file()
        assert shipped is not None
        row = next(row for row in read_models(shipped) if row.is_default)
        with opened_database(path, create=True) as engine, engine.begin() as connection:
            save_model(connection, row)

    return (_written(".db", write),)


def _read_database(path: Path) -> object:
    try:
        return read_models(path)
    finally:
        for beside in ("-wal", "-shm", "-journal"):
            path.with_name(path.name + beside).unlink(missing_ok=True)


def _read_index(path: Path) -> object:
    # the index is read with the list of accelerations that it stands beside
    record = path.with_name("list.txt")
    record.write_text("0.1\n0.2\n-0.1\n")
    return read_motions(record, units="g")


def _read_uncertainty(path: Path) -> object:
    grid = path.with_name("grid.xml")
    grid.write_bytes(SHAKEMAP[0])
    return read_shakemap(grid, uncertainty=path)


def _read_weights(path: Path) -> object:
    curve = hazard_curve(
        "pgv_m_s", np.array([0.1, 0.2]), np.array([0.01, 0.001]), source="c", statistic="rlz-001"
    )
    return realization_weights(path, [curve])


def _import(path: Path) -> object:
    beside = path.with_name(f"beside{'.csv' if path.suffix == '.toml' else '.toml'}")
    beside.write_bytes((CRITICAL_TABLE if path.suffix == ".toml" else CRITICAL_MAP)[0])
    table, columns = (beside, path) if path.suffix == ".toml" else (path, beside)
    with tempfile.TemporaryDirectory() as folder:
        return import_critical_values(table, columns, db=Path(folder) / "imported.db")


def _predict(path: Path) -> object:
    out = path.with_name(f"answers{path.suffix}")
    return predict_table(path, out, inputs={"pgv_m_s": 0.5}, model=None, level=0.95, db=None)


def _predict_by_arrow(path: Path) -> object:
    with patch.object(files, "_LARGE", 0):  # as if the file were a large one
        return _predict(path)


@cache
def _job(name: str) -> tuple[bytes, ...]:
    with tempfile.TemporaryDirectory() as folder:
        write_job(Path(folder))
        return (job_files(folder)[name].read_bytes(),)


def _read_job(path: Path, name: str) -> object:
    return read_events(job_files(write_job(path.with_name("job")), {name: path}))


READERS: tuple[Reader, ...] = (
    Reader("block TOML", ".toml", lambda: BLOCKS_TOML, read_block),
    Reader("block CSV", ".csv", lambda: BLOCK_CSV, read_block),
    Reader("rock mass TOML", ".toml", lambda: ROCK_MASS_TOML, read_rock_mass),
    Reader("rock mass CSV", ".csv", lambda: ROCK_MASS_CSV, read_rock_mass),
    Reader("measured planes", ".csv", lambda: PLANES, read_planes),
    Reader("hazard curve CSV", ".csv", lambda: HAZARD_CSV, read_hazard_curves),
    Reader("hazard curve JSON", ".json", lambda: HAZARD_JSON, read_hazard_curves),
    Reader("realizations", ".csv", lambda: REALIZATIONS, _read_weights),
    Reader("ground-motion medians", ".csv", lambda: GMM_TABLE, read_gmm_table),
    Reader("critical values", ".csv", lambda: CRITICAL_TABLE, _import),
    Reader("map of critical values", ".toml", lambda: CRITICAL_MAP, _import),
    Reader("disaggregation", ".csv", lambda: DISAGGREGATION, Disaggregation.read),
    Reader("metadata", ".csv", lambda: METADATA, read_metadata),
    Reader("index of intervals", INDEX, lambda: (b"list.txt 0.01\n",), _read_index),
    Reader("StationXML", ".xml", lambda: STATION_XML, lambda file: sensitivities(file.parent)),
    Reader("zip of records", ".zip", _zips, read_motions),
    Reader("NRML", ".xml", lambda: (nrml_text(_functions()).encode(),), read_nrml),
    Reader("pelicun", ".csv", lambda: (pelicun_text(_functions()).encode(),), read_pelicun),
    Reader("ShakeMap", ".xml", lambda: SHAKEMAP, read_shakemap),
    Reader("ShakeMap uncertainty", ".xml", lambda: UNCERTAINTY, _read_uncertainty),
    Reader("blocks CSV", ".csv", lambda: BLOCKS, read_blocks),
    Reader("blocks Parquet", ".parquet", lambda: _blocks(".parquet"), read_blocks),
    Reader("blocks Excel", ".xlsx", lambda: _blocks(".xlsx"), read_blocks),
    Reader("blocks GeoJSON", ".geojson", lambda: GEOJSON, read_blocks),
    Reader("block draws", ".csv", lambda: BLOCKS, read_draws),
    Reader("predicted CSV", ".csv", lambda: BLOCKS, _predict),
    Reader("predicted CSV of a large table", ".csv", lambda: BLOCKS, _predict_by_arrow),
    Reader("predicted Parquet", ".parquet", lambda: _blocks(".parquet"), _predict),
    Reader("predicted Excel", ".xlsx", lambda: _blocks(".xlsx"), _predict),
    Reader("mesh OBJ", ".obj", lambda: _meshes(".obj"), block_from_mesh),
    Reader("mesh PLY", ".ply", lambda: _meshes(".ply"), block_from_mesh),
    Reader("mesh STL", ".stl", lambda: _meshes(".stl"), block_from_mesh),
    *(
        Reader(f"OpenQuake {name}", ".csv", partial(_job, name), partial(_read_job, name=name))
        for name in FILES
    ),
    Reader("database", ".db", _database, _read_database),
    Reader("token", ".txt", lambda: (b"0123456789abcdefABCDEF\n",), lambda f: read_token(str(f))),
)
"""Beside these, the formats of accelerograms, which `fuzz_readers` checks more closely."""
