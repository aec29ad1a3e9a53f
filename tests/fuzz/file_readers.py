"""Every reader of files, with small whole files of its kind."""

import io
import json
import lzma
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import flightsim
from autopilot_bridge.errors import TlogError
from autopilot_bridge.parameter_files import read_untyped_parameter_file
from autopilot_bridge.parameters import ParameterError
from autopilot_bridge.tlog import TlogReader
from estimators.errors import EstimatorError, LogError
from estimators.logs import open_log, report_of
from estimators.logs.dialect import load_dialect
from estimators.observations import Image, ObservationWriter, read_observations
from estimators.survey.compensation import Compensation, compensation_bytes, load_compensation
from estimators.survey.lines import HEADER, load_lines
from estimators.survey.map_import import imported_map
from estimators.survey.map_import_options import MapImport
from estimators.vision import CameraDescription, CameraGeometry, load_camera
from estimators.vision.video import Film, frames_of
from flightsim.airframe import AirframeError
from flightsim.airframe_file import load_airframe
from flightsim.foundation.magnetic_map_file import MagneticMapError, read_map_file
from flightsim.home import Home
from flightsim.payload.magnetic_map import MagneticMap
from flightsim.world_file import WorldFileError
from flightsim.world_spec import WorldSpec
from missions.errors import PlanError
from missions.plan_files.files import read_mission_file
from missions.survey.drape import load_terrain
from tests.estimators.logs import flight_log
from tests.estimators.logs.onboard_logs import ardupilot_plane, px4_plane
from tests.estimators.logs.test_dataflash_formats import copter_of_2014, text_of
from tests.fuzz.file_campaign import Reader
from tests.missions.plan_files import plans

_AXIS = np.arange(12.0) * 100.0
_FIELD = 48_000.0 + np.add.outer(_AXIS, _AXIS) * 0.01
_EXAMPLES = Path(__file__).parents[2] / "examples"
_DIALECT = b"""<?xml version='1.0'?><mavlink><messages><message id="150" name="OWN">
<field type="uint32_t" name="time_boot_ms" units="ms">a</field><field type="float[4]" name="q">b</field>
<extensions/><field type="char[10]" name="text">c</field></message></messages></mavlink>"""
_CALIBRATION = b"""image_width: 64
image_height: 48
camera_matrix:
  rows: 3
  cols: 3
  data: [43.8, 0.0, 30.5, 0.0, 43.7, 24.3, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.36, 0.11, 0.001, 0.0005, 0.0]}
"""


def _made(write: Callable[[Path], Any], suffix: str = "") -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"whole{suffix}")
        write(path)
        return path.read_bytes()


def _read_log(path: Path) -> None:
    """All that `log info` and `log export` look at."""
    log = open_log(path)
    report_of(log)
    for key in log.keys:
        for table in log.tables(key.name, system_id=key.system_id, component_id=key.component_id):
            table.time_us, table.log_time_us  # noqa: B018
            for name in table.fields:
                if table[name].dtype.kind != "S":
                    table.si(name)


def _log(suffix: str, *seeds: bytes, text: bool = False) -> Reader:
    return Reader(suffix=suffix, seeds=seeds, read=_read_log, errors=(LogError,), text=text)


def _observations(path: Path) -> None:
    writer = ObservationWriter(path)
    for number in range(3):
        writer.write(
            Image(
                time_us=number,
                src_system=1,
                pixels=np.zeros((4, 5, 3), dtype=np.uint8),
                focal_px=(1.0, 1.0),
                centre_px=(2.0, 2.0),
                q_ned_from_camera=(1.0, 0.0, 0.0, 0.0),
                pos_ned_m=(0.0, 0.0, 0.0),
            ),
            number,
        )
    writer.close()


def _magnetic_map(path: Path) -> None:
    home = Home(lat_deg=47.4, lon_deg=8.55, alt_m=400.0)
    MagneticMap(north_m=_AXIS, east_m=_AXIS, total_field_nt=_FIELD, height_m=80.0, home=home).save(path)


def _film(path: Path) -> None:
    with Film(path, width_px=32, height_px=32) as film:
        for number in range(4):
            film.write(number * 100_000, np.full((32, 32, 3), 60 * number, dtype=np.uint8))


def _line_data(separator: str = ",", header: str = "longitude,latitude,mag") -> bytes:
    rows = (
        f"{8.55 + 0.002 * east:.6f},{47.4 + 0.0005 * north:.6f},{48_000 + north + east:.2f}"
        for east in range(5)
        for north in range(8)
    )
    return "\n".join((header, *rows, "")).replace(",", separator).encode()


def _grid(driver: str, path: Path) -> None:
    import rasterio

    shape = {"width": 12, "height": 12, "count": 1}
    place = rasterio.transform.from_origin(450_000.0, 5_250_000.0, 100.0, 100.0)
    with rasterio.open(path, "w", driver=driver, dtype="float32", transform=place, **shape) as dataset:
        dataset.write(_FIELD.astype(np.float32), 1)


def _netcdf(path: Path) -> None:
    import netCDF4

    with netCDF4.Dataset(path, "w") as dataset:
        for name, first in (("lat", 47.4), ("lon", 8.55)):
            dataset.createDimension(name, 12)
            dataset.createVariable(name, "f8", (name,))[:] = first + 0.001 * np.arange(12)
        dataset.createVariable("z", "f8", ("lat", "lon"))[:] = _FIELD


def _vehicle(model: str) -> bytes:
    """A description of the package, with the whole path of its JSBSim model."""
    folder = Path(flightsim.__file__).parent / "models" / model
    text = (folder / "vehicle.toml").read_text()
    return text.replace('jsbsim = "', f'jsbsim = "{folder}/', 1).encode()


def _map_source(suffix: str, *seeds: bytes, text: bool = False, crs: str | None = None) -> Reader:
    def read(path: Path) -> None:
        imported_map(path, MapImport(line_spacing_m=200.0, crs=crs))

    return Reader(suffix=suffix, seeds=seeds, read=read, errors=(EstimatorError,), text=text)


@cache
def readers() -> dict[str, Reader]:
    """The readers by name."""
    tlog = _made(flight_log.write)
    text = _made(lambda path: path.write_text(text_of(copter_of_2014(path.with_name("a.bin")))[:60_000]))
    camera = CameraDescription(
        geometry=CameraGeometry.of_view(width_px=64, height_px=48, horizontal_fov_rad=1.0)
    )
    table = b"north_m,east_m,ground_m\n" + b"".join(
        b"%d,%d,5.5\n" % (n, e) for n in range(4) for e in range(4)
    )
    terrain = io.BytesIO()
    np.savez_compressed(terrain, north_m=_AXIS, east_m=_AXIS, ground_m=_FIELD)
    lines = f"{HEADER}\nL1,line,0.0,0.0,100.0,0.0\nT1,tie,0.0,0.0,0.0,100.0\n".encode()
    terms = compensation_bytes(Compensation(coefficients=np.arange(16.0)))
    plan = json.dumps({**plans.PLAN, "geoFence": {"circles": [], "polygons": [], "version": 2}}).encode()
    waypoints = b"QGC WPL 110\n" + b"".join(
        b"%d\t%d\t%d\t%d\t%d\t1\t0\t0\t47.4%d\t8.55\t20\t1\n" % (n, not n, 3 if n else 0, item, n > 2, n)
        for n, item in enumerate((16, 22, 16, 177, 20))
    )
    return {
        "tlog": _log(".tlog", tlog),
        "bin": _log(".bin", bytes(ardupilot_plane(1).data), _made(copter_of_2014)[:30_000]),
        "text log": _log(".log", text, text=True),
        "ulg": _log(".ulg", bytes(px4_plane(1).data)),
        "tlog of the bridge": Reader(
            suffix=".tlog", seeds=(tlog,), read=lambda path: list(TlogReader(path)), errors=(TlogError,)
        ),
        "dialect": Reader(suffix=".xml", seeds=(_DIALECT,), read=load_dialect, errors=(LogError,), text=True),
        "observations": Reader(
            suffix=".observations",
            seeds=(_made(_observations, ".observations"),),
            read=lambda path: list(read_observations(path, (Image,))),
            errors=(),
        ),
        "magnetic map": Reader(
            suffix=".npz", seeds=(_made(_magnetic_map),), read=read_map_file, errors=(MagneticMapError,)
        ),
        "terrain table": Reader(
            suffix=".csv", seeds=(table,), read=load_terrain, errors=(PlanError,), text=True
        ),
        "terrain arrays": Reader(
            suffix=".npz", seeds=(terrain.getvalue(),), read=load_terrain, errors=(PlanError,)
        ),
        "survey lines": Reader(
            suffix=".csv", seeds=(lines,), read=load_lines, errors=(EstimatorError,), text=True
        ),
        "compensation": Reader(
            suffix=".json", seeds=(terms,), read=load_compensation, errors=(EstimatorError,), text=True
        ),
        "line data": _map_source(
            ".csv",
            _line_data(),
            _line_data(";"),
            b"/ LON LAT MAG\nLine 5\n" + _line_data(" ", "").lstrip(),
            text=True,
        ),
        "packed line data": _map_source(".csv.xz", lzma.compress(_line_data())),
        "geotiff": _map_source(".tif", _made(lambda path: _grid("GTiff", path)), crs="EPSG:32632"),
        "esri grid": _map_source(
            ".asc", _made(lambda path: _grid("AAIGrid", path), ".asc"), text=True, crs="EPSG:32632"
        ),
        "netcdf": _map_source(".nc", _made(_netcdf, ".nc")),
        "camera": Reader(
            suffix=".toml",
            seeds=(camera.toml().encode(),),
            read=load_camera,
            errors=(EstimatorError,),
            text=True,
        ),
        "calibration": Reader(
            suffix=".yaml", seeds=(_CALIBRATION,), read=load_camera, errors=(EstimatorError,), text=True
        ),
        "video": Reader(
            suffix=".mp4",
            seeds=(_made(_film, ".mp4"),),
            read=lambda path: list(frames_of(str(path))),
            errors=(EstimatorError,),
        ),
        "plan": Reader(suffix=".plan", seeds=(plan,), read=read_mission_file, errors=(PlanError,), text=True),
        "waypoints": Reader(
            suffix=".waypoints", seeds=(waypoints,), read=read_mission_file, errors=(PlanError,), text=True
        ),
        "parameters": Reader(
            suffix=".params",
            seeds=(
                b"# comment\nMPC_XY_CRUISE 5.5\n1\t1\tCOM_RC_IN_MODE\t1\t6\n",
                b"A_B,1\nC=2.5 @READONLY\n",
            ),
            read=read_untyped_parameter_file,
            errors=(ParameterError,),
            text=True,
        ),
        "world": Reader(
            suffix=".toml",
            seeds=((_EXAMPLES / "windy_world.toml").read_bytes(), (_EXAMPLES / "handoff.toml").read_bytes()),
            read=WorldSpec.load,
            errors=(WorldFileError,),
            text=True,
        ),
        "vehicle": Reader(
            suffix=".toml",
            seeds=(_vehicle("iris"), _vehicle("aerosonde")),
            read=load_airframe,
            errors=(AirframeError,),
            text=True,
        ),
    }
