"""What a user can get wrong about aircraft and their missions: one clear line that names the value and what
is accepted, exit code 2 before anything flies, no run folder left behind.
"""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.system.test_bad_input import refused

ZURICH = {"home_lat_deg": 47.39774, "home_lon_deg": 8.54559, "home_alt_m": 489.4}
LINES = np.linspace(-1500.0, 1500.0, 31)
FIELD = np.full((31, 31), 48_000.0)
HOLE = np.where(np.hypot(*np.meshgrid(LINES, LINES)) < 150.0, np.nan, FIELD)

MAPS: dict[str, dict[str, Any]] = {
    "nodata.npz": {"total_field_nt": np.full((31, 31), np.nan)},
    "hole.npz": {"total_field_nt": HOLE},
    "infinite.npz": {"total_field_nt": np.full((31, 31), np.inf)},
    "weak.npz": {"total_field_nt": np.full((31, 31), 5.0)},
    "negative.npz": {"total_field_nt": -FIELD},
    "complex.npz": {"total_field_nt": FIELD * 1j},
    "objects.npz": {"total_field_nt": np.array([{}], dtype=object)},
    "words.npz": {"north_m": np.array(["south", "north"] * 15 + ["pole"])},
    "falling.npz": {"north_m": LINES[::-1]},
    "uneven.npz": {"east_m": np.sign(LINES) * LINES**2 / 1500.0},
    "shape.npz": {"total_field_nt": FIELD[:5]},
    "nogradient.npz": {"vertical_gradient_nt_m": np.full((31, 31), np.nan)},
    "heights.npz": {"height_m": np.zeros(3)},
    "nowhere.npz": {"home_alt_m": np.nan},
    "elsewhere.npz": {"home_lat_deg": -35.0, "home_lon_deg": 149.0},
    "other_format.npz": {"format": "aeromag-7"},
    "small.npz": {"north_m": LINES / 3.0, "east_m": LINES / 3.0},
}

MAP_REFUSALS = {
    "nosuch.npz": ("--map nosuch.npz can't be read", "No such file"),
    "folder": ("--map folder can't be read", "directory"),
    "random.npz": ("--map random.npz is not a magnetic map", ".npz"),
    "text.npz": ("--map text.npz is not a magnetic map", ".npz"),
    "empty.npz": ("--map empty.npz", "it is empty"),
    "array.npy": ("--map array.npy is not a magnetic map", ".npz"),
    "torn.npz": ("--map torn.npz is not a magnetic map",),
    "spoiled.npz": ("--map spoiled.npz is not a magnetic map",),
    "partial.npz": ("--map partial.npz", "it has no format, north_m"),
    "nodata.npz": ("nodata.npz: it has no data", "total_field_nt"),
    "hole.npz": ("magnetic map has no data in part of it", "north -1500 to 1500 m", "--size"),
    "infinite.npz": ("infinite.npz: it has no data",),
    "weak.npz": ("--map weak.npz has values from 5 to 5 nT", "18000 to 72000 nT"),
    "negative.npz": ("negative.npz has values from -", "no total field of the Earth"),
    "complex.npz": ("complex.npz", "total_field_nt holds complex128"),
    "objects.npz": ("objects.npz is not a magnetic map",),
    "words.npz": ("words.npz", "north_m holds <U5"),
    "falling.npz": ("falling.npz", "rising lines"),
    "uneven.npz": ("uneven.npz", "east_m", "even spacing"),
    "shape.npz": ("shape.npz", "(5, 31)", "31 rising lines"),
    "nogradient.npz": ("nogradient.npz", "vertical_gradient_nt_m", "leave it out"),
    "heights.npz": ("heights.npz", "height_m has the shape (3,)"),
    "nowhere.npz": ("nowhere.npz", "nan", "not finite"),
    "elsewhere.npz": ("elsewhere.npz", "another place", "-35.000000,149.000000", "--home"),
    "other_format.npz": ("aeromag-7", "accepted is flightstack-magnetic-map-1"),
    "small.npz": ("does not cover it", "north -500 to 500 m", "--size"),
}

MODELS = {
    "broken.toml": (b"kind = [", ("broken.toml", "not TOML")),
    "empty.toml": (b"", ("empty.toml", "no table [vehicle]")),
    "boat.toml": (
        b'[vehicle]\nname = "b"\nkind = "boat"\njsbsim = "c172x"\n',
        ("boat.toml", "boat", "fixed_wing"),
    ),
    "unknown.toml": (
        b'[vehicle]\nname = "u"\nkind = "fixed_wing"\njsbsim = "c172x"\nwings = 3\n',
        ("unknown.toml", "wings"),
    ),
    "missing.toml": (b'[vehicle]\nname = "m"\nkind = "fixed_wing"\njsbsim = "nosuch.xml"\n', ("nosuch",)),
    "bytes.toml": (b"\xff\xfe\x00\x01", ("bytes.toml", "UTF-16")),
    "broken.xml": (b"<fdm_config", ("broken.xml", "JSBSim cannot load")),
}

FLY = {
    # aircraft
    "lissajous --model nowhere": ("'nowhere' is unknown", "aerosonde", "vehicle.toml"),
    "orbit --model aerosonde --launch foo": ("'foo'", "'runway', 'catapult', 'hand'"),
    "lissajous --model iris --launch hand": ("launch 'hand' is for aircraft", "iris", "aerosonde"),
    "occupancy --model iris --launch catapult": ("launch 'catapult' is for aircraft", "aerosonde"),
    "occupancy --vehicles 3 --model iris,aerosonde": ("2 models for 3 vehicles", "one for all, or 3"),
    "lissajous --model aerosonde --speed 80": ("airspeed 80 m/s", "18..30 m/s"),
    "lissajous --model aerosonde --speed 2": ("airspeed 2 m/s", "range"),
    "lissajous --model aerosonde --size 50": ("radius", "ask for --size"),
    "lissajous --model aerosonde --vehicles 2 --separation 1": ("layers of 1 m", "--separation 10"),
    "lissajous --model ,": ("--model ','", "without a name"),
    "lissajous --model aerosonde --wind 30": (
        "airspeed 25 m/s",
        "42.8 m/s of wind at the height of the flight",
    ),
    "lissajous --model aerosonde --altitude 5": ("altitude 5 m", "20..120 m"),
    "lissajous --model aerosonde --size 100": ("the aircraft needs 115 m", "ask for --size 1940"),
    "parallel-sweep --model aerosonde --size 50": ("no room for the aircraft's turns", "--size 560"),
    # the orbit
    "orbit --airspeed 100": ("airspeed 100 m/s", "18..30 m/s"),
    "orbit --model iris": ("orbit is flown by aircraft", "--model aerosonde"),
    "orbit --radius 60": ("radius 60 m can't be held", "45 degrees of bank (FW_R_LIM)", "--radius"),
    "orbit --autopilot ardupilot --radius 60": ("radius 60 m can't be held", "ROLL_LIMIT_DEG", "--radius"),
    "orbit --radius 115 --target-speed 12": ("radius 115 m can't be held", "12 m/s", "--airspeed"),
    "orbit --radius nan": ("--radius nan", "more than 0"),
    "orbit --radius -150": ("--radius -150", "more than 0"),
    "orbit --radius inf": ("--radius inf", "more than 0"),
    "orbit --radius 5000": ("5000 m", "below the horizon", "--altitude"),
    "orbit --duration nan": ("--duration nan",),
    "orbit --duration 1e9": ("--duration 1e+09 s", "1..21600 s"),
    "orbit --altitude nan": ("--altitude nan", "finite"),
    "orbit --altitude -10": ("altitude -10 m", "20..120 m"),
    "orbit --airspeed nan": ("--airspeed nan",),
    "orbit --airspeed 5": ("airspeed 5 m/s", "18..30 m/s"),
    "orbit --target 1": ("'--target': '1'", "NORTH,EAST"),
    "orbit --target nan,0": ("'--target': 'nan,0'",),
    "orbit --target 1e9,0": ("--target 1e+09,0 m", "50000 m of home"),
    "orbit --target-speed nan": ("--target-speed nan", "0..15 m/s"),
    "orbit --target-heading nan": ("'--target-heading': nan", "degrees"),
    "orbit --target-motion circle": ("--target-motion circle", "--target-speed"),
    "orbit --target-motion static --target-speed 2": ("--target-motion static", "--target-speed"),
    "orbit --target-ground nan": ("--target-ground nan",),
    "orbit --target-ground -inf": ("--target-ground -inf",),
    "orbit --target-ground 200": ("200 m above home", "--altitude"),
    "orbit --entry-bearing nan": ("'--entry-bearing': nan", "degrees"),
    "orbit --entry-distance 0": ("--entry-distance 0", "more than 0"),
    "orbit --entry-heading inf": ("'--entry-heading': inf", "degrees"),
    "orbit --lost-limit nan": ("--lost-limit nan", "more than 0"),
    "orbit --lost-limit -1": ("--lost-limit -1", "more than 0"),
    "orbit --direction up": ("'up'", "'cw', 'ccw'"),
    "orbit --expect-wind nan": ("--expect-wind nan",),
    "orbit --arg foo=1": ("--arg is for a mission of your own",),
    "orbit --size 100": ("--size is for", "not for orbit"),
    "orbit --map some.npz": ("--map is for occupancy, survey, not for orbit",),
    "orbit --search-time 5": ("--search-time is for", "not for orbit"),
    # the search
    "occupancy --vehicles 2 --separation 1": ("layers of 1 m", "--separation 10"),
    "occupancy --target 9000,0": ("--target 9000,0 is outside", "north -1200 to 1200 m", "--size"),
    "occupancy --target nan,0": ("'--target': 'nan,0'",),
    "occupancy --target 5": ("'--target': '5'", "NORTH,EAST"),
    "occupancy --cell 20": ("--cell 20 m is too small", "--cell"),
    "occupancy --cell 120 --wind 12": ("--cell 120 m is too small", "17.1 m/s of wind"),
    "occupancy --cell nan": ("--cell nan",),
    "occupancy --cell -1": ("--cell -1",),
    "occupancy --cell 5000": ("--cell 5000 m", "0 x 0 cells"),
    "occupancy --cell 0.001": ("--cell 0.001 m", "250000"),
    "occupancy --size 0": ("--size 0 ", "more than 0", "50000 m"),
    "occupancy --size 1e6": ("--size 1e+06 ", "50000 m"),
    "occupancy --area 5": ("'--area': '5'", "NORTH,EAST"),
    "occupancy --area 1e9,0": ("1000001200 m", "--area"),
    "occupancy --neighbourhood 0": ("--neighbourhood 0", "1..20"),
    "occupancy --heading-penalty nan": ("--heading-penalty nan",),
    "occupancy --detection-probability 2": ("--detection-probability 2", "more than 0, less than 1"),
    "occupancy --detection-range nan": ("--detection-range nan",),
    "occupancy --threshold 1": ("--threshold 1 nT", "standard deviations"),
    "occupancy --noise nan": ("--noise nan",),
    "occupancy --confirmations 0": ("--confirmations 0", "1 or more"),
    "occupancy --raise-radius nan": ("--raise-radius nan",),
    "occupancy --search-time 1e9": ("--search-time 1e+09 ", "86400 s"),
    "occupancy --altitude 5000": ("altitude 5000 m", "20..120 m"),
    "occupancy --speed nan": ("--speed nan",),
    "occupancy --rate nan": ("--rate nan Hz", "2.5..100 Hz"),
    "occupancy --amplitude 1": ("--amplitude 1 nT", "--threshold 3 nT"),
    "occupancy --sigma 0": ("--sigma 0 ", "more than 0"),
    "occupancy --arg foo=1": ("--arg is for a mission of your own",),
    "occupancy --radius 100": ("--radius is for orbit, handoff, not for occupancy",),
    "occupancy --via setpoints": ("--via is for lissajous", "not for occupancy"),
    "occupancy --connect udpin:127.0.0.1:0": ("needs the published magnetic map", "--map FILE"),
    "occupancy --connect udpin:127.0.0.1:0 --model aerosonde": ("--model", "--connect"),
    "orbit --connect udpin:127.0.0.1:0 --launch hand": ("--launch", "--connect"),
}


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("arguments", FLY)
def test_fly_says_what_is_wrong(arguments: str, place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = refused(capsys, ["fly", *arguments.split()])
    for words in FLY[arguments]:
        assert words in line
    assert list(place.iterdir()) == []


@pytest.mark.parametrize("command", ["fly lissajous", "sitl --link udpin:127.0.0.1:0"])
@pytest.mark.parametrize("name", MODELS)
def test_a_broken_description(
    name: str, command: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content, expected = MODELS[name]
    (place / name).write_bytes(content)
    line = refused(capsys, [*command.split(), "--model", name])
    for words in expected:
        assert words in line
    assert [path.name for path in place.iterdir()] == [name]


def test_sitl_refuses_a_launch_of_multicopters(capsys: pytest.CaptureFixture[str]) -> None:
    line = refused(capsys, ["sitl", "--link", "udpin:127.0.0.1:0", "--launch", "hand"])
    assert "launch 'hand' is for aircraft" in line and "iris" in line


def write_map(path: Path, **changes: Any) -> None:
    contents = {
        "format": "flightstack-magnetic-map-1",
        "north_m": LINES,
        "east_m": LINES,
        "total_field_nt": FIELD,
        "height_m": 80.0,
        **ZURICH,
    }
    np.savez(path, **(contents | changes))


def write_spoiled(name: str, path: Path) -> None:
    """A file that is no map at all, or was one."""
    match name:
        case "folder":
            path.mkdir()
        case "random.npz":
            path.write_bytes(np.random.Generator(np.random.PCG64(1)).bytes(3000))
        case "text.npz":
            path.write_text("north_m,east_m,total_field_nt\n")
        case "empty.npz":
            path.touch()
        case "array.npy":
            np.save(path, FIELD)
        case "partial.npz":
            np.savez(path, total=FIELD)
        case "torn.npz":
            write_map(path)
            os.truncate(path, path.stat().st_size // 2)
        case "spoiled.npz":
            write_map(path)
            data = bytearray(path.read_bytes())
            data[1000:1016] = bytes(16)
            path.write_bytes(data)


@pytest.mark.parametrize("name", MAP_REFUSALS)
def test_an_unusable_map(name: str, place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = place / name
    if name in MAPS:
        write_map(path, **MAPS[name])
    elif name != "nosuch.npz":
        write_spoiled(name, path)
    before = path.read_bytes() if path.is_file() else None
    line = refused(capsys, ["fly", "occupancy", "--map", name, "--out", "run"])
    for words in MAP_REFUSALS[name]:
        assert words in line
    assert not (place / "run").exists()
    assert before is None or path.read_bytes() == before


@pytest.mark.parametrize(("away_deg", "model"), [(0.25, "aerosonde"), (0.06, "iris")])
def test_a_map_too_far_away_is_refused_before_anything_flies(
    away_deg: float, model: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """28 and 7 km: the embedded vehicles' home is known before they are received."""
    write_map(place / "far.npz", home_lat_deg=ZURICH["home_lat_deg"] + away_deg)
    line = refused(capsys, ["fly", "occupancy", "--map", "far.npz", "--model", model, "--out", "run"])
    assert "from the vehicle's home" in line
    assert "the map of this place" in line
    assert not (place / "run").exists()
