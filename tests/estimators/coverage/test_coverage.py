"""Coverage and probability of detection: against Koopman's formulas, and against targets drawn one by one."""

import json
import math

import numpy as np
import pytest

from estimators.coverage.coverage import coverage_of
from estimators.coverage.files import read_area
from estimators.coverage.parameters import CoverageParameters, LateralRange, Looks
from estimators.errors import EstimatorError
from estimators.flown_track import FlownTrack
from estimators.vision.camera import CameraGeometry
from estimators.vision.camera_file import CameraDescription
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.cli.main import run_command_line
from tests.estimators.logs.track_log import write

HOME = GeodeticPosition(lat_deg=-27.0, lon_deg=153.0, alt_m=40.0)
AREA = np.array([[0.0, 0.0], [0.0, 300.0], [400.0, 300.0], [400.0, 0.0]])


def parallel_sweep(spacing_m, *, height_m=60.0, speed_m_s=10.0, bank_rad=0.0, seed=1):
    """Legs to the north and back over the area and a margin, the first half a spacing inside; 5 Hz."""
    legs = np.arange(0.5 * spacing_m - 300.0, 600.0, spacing_m)
    north = np.arange(-600.0, 1000.0, speed_m_s / 5.0)
    n = np.concatenate([north if k % 2 == 0 else north[::-1] for k in range(len(legs))])
    e = np.repeat(legs, len(north))
    yaw = np.repeat([0.0 if k % 2 == 0 else math.pi for k in range(len(legs))], len(north))
    rng = np.random.default_rng(seed)
    roll, pitch = bank_rad * rng.standard_normal((2, len(n)))
    # a leg has nothing to do with the next one: 3 s without a message between them
    time_us = np.round(0.2e6 * np.arange(len(n)) + 3e6 * np.repeat(np.arange(len(legs)), len(north)))
    lat, lon, alt = LocalFrame(HOME).geodetic_from_ned(n, e, np.full(len(n), -height_m))
    return FlownTrack(
        system_id=1, boot=0, source="truth", home=HOME, time_us=time_us.astype(np.int64),
        unix_us=np.zeros(len(n), dtype=np.int64), lat_deg=lat, lon_deg=lon, alt_m=alt,
        roll_rad=roll, pitch_rad=pitch, yaw_rad=yaw,
    )  # fmt: skip


def test_parallel_sweep_by_the_inverse_cube_law(coverage=0.8):
    """POD = erf(sqrt(pi) / 2 C) (Koopman 1946), C: sweep width by track spacing. Legs end 300 m outside."""
    parameters = CoverageParameters(
        sweep_width_m=50.0, lateral_range=LateralRange.INVERSE_CUBE, most_range_m=400.0, cell_m=5.0
    )
    found = coverage_of([parallel_sweep(50.0 / coverage)], parameters, None, AREA).figures
    assert found["pod"] == pytest.approx(math.erf(0.5 * math.sqrt(math.pi) * coverage), abs=0.015)
    assert found["coverage"] == pytest.approx(coverage, rel=0.05)  # 5 legs in 300 m
    assert found["track_by"] == "truth"


@pytest.mark.parametrize(("spacing_m", "share"), [(100.0, 0.5), (50.0, 1.0), (30.0, 1.0)])
def test_parallel_sweep_by_definite_detection(spacing_m, share):
    parameters = CoverageParameters(sweep_width_m=50.0, cell_m=1.0)
    found = coverage_of([parallel_sweep(spacing_m)], parameters, None, AREA).figures
    assert found["swept_share"] == found["pod"] == pytest.approx(share, abs=0.02)
    assert found["area_m2"] == pytest.approx(120_000.0, rel=0.01)


def rotation(roll, pitch, yaw):
    """R_ned_from_frd, written from the definition of the angles."""
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def drawn_pod(track, camera, parameters, count, rng):
    """Share of targets that are detected, each drawn at a place and look by look, and where they were."""
    targets = rng.uniform(AREA.min(axis=0), AREA.max(axis=0), (count, 2))
    step = round(parameters.look_s * 5.0)
    frame, part = LocalFrame(HOME), np.cumsum(np.diff(track.time_us, prepend=track.time_us[0]) > 2_000_000)
    n, e, d = frame.ned_from_geodetic(track.lat_deg, track.lon_deg, track.alt_m)
    rows = np.concatenate([np.flatnonzero(part == k)[::step] for k in range(part[-1] + 1)])
    mount = rotation(*camera.mount_rad)
    g, p = camera.geometry, parameters
    found, best, newest_s = np.zeros(count, dtype=bool), np.zeros(count), np.full(count, -np.inf)
    for row in rows:
        now_s = 1e-6 * track.time_us[row]
        r_cam = (rotation(track.roll_rad[row], track.pitch_rad[row], track.yaw_rad[row]) @ mount).T
        away = np.column_stack([targets - (n[row], e[row]), np.full(count, -d[row])]) @ r_cam.T
        ahead = np.flatnonzero(away[:, 0] > 1.0)
        if not len(ahead):
            continue
        points = away[ahead][:, [1, 2, 0]]  # right, down, along the axis
        size_px = p.target_size_m * g.focal_px[0] * math.sqrt(-d[row]) / points[:, 2] ** 1.5
        pixels, half = g.pixels(points), 0.6 * size_px  # the border of `SightModel`
        whole = (pixels > half[:, None]).all(axis=1)
        whole &= (pixels < np.array([g.width_px, g.height_px]) - half[:, None]).all(axis=1)
        chance = p.detect_peak / (1.0 + np.exp(-(size_px - p.detect_half_px) / p.detect_width_px))
        seen = np.zeros(count)
        seen[ahead[whole]] = chance[whole]
        if p.looks is Looks.EACH:
            found |= rng.random(count) < seen
            continue
        over = (best > 0.0) & (now_s - newest_s > p.pass_gap_s) & (seen > 1e-3)
        found |= over & (rng.random(count) < best)
        best[over] = 0.0
        best = np.maximum(best, seen)
        newest_s[seen > 1e-3] = now_s
    found |= rng.random(count) < best
    return found, targets


@pytest.mark.parametrize("looks", [Looks.PASS, Looks.EACH])
def test_camera_against_targets_drawn_one_by_one(looks):
    camera = CameraDescription(
        geometry=CameraGeometry.of_view(
            width_px=640, height_px=480, horizontal_fov_rad=math.radians(60.0),
            distortion=(-0.12, 0.02, 0.0, 0.0, 0.0),
        ),
        mount_rad=(0.0, math.radians(-65.0), 0.0),
    )  # fmt: skip
    parameters = CoverageParameters(
        cell_m=2.0, looks=looks, look_s=1.0, target_size_m=1.0, detect_peak=0.6, detect_half_px=9.0
    )
    track = parallel_sweep(90.0, bank_rad=math.radians(4.0), speed_m_s=20.0)
    coverage = coverage_of([track], parameters, camera, AREA)
    detected, targets = drawn_pod(track, camera, parameters, 6000, np.random.default_rng(3))
    count = len(detected)
    sigma = math.sqrt(coverage.figures["pod"] * (1.0 - coverage.figures["pod"]) / count)
    assert coverage.figures["pod"] == pytest.approx(detected.mean(), abs=3.0 * sigma)
    assert 0.2 < coverage.figures["pod"] < 0.9
    layout = coverage.area.layout  # the map is right, and not only its mean: Brier score below a constant's
    cells = tuple(np.floor((targets - (layout.south_m, layout.west_m)) / layout.cell_m).astype(int).T)
    brier = np.mean((coverage.pod[cells] - detected) ** 2)
    assert brier == pytest.approx(np.mean(coverage.pod[cells] * (1.0 - coverage.pod[cells])), abs=0.012)


def test_two_searches_count_together():
    parameters = CoverageParameters(
        sweep_width_m=30.0, lateral_range=LateralRange.INVERSE_CUBE, cell_m=10.0, most_range_m=100.0
    )
    track = parallel_sweep(60.0)
    once, twice = (coverage_of([track] * n, parameters, None, AREA).pod for n in (1, 2))
    assert twice == pytest.approx(1.0 - (1.0 - once) ** 2, abs=1e-12)


def test_no_camera_and_no_sweep_width_is_refused():
    with pytest.raises(EstimatorError, match="give a camera or `sweep_width_m`, and not both"):
        coverage_of([parallel_sweep(60.0)], CoverageParameters())
    with pytest.raises(EstimatorError, match="no flight above 100 m over the ground"):
        coverage_of([parallel_sweep(60.0)], CoverageParameters(sweep_width_m=10.0, least_height_m=100.0))


def geojson(path, corners_ne_m=((20.0, 0.0), (20.0, 40.0), (180.0, 40.0), (180.0, 0.0))):
    north, east = np.array(corners_ne_m).T
    lat, lon, _ = LocalFrame(HOME).geodetic_from_ned(north, east, np.zeros(len(north)))
    ring = [[float(x), float(y)] for x, y in zip([*lon, lon[0]], [*lat, lat[0]], strict=True)]
    feature = {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [ring]}, "properties": {}}
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}), encoding="utf-8")
    return path


def test_the_command_writes_picture_geotiff_and_numbers(tmp_path, capsys):
    rasterio = pytest.importorskip("rasterio")
    log, area = write(tmp_path / "flight.tlog"), geojson(tmp_path / "area.geojson")
    out = tmp_path / "out"
    arguments = ["--sweep-width", "10", "--area", str(area), "--cell", "1", "--out", str(out)]
    assert run_command_line(["log", "coverage", str(log), *arguments]) == 0
    figures = json.loads((out / "coverage.json").read_text())
    # two legs of 160 m, their outer halves outside of the area, less 30 m of the second in a gap
    assert figures["swept_m2"] == pytest.approx(2 * 160 * 5 - 30 * 5, rel=0.03)
    assert figures["track_by"] == "autopilot"
    assert (out / "coverage.png").stat().st_size > 10_000
    with rasterio.open(out / "coverage.tif") as dataset:
        assert dataset.descriptions == ("pod", "swept")
        assert np.nanmean(dataset.read(1)) == pytest.approx(figures["pod"], abs=1e-6)
        assert dataset.bounds.bottom == pytest.approx(HOME.lat_deg + 20.0 / 110790.0, abs=2e-5)
    assert "swept, POD" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "is no GeoJSON"),
        ('{"type": "Point", "coordinates": [1, 2]}', "has no Polygon without holes"),
        ('{"type": "Polygon", "coordinates": [[[0, 0], [0, 1], [1, 1]]]}', "a Polygon has 4 positions"),
        ("[]", "is no GeoJSON"),
    ],
)
def test_a_file_without_a_polygon_is_refused(tmp_path, text, words):
    (tmp_path / "area.geojson").write_text(text, encoding="utf-8")
    with pytest.raises(EstimatorError, match=words):
        read_area(tmp_path / "area.geojson", HOME)
