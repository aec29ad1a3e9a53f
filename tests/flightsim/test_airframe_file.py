"""Descriptions of fixed-wing vehicles: what a TOML may say, defaults, foreign aircraft, errors."""

from pathlib import Path

import jsbsim
import numpy as np
import pytest

from flightsim import truth as t
from flightsim.airframe import (
    AirframeError,
    AirframeKind,
    LaunchKind,
    Role,
    known_models,
    load_airframe,
    package_aircraft,
)
from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.initial_state import InitialState
from flightsim.interface import AILERON, BRAKE, ELEVATOR, MAX_ACTUATORS, STEERING, THROTTLE
from flightsim.vehicle import Vehicle

SHORTEST = """
[vehicle]
name = "mine"
kind = "fixed_wing"
jsbsim = "c172p"
"""


def described(tmp_path: Path, more: str = "", text: str = SHORTEST) -> Path:
    path = tmp_path / "mine.toml"
    path.write_text(text + more)
    return path


def make(model: str | Path, initial: InitialState | None = None) -> Vehicle:
    return Vehicle(
        model,
        home=Home(),
        environment=Environment(),
        seed_sequence=np.random.SeedSequence(0),
        initial=initial,
    )


def written(vehicle: Vehicle, *names: str) -> list[float]:
    return [vehicle._fdm.get_property_value(name) for name in names]


def test_a_few_lines_are_enough(tmp_path: Path) -> None:
    airframe = load_airframe(described(tmp_path))
    assert airframe.kind is AirframeKind.FIXED_WING
    assert airframe.launch_kind is LaunchKind.RUNWAY
    assert airframe.xml_path.name == "c172p.xml"
    assert [channel.role for channel in airframe.channels] == list(Role)
    assert airframe.actuator_count == 7
    vehicle = make(described(tmp_path))
    assert vehicle.truth[t.BATTERY_VOLTAGE_V] == 14.0
    assert vehicle.truth[t.BATTERY_CURRENT_A] == 0.0
    commands = np.array([0.2, 0.3, 0.6, 0.4, 0.0, 0.1, 0.7, 0.0])
    for _ in range(10):
        vehicle.step(commands)
    assert written(
        vehicle,
        "fcs/aileron-cmd-norm",
        "fcs/elevator-cmd-norm",
        "fcs/throttle-cmd-norm",
        "fcs/rudder-cmd-norm",
    ) == [0.2, -0.3, 0.6, -0.4]
    assert written(vehicle, "fcs/steer-cmd-norm", "fcs/left-brake-cmd-norm") == [0.1, 0.7]


def test_aircraft_of_the_package_by_name_and_by_path() -> None:
    assert {"c172x", "T38", "sgs126"} <= set(package_aircraft())
    by_name = load_airframe("pa28")
    by_path = load_airframe(Path(jsbsim.get_default_root_dir()) / "aircraft" / "pa28" / "pa28.xml")
    assert by_name == by_path
    assert by_name.limits.airspeed_trim_m_s is None


def test_packaged_descriptions() -> None:
    assert {"iris", "aerosonde", "c172x", "j3cub", "t37", "sgs126"} <= set(known_models())
    for name in known_models():
        assert load_airframe(name).name == name


def test_an_own_aircraft_beside_its_description(tmp_path: Path) -> None:
    source = load_airframe("aerosonde")
    (tmp_path / "own.xml").write_text(source.xml_path.read_text())
    text = (source.folder / "vehicle.toml").read_text()
    (tmp_path / "vehicle.toml").write_text(text.replace('jsbsim = "aerosonde"', 'jsbsim = "own"'))
    ours, theirs = make(tmp_path), make("aerosonde")
    commands = np.array([0.1, 0.1, 0.8, 0.0, 0.0, 0.0, 0.0, 0.0])
    for _ in range(100):
        ours.step(commands)
        theirs.step(commands)
    assert ours.truth.tobytes() == theirs.truth.tobytes()


def test_several_properties_scale_offset_and_limits(tmp_path: Path) -> None:
    path = described(
        tmp_path,
        """
[actuators]
aileron = { property = "fcs/aileron-cmd-norm", scale = -0.5, offset = 0.1, maximum = 0.3 }
brake = ["fcs/left-brake-cmd-norm", "fcs/right-brake-cmd-norm"]
flaps = false
""",
    )
    vehicle = make(path, InitialState(height_m=500.0, vel_ned_m_s=(40.0, 0.0, 0.0)))
    commands = np.zeros(MAX_ACTUATORS)
    commands[BRAKE] = 0.5
    for aileron, expected in ((0.2, 0.0), (-0.2, 0.2), (-1.0, 0.3)):
        commands[AILERON] = aileron
        vehicle.step(commands)
        assert written(vehicle, "fcs/aileron-cmd-norm") == pytest.approx([expected])
    brakes = ("fcs/left-brake-cmd-norm", "fcs/right-brake-cmd-norm", "fcs/center-brake-cmd-norm")
    assert written(vehicle, *brakes) == [0.5, 0.5, 0.0]
    assert load_airframe(path).channel(Role.FLAPS) is None


def test_elevons_and_brakes_that_steer_are_sums(tmp_path: Path) -> None:
    path = described(
        tmp_path,
        """
[actuators]
aileron = [
    { property = "fcs/aileron-cmd-norm", scale = 0.5, minimum = -1, maximum = 1 },
    { property = "fcs/rudder-cmd-norm", scale = -0.5, minimum = -1, maximum = 1 },
]
elevator = ["fcs/aileron-cmd-norm", "fcs/rudder-cmd-norm"]
rudder = false
steering = [
    { property = "fcs/left-brake-cmd-norm", scale = -1, minimum = 0, maximum = 1 },
    { property = "fcs/right-brake-cmd-norm", scale = 1, minimum = 0, maximum = 1 },
]
""",
    )
    vehicle = make(path, InitialState(height_m=500.0, vel_ned_m_s=(40.0, 0.0, 0.0)))
    commands = np.zeros(MAX_ACTUATORS)
    commands[AILERON], commands[ELEVATOR] = 0.4, 0.3
    commands[STEERING], commands[BRAKE] = -0.2, 0.5
    vehicle.step(commands)
    elevons = ("fcs/aileron-cmd-norm", "fcs/rudder-cmd-norm")
    assert written(vehicle, *elevons) == pytest.approx([0.5, 0.1])
    brakes = ("fcs/left-brake-cmd-norm", "fcs/right-brake-cmd-norm")
    assert written(vehicle, *brakes) == pytest.approx([0.7, 0.3])
    vehicle.set_actuator_effectiveness(Role.AILERON, 0.0)
    vehicle.step(commands)
    assert written(vehicle, *elevons) == pytest.approx([0.3, 0.3])


def test_start_truth_limits_and_launch(tmp_path: Path) -> None:
    path = described(
        tmp_path,
        """
[start]
"propulsion/set-running" = -1
"fcs/mixture-cmd-norm" = 0.9
[truth]
ROTOR_RAD_S = [{ property = "propulsion/engine/propeller-rpm", scale = 0.1047 }]
BATTERY_VOLTAGE_V = 28.0
[limits]
airspeed_trim_m_s = 50
bank_max_deg = 30
[launch]
kind = "catapult"
[launch.catapult]
speed_m_s = 35
pitch_deg = 8
""",
    )
    airframe = load_airframe(path)
    assert airframe.limits.bank_max_rad == pytest.approx(np.radians(30.0))
    assert airframe.launch(LaunchKind.CATAPULT).speed_m_s == 35.0
    assert airframe.launch(LaunchKind.HAND).kind is LaunchKind.HAND
    vehicle = make(path)
    assert vehicle.launcher is not None
    assert vehicle.truth[t.BATTERY_VOLTAGE_V] == 28.0
    rpm = written(vehicle, "propulsion/engine/propeller-rpm")[0]
    assert rpm > 300.0
    assert vehicle.truth[t.ROTOR_RAD_S][0] == pytest.approx(0.1047 * rpm, rel=1e-6)
    assert written(vehicle, "fcs/mixture-cmd-norm") == [0.9]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("[wings]\n", r"'wings' is unknown; tables are \[vehicle\], \[actuators\]"),
        ("[actuators]\naillerons = 'x'\n", r"'aillerons' is unknown; roles of \[actuators\] are aileron, el"),
        ("[actuators]\naileron = 5\n", "aileron is 5; expected is a JSBSim property name"),
        ("[actuators]\naileron = {prop = 'a'}\n", "'prop' is unknown; keys of .* are property, properties"),
        ("[actuators]\naileron = {scale = 0}\n", "a scale other than 0"),
        ("[actuators]\naileron = {minimum = 1, maximum = 0}\n", "minimum below the maximum"),
        ("[actuators]\naileron = 'fcs/no-such'\n", "no property 'fcs/no-such', which aileron"),
        ("[start]\n'engine/on' = 1\n", r"no property 'engine/on', which \[start\]"),
        ("[start]\n'propulsion/set-running' = 'yes'\n", "set-running is 'yes'; expected is a number"),
        ("[truth]\nMOOD = 'a'\n", "names MOOD"),
        ("[truth]\nROTOR_RAD_S = 'a'\n", "ROTOR_RAD_S is 'a'; a list of at most 8"),
        ("[truth]\nBATTERY_VOLTAGE_V = ['a']\n", "one property fits"),
        ("[truth]\nBATTERY_VOLTAGE_V = true\n", "BATTERY_VOLTAGE_V is True"),
        ("[truth]\nBATTERY_VOLTAGE_V = 'no/such'\n", "no/such"),
        (
            "[limits]\nspeed = 3\n",
            ".limits. speed is unknown; accepted are airspeed_max_m_s, airspeed_min_m_s",
        ),
        ("[limits]\nairspeed_min_m_s = 0.1\n", r"airspeed_min_m_s 0\.1 is not in 1\.\.300"),
        (
            "[limits]\nairspeed_min_m_s = 30\nairspeed_max_m_s = 20\n",
            r"airspeed_max_m_s 20\.0 must be higher than airspeed_min_m_s 30",
        ),
        ("[limits]\nbank_max_deg = 95\n", r"bank_max_deg 95 is not in 5\.\.80"),
        ("[limits]\nbank_max_deg = 'steep'\n", "bank_max_deg is 'steep'; expected is a number"),
        ("[limits]\nthrottle_max = 2\n", r"throttle_max 2\.0"),
        ("[launch]\nkind = 'rocket'\n", "'rocket' is unknown; accepted are runway, catapult, hand"),
        ("[launch]\nspeed = 3\n", "'speed' is unknown; keys of .launch. are kind, catapult, hand"),
        ("[launch.hand]\nspeed = 3\n", ".launch.hand. speed is unknown; accepted are acceleration_m_s2"),
        ("[launch.hand]\npitch_deg = 99\n", r"pitch_deg 99 is not in -5\.\.60"),
    ],
)
def test_bad_descriptions_are_named(tmp_path: Path, more: str, message: str) -> None:
    with pytest.raises(AirframeError, match=message) as caught:
        make(described(tmp_path, more))
    if not any(late in more for late in ("no-such", "no/such", "engine/on")):  # those the model tells
        assert "mine.toml" in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('jsbsim = "c172p"', 'jsbsim = "c172z"', "c172z.xml, which does not exist.*c172p"),
        (
            'kind = "fixed_wing"',
            'kind = "airship"',
            "'airship' is unknown; accepted are multicopter, fixed_wing",
        ),
        ('name = "mine"', "", "name is None; expected is a text"),
        ('name = "mine"', 'nom = "mine"', "'nom' is unknown"),
        ("[vehicle]", "", "'name' is unknown"),
    ],
)
def test_bad_vehicle_tables_are_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in SHORTEST
    with pytest.raises(AirframeError, match=message):
        make(described(tmp_path, text=SHORTEST.replace(old, new)))


def test_unknown_names_tell_what_is_accepted() -> None:
    with pytest.raises(AirframeError) as caught:
        load_airframe("concorde2")
    message = str(caught.value)
    for part in ("'concorde2'", "aerosonde", "vehicle.toml", ".xml", "T38", "[vehicle]", "docs/vehicles.md"):
        assert part in message


@pytest.mark.parametrize("model", ["c172x", "j3cub", "t37", "sgs126"])
def test_package_aircraft_load_quietly_and_stand(model: str, capfd: pytest.CaptureFixture[str]) -> None:
    vehicle = make(model, InitialState(launch="runway"))
    commands = np.zeros(MAX_ACTUATORS)
    place = vehicle.truth[:2].copy()
    for _ in range(1000):
        vehicle.step(commands)
    assert capfd.readouterr() == ("", "")
    assert vehicle.load_warnings == ()
    assert vehicle.truth[t.ON_GROUND] == 1.0
    assert np.linalg.norm(vehicle.truth[t.VEL_NED_M_S]) < 0.05
    np.testing.assert_allclose(vehicle.truth[:2], place, atol=5e-8)


@pytest.mark.parametrize("model", ["c172x", "j3cub", "t37"])
def test_package_aircraft_gather_speed(model: str) -> None:
    vehicle = make(model)
    commands = np.zeros(MAX_ACTUATORS)
    commands[THROTTLE] = 1.0
    for _ in range(2500):
        vehicle.step(commands)
    assert vehicle.truth[t.AIRSPEED_TRUE_M_S] > 7.0
