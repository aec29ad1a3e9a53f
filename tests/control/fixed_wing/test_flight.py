"""Closed loop: the Aerosonde, perfect navigation, the control laws."""

import math

import numpy as np
import pytest

from autopilot_bridge.control.fixed_wing import FixedWingParameters
from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.navigation import layout as n
from flightsim.airframe import Role
from flightsim.environment import CosineGust, Environment, Turbulence
from tests.control.fixed_wing.aerosonde import AEROSONDE
from tests.control.fixed_wing.rig import ACTUATORS, Rig

ROLL, PITCH, YAW = 25, 26, 27
TRIM_M_S = AEROSONDE.airspeed_trim_m_s


def rig(**fields: object) -> Rig:
    """In steady flight at 150 m, heading north."""
    made = Rig(AEROSONDE, **fields)  # type: ignore[arg-type]
    made.run(8.0)
    return made


def settled_s(values: np.ndarray, target: float, band: float) -> float:
    """Time after which the values stay within the band."""
    outside = np.nonzero(np.abs(values - target) > band)[0]
    return 0.02 * (outside[-1] + 1) if len(outside) else 0.0


def overshoot(values: np.ndarray, target: float) -> float:
    """Of the step's size."""
    step = target - values[0]
    return max(0.0, float((np.sign(step) * (values - target)).max()) / abs(step))


@pytest.mark.parametrize("physics_rate_hz", [100, 250, 400])
@pytest.mark.sampled(1)
def test_roll_steps(physics_rate_hz: int) -> None:
    flown = rig(physics_rate_hz=physics_rate_hz)
    for wanted_deg in (30.0, -30.0, 0.0):
        flown.set(roll_rad=math.radians(wanted_deg), down_m=-150.0)
        log = flown.run(5.0)
        roll = np.degrees(log[:, ROLL])
        assert settled_s(roll, wanted_deg, 1.0) < 1.5
        assert overshoot(roll, wanted_deg) < 0.05
        assert np.abs(log[:, 23]).max() < 0.5  # lateral specific force
        assert np.abs(log[-50:, 23]).max() < 0.1
        assert np.ptp(log[:, 12]) < 1.0


@pytest.mark.parametrize("physics_rate_hz", [100, 250, 400])
@pytest.mark.sampled(1)
def test_pitch_steps(physics_rate_hz: int) -> None:
    flown = rig(physics_rate_hz=physics_rate_hz)
    for start_deg, wanted_deg in ((3.0, 13.0), (3.0, -7.0)):
        flown.set(roll_rad=0.0, pitch_rad=math.radians(start_deg), throttle=0.8)
        flown.run(2.0)
        flown.set(roll_rad=0.0, pitch_rad=math.radians(wanted_deg), throttle=0.8)
        pitch = np.degrees(flown.run(2.5)[:, PITCH])
        assert settled_s(pitch, wanted_deg, 0.5) < 1.5
        assert overshoot(pitch, wanted_deg) < 0.05
        flown.set(roll_rad=0.0, down_m=-150.0)
        flown.run(8.0)


@pytest.mark.parametrize("step_m", [20.0, -20.0])
def test_height_step_costs_no_airspeed(step_m: float) -> None:
    flown = rig()
    flown.set(heading_rad=0.0, down_m=-150.0 - step_m)
    log = flown.run(20.0)
    height = -log[:, 12]
    assert np.abs(log[:, n.AIRSPEED_M_S] - TRIM_M_S).max() < 1.0
    assert overshoot(height, 150.0 + step_m) < 0.03
    assert settled_s(height, 150.0 + step_m, 1.0) < 10.0
    assert np.abs(height[-50:] - 150.0 - step_m).max() < 0.2


@pytest.mark.parametrize("airspeed", [19.0, 30.0])
def test_airspeed_step_costs_no_height(airspeed: float) -> None:
    flown = rig()
    flown.set(heading_rad=0.0, down_m=-150.0, airspeed_m_s=airspeed)
    log = flown.run(25.0)
    assert np.abs(log[:, 12] + 150.0).max() < 1.5
    assert np.abs(log[-50:, n.AIRSPEED_M_S] - airspeed).max() < 0.2


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.slow
def test_moderate_turbulence_and_wind(seed: int) -> None:
    wind = Environment(wind_ned_m_s=(4.2, -4.2, 0.0), turbulence=Turbulence.MODERATE)
    flown = rig(environment=wind, seed=seed)
    flown.set(course_rad=0.5, down_m=-150.0)
    flown.run(12.0)
    log = flown.run(60.0)
    assert np.sqrt(np.mean((log[:, 12] + 150.0) ** 2)) < 1.0
    assert np.sqrt(np.mean((log[:, n.AIRSPEED_M_S] - TRIM_M_S) ** 2)) < 0.65
    course = np.degrees(np.arctan2(log[:, 8], log[:, 7]) - 0.5)
    assert np.sqrt(np.mean(course**2)) < 0.8


@pytest.mark.parametrize("course_deg", [0.0, 90.0, -135.0])
@pytest.mark.parametrize("wind_known", [True, False])
@pytest.mark.sampled(1)
def test_course_is_held_in_wind(course_deg: float, wind_known: bool) -> None:
    flown = rig(environment=Environment(wind_ned_m_s=(6.0, 8.0, 0.0)))
    flown.wind_known = wind_known
    flown.set(course_rad=math.radians(course_deg), down_m=-150.0)
    log = flown.run(25.0)[-100:]
    course = np.degrees(np.arctan2(log[:, 8], log[:, 7]))
    assert np.abs(np.remainder(course - course_deg + 180.0, 360.0) - 180.0).max() < 1.0


def test_heading_is_held_in_wind() -> None:
    flown = rig(environment=Environment(wind_ned_m_s=(0.0, 8.0, 0.0)))
    flown.set(heading_rad=2.0, down_m=-150.0)
    log = flown.run(25.0)[-100:]
    assert np.abs(np.degrees(log[:, YAW] - 2.0)).max() < 0.5


def test_wind_faster_than_the_aircraft() -> None:
    """The airspeed rises to keep the least ground speed along the course; the aircraft still makes it."""
    flown = rig(environment=Environment(wind_ned_m_s=(-20.0, -20.0, 0.0)))
    flown.set(course_rad=math.pi / 2.0, down_m=-150.0)
    log = flown.run(40.0)[-100:]
    assert log[:, 8].mean() == pytest.approx(5.0, abs=0.3)
    assert np.abs(log[:, 7]).max() < 0.3


def test_turn_is_level_coordinated_and_as_fast_as_its_bank() -> None:
    flown = rig()
    bank = math.radians(40.0)
    flown.set(roll_rad=bank, down_m=-150.0)
    log = flown.run(30.0)
    assert np.abs(log[:, 12] + 150.0).max() < 0.8
    assert np.abs(log[:, n.AIRSPEED_M_S] - TRIM_M_S).max() < 0.5
    steady = log[-250:]
    assert np.abs(steady[:, 23]).max() < 0.05
    rate = np.gradient(np.unwrap(steady[:, YAW]), 0.02)
    assert rate.mean() == pytest.approx(9.80665 * math.tan(bank) / steady[:, 33].mean(), rel=0.02)


def test_calm_air_sees_no_limit_cycle() -> None:
    log = rig().run(30.0)[-500:]
    assert np.degrees(np.ptp(log[:, [ROLL, PITCH, YAW]], axis=0)).max() < 0.05
    assert np.ptp(log[:, ACTUATORS], axis=0).max() < 0.005
    assert np.ptp(log[:, 12]) < 0.05


@pytest.mark.slow
def test_without_airspeed_height_is_still_held() -> None:
    windy = Environment(wind_ned_m_s=(4.0, 4.0, 0.0), turbulence=Turbulence.LIGHT)
    flown = rig(environment=windy)
    flown.airspeed_known = False
    flown.set(heading_rad=1.0, down_m=-180.0)
    log = flown.run(60.0)
    airspeeds = []
    for _ in range(200):
        flown.step()
        airspeeds.append(float(flown.vehicle.truth[26]))
    assert np.abs(log[-1500:, 12] + 180.0).max() < 3.0
    assert AEROSONDE.airspeed_min_m_s < np.mean(airspeeds) < AEROSONDE.airspeed_max_m_s


@pytest.mark.slow
def test_with_a_dead_motor_height_is_given_up_for_airspeed() -> None:
    flown = rig()
    flown.vehicle.set_actuator_effectiveness(Role.THROTTLE, 0.0)
    log = flown.run(60.0)
    assert log[:, n.AIRSPEED_M_S].min() > 1.05 * AEROSONDE.stall_speed_m_s
    assert -log[-1, 12] < 130.0
    assert np.ptp(log[-500:, PITCH]) < math.radians(1.0)


@pytest.mark.slow
def test_a_lull_is_no_dead_motor() -> None:
    """A wind from behind grows faster than full throttle can follow; the height isn't given up for that."""
    lull = CosineGust(start_s=10.0, velocity_ned_m_s=(14.0, 0.0, 0.0), rise_s=5.0, hold_s=5.0, fall_s=8.0)
    flown = rig(environment=Environment(gusts=(lull,)))
    log = flown.run(12.0)
    assert log[:, ACTUATORS][:, 2].max() > 0.99
    assert log[:, n.AIRSPEED_M_S].min() < TRIM_M_S - 3.0
    assert np.ptp(log[:, 12]) < 3.0


def test_slow_turn_keeps_clear_of_the_stall() -> None:
    flown = rig()
    flown.set(heading_rad=0.0, down_m=-150.0, airspeed_m_s=18.0)
    flown.run(20.0)
    flown.set(heading_rad=3.0, down_m=-150.0, airspeed_m_s=18.0)
    log = flown.run(15.0)
    load = np.maximum(1.0, -log[:, 24] / 9.80665)
    assert (log[:, n.AIRSPEED_M_S] > 1.05 * AEROSONDE.stall_speed_m_s * np.sqrt(load)).all()


def test_full_throttle_climb_and_idle_glide_hold_the_airspeed() -> None:
    flown = rig()
    flown.set(heading_rad=0.0, throttle=1.0)
    log = flown.run(20.0)
    assert np.abs(log[-250:, n.AIRSPEED_M_S] - TRIM_M_S).max() < 0.5
    assert -log[-250:, 9].mean() == pytest.approx(AEROSONDE.climb_max_m_s, abs=0.5)
    flown.set(heading_rad=0.0, throttle=0.0)
    log = flown.run(20.0)
    assert np.abs(log[-250:, n.AIRSPEED_M_S] - TRIM_M_S).max() < 0.8


def test_rates_are_flown() -> None:
    flown = rig()
    setpoint = flown.controller.setpoint
    setpoint[:] = math.nan
    setpoint[sp.LEVEL] = sp.RATES
    setpoint[sp.THROTTLE] = 0.8
    setpoint[sp.RATES_FRD_RAD_S] = (0.4, 0.0, 0.0)
    log = flown.run(1.5)
    assert log[25:50, 4] == pytest.approx(0.4, abs=0.06)
    setpoint[sp.RATES_FRD_RAD_S] = (0.0, 0.15, 0.0)
    log = flown.run(1.5)
    assert log[-1, 5] == pytest.approx(0.15, abs=0.04)


def test_a_glide_slope_is_followed() -> None:
    flown = rig()
    slope = math.tan(math.radians(4.0))
    start = flown.nav[n.POS_NED_M].copy()
    errors = []
    for _ in range(round(12.0 * 50)):
        run_m = float(flown.nav[n.POS] - start[0])
        flown.set(
            heading_rad=0.0,
            down_m=float(start[2]) + run_m * slope,
            height_rate_m_s=-float(flown.nav[n.VEL]) * slope,
            airspeed_m_s=20.0,
        )
        flown.run(0.02)
        errors.append(float(flown.nav[n.POS + 2] - start[2]) - run_m * slope)
    assert np.abs(errors).max() < 1.5
    assert np.abs(errors[-100:]).max() < 0.4


@pytest.mark.slow
def test_px4_defaults_fly_it_too() -> None:
    """Limits and speeds of the aircraft, PX4's default gains: slower, but stable."""
    p, d = FixedWingParameters.for_envelope(AEROSONDE), FixedWingParameters()
    control = FixedWingParameters(
        **{
            name: getattr(
                p if name.startswith(("airspeed_", "trim", "climb", "sink", "scaling")) else d, name
            )
            for name in FixedWingParameters.__slots__
        }
    )
    flown = rig(control=control)
    flown.set(heading_rad=1.0, down_m=-170.0)
    log = flown.run(60.0)
    assert np.abs(log[-250:, 12] + 170.0).max() < 3.0
    assert np.degrees(np.ptp(log[-250:, [ROLL, PITCH]], axis=0)).max() < 2.0
