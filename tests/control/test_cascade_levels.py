"""Where the multicopter's cascade starts at each level, what it fills in, and what it forgets at rest."""

import math
from typing import get_type_hints

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot_bridge.control.multicopter import MulticopterController, MulticopterParameters
from autopilot_bridge.control.multicopter import layout as c
from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.control.multicopter.attitude import attitude_control
from autopilot_bridge.control.multicopter.mixer import ALLOCATION, command_from_thrust
from autopilot_bridge.navigation import layout as n
from flightsim.foundation.atmosphere import GRAVITY_M_S2 as G
from flightsim.foundation.records import new_record
from flightsim.foundation.rotations import quaternion_from_euler
from tests.control.test_attitude_law import packed
from tests.rotations import rotation_matrix

Array = NDArray[np.float64]
RATE_HZ = 250.0
YAW = 0.8


class Rig:
    """A controller in the air, 20 m up, nose at 0.8 rad."""

    def __init__(self, level: float, parameters: MulticopterParameters | None = None) -> None:
        self.nav = np.zeros(n.NAV_SIZE)
        quaternion_from_euler(0.0, 0.0, YAW, self.nav[n.Q_NED_FROM_FRD])
        self.nav[n.YAW] = YAW
        self.nav[n.POS + 2] = -20.0
        self.nav[n.FORCE + 2] = -G
        self.controller = MulticopterController(parameters, physics_rate_hz=RATE_HZ, nav=self.nav)
        self.setpoint = self.controller.setpoint
        self.setpoint[sp.LEVEL] = level
        self.state = self.controller._state
        self.state.airborne = 1.0

    def step(self, steps: int = 1) -> Array:
        for _ in range(steps):
            self.controller.step()
        return self.controller.actuators

    def rates(self) -> Array:
        return self.controller.rate_setpoint_frd_rad_s.copy()


def test_rates_go_to_the_rate_loop_within_their_limits() -> None:
    rig = Rig(sp.RATES)
    rig.setpoint[sp.RATES_FRD_RAD_S] = 0.5, math.nan, -9.0
    rig.setpoint[sp.THRUST] = 0.4
    rig.step()
    p = rig.controller.parameters
    assert rig.rates() == pytest.approx([0.5, 0.0, -p.yaw_rate_max_rad_s])
    assert rig.controller.thrust == pytest.approx(0.4)


def test_motors_are_mixed_from_torques_and_thrust() -> None:
    """One step from rest: P and I of the rate loop, the yaw torque through its low-pass, the thrust curve."""
    rig = Rig(sp.RATES)
    rig.setpoint[sp.RATES_FRD_RAD_S] = 0.3, -0.2, 0.1
    rig.setpoint[sp.THRUST] = 0.5
    actuators = rig.step()
    p = rig.controller.parameters
    dt = 1.0 / RATE_HZ
    share = dt / (dt + 1.0 / (2.0 * math.pi * p.yaw_torque_cutoff_hz))
    torques = np.array([p.rate_roll_p * 0.3, -p.rate_pitch_p * 0.2, share * p.rate_yaw_p * 0.1])
    motors = ALLOCATION @ [*torques, 0.5]
    expected = [command_from_thrust(motor, p.thrust_model_factor) for motor in motors]
    np.testing.assert_allclose(actuators[:4], expected, rtol=1e-9)
    assert not actuators[4:].any()
    assert rig.controller.thrust == pytest.approx(0.5)
    # without the low-pass all of the torque is given at once
    sudden = Rig(sp.RATES, MulticopterParameters(yaw_torque_cutoff_hz=0.0))
    sudden.setpoint[:] = rig.setpoint
    motors = ALLOCATION @ [*torques[:2], p.rate_yaw_p * 0.1, 0.5]
    expected = [command_from_thrust(motor, p.thrust_model_factor) for motor in motors]
    np.testing.assert_allclose(sudden.step()[:4], expected, rtol=1e-9)


@pytest.mark.parametrize("scale", [1.0, 2.0, -0.5])
def test_attitude_goes_to_the_attitude_loop_whatever_its_norm(scale: float) -> None:
    rig = Rig(sp.ATTITUDE)
    q = np.zeros(4)
    quaternion_from_euler(0.05, -0.08, 0.9, q)
    rig.setpoint[sp.Q_NED_FROM_FRD] = scale * q
    rig.setpoint[sp.RATES_FRD_RAD_S] = 0.02, math.nan, -0.03
    rig.setpoint[sp.YAW_RATE_RAD_S], rig.setpoint[sp.THRUST] = 0.1, 0.5
    rig.step()
    expected = np.zeros(3)
    attitude_control(rig.nav[n.Q_NED_FROM_FRD], q, 0.1, packed(), expected, np.zeros(8))
    np.testing.assert_allclose(rig.rates(), expected + np.array([0.02, 0.0, -0.03]), atol=1e-9)
    np.testing.assert_allclose(np.abs(rig.controller.attitude_setpoint), np.abs(q), atol=1e-12)


@pytest.mark.parametrize("bad", [0.0, math.nan, 0.1, math.inf])
def test_no_attitude_is_level_flight_at_the_present_heading(bad: float) -> None:
    rig = Rig(sp.ATTITUDE)
    rig.setpoint[sp.Q_NED_FROM_FRD] = bad
    rig.setpoint[sp.THRUST] = 0.5
    rig.step()
    level = np.zeros(4)
    quaternion_from_euler(0.0, 0.0, YAW, level)
    if bad == 0.1:
        rig.setpoint[sp.Q_NED_FROM_FRD] = 0.15  # squared norm 0.09: no attitude either
        rig.step()
    np.testing.assert_allclose(rig.controller.attitude_setpoint, level, atol=1e-12)
    np.testing.assert_allclose(rig.rates(), 0.0, atol=1e-9)


@pytest.mark.parametrize(("given", "flown"), [(0.4, 0.4), (1.7, 1.0), (-0.3, 0.0)])
def test_given_thrust_is_flown_and_the_vertical_loop_forgets(given: float, flown: float) -> None:
    rig = Rig(sp.ATTITUDE)
    rig.state.vel_integral = rig.state.bump[2] = 0.5
    rig.setpoint[sp.THRUST] = given
    rig.step()
    assert rig.state.thrust_setpoint == flown
    assert math.isnan(rig.state.acc_setpoint[2])
    assert not rig.state.vel_integral.any()
    assert rig.state.bump[2] == 0.0


@pytest.mark.parametrize(
    ("down_m", "velocity", "acceleration", "flown"),
    [
        (-21.0, math.nan, math.nan, -1.0),
        (-21.0, -0.4, math.nan, -1.4),
        (math.nan, 0.7, math.nan, 0.7),
        (math.nan, math.nan, math.nan, 0.0),
        (-50.0, math.nan, math.nan, -3.0),
        (10.0, math.nan, math.nan, 1.5),
        (math.nan, math.nan, 0.3, math.nan),
    ],
)
def test_without_thrust_the_vertical_part_of_the_trajectory_is_flown(
    down_m: float, velocity: float, acceleration: float, flown: float
) -> None:
    rig = Rig(sp.ATTITUDE)
    rig.setpoint[sp.POS + 2], rig.setpoint[sp.VEL + 2] = down_m, velocity
    rig.setpoint[sp.ACC + 2] = acceleration
    rig.step()
    assert rig.controller.velocity_setpoint_ned_m_s[2] == pytest.approx(flown, nan_ok=True)


@pytest.mark.parametrize(("tilt", "lift"), [(0.0, 1.0), (0.6, math.cos(0.6)), (1.4, 0.5)])
def test_collective_makes_up_for_the_tilt(tilt: float, lift: float) -> None:
    rig = Rig(sp.ATTITUDE)
    quaternion_from_euler(tilt, 0.0, YAW, rig.nav[n.Q_NED_FROM_FRD])
    rig.state.last_level = sp.ATTITUDE  # flown so for a while, and the thrust was the setpoint's
    rig.state.thrust_given = rig.state.thrust_lagged = 0.45
    rig.nav[n.FORCE + 2] = -G
    rig.step()
    assert rig.state.thrust_setpoint == pytest.approx(0.45 / lift, rel=1e-3)


def test_trajectory_runs_at_the_position_rate() -> None:
    rig = Rig(sp.TRAJECTORY)
    rig.setpoint[sp.VEL_NED_M_S] = 0.0
    rig.step()
    setpoints = []
    for k in range(8):
        rig.nav[n.VEL] = 0.1 * (k + 1)
        rig.step()
        setpoints.append(rig.state.acc_setpoint[0])
    changed = np.flatnonzero(np.diff(setpoints))
    assert (changed + 1).tolist() == [3, 7]  # every fourth step of 250 Hz: 62.5 Hz
    rig.setpoint[sp.LEVEL] = sp.ATTITUDE
    rig.step()
    rig.setpoint[sp.LEVEL] = sp.TRAJECTORY
    before = rig.state.vel_setpoint[0]
    rig.setpoint[sp.VEL] = 2.0
    rig.step()  # and at once where the level changes
    assert rig.state.vel_setpoint[0] != before


@pytest.mark.parametrize(("rate_hz", "divisor"), [(50.0, 1.0), (62.5, 1.0), (250.0, 4.0), (400.0, 6.0)])
def test_position_rate_is_a_divisor_of_the_physics_rate(rate_hz: float, divisor: float) -> None:
    controller = MulticopterController(physics_rate_hz=rate_hz, nav=np.zeros(n.NAV_SIZE))
    assert controller._state.divisor == divisor
    assert controller._state.dt == pytest.approx(1.0 / rate_hz)


@pytest.mark.parametrize("rate_hz", [49.9, 4000.1])
def test_other_physics_rates_are_refused(rate_hz: float) -> None:
    with pytest.raises(ValueError, match="physics_rate_hz"):
        MulticopterController(physics_rate_hz=rate_hz, nav=np.zeros(n.NAV_SIZE))
    MulticopterController(physics_rate_hz=4000.0, nav=np.zeros(n.NAV_SIZE))


@pytest.mark.parametrize("level", [sp.OFF, sp.IDLE])
def test_at_rest_everything_starts_again(level: float) -> None:
    rig = Rig(sp.TRAJECTORY)
    rig.setpoint[sp.VEL_NED_M_S] = 2.0, 1.0, -1.0
    rig.step(200)
    hover = rig.controller.hover_thrust
    rig.nav[n.RATES_FRD_RAD_S] = 0.1, math.nan, 0.3
    rig.setpoint[sp.LEVEL] = level
    actuators = rig.step()
    idle = rig.controller.parameters.motor_idle if level == sp.IDLE else 0.0
    assert actuators.tolist() == [idle] * 4 + [0.0] * (len(actuators) - 4)
    expected = new_record(c.MulticopterState)
    expected.counter = 4.0  # the position loop runs at the first step
    expected.start_down_m = -20.0
    expected.q_setpoint[0] = 1.0
    expected.rate_previous[:] = 0.1, 0.0, 0.3
    kept = {"dt", "divisor", "hover", "hover_variance", "motor_thrust"}
    for name in set(get_type_hints(c.MulticopterState)) - kept:
        np.testing.assert_allclose(getattr(rig.state, name), getattr(expected, name), err_msg=name)
    assert rig.controller.hover_thrust == hover
    assert rig.controller.thrust == 0.0
    assert rig.state.thrust_lagged == 0.0


def test_take_off_from_an_unknown_height_counts_from_zero() -> None:
    rig = Rig(sp.IDLE)
    rig.nav[n.POS + 2] = math.nan
    rig.step()
    assert rig.state.start_down_m == 0.0


@pytest.mark.parametrize("place", [n.Q, n.Q + 1, n.Q + 2, n.Q + 3, n.RATES, n.RATES + 1, n.RATES + 2])
@pytest.mark.parametrize("level", [sp.RATES, sp.ATTITUDE, sp.TRAJECTORY])
def test_without_attitude_or_rates_the_motors_idle(place: int, level: float) -> None:
    rig = Rig(level)
    rig.step()
    rig.nav[place] = math.nan
    assert rig.step()[:4].tolist() == [rig.controller.parameters.motor_idle] * 4
    assert np.isfinite(rig.state.rate_integral).all()
    assert np.isfinite(rig.state.rate_derivative).all()
    assert np.isfinite(rig.controller.attitude_setpoint).all()


def test_integrators_wait_on_the_ground_until_the_thrust_lifts() -> None:
    """The legs hold the vehicle: an integrator would only store a kick for the take-off."""
    for thrust, airborne, integrates in ((0.2, 0.0, False), (0.35, 0.0, True), (0.2, 1.0, True)):
        rig = Rig(sp.RATES)
        rig.state.airborne = airborne
        rig.nav[n.POS + 2] = 0.0
        rig.state.start_down_m = 0.0
        rig.setpoint[sp.RATES_FRD_RAD_S] = 0.1
        rig.setpoint[sp.THRUST] = thrust
        rig.step()
        assert bool(rig.state.rate_integral[0]) is integrates


def test_start_of_the_state() -> None:
    controller = MulticopterController(physics_rate_hz=RATE_HZ, nav=np.zeros(n.NAV_SIZE))
    assert controller.attitude_setpoint.tolist() == [1.0, 0.0, 0.0, 0.0]
    assert controller.hover_thrust == MulticopterParameters().hover_thrust
    assert controller.setpoint[sp.LEVEL] == sp.OFF
    assert controller.thrust == 0.0
    for contact in (True, False):
        controller.set_ground_contact(contact)
        assert controller._state.ground_contact == float(contact)


def test_hover_thrust_is_the_parameter_where_it_is_not_estimated() -> None:
    controller = MulticopterController(physics_rate_hz=RATE_HZ, nav=np.zeros(n.NAV_SIZE))
    controller.change(hover_thrust=0.6)
    assert controller.hover_thrust == MulticopterParameters().hover_thrust  # the estimate is kept
    controller.change(use_hover_thrust_estimate=False)
    assert controller.hover_thrust == 0.6


def test_trajectory_flies_its_thrust_vector() -> None:
    rig = Rig(sp.TRAJECTORY)
    rig.setpoint[sp.VEL_NED_M_S] = 0.0
    rig.setpoint[sp.ACC_NED_M_S2] = 1.0, -0.5, 0.0
    rig.state.last_level = sp.TRAJECTORY
    rig.step()
    down = rotation_matrix(rig.controller.attitude_setpoint)[:, 2]
    np.testing.assert_allclose(down / down[2], [-1.0 / G, 0.5 / G, 1.0], atol=1e-6)
