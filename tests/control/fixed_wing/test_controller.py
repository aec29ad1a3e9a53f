"""What the controller does with levels, missing values, the ground and bad input."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopilot_bridge.control.fixed_wing import FixedWingController, FixedWingParameters
from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.control.multicopter import setpoint as multicopter_sp
from autopilot_bridge.navigation import layout as n
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.interface import AILERON, BRAKE, ELEVATOR, FLAPS, MAX_ACTUATORS, RUDDER, STEERING, THROTTLE

SURFACES = [AILERON, ELEVATOR, RUDDER, STEERING]


def level_flight(nav: np.ndarray, *, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> None:
    """A navigation state of flight at 15 m/s, 100 m up."""
    nav[:] = 0.0
    quaternion_from_euler(roll, pitch, yaw, nav[n.Q_NED_FROM_FRD])
    nav[n.EULER_RAD] = (roll, pitch, yaw)
    nav[n.VEL_NED_M_S] = (15.0 * math.cos(yaw), 15.0 * math.sin(yaw), 0.0)
    nav[n.POS_NED_M] = (0.0, 0.0, -100.0)
    nav[n.SPECIFIC_FORCE_FRD_M_S2] = (0.0, 0.0, -9.81)
    nav[n.AIRSPEED_M_S] = nav[n.AIRSPEED_TRUE_M_S] = 15.0


class Controller(FixedWingController):
    """With the navigation state that it reads."""

    def __init__(self) -> None:
        self.nav = np.zeros(n.NAV_SIZE)
        level_flight(self.nav)
        super().__init__(physics_rate_hz=250.0, nav=self.nav)


def controller(**setpoint: float) -> Controller:
    made = Controller()
    write(made, **setpoint)
    return made


def write(made: FixedWingController, *, level: float = sp.FLY, **values: float) -> None:
    made.setpoint[:] = math.nan
    made.setpoint[sp.LEVEL] = level
    for name, value in values.items():
        made.setpoint[getattr(sp, name.upper())] = value


def run(made: FixedWingController, steps: int) -> None:
    for _ in range(steps):
        made.step()


@pytest.mark.parametrize(
    "level", [sp.OFF, sp.IDLE, multicopter_sp.ATTITUDE, multicopter_sp.TRAJECTORY, math.nan, 7.0]
)
def test_no_flight_level_stops_the_propeller_and_centres_the_surfaces(level: float) -> None:
    made = controller(down_m=-150.0, course_rad=1.0)
    run(made, 100)
    assert made.actuators[THROTTLE] > 0.0
    write(made, level=level, throttle=1.0, brake=1.0)
    made.step()
    assert not made.actuators.any()
    assert made.thrust == 0.0


def test_direct_surfaces_and_throttle_go_through() -> None:
    made = controller(level=sp.SURFACES_DIRECT, throttle=0.7, flaps=0.5, brake=2.0)
    made.setpoint[sp.SURFACES] = (0.2, -0.3, 1.5)
    made.step()
    expected = np.zeros(MAX_ACTUATORS)
    expected[[AILERON, ELEVATOR, RUDDER, STEERING]] = (0.2, -0.3, 1.0, 1.0)
    expected[[THROTTLE, FLAPS, BRAKE]] = (0.7, 0.5, 1.0)
    assert made.actuators == pytest.approx(expected)
    made.nav[:] = math.nan  # nothing known: the sticks still work
    made.step()
    assert made.actuators == pytest.approx(expected)


def test_rates_are_answered_by_their_surfaces() -> None:
    made = controller(level=sp.RATES, throttle=0.4)
    made.setpoint[sp.RATES_FRD_RAD_S] = (0.5, 0.2, 0.1)
    made.step()
    p = made.parameters
    assert made.actuators[AILERON] == pytest.approx((p.rate_roll_ff + p.rate_roll_p) * 0.5)
    assert made.actuators[ELEVATOR] == pytest.approx((p.rate_pitch_ff + p.rate_pitch_p) * 0.2)
    assert made.actuators[RUDDER] == pytest.approx((p.rate_yaw_ff + p.rate_yaw_p) * 0.1)
    assert made.actuators[THROTTLE] == 0.4
    assert made.rate_setpoint_frd_rad_s == pytest.approx([0.5, 0.2, 0.1])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rates_sticks_and_throttle_are_limited_and_zero_where_they_are_not_given(sign: float) -> None:
    made = controller(
        level=sp.RATES, throttle=sign * 3.0, yaw_stick=sign * 2.0, flaps=sign * 2.0, brake=sign * 2.0
    )
    made.setpoint[sp.RATES_FRD_RAD_S] = sign * 30.0
    made.step()
    on = max(0.0, sign)
    assert made.rate_setpoint_frd_rad_s.tolist() == [sign * 20.0] * 3
    assert made.actuators[[THROTTLE, FLAPS, BRAKE]].tolist() == [on, on, on]
    assert made.actuators[STEERING] == sign
    write(made, level=sp.RATES)
    made.step()
    assert made.rate_setpoint_frd_rad_s.tolist() == [0.0] * 3
    assert made.actuators[[THROTTLE, FLAPS, BRAKE, STEERING]].tolist() == [0.0] * 4
    write(made, level=sp.SURFACES_DIRECT, throttle=sign * 3.0)
    made.setpoint[sp.SURFACES] = sign * 2.0
    made.step()
    assert made.actuators[[AILERON, ELEVATOR, RUDDER, STEERING]].tolist() == [sign] * 4
    assert made.actuators[THROTTLE] == on


def test_at_rest_no_attitude_is_wanted() -> None:
    made = controller(level=sp.OFF)
    assert made.attitude_setpoint.tolist() == [1.0, 0.0, 0.0, 0.0]
    assert math.isnan(made.heading_setpoint_rad)
    assert math.isnan(made.course_setpoint_rad)
    assert np.isnan(made.velocity_setpoint_ned_m_s).all()
    assert math.isnan(made.down_reference_m)
    write(made, level=sp.FLY, heading_rad=0.5, down_m=-120.0)
    run(made, 50)
    assert made.attitude_setpoint.tolist() != [1.0, 0.0, 0.0, 0.0]
    made.nav[n.RATES_FRD_RAD_S] = 0.2, math.nan, -0.1
    write(made, level=sp.OFF)
    made.step()
    assert made.attitude_setpoint.tolist() == [1.0, 0.0, 0.0, 0.0]
    assert np.isnan(made.velocity_setpoint_ned_m_s).all()


@pytest.mark.parametrize(
    "place", [n.Q, n.Q + 1, n.Q + 2, n.Q + 3, n.RATES, n.RATES + 1, n.RATES + 2, n.ROLL, n.PITCH, n.YAW]
)
def test_any_unknown_part_of_the_attitude_stops_the_propeller(place: int) -> None:
    made = controller(down_m=-120.0)
    run(made, 20)
    assert made.actuators[THROTTLE] > 0.0
    made.nav[place] = math.nan
    made.step()
    assert not made.actuators.any()
    level_flight(made.nav)
    run(made, 20)
    assert made.actuators[THROTTLE] > 0.0


@pytest.mark.parametrize("level", [sp.RATES, sp.SURFACES_DIRECT])
def test_past_the_guidance_nothing_of_it_is_reported(level: float) -> None:
    made = controller(heading_rad=1.0, down_m=-150.0)
    run(made, 100)
    level_flight(made.nav, roll=0.3, pitch=-0.1)
    write(made, level=level, throttle=0.6)
    made.step()
    assert made.roll_setpoint_rad == 0.3
    assert made.pitch_setpoint_rad == -0.1
    assert math.isnan(made.heading_setpoint_rad)
    assert math.isnan(made.course_setpoint_rad)
    assert math.isnan(made.velocity_setpoint_ned_m_s[2])
    assert math.isnan(made.down_reference_m)
    assert made.thrust == 0.6
    assert made.underspeed == 0.0


@pytest.mark.parametrize("level", [sp.RATES, sp.SURFACES_DIRECT])
def test_guidance_starts_anew_after_a_flight_without_it(level: float) -> None:
    """The integrals of an earlier flight are not flown again."""
    made = controller(down_m=-140.0, airspeed_m_s=18.0)
    run(made, 1000)
    write(made, level=level, throttle=0.5)
    run(made, 20)
    write(made, down_m=-100.0)
    run(made, 10)
    fresh = controller(level=level, throttle=0.5)
    run(fresh, 20)
    write(fresh, down_m=-100.0)
    run(fresh, 10)
    assert made.actuators[THROTTLE] == pytest.approx(fresh.actuators[THROTTLE], abs=1e-3)
    assert made.pitch_setpoint_rad == pytest.approx(fresh.pitch_setpoint_rad, abs=1e-3)


def test_guidance_runs_at_fifty_hertz() -> None:
    made = controller(heading_rad=0.5, down_m=-100.0)
    run(made, 5)
    rolls = []
    for _ in range(12):
        made.step()
        rolls.append(made.roll_setpoint_rad)
    assert np.flatnonzero(np.diff(rolls)).tolist() in ([0, 5, 10], [1, 6], [2, 7], [3, 8], [4, 9])


@pytest.mark.parametrize("airspeed", [8.0, 15.0, 20.0])
def test_surfaces_scale_with_airspeed(airspeed: float) -> None:
    made = controller(level=sp.RATES, throttle=0.4)
    made.setpoint[sp.RATES_FRD_RAD_S] = (0.5, 0.0, 0.0)
    made.nav[n.AIRSPEED_M_S] = made.nav[n.AIRSPEED_TRUE_M_S] = airspeed
    made.step()
    p = made.parameters
    ratio = 15.0 / airspeed
    assert made.actuators[AILERON] == pytest.approx(
        0.5 * (p.rate_roll_ff * ratio + p.rate_roll_p * ratio * ratio), rel=1e-6
    )


def test_turn_rate_of_a_coordinated_turn_is_requested() -> None:
    bank = math.radians(35.0)
    made = controller(roll_rad=bank, pitch_rad=0.0, throttle=0.5)
    level_flight(made.nav, roll=bank)
    run(made, 5)
    turn = 9.80665 * math.tan(bank) / 15.0
    assert made.rate_setpoint_frd_rad_s == pytest.approx(
        [0.0, turn * math.sin(bank), turn * math.cos(bank)], abs=1e-6
    )


def test_wings_level_and_the_present_height_when_nothing_is_given() -> None:
    made = controller()
    run(made, 500)
    assert made.roll_setpoint_rad == 0.0
    assert made.down_reference_m == pytest.approx(-100.0)
    assert made.velocity_setpoint_ned_m_s[2] == pytest.approx(0.0, abs=1e-9)
    assert made.airspeed_setpoint_m_s == 15.0


def test_bank_command_is_limited_in_size_and_rate() -> None:
    made = controller(heading_rad=math.pi / 2.0, down_m=-100.0)
    rolls = [made.roll_setpoint_rad]
    for _ in range(300):
        made.step()
        rolls.append(made.roll_setpoint_rad)
    slew = made.parameters.roll_slew_rad_s * 0.02
    assert np.diff(rolls).max() <= slew + 1e-9
    assert rolls[-1] == pytest.approx(made.roll_limit_rad)
    assert rolls[-1] == pytest.approx(math.atan(made.lateral_acceleration_setpoint_m_s2 / 9.80665), abs=0.6)
    write(made, heading_rad=math.pi / 2.0, down_m=-100.0, roll_limit_rad=0.1)
    run(made, 300)
    assert made.roll_setpoint_rad == pytest.approx(0.1)


def test_lateral_acceleration_alone_gives_its_bank() -> None:
    made = controller(lateral_acceleration_m_s2=-4.0, down_m=-100.0)
    run(made, 300)
    assert made.roll_setpoint_rad == pytest.approx(-math.atan(4.0 / 9.80665))
    assert math.isnan(made.heading_setpoint_rad)
    assert math.isnan(made.course_setpoint_rad)


def test_ground_speed_is_kept_up_against_the_wind() -> None:
    made = controller(course_rad=0.0, down_m=-100.0)
    made.nav[n.WIND_NED_M_S] = (-12.0, 0.0, 0.0)
    made.nav[n.VEL_NED_M_S] = (3.0, 0.0, 0.0)
    run(made, 10)
    assert made.airspeed_setpoint_m_s == pytest.approx(12.0 + made.parameters.ground_speed_min_m_s)


def test_switching_to_fly_starts_from_the_present_attitude() -> None:
    made = controller(level=sp.RATES, throttle=0.8)
    level_flight(made.nav, roll=0.5, pitch=0.1)
    run(made, 50)
    write(made, heading_rad=0.0, down_m=-100.0)
    made.step()
    assert made.roll_setpoint_rad == pytest.approx(0.5, abs=0.05)
    assert made.pitch_setpoint_rad == pytest.approx(0.1, abs=0.02)


def test_integrators_rest_on_the_ground() -> None:
    made = controller(roll_rad=0.3, pitch_rad=0.2, throttle=0.0)
    made.set_ground_contact(True)
    made.step()
    first = made.actuators.copy()
    run(made, 1000)
    assert made.actuators == pytest.approx(first)
    made.set_ground_contact(False)
    run(made, 250)
    assert made.actuators[AILERON] > first[AILERON] + 0.02


@pytest.mark.parametrize("yaw_deg", [-20.0, 15.0])
def test_wheels_and_rudder_steer_back_to_the_heading(yaw_deg: float) -> None:
    made = controller(roll_rad=0.0, pitch_rad=0.0, throttle=1.0, steering_heading_rad=0.0)
    level_flight(made.nav, yaw=math.radians(yaw_deg))
    made.set_ground_contact(True)
    made.step()
    assert made.actuators[STEERING] * yaw_deg < 0.0
    assert made.actuators[RUDDER] * yaw_deg < 0.0
    stick = controller(roll_rad=0.0, pitch_rad=0.0, throttle=0.0, yaw_stick=0.4)
    stick.step()
    assert stick.actuators[[STEERING, RUDDER]] == pytest.approx([0.4, 0.4], abs=1e-6)


def test_a_flare_flies_its_sink_rate_even_when_slow() -> None:
    """Throttle and a height rate: the pitch goes up as the aircraft sinks, whatever the airspeed."""
    made = controller(throttle=0.0, height_rate_m_s=-0.3, airspeed_m_s=15.0)
    made.change(pitch_damping=0.6)
    made.nav[n.AIRSPEED_M_S] = made.nav[n.AIRSPEED_TRUE_M_S] = 8.0
    made.nav[n.VEL_NED_M_S] = (8.0, 0.0, 1.5)
    run(made, 250)
    assert made.pitch_setpoint_rad > 0.04
    assert made.underspeed == 0.0
    write(made, throttle=0.0, height_rate_m_s=-0.3, pitch_min_rad=-0.1, pitch_max_rad=0.03)
    run(made, 250)
    assert made.pitch_setpoint_rad == pytest.approx(0.03)


def test_too_slow_means_nose_down_and_full_throttle() -> None:
    made = controller(down_m=-120.0)
    made.nav[n.AIRSPEED_M_S] = made.nav[n.AIRSPEED_TRUE_M_S] = 7.5
    run(made, 500)
    assert made.underspeed == 1.0
    assert made.pitch_setpoint_rad < 0.0
    assert made.actuators[THROTTLE] == 1.0
    write(made, down_m=-120.0, pitch_min_rad=0.2)  # the least pitch of a climb-out gives way
    run(made, 500)
    assert made.pitch_setpoint_rad < 0.0


def test_pitch_alone_leaves_the_airspeed_to_the_throttle() -> None:
    made = controller(pitch_rad=0.05, airspeed_m_s=18.0)
    run(made, 250)
    fast = made.actuators[THROTTLE]
    write(made, pitch_rad=0.05, airspeed_m_s=12.0)
    run(made, 250)
    assert made.pitch_setpoint_rad == 0.05
    assert made.actuators[THROTTLE] < fast - 0.1
    assert math.isnan(made.velocity_setpoint_ned_m_s[2])
    assert math.isnan(made.down_reference_m)


@pytest.mark.parametrize(("airspeed", "sign"), [(12.0, -1.0), (18.0, 1.0)])
def test_throttle_alone_leaves_the_airspeed_to_the_pitch(airspeed: float, sign: float) -> None:
    made = controller(throttle=1.0)
    made.nav[n.AIRSPEED_M_S] = made.nav[n.AIRSPEED_TRUE_M_S] = airspeed
    run(made, 250)
    assert sign * made.pitch_setpoint_rad > 0.02
    assert made.actuators[THROTTLE] == 1.0


def test_throttle_limit_and_slew() -> None:
    made = controller(down_m=-200.0, throttle_max=0.35)
    run(made, 1000)
    assert made.thrust == pytest.approx(0.35)
    made.change(throttle_slew_1_s=0.5)
    write(made, down_m=-200.0)
    before = made.thrust
    run(made, 50)  # 0.2 s
    assert made.thrust == pytest.approx(before + 0.1, abs=0.011)


def test_parameters_are_replaced_in_flight() -> None:
    made = controller(roll_rad=0.4, pitch_rad=0.0, throttle=0.5)
    run(made, 10)
    before = made.actuators[AILERON]
    made.set_parameters(FixedWingParameters(rate_roll_ff=1.0))
    made.step()
    assert made.actuators[AILERON] > 1.3 * before
    assert made.parameters.rate_roll_ff == 1.0
    assert made.hover_thrust == 0.5


def test_unknown_attitude_stops_the_propeller() -> None:
    made = controller(down_m=-120.0)
    run(made, 100)
    made.nav[n.EULER_RAD] = math.nan
    made.step()
    assert not made.actuators.any()


BAD = st.one_of(st.floats(allow_nan=True, allow_infinity=True), st.floats(-30.0, 30.0), st.just(math.nan))


@settings(max_examples=30, deadline=None)
@given(
    st.sampled_from([sp.RATES, sp.FLY, sp.SURFACES_DIRECT]),
    st.lists(BAD, min_size=sp.SETPOINT_SIZE, max_size=sp.SETPOINT_SIZE),
    st.lists(st.tuples(st.integers(0, n.NAV_SIZE - 1), BAD), max_size=6),
    st.booleans(),
)
def test_whatever_comes_in_what_goes_out_is_within_limits(
    level: float, setpoint: list[float], spoiled: list[tuple[int, float]], contact: bool
) -> None:
    made = controller()
    made.set_ground_contact(contact)
    made.setpoint[:] = setpoint
    made.setpoint[sp.LEVEL] = level
    for index, value in spoiled:
        made.nav[index] = value
    run(made, 30)
    assert np.isfinite(made.actuators).all()
    assert (np.abs(made.actuators) <= 1.0).all()
    assert (made.actuators[[THROTTLE, FLAPS, BRAKE]] >= 0.0).all()
    level_flight(made.nav)
    write(made, down_m=-100.0, heading_rad=0.0)
    made.set_ground_contact(False)
    run(made, 1500)  # nothing bad has stayed inside
    assert np.isfinite(made.attitude_setpoint).all()
    assert np.isfinite(made.actuators).all()
    assert abs(made.pitch_setpoint_rad) <= made.parameters.pitch_max_rad + 1e-9
    assert made.roll_setpoint_rad == pytest.approx(0.0, abs=1e-3)
    assert made.airspeed_error_m_s == pytest.approx(0.0, abs=0.1)
