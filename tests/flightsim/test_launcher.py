"""Launch kinds: held until launched, continuous acceleration, let go at speed, any model, bad arguments."""

import math

import numpy as np
import pytest

from flightsim import truth as t
from flightsim.airframe import AirframeError, LaunchKind, LaunchParameters, load_airframe
from flightsim.environment import Environment, Turbulence
from flightsim.foundation.rotations import euler_from_quaternion
from flightsim.home import Home
from flightsim.initial_state import InitialState
from flightsim.interface import MAX_ACTUATORS
from flightsim.vehicle import Vehicle
from flightsim.world import World

G_M_S2 = 9.807


def make(model: str, launch: str | None, environment: Environment | None = None) -> Vehicle:
    return Vehicle(
        model,
        home=Home(heading_deg=60.0),
        environment=environment or Environment(),
        seed_sequence=np.random.SeedSequence(1),
        initial=InitialState(launch=launch),
    )


def until_released(vehicle: Vehicle, commands: np.ndarray) -> np.ndarray:
    """Truth of every step of the launch."""
    rows = [vehicle.truth.copy()]
    assert vehicle.launcher is not None
    for _ in range(8000):
        vehicle.step(commands)
        rows.append(vehicle.truth.copy())
        if vehicle.launcher.released:
            return np.array(rows)
    raise AssertionError("never let go")


@pytest.mark.parametrize(
    ("model", "kind"),
    [
        ("aerosonde", "catapult"),
        ("aerosonde", "hand"),
        ("c172x", "catapult"),
        ("sgs126", "catapult"),
        ("t37", "catapult"),
    ],
)
def test_held_then_launched(model: str, kind: str) -> None:
    vehicle = make(model, kind)
    launch = load_airframe(model).launch(LaunchKind(kind))
    launcher = vehicle.launcher
    assert launcher is not None and launcher.held
    truth, commands = vehicle.truth, np.zeros(MAX_ACTUATORS)
    place = truth[:3].copy()
    for _ in range(500):
        vehicle.step(commands)
    np.testing.assert_allclose(truth[:2], place[:2], atol=1e-9)
    assert truth[t.ALT_M] == pytest.approx(place[2], abs=2e-3)
    assert truth[t.HEIGHT_ABOVE_GROUND_M] == pytest.approx(launch.height_m, abs=0.01)
    still = [G_M_S2 * math.sin(launch.pitch_rad), 0.0, -G_M_S2 * math.cos(launch.pitch_rad)]
    np.testing.assert_allclose(truth[t.SPECIFIC_FORCE_FRD_M_S2], still, atol=0.1)
    assert truth[t.ON_GROUND] == 1.0

    vehicle.launch()
    assert not launcher.held
    rows = until_released(vehicle, commands)
    speed = np.linalg.norm(rows[:, t.VEL_NED_M_S], axis=1)
    assert speed[-1] == pytest.approx(launch.speed_m_s, rel=0.03)
    assert launcher.distance_m >= launch.length_m
    # the accelerometer feels rail and gravity, and no jumps: at most a step's share of the 50 ms rise
    forward = rows[:, 13]
    assert np.max(forward) == pytest.approx(launch.acceleration_m_s2 + still[0], rel=0.1)
    rising = forward[speed < 0.9 * launch.speed_m_s]
    assert np.max(np.abs(np.diff(rising))) < 0.15 * launch.acceleration_m_s2 + 0.5
    # what it feels is what it does
    gained = np.sum(forward - still[0]) / 250.0
    assert gained == pytest.approx(speed[-1], rel=0.08)
    euler = np.empty(3)
    euler_from_quaternion(np.ascontiguousarray(rows[-1, t.Q_NED_FROM_FRD]), euler)
    np.testing.assert_allclose(euler, [0.0, launch.pitch_rad, math.radians(60.0)], atol=0.02)
    for _ in range(25):
        vehicle.step(commands)
    assert truth[t.ON_GROUND] == 0.0
    assert vehicle.launcher is launcher and launcher.released


def test_time_and_way_of_the_catapult() -> None:
    vehicle = make("aerosonde", "catapult")
    vehicle.launch()
    until_released(vehicle, np.zeros(MAX_ACTUATORS))
    launcher = vehicle.launcher
    assert launcher is not None
    assert launcher.time_s == pytest.approx(20.0 / 50.0 + 0.025, abs=0.006)
    assert launcher.distance_m == pytest.approx(20.0**2 / 100.0, rel=0.05)


def test_a_winch_brings_the_glider_up() -> None:
    vehicle = make("sgs126", None)
    vehicle.launch()
    rows = until_released(vehicle, np.zeros(MAX_ACTUATORS))
    assert rows[-1, t.HEIGHT_ABOVE_GROUND_M] > 160.0
    assert 25.0 < rows[-1, t.AIRSPEED_TRUE_M_S] < 30.0
    assert len(rows) * 0.004 == pytest.approx(400.0 / 27.0 + 27.0 / 6.0 / 2.0, rel=0.02)


def test_held_in_turbulence() -> None:
    air = Environment(wind_ned_m_s=(-6.0, 3.0, 0.0), turbulence=Turbulence.SEVERE)
    vehicle = make("aerosonde", "catapult", air)
    place = vehicle.truth[:3].copy()
    for _ in range(500):
        vehicle.step(np.zeros(MAX_ACTUATORS))
        assert np.linalg.norm(vehicle.truth[t.VEL_NED_M_S]) < 0.2
    np.testing.assert_allclose(vehicle.truth[:2], place[:2], atol=1e-8)


def test_a_runway_needs_no_crew() -> None:
    vehicle = make("aerosonde", None)
    assert vehicle.launcher is None
    vehicle.launch()
    vehicle.step(np.zeros(MAX_ACTUATORS))
    assert vehicle.truth[t.ON_GROUND] == 1.0


def test_the_same_launch_again_after_a_reset() -> None:
    vehicle = make("aerosonde", "hand")
    records = []
    for _ in range(2):
        vehicle.launch()
        records.append(until_released(vehicle, np.zeros(MAX_ACTUATORS)).tobytes())
        vehicle.reset()
        assert vehicle.launcher is not None and vehicle.launcher.held
    assert records[0] == records[1]


def test_a_world_passes_the_launch_on() -> None:
    vehicle = World().add_vehicle("aerosonde", initial=InitialState(launch=LaunchKind.HAND))
    assert vehicle.launcher is not None
    assert vehicle.truth[t.HEIGHT_ABOVE_GROUND_M] == pytest.approx(1.6, abs=0.01)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"launch": "rocket"}, "'rocket' is unknown; accepted are runway, catapult, hand"),
        ({"launch": "hand", "height_m": 50.0}, "starts in the air"),
        ({"actuators": (0.1,)}, "give height_m"),
    ],
)
def test_bad_starts_are_named(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        InitialState(**arguments)  # type: ignore[arg-type]


def test_only_a_fixed_wing_is_launched() -> None:
    with pytest.raises(ValueError, match=r"iris.*multicopter"):
        make("iris", "catapult")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pitch_rad": 1.5}, r"pitch_deg 85\.9437"),
        ({"acceleration_m_s2": 0.0}, "acceleration_m_s2 0"),
        ({"speed_m_s": 500.0}, "speed_m_s 500"),
        ({"length_m": -1.0}, "length_m -1"),
    ],
)
def test_bad_launch_parameters_are_named(changes: dict[str, float], message: str) -> None:
    values = {"pitch_rad": 0.2, "acceleration_m_s2": 30.0, "speed_m_s": 15.0, **changes}
    with pytest.raises(AirframeError, match=message):
        LaunchParameters(kind=LaunchKind.CATAPULT, **values)
