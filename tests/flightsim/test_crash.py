"""What hits the ground hard lies there: no wreck flies on, sinks into the ground or ends the world."""

import math

import numpy as np
import pytest

from flightsim import truth as t
from flightsim.crash import lay_down
from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.initial_state import InitialState
from flightsim.interface import MAX_ACTUATORS, THROTTLE
from flightsim.rotations import quaternion_from_euler, rotate
from flightsim.vehicle import Vehicle, VehicleDivergedError

HOME = Home()
G_M_S2 = 9.80665


def dive(
    model: str, *, speed_m_s: float, pitch_deg: float, roll_deg: float, height_m: float = 15.0
) -> Vehicle:
    down_rad = -math.radians(pitch_deg)
    return Vehicle(
        model,
        home=HOME,
        environment=Environment(),
        seed_sequence=np.random.SeedSequence(0),
        initial=InitialState(
            height_m=height_m,
            vel_ned_m_s=(speed_m_s * math.cos(down_rad), 0.0, speed_m_s * math.sin(down_rad)),
            roll_rad=math.radians(roll_deg),
            pitch_rad=-down_rad,
            yaw_rad=0.0,
        ),
    )


@pytest.mark.parametrize(
    ("model", "speed_m_s", "pitch_deg", "roll_deg"),
    [
        ("aerosonde", 30.0, -85.0, 180.0),  # JSBSim alone: not finite after 0.5 s
        ("c172x", 60.0, -85.0, 120.0),  # the same, before the slow part of truth has seen the ground
        ("sgs126", 30.0, -45.0, 120.0),  # thrown to 1e12 m
        ("t37", 100.0, -10.0, 180.0),  # no contact point there: 700 m into the ground
    ],
)
def test_a_hard_blow_leaves_a_wreck_at_rest(
    model: str, speed_m_s: float, pitch_deg: float, roll_deg: float
) -> None:
    vehicle = dive(model, speed_m_s=speed_m_s, pitch_deg=pitch_deg, roll_deg=roll_deg)
    commands = np.zeros(MAX_ACTUATORS)
    commands[THROTTLE] = 1.0
    while vehicle.crash is None:
        assert vehicle.steps < 500
        vehicle.step(commands)
    assert "hit the ground at" in vehicle.crash
    wreck, steps = vehicle.truth.copy(), vehicle.steps
    force_ned = np.empty(3)
    rotate(wreck[t.Q_NED_FROM_FRD].copy(), wreck[t.SPECIFIC_FORCE_FRD_M_S2].copy(), force_ned)
    np.testing.assert_allclose(force_ned, [0.0, 0.0, -G_M_S2], atol=1e-9)
    assert np.all(np.isfinite(wreck))
    assert not np.any(wreck[t.VEL_NED_M_S]) and not np.any(wreck[t.RATES_FRD_RAD_S])
    assert not np.any(wreck[t.ROTOR_RAD_S])
    assert wreck[t.ON_GROUND] == 1.0
    assert 0.0 <= wreck[t.ALT_M] - HOME.alt_m <= 1.0
    assert wreck[t.ALT_M] - HOME.alt_m == pytest.approx(wreck[t.HEIGHT_ABOVE_GROUND_M])
    for _ in range(100):
        vehicle.step(commands)
    assert vehicle.steps == steps + 100
    assert vehicle.truth.tobytes() == wreck.tobytes()


def test_a_wreck_starts_again_whole() -> None:
    vehicle = dive("aerosonde", speed_m_s=30.0, pitch_deg=-85.0, roll_deg=180.0)
    for _ in range(300):
        vehicle.step(np.zeros(MAX_ACTUATORS))
    assert vehicle.crash is not None
    vehicle.reset(InitialState())
    assert vehicle.crash is None
    before_m = vehicle.truth[t.LAT_RAD]
    commands = np.zeros(MAX_ACTUATORS)
    commands[THROTTLE] = 1.0
    for _ in range(500):
        vehicle.step(commands)
    assert vehicle.truth[t.LAT_RAD] != before_m


@pytest.mark.parametrize("model", ["aerosonde", "iris"])
@pytest.mark.parametrize("height_m", [2.0, 300.0])
def test_commands_that_are_none_are_no_crash(model: str, height_m: float) -> None:
    vehicle = dive(model, speed_m_s=25.0, pitch_deg=0.0, roll_deg=0.0, height_m=height_m)
    with pytest.raises(VehicleDivergedError, match=model):
        for _ in range(20):
            vehicle.step(np.full(MAX_ACTUATORS, np.nan))
    assert np.all(np.isfinite(vehicle.truth))


def test_a_wreck_thrown_up_has_the_pressure_of_the_ground() -> None:
    """500 m lower the standard atmosphere has 5.8 % more pressure (ISA: 955 to 1013 hPa)."""
    truth = np.zeros(t.TRUTH_SIZE)
    quaternion_from_euler(2.0, 0.4, 1.0, truth[t.Q_NED_FROM_FRD])
    truth[t.ALT_M], truth[t.PRESSURE_PA], truth[t.TEMPERATURE_K] = 500.0, 95_461.0, 284.9
    lay_down(truth, 0.0)
    assert truth[t.ALT_M] == 1.0
    assert truth[t.PRESSURE_PA] == pytest.approx(101_313.0, rel=1e-3)
