"""Attitude, rate, wheel, air and energy laws of a fixed wing, one step at a time, against closed forms."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_are
from scipy.spatial.transform import Rotation

from autopilot_bridge.control.fixed_wing import FixedWingParameters, air, attitude, energy, lateral
from autopilot_bridge.control.fixed_wing import layout as c
from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.control.fixed_wing.attitude import ease_on_runway, limit_surfaces
from autopilot_bridge.control.fixed_wing.lateral import heading_for_course
from autopilot_bridge.control.fixed_wing.vertical import follow_height, reset_height
from autopilot_bridge.navigation import layout as n
from flightsim.foundation.atmosphere import GRAVITY_M_S2 as G
from flightsim.foundation.records import new_record
from flightsim.foundation.rotations import quaternion_from_euler
from tests.control.fixed_wing.test_lateral import packed
from tests.control.on_arrays import on_arrays

Array = NDArray[np.float64]
acceleration_along_flow, update_air = on_arrays(sp.Setpoint, air.acceleration_along_flow, air.update_air)
attitude_control, rate_control, wheel_control = on_arrays(
    sp.Setpoint, attitude.attitude_control, attitude.rate_control, attitude.wheel_control
)
energy_control, lateral_control = on_arrays(sp.Setpoint, energy.energy_control, lateral.lateral_control)
PHYSICS_S = 0.004
GUIDANCE_S = 0.02
AIRSPEED = 15.0


def parameters(**values: float | bool) -> FixedWingParameters:
    return packed(FixedWingParameters(**values))  # type: ignore[arg-type]


def flying(
    *, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0, airspeed: float = AIRSPEED, climb: float = 0.0
) -> tuple[Array, Array, c.FixedWingState]:
    """(navigation state, setpoint, controller state) of flight without wind, 100 m up."""
    nav, setpoint, s = np.zeros(n.NAV_SIZE), np.full(sp.SETPOINT_SIZE, math.nan), new_record(c.FixedWingState)
    quaternion_from_euler(roll, pitch, yaw, nav[n.Q_NED_FROM_FRD])
    nav[n.EULER_RAD] = roll, pitch, yaw
    nav[n.POS + 2] = -100.0
    nav[n.VEL_NED_M_S] = airspeed * math.cos(yaw), airspeed * math.sin(yaw), -climb
    nav[n.SPECIFIC_FORCE_FRD_M_S2] = 0.0, 0.0, -G
    nav[n.AIRSPEED_M_S] = nav[n.AIRSPEED_TRUE_M_S] = airspeed
    s.dt, s.divisor = PHYSICS_S, GUIDANCE_S / PHYSICS_S
    s.eas, s.eas_to_tas, s.eas_known, s.flying = airspeed, 1.0, 1.0, 1.0
    return nav, setpoint, s


def rates_of(euler_rates: tuple[float, float, float], roll: float, pitch: float) -> Array:
    """Body rates of Euler rates, by differencing the attitude itself."""
    h = 1e-6
    before = Rotation.from_euler("ZYX", [0.0, pitch, roll])
    yaw_rate, pitch_rate, roll_rate = euler_rates[2], euler_rates[1], euler_rates[0]
    after = Rotation.from_euler("ZYX", [h * yaw_rate, pitch + h * pitch_rate, roll + h * roll_rate])
    return (before.inv() * after).as_rotvec() / h


@pytest.mark.parametrize(("roll", "pitch"), [(0.0, 0.0), (0.5, 0.2), (-0.7, 0.3), (0.4, -0.3), (1.2, 0.1)])
@pytest.mark.parametrize("ratio", [1.0, 1.2])
def test_attitude_law(roll: float, pitch: float, ratio: float) -> None:
    """Euler rates: the errors over their time constants, and the turn of coordinated flight."""
    nav, _, s = flying(roll=roll, pitch=pitch)
    s.eas_to_tas = ratio
    s.roll_setpoint, s.pitch_setpoint = roll + 0.15, pitch - 0.05
    p = parameters(
        roll_time_constant_s=0.5,
        pitch_time_constant_s=0.3,
        roll_rate_max_rad_s=9.0,
        pitch_rate_max_up_rad_s=9.0,
        pitch_rate_max_down_rad_s=9.0,
        yaw_rate_max_rad_s=9.0,
    )
    attitude_control(nav, p, s)
    turn = G * math.tan(roll) * math.cos(pitch) / (AIRSPEED * ratio)
    expected = rates_of((0.15 / 0.5, -0.05 / 0.3, turn), roll, pitch)
    np.testing.assert_allclose(s.rate_setpoint, expected, atol=1e-5)


def test_attitude_law_on_the_ground_asks_for_no_turn() -> None:
    nav, _, s = flying(roll=0.3)
    s.roll_setpoint, s.ground_contact = 0.3, 1.0
    nav[n.FORCE + 1] = 2.0
    attitude_control(nav, parameters(sideslip_gain_rad_s_per_m_s2=0.1), s)
    np.testing.assert_allclose(s.rate_setpoint, 0.0, atol=1e-12)


@pytest.mark.parametrize("bank", [math.radians(100.0), -math.radians(100.0)])
def test_turn_rate_is_that_of_at_most_eighty_degrees(bank: float) -> None:
    nav, _, s = flying(roll=bank)
    s.roll_setpoint = bank
    p = parameters(pitch_rate_max_up_rad_s=9.0, pitch_rate_max_down_rad_s=9.0, yaw_rate_max_rad_s=9.0)
    attitude_control(nav, p, s)
    turn = math.copysign(G * math.tan(math.radians(80.0)) / AIRSPEED, bank)
    expected = [0.0, math.sin(bank) * turn, math.cos(bank) * turn]
    np.testing.assert_allclose(s.rate_setpoint, expected, atol=1e-9)


def test_slow_flight_turns_as_at_seven_tenths_of_the_lowest_airspeed() -> None:
    nav, _, s = flying(roll=0.4, airspeed=3.0)
    s.roll_setpoint = 0.4
    attitude_control(nav, parameters(yaw_rate_max_rad_s=9.0), s)
    turn = G * math.tan(0.4) / (0.7 * 10.0)
    assert s.rate_setpoint[2] == pytest.approx(math.cos(0.4) * turn)


@pytest.mark.parametrize(
    ("slip", "counted"), [(1.0, 1.0), (-1.0, -1.0), (9.0, 3.0), (-9.0, -3.0), (math.nan, 0.0)]
)
def test_yaw_rate_leans_against_lateral_acceleration(slip: float, counted: float) -> None:
    nav, _, s = flying()
    nav[n.FORCE + 1] = slip
    attitude_control(nav, parameters(sideslip_gain_rad_s_per_m_s2=0.1), s)
    assert s.rate_setpoint[2] == pytest.approx(-0.1 * counted)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rate_setpoints_have_limits(sign: float) -> None:
    nav, _, s = flying()
    s.roll_setpoint, s.pitch_setpoint = sign * 1.4, sign * 1.3
    nav[n.FORCE + 1] = -sign * 3.0
    p = parameters(
        roll_rate_max_rad_s=0.9,
        pitch_rate_max_up_rad_s=0.8,
        pitch_rate_max_down_rad_s=0.7,
        yaw_rate_max_rad_s=0.2,
        sideslip_gain_rad_s_per_m_s2=1.0,
    )
    attitude_control(nav, p, s)
    limits = [0.9, 0.8, 0.2] if sign > 0.0 else [-0.9, -0.7, -0.2]
    np.testing.assert_allclose(s.rate_setpoint, limits)


def test_roll_error_is_the_shorter_way_round() -> None:
    nav, _, s = flying(roll=3.0)
    s.roll_setpoint = -3.0
    attitude_control(nav, parameters(roll_rate_max_rad_s=9.0), s)
    assert s.rate_setpoint[0] == pytest.approx((2.0 * math.pi - 6.0) / 0.4)


RATE_GAINS = {
    "rate_roll_p": 0.1,
    "rate_roll_i": 0.2,
    "rate_roll_d": 0.01,
    "rate_roll_ff": 0.4,
    "rate_roll_integral_max": 0.3,
    "rate_pitch_p": 0.12,
    "rate_pitch_i": 0.25,
    "rate_pitch_d": 0.02,
    "rate_pitch_ff": 0.5,
    "rate_pitch_integral_max": 0.35,
    "rate_yaw_p": 0.08,
    "rate_yaw_i": 0.15,
    "rate_yaw_d": 0.015,
    "rate_yaw_ff": 0.3,
    "rate_yaw_integral_max": 0.2,
    "rate_derivative_cutoff_hz": 12.0,
    "trim_aileron": 0.01,
    "trim_elevator": -0.03,
    "trim_rudder": 0.02,
}


def of_axes(name: str) -> Array:
    return np.array([RATE_GAINS[f"rate_{axis}_{name}"] for axis in ("roll", "pitch", "yaw")])


def rate_state() -> tuple[Array, c.FixedWingState]:
    nav, _, s = flying()
    nav[n.RATES_FRD_RAD_S] = 0.3, -0.2, 0.1
    s.rate_setpoint = 0.8, 0.5, -0.4
    s.rate_previous = 0.25, -0.1, 0.15
    s.rate_derivative = 1.0, -2.0, 0.5
    s.rate_integral = 0.05, -0.04, 0.03
    return nav, s


@pytest.mark.parametrize(
    ("airspeed", "scaled_with"), [(12.0, 12.0), (15.0, 15.0), (2.0, 7.0), (60.0, 30.0), (10.0, None)]
)
def test_rate_law(airspeed: float, scaled_with: float | None) -> None:
    """A moment grows with the square of the airspeed, and the steady rate of a surface with the airspeed:
    the PID scales with the inverse square, the feed-forward with the inverse, between the stall speed and
    1.5 times the highest airspeed."""
    nav, s = rate_state()
    if scaled_with is None:
        p, scale = parameters(**RATE_GAINS, airspeed_scaling=False), 1.0
    else:
        p, scale = parameters(**RATE_GAINS), 15.0 / scaled_with
    s.eas = airspeed
    before, surfaces = s.copy(), np.zeros(3)  # type: ignore[attr-defined]
    rate_control(nav, p, s, surfaces, False)
    rates, wanted = nav[n.RATES_FRD_RAD_S], before.rate_setpoint
    error = wanted - rates
    old = before.rate_derivative
    slope = (rates - before.rate_previous) / PHYSICS_S
    derivative = old + PHYSICS_S / (PHYSICS_S + 1.0 / (2.0 * math.pi * 12.0)) * (slope - old)
    integral = before.rate_integral
    moment = of_axes("p") * error + integral - of_axes("d") * derivative
    expected = scale**2 * moment + scale * of_axes("ff") * wanted + [0.01, -0.03, 0.02]
    np.testing.assert_allclose(surfaces, expected, rtol=1e-12)
    np.testing.assert_allclose(s.rate_derivative, derivative, rtol=1e-12)
    np.testing.assert_array_equal(s.rate_previous, rates)
    moved = s.rate_integral - integral
    np.testing.assert_allclose(moved, of_axes("i") * error * PHYSICS_S, rtol=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("missing", "error", "integrates"),
    [
        (0.0, 0.4, True),
        (0.0, -0.4, True),
        (0.2, 0.4, False),
        (-0.2, -0.4, False),
        (0.2, -0.4, True),
        (-0.2, 0.4, True),
    ],
)
def test_rate_integrators_wait_at_the_stops(
    axis: int, missing: float, error: float, integrates: bool
) -> None:
    nav, s = rate_state()
    nav[n.RATES_FRD_RAD_S] = 0.0
    s.rate_setpoint = 0.0
    s.rate_setpoint[axis], s.unallocated[axis] = error, missing
    before = s.rate_integral[axis]
    rate_control(nav, parameters(**RATE_GAINS), s, np.zeros(3), False)
    assert bool((s.rate_integral[axis] - before) * error > 0.0) is integrates


@pytest.mark.parametrize(
    ("contact", "rolling", "integral"), [(0.0, True, [0.05, -0.04, 0.03]), (1.0, False, [0.0, 0.0, 0.0])]
)
def test_rate_integrators_wait_on_the_runway_and_are_empty_on_the_ground(
    contact: float, rolling: bool, integral: list[float]
) -> None:
    nav, s = rate_state()
    s.ground_contact = contact
    rate_control(nav, parameters(**RATE_GAINS), s, np.zeros(3), rolling)
    np.testing.assert_array_equal(s.rate_integral, integral)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rate_integrators_and_gyro_readings_have_limits(sign: float) -> None:
    nav, s = rate_state()
    nav[n.RATES_FRD_RAD_S] = -sign * 1e4
    s.rate_setpoint = 0.0
    for _ in range(200):
        s.unallocated = 0.0
        rate_control(nav, parameters(**RATE_GAINS), s, np.zeros(3), False)
    np.testing.assert_allclose(s.rate_integral, sign * of_axes("integral_max"))
    np.testing.assert_array_equal(s.rate_previous, -sign * 40.0)  # no gyro reads more


def test_surfaces_fade_in_on_the_runway() -> None:
    full = 0.7 * 7.0
    for airspeed, share in ((0.0, 0.0), (0.5 * full, 0.5), (full, 1.0), (2.0 * full, 1.0)):
        _, _, s = flying(airspeed=airspeed)
        surfaces = np.array([0.4, -3.0, 0.6])
        ease_on_runway(parameters(), s, surfaces)
        np.testing.assert_allclose(surfaces, [0.4 * share, -share, 0.6])
        surfaces = np.array([3.0, 0.2, 0.6])
        ease_on_runway(parameters(), s, surfaces)
        np.testing.assert_allclose(surfaces, [share, 0.2 * share, 0.6])


def test_rudder_goes_with_aileron_and_stick_and_stops_at_its_stop() -> None:
    _, _, s = flying()
    surfaces = np.array([0.5, -1.4, 0.1])
    limit_surfaces(parameters(roll_to_rudder_ff=0.4), s, 0.15, surfaces)
    np.testing.assert_allclose(surfaces, [0.5, -1.0, 0.45])
    np.testing.assert_allclose(s.unallocated, [0.0, -0.4, 0.0], atol=1e-12)
    for sign in (1.0, -1.0):  # of the aileron, only what it can give
        surfaces = sign * np.array([3.0, 0.2, 0.9])
        limit_surfaces(parameters(roll_to_rudder_ff=0.4), s, 0.0, surfaces)
        np.testing.assert_allclose(surfaces, sign * np.array([1.0, 0.2, 1.0]))
        np.testing.assert_allclose(s.unallocated, sign * np.array([2.0, 0.0, 0.3]), atol=1e-12)


WHEEL = {
    "wheel_time_constant_s": 0.5,
    "wheel_rate_max_rad_s": 0.4,
    "wheel_p": 0.6,
    "wheel_i": 0.2,
    "wheel_integral_max": 0.3,
    "wheel_ff": 0.25,
}


@pytest.mark.parametrize(("speed", "scale"), [(3.0, 1.0), (6.0, 1.0), (12.0, 0.5)])
@pytest.mark.parametrize(("error", "wanted"), [(0.1, 0.2), (-0.1, -0.2), (1.0, 0.4), (-1.0, -0.4)])
def test_wheel_law(speed: float, scale: float, error: float, wanted: float) -> None:
    """Heading error to yaw rate, PI and feed-forward on it; above 0.6 of the lowest airspeed they fade with
    the speed, as the wheels' and the rudder's effect grows (PX4)."""
    nav, setpoint, s = flying(yaw=1.0, airspeed=speed)
    setpoint[sp.STEERING_HEADING_RAD] = 1.0 + error
    nav[n.RATES + 2], s.wheel_integral = 0.05, 0.04
    command = wheel_control(nav, setpoint, parameters(**WHEEL), s)
    rate_error = wanted - 0.05
    assert s.rate_setpoint[2] == pytest.approx(wanted)
    assert command == pytest.approx(scale * 0.25 * wanted + scale**2 * (0.6 * rate_error + 0.04))
    assert s.wheel_integral == pytest.approx(0.04 + 0.2 * rate_error * PHYSICS_S)


def test_wheel_integrator_rests_at_rest_and_at_the_stops() -> None:
    nav, setpoint, s = flying(airspeed=0.9)
    setpoint[sp.STEERING_HEADING_RAD] = 0.2
    wheel_control(nav, setpoint, parameters(**WHEEL), s)
    assert s.wheel_integral == 0.0
    for sign in (1.0, -1.0):
        nav, setpoint, s = flying(airspeed=4.0)
        setpoint[sp.STEERING_HEADING_RAD] = sign * 0.2
        stiff = parameters(**(WHEEL | {"wheel_p": 9.0}))
        assert wheel_control(nav, setpoint, stiff, s) == sign
        assert s.wheel_integral == 0.0
        nav[n.RATES + 2] = sign * 0.35  # little is missing, for long
        s.wheel_integral = sign * 0.2999
        p = parameters(**WHEEL)
        for _ in range(10):
            wheel_control(nav, setpoint, p, s)
        assert s.wheel_integral == sign * 0.3
    nav[n.VEL_NED_M_S] = math.nan
    assert math.isfinite(wheel_control(nav, setpoint, parameters(**WHEEL), s))


# -- the air


def test_airspeed_filter_is_the_steady_state_kalman_filter() -> None:
    """Airspeed and its rate, both measured: the gains of the Riccati equation."""
    noise, rate_noise, process = 0.07, 0.2, 0.3
    a, noises = np.array([[0.0, 1.0], [0.0, 0.0]]), np.diag([noise**2, rate_noise**2])
    cov = solve_continuous_are(a.T, np.eye(2), np.diag([0.0, process**2]), noises)
    gain = cov @ np.linalg.inv(noises)
    nav, _, s = flying(airspeed=15.3)
    s.eas, s.eas_rate = 15.0, 0.4
    nav[n.ACC] = 0.9
    p = parameters(
        airspeed_noise_m_s=noise,
        airspeed_rate_noise_m_s2=rate_noise,
        airspeed_rate_process_noise_m_s2=process,
    )
    update_air(nav, p, s, GUIDANCE_S)
    predicted = 15.0 + GUIDANCE_S * 0.4
    innovation = np.array([15.3 - predicted, 0.9 - 0.4])
    np.testing.assert_allclose(
        [s.eas, s.eas_rate], np.array([predicted, 0.4]) + GUIDANCE_S * gain @ innovation, rtol=1e-9
    )


def test_airspeed_starts_at_what_is_measured_and_is_the_trim_without() -> None:
    nav, _, s = flying(airspeed=13.0)
    s.eas_known, s.eas_rate = 0.0, 0.7
    update_air(nav, parameters(), s, GUIDANCE_S)
    assert (s.eas, s.eas_rate, s.eas_known) == (13.0, 0.0, 1.0)
    s.eas_rate = 0.7
    nav[n.AIRSPEED_M_S] = math.nan
    update_air(nav, parameters(), s, GUIDANCE_S)
    assert (s.eas, s.eas_rate, s.eas_known) == (15.0, 0.0, 0.0)


def test_airspeed_is_never_negative() -> None:
    nav, _, s = flying()
    nav[n.AIRSPEED_M_S] = -4.0
    s.eas_known = 0.0
    update_air(nav, parameters(), s, GUIDANCE_S)
    assert s.eas == 0.0
    nav[n.ACC] = -30.0
    update_air(nav, parameters(), s, GUIDANCE_S)
    assert s.eas == 0.0


@pytest.mark.parametrize(
    ("equivalent", "true", "ratio"),
    [(10.0, 12.0, 1.2), (10.0, 60.0, 3.0), (10.0, 1.0, 0.8), (2.0, 4.0, 1.1), (10.0, math.nan, 1.1)],
)
def test_true_over_equivalent_airspeed(equivalent: float, true: float, ratio: float) -> None:
    nav, _, s = flying()
    nav[n.AIRSPEED_M_S], nav[n.AIRSPEED_TRUE_M_S], s.eas_to_tas = equivalent, true, 1.1
    update_air(nav, parameters(), s, GUIDANCE_S)
    assert s.eas_to_tas == pytest.approx(ratio)


def test_acceleration_is_taken_as_equivalent() -> None:
    """The rate of the equivalent airspeed is the true one over their ratio."""
    nav, _, s = flying()
    nav[n.AIRSPEED_TRUE_M_S] = 30.0
    nav[n.ACC] = 1.0
    update_air(nav, parameters(), s, GUIDANCE_S)
    other_nav, _, other = flying()
    other_nav[n.ACC] = 0.5
    update_air(other_nav, parameters(), other, GUIDANCE_S)
    assert s.eas_to_tas == 2.0
    assert s.eas_rate == pytest.approx(other.eas_rate)
    assert s.eas_rate > 0.0


def test_unknown_acceleration_leaves_the_rate_to_the_airspeed() -> None:
    nav, _, s = flying()
    nav[n.ACC] = math.nan
    s.eas_rate = 0.5
    s.eas = 15.0 - GUIDANCE_S * 0.5  # so that the airspeed is as predicted
    update_air(nav, parameters(), s, GUIDANCE_S)
    assert s.eas_rate == pytest.approx(0.5)


def test_acceleration_along_the_flow() -> None:
    nav, _, _ = flying(roll=0.3, pitch=0.2, yaw=0.7)
    nav[n.VEL_NED_M_S], nav[n.WIND_NED_M_S] = (12.0, -5.0, 1.5), (-3.0, 2.0, 0.5)
    nav[n.ACC_NED_M_S2] = 1.0, -2.0, 0.7
    flow = np.array([15.0, -7.0, 1.0])
    along = nav[n.ACC_NED_M_S2] @ flow / np.linalg.norm(flow)
    assert acceleration_along_flow(nav) == pytest.approx(along)
    nav[n.WIND + 2] = math.nan  # a vertical wind is rarely known
    flow[2] = 1.5
    along = nav[n.ACC_NED_M_S2] @ flow / np.linalg.norm(flow)
    assert acceleration_along_flow(nav) == pytest.approx(along)
    nose = Rotation.from_euler("ZYX", [0.7, 0.2, 0.3]).apply([1.0, 0.0, 0.0])
    along_nose = nav[n.ACC_NED_M_S2] @ nose
    nav[n.WIND] = math.nan
    assert acceleration_along_flow(nav) == pytest.approx(along_nose)
    nav[n.WIND_NED_M_S] = nav[n.VEL_NED_M_S] - [4.0, 0.0, 2.0]  # too slow a flow has no direction
    assert acceleration_along_flow(nav) == pytest.approx(along_nose)
    nav[n.WIND_NED_M_S] = nav[n.VEL_NED_M_S] - [4.0, 0.0, 4.0]
    assert acceleration_along_flow(nav) == pytest.approx((4.0 * 1.0 + 4.0 * 0.7) / math.sqrt(32.0))


# -- lateral guidance


@pytest.mark.parametrize("yaw", [0.0, 2.0, -2.5])
@pytest.mark.parametrize(
    ("error", "turn"), [(0.3, math.sin(0.3)), (-0.3, -math.sin(0.3)), (2.0, 1.0), (-2.0, -1.0)]
)
def test_heading_error_is_a_lateral_acceleration(yaw: float, error: float, turn: float) -> None:
    nav, setpoint, s = flying(yaw=yaw)
    setpoint[sp.HEADING_RAD], setpoint[sp.LATERAL_ACCELERATION_M_S2] = yaw + error, 0.5
    s.eas_to_tas = 1.1
    lateral_control(nav, setpoint, parameters(roll_slew_rad_s=1e3), s, GUIDANCE_S)
    acceleration = 0.5 + 0.8885 * AIRSPEED * 1.1 * turn
    assert s.lateral_acceleration == pytest.approx(acceleration)
    limit = s.roll_limited
    assert s.roll_setpoint == pytest.approx(np.clip(math.atan(acceleration / G), -limit, limit))
    assert math.remainder(s.heading_setpoint - yaw - error, 2.0 * math.pi) == pytest.approx(0.0)
    assert math.isnan(s.course_setpoint)
    assert s.airspeed_floor == 0.0


def test_course_is_flown_by_the_velocity_through_the_air() -> None:
    nav, setpoint, s = flying(yaw=1.3)  # the nose is elsewhere: sideslip
    nav[n.VEL_NED_M_S], nav[n.WIND_NED_M_S] = (14.0, 3.0, 0.0), (2.0, -4.0, 0.0)
    setpoint[sp.COURSE_RAD] = 0.6 + 2.0 * math.pi
    s.eas_to_tas = 1.2
    p = parameters(roll_slew_rad_s=1e3, ground_speed_min_m_s=9.0)
    lateral_control(nav, setpoint, p, s, GUIDANCE_S)
    airspeed = math.hypot(12.0, 7.0)
    heading = heading_for_course(0.6, airspeed, 2.0, -4.0)
    assert s.heading_setpoint == pytest.approx(heading)
    assert s.course_setpoint == pytest.approx(0.6)
    error = heading - math.atan2(7.0, 12.0)
    assert s.lateral_acceleration == pytest.approx(0.8885 * AIRSPEED * 1.2 * math.sin(error))
    # least airspeed for 9 m/s over ground along the course
    course = np.array([math.cos(0.6), math.sin(0.6)])
    needed = 9.0 * course - [2.0, -4.0] + 0.0
    across = np.array([-course[1], course[0]])
    along_wind, cross_wind = course @ [2.0, -4.0], across @ [2.0, -4.0]
    assert s.airspeed_floor == pytest.approx(math.hypot(9.0 - along_wind, cross_wind) / 1.2)
    assert np.linalg.norm(needed) == pytest.approx(s.airspeed_floor * 1.2)


def test_without_wind_or_velocity_a_course_is_flown_by_what_is_known() -> None:
    nav, setpoint, s = flying(yaw=0.4)
    nav[n.VEL_NED_M_S], nav[n.WIND_NED_M_S] = (0.0, 15.0, 0.0), math.nan
    setpoint[sp.COURSE_RAD] = 1.2
    p = parameters(roll_slew_rad_s=1e3)
    lateral_control(nav, setpoint, p, s, GUIDANCE_S)  # no wind: by the velocity over ground
    gain = 0.8885 * AIRSPEED
    assert s.lateral_acceleration == pytest.approx(gain * math.sin(1.2 - 0.5 * math.pi))
    nav[n.VEL_NED_M_S] = math.nan
    lateral_control(nav, setpoint, p, s, GUIDANCE_S)  # nor a velocity: by the nose and the airspeed
    assert s.lateral_acceleration == pytest.approx(gain * math.sin(1.2 - 0.4))
    nav[n.WIND_NED_M_S] = 3.0, 0.0, 0.0
    lateral_control(nav, setpoint, p, s, GUIDANCE_S)
    heading = heading_for_course(1.2, AIRSPEED, 3.0, 0.0)
    assert s.lateral_acceleration == pytest.approx(gain * math.sin(heading - 0.4))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_wind_from_behind_may_be_stronger_than_the_airspeed(side: float) -> None:
    heading = heading_for_course(
        0.5, 10.0, *(20.0 * np.array([math.cos(0.5 + 0.3 * side), math.sin(0.5 + 0.3 * side)]))
    )
    over_ground = 10.0 * np.array([math.cos(heading), math.sin(heading)]) + 20.0 * np.array(
        [math.cos(0.5 + 0.3 * side), math.sin(0.5 + 0.3 * side)]
    )
    assert math.atan2(over_ground[1], over_ground[0]) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("roll", "flown"), [(0.6, 0.6), (-0.6, -0.6), (1.5, math.radians(80.0)), (-2.0, -math.radians(80.0))]
)
def test_bank_given_past_the_guidance(roll: float, flown: float) -> None:
    nav, setpoint, s = flying()
    setpoint[sp.ROLL_RAD], setpoint[sp.COURSE_RAD] = roll, 1.0
    lateral_control(nav, setpoint, parameters(), s, GUIDANCE_S)
    assert s.roll_setpoint == flown
    assert s.lateral_acceleration == pytest.approx(G * math.tan(flown))
    assert math.isnan(s.course_setpoint)
    assert math.isnan(s.heading_setpoint)


def test_a_course_can_be_flown_from_rest() -> None:
    """Without any motion through the air the course is the heading: the start of a catapult or a roll."""
    nav, setpoint, s = flying(yaw=0.4, airspeed=0.0)
    setpoint[sp.COURSE_RAD] = 1.2
    lateral_control(nav, setpoint, parameters(), s, GUIDANCE_S)
    assert s.heading_setpoint == pytest.approx(1.2)


@pytest.mark.parametrize("airspeed", [7.0, 3.0, 7.75])
def test_a_slow_wing_may_still_bank_by_fifteen_degrees(airspeed: float) -> None:
    nav, setpoint, s = flying(airspeed=airspeed)
    setpoint[sp.LATERAL_ACCELERATION_M_S2] = 20.0
    lateral_control(nav, setpoint, parameters(roll_slew_rad_s=1e3), s, GUIDANCE_S)
    assert s.roll_setpoint == pytest.approx(math.radians(15.0))


# -- heights


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("left", "rate"), [(0.5, 0.4), (1.1, 0.88), (4.0, math.sqrt(1.2 * (8.0 - 1.2 / 0.64)))]
)
def test_height_trajectory_closes_in_proportion_and_brakes_before(
    sign: float, left: float, rate: float
) -> None:
    """Near the end 0.8 per second of what is left, before it the speed that a constant deceleration of
    1.2 m/s^2 takes away in time."""
    p = parameters(
        height_acceleration_m_s2=1.2, climb_rate_target_m_s=4.5, sink_rate_target_m_s=4.5, climb_max_m_s=6.0
    )
    _, _, s = flying()
    reset_height(100.0, 0.0, s)
    s.height_rate_reference = sign * rate
    follow_height(100.0 + sign * left, 0.5, 100.0, p, s, GUIDANCE_S)
    assert s.height_rate_reference == pytest.approx(sign * rate)
    assert s.height_reference == pytest.approx(100.0 + (sign * rate + 0.5) * GUIDANCE_S)
    assert s.height_controlled == 1.0
    # a rate of its own changes with the acceleration
    s.height_rate_reference = 0.0
    s.height_reference = 100.0
    follow_height(100.0 + sign * left, 0.5, 100.0, p, s, GUIDANCE_S)
    assert s.height_rate_reference == pytest.approx(sign * 1.2 * GUIDANCE_S)


@pytest.mark.parametrize(
    ("climb_target", "climb_max", "sink_target", "sink_max", "up", "down"),
    [(3.0, 5.0, 2.0, 4.0, 3.0, 2.0), (6.0, 5.0, 6.0, 4.0, 5.0, 4.0)],
)
def test_height_trajectory_has_the_lower_of_its_rates(
    climb_target: float, climb_max: float, sink_target: float, sink_max: float, up: float, down: float
) -> None:
    p = parameters(
        climb_rate_target_m_s=climb_target,
        climb_max_m_s=climb_max,
        sink_rate_target_m_s=sink_target,
        sink_max_m_s=sink_max,
        sink_min_m_s=1.0,
    )
    for wanted, rate in ((300.0, up), (-100.0, -down)):
        _, _, s = flying()
        reset_height(100.0, rate, s)
        follow_height(wanted, 0.0, 100.0, p, s, GUIDANCE_S)
        assert s.height_rate_reference == pytest.approx(rate)


def test_height_reference_waits_for_the_vehicle() -> None:
    p = parameters(climb_max_m_s=5.0, sink_max_m_s=4.0, height_time_constant_s=3.0)
    for reference, held in ((150.0, 100.0 + 1.2 * 5.0 * 3.0), (50.0, 100.0 - 1.2 * 4.0 * 3.0)):
        _, _, s = flying()
        reset_height(reference, 0.0, s)
        follow_height(reference, 0.0, 100.0, p, s, GUIDANCE_S)
        assert s.height_reference == pytest.approx(held)


@pytest.mark.parametrize(("height", "climb"), [(math.nan, 2.0), (80.0, math.nan), (80.0, 2.0)])
def test_height_trajectory_starts_where_the_vehicle_is(height: float, climb: float) -> None:
    _, _, s = flying()
    s.height_controlled = 1.0
    reset_height(height, climb, s)
    assert s.height_reference == (80.0 if math.isfinite(height) else 0.0)
    assert s.height_rate_reference == (2.0 if math.isfinite(climb) else 0.0)
    assert s.height_controlled == 0.0


# -- total energy

ENERGY = {
    "trim_throttle": 0.5,
    "trim_throttle_min_speed": 0.35,
    "trim_throttle_max_speed": 0.8,
    "throttle_damping": 0.3,
    "throttle_integral_1_s": 0.4,
    "pitch_damping": 0.5,
    "pitch_integral_1_s": 0.6,
    "energy_balance_ff": 0.9,
    "height_rate_ff": 0.7,
    "trim_pitch_rad": 0.05,
    "lift_angle_rad": 0.12,
    "turn_energy_rate_m2_s3": 12.0,
    "energy_rate_time_constant_s": 0.5,
    "vertical_acceleration_max_m_s2": 1e4,
    "climb_max_m_s": 4.0,
    "sink_min_m_s": 2.5,
    "sink_max_m_s": 5.0,
    "climb_rate_target_m_s": 2.0,
    "sink_rate_target_m_s": 2.0,
    "height_time_constant_s": 3.0,
    "airspeed_time_constant_s": 4.0,
}


def trim_pitch(airspeed: float, load_factor: float = 1.0) -> float:
    """Lift balances the weight times the load factor; the zero-lift angle is trim less lift angle."""
    return (0.05 - 0.12) / load_factor + 0.12 * min(4.0, (15.0 / airspeed) ** 2)


@pytest.mark.parametrize("weight", [0.0, 0.6, 1.0, 1.5, 2.0])
@pytest.mark.parametrize("climb", [0.8, -0.6])
def test_energy_law(weight: float, climb: float) -> None:
    """Throttle flies the rate of the total energy, pitch that of the balance (Lambregts 1983); each with its
    trim, feed-forward, damping and integrator. Values of a step worked out on paper."""
    nav, setpoint, s = flying(airspeed=16.0, climb=0.3)
    p = parameters(**(ENERGY | {"speed_weight": weight}))
    s.eas_rate, s.energy_rate, s.eas_to_tas = 0.2, 5.0, 1.1
    s.pitch_integral, s.throttle_integral, s.throttle, s.pitch_setpoint = 0.02, 0.03, 0.5, 0.04
    setpoint[sp.HEIGHT_RATE_M_S], setpoint[sp.AIRSPEED_M_S] = climb, 17.0
    energy_control(nav, setpoint, p, s, GUIDANCE_S, False)

    true = 16.0 * 1.1
    potential, kinetic = G * 0.3, true * 0.2 * 1.1
    acceleration = (17.0 * 1.1 - true) / 4.0
    if weight < 2.0:
        acceleration = min(0.5 * G * 4.0 / true, acceleration)
    wanted_potential, wanted_kinetic = G * climb, true * acceleration
    share = GUIDANCE_S / (GUIDANCE_S + 0.5)
    energy = 5.0 + share * (potential + kinetic - 5.0)
    wanted = np.clip(wanted_potential + wanted_kinetic, -G * 2.5, G * 4.0)
    assert s.energy_rate == pytest.approx(energy)
    assert s.energy_rate_setpoint == pytest.approx(wanted)
    missing = (wanted - energy) / (G * 4.0 + G * 2.5)
    trim = 0.5 + (0.8 - 0.5) * (17.0 - 15.0) / (20.0 - 15.0)
    throttle = trim + (wanted / (G * 4.0) * (1.0 - trim) if wanted >= 0.0 else wanted / (G * 2.5) * trim)
    integral = 0.03 + 0.4 * missing * GUIDANCE_S
    assert s.throttle_integral == pytest.approx(integral)
    assert s.throttle == pytest.approx(np.clip(throttle + 0.3 * missing + integral, 0.0, 1.0))

    height_share, speed_share = min(1.0, 2.0 - weight), min(1.0, weight)
    balance = (height_share * potential - speed_share * kinetic) / (true * G)
    balance_wanted = (height_share * wanted_potential - speed_share * wanted_kinetic) / (true * G)
    pitch_missing = balance_wanted - balance
    pitch_integral = 0.02 + 0.6 * pitch_missing * GUIDANCE_S
    assert s.pitch_integral == pytest.approx(pitch_integral)
    assert s.pitch_setpoint == pytest.approx(
        trim_pitch(17.0) + 0.5 * pitch_missing + 0.9 * balance_wanted + pitch_integral
    )
    assert s.height_rate_setpoint == climb
    assert s.vel_setpoint[2] == -climb


@pytest.mark.parametrize(
    ("airspeed", "throttle"),
    [(15.0, 0.5), (12.0, 0.5 - 0.15 * 3.0 / 5.0), (20.0, 0.8), (18.0, 0.5 + 0.3 * 3.0 / 5.0)],
)
def test_trim_throttle_lies_between_the_three_that_are_known(airspeed: float, throttle: float) -> None:
    nav, setpoint, s = flying(airspeed=airspeed)
    setpoint[sp.HEIGHT_RATE_M_S], setpoint[sp.AIRSPEED_M_S] = 0.0, airspeed
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.throttle == pytest.approx(throttle)
    unknown = parameters(**(ENERGY | {"trim_throttle_min_speed": 0.0, "trim_throttle_max_speed": 0.0}))
    energy_control(nav, setpoint, unknown, s, GUIDANCE_S, False)
    assert s.throttle == pytest.approx(0.5)
    # ends at the same airspeed as the trim give no slope
    flat = parameters(**(ENERGY | {"airspeed_min_m_s": 14.9995, "airspeed_max_m_s": 15.0005}))
    for wanted in (14.0, 16.0):
        setpoint[sp.AIRSPEED_M_S] = wanted
        nav, _, s = flying(airspeed=15.0)
        energy_control(nav, setpoint, flat, s, GUIDANCE_S, False)
        assert s.throttle == pytest.approx(0.5, abs=2e-3)


def test_trim_throttle_is_known_near_the_trim_airspeed_too() -> None:
    """The lowest and the highest airspeed may be less than 1 m/s from the trim."""
    near = parameters(**(ENERGY | {"airspeed_min_m_s": 14.5, "airspeed_max_m_s": 15.5}))
    for wanted, throttle in ((14.5, 0.35), (14.75, 0.425), (15.25, 0.65), (15.5, 0.8)):
        nav, setpoint, s = flying(airspeed=15.2)
        s.eas = wanted + 1e-12
        setpoint[sp.HEIGHT_RATE_M_S], setpoint[sp.AIRSPEED_M_S] = 0.0, wanted
        p = near.copy()  # type: ignore[attr-defined]
        p.airspeed_stall_m_s = 7.0
        p.throttle_damping = p.throttle_integral_1_s = 0.0
        s.energy_rate_setpoint = 0.0
        energy_control(nav, setpoint, p, s, GUIDANCE_S, False)
        under = s.underspeed
        assert s.throttle == pytest.approx(under + (1.0 - under) * throttle, abs=1e-6)


@pytest.mark.parametrize("bank", [0.7, -0.7])
def test_a_turn_asks_for_lift_energy_and_airspeed(bank: float) -> None:
    nav, setpoint, s = flying(airspeed=15.0)
    s.roll_setpoint = bank
    setpoint[sp.HEIGHT_RATE_M_S] = 0.0
    p = parameters(**ENERGY)
    energy_control(nav, setpoint, p, s, GUIDANCE_S, False)
    load_factor = 1.0 / math.cos(0.7)
    assert s.energy_rate_setpoint == pytest.approx(12.0 * (load_factor - 1.0))
    assert s.pitch_setpoint == pytest.approx(trim_pitch(15.0, load_factor))
    setpoint[sp.AIRSPEED_M_S] = 10.0  # the lowest airspeed grows with the root of the load factor
    energy_control(nav, setpoint, p, s, GUIDANCE_S, False)
    assert s.airspeed_setpoint == pytest.approx(10.0 * math.sqrt(load_factor))


@pytest.mark.parametrize("bank", [1.5, -1.5])
def test_load_factor_of_a_bank_counts_up_to_five(bank: float) -> None:
    nav, setpoint, s = flying(airspeed=15.0)
    s.roll_setpoint = bank
    setpoint[sp.HEIGHT_RATE_M_S] = 0.0
    p = parameters(**(ENERGY | {"turn_energy_rate_m2_s3": 2.0}))
    energy_control(nav, setpoint, p, s, GUIDANCE_S, False)
    # the lowest airspeed of that turn is above the highest of all: 5 m/s faster, over the time constant
    assert s.energy_rate_setpoint == pytest.approx(2.0 * (5.0 - 1.0) + 15.0 * 5.0 / 4.0)


@pytest.mark.parametrize(
    ("airspeed", "under"), [(7.0, 1.0), (8.2, 1.0), (8.95, 0.5), (9.7, 0.0), (12.0, 0.0)]
)
def test_underspeed_lies_between_stall_and_lowest_airspeed(airspeed: float, under: float) -> None:
    """From 0.9 of the way between stall (7 m/s) and lowest airspeed (10 m/s), fully at 0.4 of it."""
    nav, setpoint, s = flying(airspeed=airspeed)
    setpoint[sp.HEIGHT_RATE_M_S] = 0.0
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.underspeed == pytest.approx(under, abs=1e-9)
    s.eas_known = 0.0
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.underspeed == 0.0


def test_underspeed_grows_with_the_bank() -> None:
    bank = math.acos(1.0 / 1.44)  # the root of the load factor is 1.2
    nav, setpoint, s = flying(airspeed=1.2 * 8.95)
    s.roll_setpoint = bank
    setpoint[sp.HEIGHT_RATE_M_S] = 0.0
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.underspeed == pytest.approx(0.5)


def test_pitch_setpoint_changes_with_the_vertical_acceleration() -> None:
    p = parameters(**(ENERGY | {"vertical_acceleration_max_m_s2": 3.0}))
    for climb, sign in ((4.0, 1.0), (-4.0, -1.0)):
        nav, setpoint, s = flying()
        setpoint[sp.HEIGHT_RATE_M_S] = climb
        s.pitch_setpoint = 0.02
        energy_control(nav, setpoint, p, s, GUIDANCE_S, False)
        assert s.pitch_setpoint == pytest.approx(0.02 + sign * GUIDANCE_S * 3.0 / AIRSPEED)


@pytest.mark.parametrize(
    ("previous", "climb", "integrates"),
    [
        (0.1, 3.0, False),
        (0.1, -3.0, True),
        (-0.1, -3.0, False),
        (-0.1, 3.0, True),
        (0.0, 3.0, True),
        (0.0, -3.0, True),
    ],
)
def test_pitch_integrator_waits_at_the_limits(previous: float, climb: float, integrates: bool) -> None:
    nav, setpoint, s = flying()
    setpoint[sp.HEIGHT_RATE_M_S], setpoint[sp.PITCH_MIN_RAD], setpoint[sp.PITCH_MAX_RAD] = climb, -0.1, 0.1
    s.pitch_setpoint = previous
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert bool(s.pitch_integral * climb > 0.0) is integrates
    assert abs(s.pitch_setpoint) <= 0.1


@pytest.mark.parametrize(
    ("previous", "climb", "integrates"),
    [
        (0.9, 3.0, False),
        (0.9, -2.0, True),
        (0.2, -2.0, False),
        (0.2, 3.0, True),
        (0.5, 3.0, True),
        (0.5, -2.0, True),
    ],
)
def test_throttle_integrator_waits_at_the_limits(previous: float, climb: float, integrates: bool) -> None:
    nav, setpoint, s = flying()
    setpoint[sp.HEIGHT_RATE_M_S] = climb
    s.throttle = previous
    p = parameters(**(ENERGY | {"throttle_min": 0.2, "throttle_max": 0.9}))
    energy_control(nav, setpoint, p, s, GUIDANCE_S, False)
    assert bool(s.throttle_integral * climb > 0.0) is integrates


def test_integrators_rest_on_the_ground_and_start_empty() -> None:
    for entering, contact in ((True, 0.0), (False, 1.0)):
        nav, setpoint, s = flying(climb=1.0)
        setpoint[sp.HEIGHT_RATE_M_S] = 0.0
        s.pitch_integral = s.throttle_integral = 0.3
        s.ground_contact = contact
        p = parameters(**(ENERGY | {"pitch_integral_1_s": 0.0, "throttle_integral_1_s": 0.0}))
        energy_control(nav, setpoint, p, s, GUIDANCE_S, entering)
        assert s.pitch_integral == 0.0
        assert s.throttle_integral == 0.0
        if entering:
            assert s.energy_rate == pytest.approx(G * 1.0)
    nav, setpoint, s = flying(climb=1.0)
    s.ground_contact = 1.0
    setpoint[sp.HEIGHT_RATE_M_S] = 0.0
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.pitch_integral == 0.0
    assert s.throttle_integral == 0.0


def test_without_airspeed_the_throttle_keeps_a_positive_integral() -> None:
    for integral, kept in ((0.1, 0.1), (-0.1, 0.0)):
        nav, setpoint, s = flying()
        s.eas_known, s.throttle_integral = 0.0, integral
        setpoint[sp.HEIGHT_RATE_M_S] = 0.0
        energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
        assert s.throttle == pytest.approx(0.5 + kept)
        assert s.throttle_integral == integral


@pytest.mark.parametrize(("wanted", "limit", "given"), [(4.0, 0.6, 0.6), (4.0, 2.0, 1.0), (4.0, -1.0, 0.0)])
def test_throttle_limit_of_the_setpoint(wanted: float, limit: float, given: float) -> None:
    nav, setpoint, s = flying()
    setpoint[sp.HEIGHT_RATE_M_S], setpoint[sp.THROTTLE_MAX] = wanted, limit
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.throttle == pytest.approx(given)


@pytest.mark.parametrize(("climb", "sign"), [(4.0, 1.0), (-3.0, -1.0)])
def test_throttle_slews(climb: float, sign: float) -> None:
    nav, setpoint, s = flying()
    s.throttle = 0.4 if sign > 0.0 else 0.6
    setpoint[sp.HEIGHT_RATE_M_S] = climb
    p = parameters(**(ENERGY | {"throttle_slew_1_s": 0.5}))
    before = s.throttle
    energy_control(nav, setpoint, p, s, GUIDANCE_S, False)
    assert s.throttle == pytest.approx(before + sign * 0.5 * GUIDANCE_S)


def test_height_error_is_a_climb_rate() -> None:
    nav, setpoint, s = flying()
    s.height_controlled, s.height_reference, s.height_rate_reference = 1.0, 101.5, 0.4
    setpoint[sp.DOWN_M], setpoint[sp.HEIGHT_RATE_M_S] = -101.9, 0.2
    p = parameters(**ENERGY)
    energy_control(nav, setpoint, p, s, GUIDANCE_S, False)
    rate = 0.4 + min(1.5 * GUIDANCE_S, max(-1.5 * GUIDANCE_S, 0.8 * 0.4 - 0.4))
    reference = 101.5 + (rate + 0.2) * GUIDANCE_S
    assert s.height_reference == pytest.approx(reference)
    assert s.height_rate_setpoint == pytest.approx((reference - 100.0) / 3.0 + 0.7 * rate + 0.2)


@pytest.mark.parametrize(("down", "rate"), [(-1000.0, 4.0), (800.0, -5.0)])
def test_climb_rate_of_a_height_has_limits(down: float, rate: float) -> None:
    nav, setpoint, s = flying()
    s.height_controlled, s.height_reference = 1.0, 100.0 + 30.0 * math.copysign(1.0, rate)
    s.height_rate_reference = rate
    setpoint[sp.DOWN_M] = down
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.height_rate_setpoint == rate


def test_a_slope_is_joined_at_the_climb_rate_that_is_flown() -> None:
    """A path that climbs with 1 m/s, joined in a climb of 1 m/s: nothing changes."""
    nav, setpoint, s = flying(climb=1.0)
    setpoint[sp.DOWN_M], setpoint[sp.HEIGHT_RATE_M_S] = -100.0, 1.0
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.height_rate_reference == pytest.approx(0.0)
    assert s.height_reference == pytest.approx(100.0 + GUIDANCE_S)


@pytest.mark.parametrize(("given", "expected"), [(math.nan, 0.0), (0.7, 0.7)])
def test_unknown_height_is_not_controlled(given: float, expected: float) -> None:
    nav, setpoint, s = flying()
    nav[n.POS + 2] = math.nan
    setpoint[sp.DOWN_M], setpoint[sp.HEIGHT_RATE_M_S] = -120.0, given
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.height_rate_setpoint == expected


@pytest.mark.parametrize(
    ("pitch", "flown"), [(0.2, 0.2), (-0.3, -0.3), (1.5, math.radians(80.0)), (-1.5, -math.radians(80.0))]
)
def test_pitch_and_throttle_given_past_the_energy_control(pitch: float, flown: float) -> None:
    nav, setpoint, s = flying()
    setpoint[sp.PITCH_RAD], setpoint[sp.THROTTLE] = pitch, 1.4
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.pitch_setpoint == flown
    assert s.throttle == 1.0
    setpoint[sp.THROTTLE] = -0.3
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.throttle == 0.0
    assert math.isnan(s.height_rate_setpoint)


def test_throttle_given_alone_leaves_the_airspeed_to_the_pitch() -> None:
    nav, setpoint, s = flying(airspeed=16.0)
    setpoint[sp.THROTTLE], setpoint[sp.AIRSPEED_M_S] = 0.7, 15.0
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.balance_rate_setpoint == pytest.approx(16.0 * 1.0 / 4.0)  # kinetic alone, slower: nose up
    for wanted, limited in ((30.0, -1.5), (1.0, 1.5)):  # at most 1.5 m/s^2
        setpoint[sp.AIRSPEED_M_S] = wanted
        p = parameters(**(ENERGY | {"airspeed_time_constant_s": 0.5}))
        energy_control(nav, setpoint, p, s, GUIDANCE_S, False)
        assert s.balance_rate_setpoint == pytest.approx(16.0 * limited)


def test_flare_flies_its_height_rate_alone() -> None:
    nav, setpoint, s = flying(airspeed=8.0)
    setpoint[sp.THROTTLE], setpoint[sp.HEIGHT_RATE_M_S] = 0.0, -0.5
    p = parameters(**(ENERGY | {"lift_angle_rad": 0.0}))
    energy_control(nav, setpoint, p, s, GUIDANCE_S, False)
    assert s.underspeed == 0.0
    assert s.balance_rate_setpoint == pytest.approx(G * -0.5)


def test_a_glider_flies_its_airspeed_by_pitch() -> None:
    nav, setpoint, s = flying(airspeed=16.0)
    setpoint[sp.HEIGHT_RATE_M_S], setpoint[sp.AIRSPEED_M_S] = 2.0, 15.0
    glider = parameters(**(ENERGY | {"powered": False}))
    energy_control(nav, setpoint, glider, s, GUIDANCE_S, False)
    assert s.balance_rate_setpoint == pytest.approx(16.0 * 0.25)
    assert s.throttle == 0.0
    s.eas_known = 0.0  # its glide, by the attitude it should have
    energy_control(nav, setpoint, glider, s, GUIDANCE_S, False)
    assert s.balance_rate_setpoint == pytest.approx(-G * 2.5)


def test_failed_motor_is_noticed_and_height_given_up() -> None:
    """Full throttle, and the energy of height and inertial acceleration falls all the same: sure after 3 s,
    acted upon from 1.2 s; the airspeed is then that of a glide, 1.1 times the lowest."""
    nav, setpoint, s = flying(airspeed=15.0, climb=-3.0)
    setpoint[sp.HEIGHT_RATE_M_S] = 0.0
    p = parameters(**ENERGY)
    weights = []
    for _ in range(round(3.0 / GUIDANCE_S) + 2):
        s.throttle = 1.0
        energy_control(nav, setpoint, p, s, GUIDANCE_S, False)
        weights.append(s.powerless)
    assert weights[round(1.5 / GUIDANCE_S) - 1] == pytest.approx(0.5)
    assert s.powerless == 1.0
    assert s.airspeed_setpoint == pytest.approx(11.0)
    assert s.balance_rate == pytest.approx(-15.0 * s.eas_rate)  # pitch flies the airspeed alone
    # and forgotten as slowly once there is power again
    nav[n.VEL + 2] = -1.0
    s.throttle = 1.0
    energy_control(nav, setpoint, p, s, GUIDANCE_S, False)
    assert s.powerless == pytest.approx(1.0 - GUIDANCE_S / 3.0)


@pytest.mark.parametrize("doubt", ["throttle", "given", "airspeed", "acceleration"])
def test_a_motor_is_not_blamed_without_reason(doubt: str) -> None:
    nav, setpoint, s = flying(airspeed=15.0, climb=-3.0)
    setpoint[sp.HEIGHT_RATE_M_S] = 0.0
    s.throttle = 0.9 if doubt == "throttle" else 1.0
    if doubt == "given":
        setpoint[sp.PITCH_RAD] = 0.0
    if doubt == "airspeed":
        s.eas_known = 0.0
    if doubt == "acceleration":  # height becomes speed: the energy stays
        nav[n.ACC] = 3.0
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.powerless == 0.0


def test_a_climb_out_gives_way_before_the_stall() -> None:
    nav, setpoint, s = flying(airspeed=8.2)
    setpoint[sp.HEIGHT_RATE_M_S], setpoint[sp.PITCH_MIN_RAD] = 3.0, 0.2
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.underspeed == pytest.approx(1.0)
    assert s.pitch_setpoint < 0.2
    assert s.throttle == 1.0
    nav, setpoint, s = flying(airspeed=15.0)
    setpoint[sp.HEIGHT_RATE_M_S], setpoint[sp.PITCH_MIN_RAD] = -3.0, 0.2
    energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
    assert s.pitch_setpoint == pytest.approx(0.2)


def test_unknown_climb_rate_counts_as_level() -> None:
    states = []
    for down_m_s in (math.nan, 0.0):
        nav, setpoint, s = flying(airspeed=16.0)
        nav[n.VEL + 2] = down_m_s
        nav[n.ACC_NED_M_S2] = 0.0
        setpoint[sp.HEIGHT_RATE_M_S] = 1.0
        energy_control(nav, setpoint, parameters(**ENERGY), s, GUIDANCE_S, False)
        states.append(s)
    np.testing.assert_array_equal(states[0], states[1])
