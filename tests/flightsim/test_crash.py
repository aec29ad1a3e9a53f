"""What hits the ground hard lies there: no wreck flies on, sinks into the ground or ends the world."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from flightsim import truth as t
from flightsim.airframe import AirframeError, load_airframe
from flightsim.crash import Touches, lay_down
from flightsim.environment import Environment
from flightsim.foundation.rotations import quaternion_from_euler, rotate
from flightsim.home import Home
from flightsim.initial_state import InitialState
from flightsim.interface import MAX_ACTUATORS, THROTTLE
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


def touch_down(model: str, *, sink_m_s: float, speed_m_s: float, height_m: float) -> Vehicle:
    """Level, straight down onto the wheels from a small height, until a second after it has touched."""
    vehicle = Vehicle(
        model,
        home=HOME,
        environment=Environment(),
        seed_sequence=np.random.SeedSequence(0),
        slow_rate_hz=50,
        initial=InitialState(
            height_m=height_m, vel_ned_m_s=(speed_m_s, 0.0, sink_m_s), pitch_rad=0.03, yaw_rad=0.0
        ),
    )
    touched = 0
    while touched < 250 and vehicle.crash is None:
        vehicle.step(np.zeros(MAX_ACTUATORS))
        touched += bool(touched or vehicle.truth[t.ON_GROUND])
        assert vehicle.steps < 2000
    return vehicle


@pytest.mark.parametrize(
    ("model", "speed_m_s", "height_m"),
    [("aerosonde", 15.0, 0.6), ("c172x", 15.0, 1.6), ("sgs126", 12.0, 0.9)],
)
@pytest.mark.parametrize(("sink_m_s", "breaks"), [(2.5, False), (5.5, True)])
def test_a_gear_stands_a_firm_landing_and_breaks_beyond(
    model: str, speed_m_s: float, height_m: float, sink_m_s: float, breaks: bool
) -> None:
    """12 ft/s is what 14 CFR 25.723(b) asks of a gear's reserve energy."""
    vehicle = touch_down(model, sink_m_s=sink_m_s, speed_m_s=speed_m_s, height_m=height_m)
    assert (vehicle.crash is not None) == breaks, vehicle.crash
    if vehicle.crash is not None:
        reported = re.fullmatch(r"hit the ground at (\d+) m/s, sinking at ([0-9.]+) m/s", vehicle.crash)
        assert reported is not None, vehicle.crash
        assert float(reported[1]) == pytest.approx(math.hypot(speed_m_s, sink_m_s), abs=1.5)
        assert float(reported[2]) == pytest.approx(sink_m_s, abs=1.2)


def test_a_description_says_what_its_gear_stands(tmp_path: Path) -> None:
    text = '[vehicle]\nname = "s"\nkind = "fixed_wing"\njsbsim = "c172x"\n[limits]\n'
    text += "touchdown_sink_max_m_s = {}\n"
    model = tmp_path / "strong.toml"
    model.write_text(text.format(8.0))
    assert touch_down(str(model), sink_m_s=5.5, speed_m_s=15.0, height_m=1.6).crash is None
    model.write_text(text.format(0.0))
    with pytest.raises(AirframeError, match=r"touchdown_sink_max_m_s 0 is not in 0.5..50 m/s"):
        load_airframe(model)


def test_a_crash_is_reported_with_the_speed_before_the_blow() -> None:
    """What JSBSim makes of the glider within the blow is not how fast it came."""
    vehicle = dive("sgs126", speed_m_s=30.0, pitch_deg=-45.0, roll_deg=120.0)
    while vehicle.crash is None:
        vehicle.step(np.zeros(MAX_ACTUATORS))
    reported = re.fullmatch(r"hit the ground at (\d+) m/s, sinking at ([0-9.]+) m/s", vehicle.crash)
    assert reported is not None
    assert float(reported[1]) == pytest.approx(32.0, abs=3.0)
    assert float(reported[2]) == pytest.approx(math.sqrt(0.5 * 30.0**2 + 2 * G_M_S2 * 15.0), abs=4.0)


def test_of_bounces_the_hardest_is_reported() -> None:
    touches, truth = Touches(2500), np.zeros(t.TRUTH_SIZE)
    for step, sink, touching in ((0, 1.0, False), (5, 4.0, False), (10, -2.0, True), (15, -2.0, False)):
        truth[t.VEL_NED_M_S] = (3.0, 0.0, sink)
        assert touches.observe(step, touching, truth) == (4.0 if touching else 0.0)
    truth[t.VEL_NED_M_S] = (3.0, 0.0, 2.0)
    touches.observe(20, False, truth)
    assert touches.observe(25, True, truth) == 2.0
    assert touches.observe(30, True, truth) == 0.0
    assert touches.words(35, truth) == "hit the ground at 5 m/s, sinking at 4.0 m/s"
    truth[t.VEL_NED_M_S] = (0.0, 0.0, 20.0)
    assert touches.words(30 + 2500, truth) == "hit the ground at 20 m/s, sinking at 20.0 m/s"


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
