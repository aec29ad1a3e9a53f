"""KML, GPX and GeoJSON of logs, by the standards' schemas and by other readers."""

import json
from pathlib import Path

import numpy as np
import pytest

from estimators.errors import NothingThere
from estimators.exports.map_files import export_map
from estimators.logs import open_log
from estimators.scene.recording import SUFFIX, SceneWriter
from estimators.scene.shown import Shown, Subject
from estimators.scene_items import Gaussian, Line, PointSet, Role
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.cli.main import run_command_line
from tests.estimators.logs import flight_log, track_log

AREA = np.array([[0.0, 0.0, 0.0], [0.0, 50.0, 0.0], [100.0, 50.0, 0.0], [100.0, 0.0, 0.0]])


@pytest.fixture
def log(tmp_path):
    """A flight, and what its mission has shown: an area, a target that was found, particles."""
    path = track_log.write(tmp_path / "flight.tlog")
    writer = SceneWriter(path.with_suffix(SUFFIX))
    items = {
        "area": Line(points_ned_m=AREA, closed=True, role=Role.AREA, label="searched area"),
        "found": PointSet(points_ned_m=AREA[:1], labels=("tag 3",), role=Role.FOUND),
        "particles": PointSet(points_ned_m=np.zeros((1000, 3))),
        "belief": Gaussian(mean_ned_m=(30.0, 20.0, 0.0), covariance_m2=np.diag([4.0, 1.0])),
    }
    for name, item in items.items():
        writer.write(Shown(Subject(base="mission"), name, 40_000_000, None, item))
    writer.close()
    return open_log(path)


def test_kml_by_its_schema(log, tmp_path):
    validator = pytest.importorskip("fastkml.validator")
    export_map(log, tmp_path / "flight.kml", "kml")
    assert validator.validate(file_to_validate=tmp_path / "flight.kml")
    text = (tmp_path / "flight.kml").read_text(encoding="utf-8")
    assert text.count("<gx:Track>") == 2  # before and after the gap
    assert "<when>2023-11-14T22:13:21+00:00</when>" in text
    assert "153.0 -27.0 70.0" in text
    assert "tag 3" in text and "searched area" in text


def test_gpx_by_another_reader(log, tmp_path):
    gpxpy = pytest.importorskip("gpxpy")
    export_map(log, tmp_path / "flight.gpx", "gpx")
    text = (tmp_path / "flight.gpx").read_text(encoding="utf-8")
    assert 'xmlns="http://www.topografix.com/GPX/1/1"' in text and 'version="1.1"' in text
    read = gpxpy.parse(text)
    (track,) = read.tracks
    assert [len(segment.points) for segment in track.segments] == [121, 74]
    first = track.segments[0].points[0]
    assert (first.latitude, first.longitude, first.elevation) == (-27.0, 153.0, 70.0)
    assert first.time.isoformat() == "2023-11-14T22:13:21+00:00"
    assert track.segments[0].length_2d() == pytest.approx(240.0, rel=0.01)
    assert {point.name for point in read.waypoints} == {"mission found tag 3", "mission belief"}


def test_geojson_by_its_model(log, tmp_path):
    model = pytest.importorskip("geojson_pydantic").FeatureCollection
    export_map(log, tmp_path / "flight.geojson", "geojson")
    text = (tmp_path / "flight.geojson").read_text(encoding="utf-8")
    model.model_validate_json(text)
    features = {feature["properties"]["name"]: feature for feature in json.loads(text)["features"]}
    area = features["searched area"]
    assert area["properties"]["role"] == "area"
    ring = np.array(area["geometry"]["coordinates"][0])
    home = track_log.HOME
    frame = LocalFrame(GeodeticPosition(lat_deg=home[0], lon_deg=home[1], alt_m=home[2]))
    north_m, east_m, _ = frame.ned_from_geodetic(ring[:, 1], ring[:, 0], np.full(len(ring), home[2]))
    assert north_m.max() == pytest.approx(100.0, abs=0.01) and east_m.max() == pytest.approx(50.0, abs=0.01)
    assert np.sum(ring[:-1, 0] * ring[1:, 1] - ring[1:, 0] * ring[:-1, 1]) > 0.0  # counterclockwise
    track = features["vehicle 1"]
    assert [len(line) for line in track["geometry"]["coordinates"]] == [121, 74]
    assert len(track["properties"]["unix_s"]) == 195
    assert "mission particles 1" not in features


@pytest.mark.parametrize("form", ["kml", "gpx", "geojson"])
def test_nothing_is_overwritten_and_options_of_messages_are_refused(log, tmp_path, capsys, form):
    out = tmp_path / f"out.{form}"
    arguments = ["log", "export", str(log.path), "--format", form, "--out", str(out)]
    assert run_command_line([*arguments, "--types", "ATTITUDE"]) == 2
    assert f"--format {form} has whole tracks and takes no --types" in capsys.readouterr().err
    assert run_command_line(arguments) == 0
    assert "1 track" in capsys.readouterr().out
    written = out.read_bytes()
    assert run_command_line(arguments) == 1
    assert out.read_bytes() == written


def test_a_log_without_a_position_is_refused(tmp_path: Path) -> None:
    opened = open_log(flight_log.write(tmp_path / "flight.tlog"))
    with pytest.raises(NothingThere, match="has no positions of a vehicle by the autopilot"):
        export_map(opened, tmp_path / "x.kml", "kml")
