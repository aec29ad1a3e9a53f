"""Gimbal: geometry against scipy and the paper, steadying, limits, rates, MAVLink's flags, measurements."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from pymavlink.dialects.v20 import all as mavlink
from scipy.spatial.transform import Rotation

from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.payload import LEVEL, Gimbal, GimbalFlags, GimbalParameters
from flightsim.payload.gimbal_kernel import joints_from_quaternion, quaternion_from_joints

Array = NDArray[np.float64]

STEP_US = 4000
PERFECT = {
    "jitter_rad": 0.0,
    "encoder_noise_rad": 0.0,
    "attitude_noise_rad": 0.0,
    "tilt_error_rad": 0.0,
    "heading_error_rad": 0.0,
    "gyro_noise_rad_s": 0.0,
}
BODY = GimbalFlags.NONE
NORTH = LEVEL | GimbalFlags.YAW_LOCK


def rotation(q: Array) -> Rotation:
    """scipy's, from w x y z."""
    return Rotation.from_quat(np.roll(q, -1))


def quaternion(r: Rotation) -> Array:
    return np.roll(r.as_quat(), 1)


def attitude(roll_deg: float, pitch_deg: float, yaw_deg: float) -> Array:
    return quaternion(Rotation.from_euler("ZYX", [yaw_deg, pitch_deg, roll_deg], degrees=True))


class Bench:
    """A gimbal on a vehicle whose attitude the test sets."""

    def __init__(self, parameters: GimbalParameters, seed: int = 1) -> None:
        self.truth = np.zeros(t.TRUTH_SIZE)
        self.truth[t.Q_NED_FROM_FRD] = (1.0, 0.0, 0.0, 0.0)
        self.gimbal = Gimbal(
            parameters, truth=self.truth, physics_rate_hz=250, seed=RandomStreams(seed).child("gimbal")
        )
        self.time_us = 0

    def run(self, seconds: float) -> "Bench":
        for _ in range(round(seconds * 250)):
            self.gimbal.step(self.time_us)
            self.time_us += STEP_US
        return self

    def euler_deg(self, q: Array | None = None) -> Array:
        """roll, pitch, yaw in NED."""
        q = self.gimbal.q_ned_from_gimbal if q is None else q
        angles: Array = rotation(q).as_euler("ZYX", degrees=True)[::-1]
        return angles


def three(**changes: float) -> GimbalParameters:
    return GimbalParameters(**(PERFECT | changes))  # type: ignore[arg-type]


def two(**changes: float) -> GimbalParameters:
    return GimbalParameters.two_axis(**(PERFECT | changes))


angles = st.floats(-3.1, 3.1)


@given(st.floats(-1.5, 1.5), angles, angles)
def test_joints_are_yaw_roll_pitch_from_the_body_outwards(roll: float, pitch: float, yaw: float) -> None:
    q, joints = np.zeros(4), np.zeros(3)
    quaternion_from_joints(roll, pitch, yaw, q)
    expected = Rotation.from_euler("ZXY", [yaw, roll, pitch])
    assert (rotation(q) * expected.inv()).magnitude() < 1e-9
    joints_from_quaternion(q, 3.0, 0.0, joints)
    np.testing.assert_allclose(joints, (roll, pitch, yaw), atol=1e-6)


@given(st.floats(-1.5, 1.5), angles)
def test_two_axes_are_azimuth_and_elevation_of_the_paper(elevation: float, azimuth: float) -> None:
    """Tolman et al. 2021: equation 39, and az = atan2(ly, lx), el = -asin(lz)."""
    q, joints = np.zeros(4), np.zeros(3)
    quaternion_from_joints(0.0, elevation, azimuth, q)
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    equation_39 = [[ce * ca, -sa, se * ca], [ce * sa, ca, se * sa], [-se, 0.0, ce]]
    np.testing.assert_allclose(rotation(q).as_matrix(), equation_39, atol=1e-12)
    joints_from_quaternion(q, 2.0, 0.0, joints)
    np.testing.assert_allclose(joints, (0.0, elevation, azimuth), atol=1e-6)


@pytest.mark.parametrize("flag", GimbalFlags, ids=lambda flag: str(flag.name))
def test_flags_have_mavlinks_numbers(flag: GimbalFlags) -> None:
    assert getattr(mavlink, f"GIMBAL_DEVICE_FLAGS_{flag.name}") == flag
    assert getattr(mavlink, f"GIMBAL_MANAGER_FLAGS_{flag.name}") == flag


@pytest.mark.parametrize(("roll", "pitch", "heading"), [(0, 0, 30), (25, 5, 110), (-30, -10, -150)])
@pytest.mark.parametrize("pitch_command", [-90.0, -45.0, 0.0])
def test_levelled_it_holds_the_horizon_and_follows_the_nose(
    roll: float, pitch: float, heading: float, pitch_command: float
) -> None:
    bench = Bench(three())
    bench.truth[t.Q_NED_FROM_FRD] = attitude(roll, pitch, heading)
    bench.gimbal.command(LEVEL, pitch_rad=math.radians(pitch_command))
    bench.run(3.0)
    expected = Rotation.from_euler("ZYX", [heading, pitch_command, 0.0], degrees=True)
    assert (rotation(bench.gimbal.q_ned_from_gimbal) * expected.inv()).magnitude() < 1e-6
    np.testing.assert_allclose(
        rotation(bench.gimbal.q_frd_from_gimbal).as_matrix(),
        (rotation(bench.truth[t.Q_NED_FROM_FRD]).inv() * expected).as_matrix(),
        atol=1e-6,
    )


def test_unlocked_it_turns_with_the_body() -> None:
    bench = Bench(three())
    bench.truth[t.Q_NED_FROM_FRD] = attitude(20.0, -10.0, 70.0)
    bench.gimbal.command(BODY, pitch_rad=-0.5, yaw_rad=0.4)
    bench.run(3.0)
    expected = Rotation.from_euler("ZYX", [0.4, -0.5, 0.0])
    assert (rotation(bench.gimbal.q_frd_from_gimbal) * expected.inv()).magnitude() < 1e-6


def test_two_axes_point_the_optical_axis_and_let_the_picture_lean() -> None:
    bench = Bench(two())
    bench.truth[t.Q_NED_FROM_FRD] = attitude(30.0, 5.0, 40.0)
    bench.gimbal.command(NORTH, pitch_rad=-0.6, yaw_rad=2.0)
    bench.run(5.0)
    line_of_sight = rotation(bench.gimbal.q_ned_from_gimbal).apply([1.0, 0.0, 0.0])
    wanted = Rotation.from_euler("ZYX", [2.0, -0.6, 0.0]).apply([1.0, 0.0, 0.0])
    np.testing.assert_allclose(line_of_sight, wanted, atol=1e-6)
    assert abs(bench.euler_deg()[0]) > 10.0
    assert bench.gimbal.joints_rad[0] == 0.0


@pytest.mark.parametrize("parameters", [three(), two()], ids=["three axes", "two axes"])
@pytest.mark.sampled(1)
def test_locked_it_looks_at_the_same_place_while_the_vehicle_moves(parameters: GimbalParameters) -> None:
    """A turning, rolling vehicle: after the start the line of sight stands still, as in an orbit."""
    bench = Bench(parameters)
    bench.gimbal.command(NORTH, pitch_rad=-0.7, yaw_rad=1.0)
    bench.run(3.0)
    wanted = Rotation.from_euler("ZYX", [1.0, -0.7, 0.0]).apply([1.0, 0.0, 0.0])
    worst = 0.0
    for step in range(250 * 20):
        s = step / 250.0
        bench.truth[t.Q_NED_FROM_FRD] = attitude(20.0 * math.sin(s), 5.0 * math.sin(1.7 * s), 15.0 * s)
        if bench.gimbal.step(bench.time_us):
            sight = rotation(bench.gimbal.q_ned_from_gimbal).apply([1.0, 0.0, 0.0])
            worst = max(worst, float(np.linalg.norm(sight - wanted)))
        bench.time_us += STEP_US
    assert worst < 1e-6


def test_approach_is_first_order_then_rate_limited() -> None:
    parameters = three(time_constant_s=0.2, max_rate_rad_s=1.0)
    bench = Bench(parameters).run(0.1)
    bench.gimbal.command(LEVEL, pitch_rad=-0.1)
    bench.run(0.2)
    assert bench.gimbal.joints_rad[1] == pytest.approx(-0.1 * (1.0 - math.exp(-1.0)), rel=1e-9)
    bench.run(3.0)
    bench.gimbal.command(LEVEL, pitch_rad=-1.5)
    before = float(bench.gimbal.joints_rad[1])
    bench.run(0.5)
    assert bench.gimbal.joints_rad[1] == pytest.approx(before - 0.5, abs=1e-9)
    assert bench.gimbal.rates_gimbal_rad_s[1] == pytest.approx(-1.0)


def test_limits_of_every_joint() -> None:
    parameters = three(yaw_limit_rad=1.0, roll_limit_rad=0.3, pitch_min_rad=-0.8, pitch_max_rad=0.2)
    bench = Bench(parameters)
    bench.gimbal.command(BODY, roll_rad=1.0, pitch_rad=-1.2, yaw_rad=2.0)
    bench.run(4.0)
    assert bench.gimbal.limits_reached == (True, True, True)
    low, high = np.array([-0.3, -0.8, -1.0]), np.array([0.3, 0.2, 1.0])
    assert np.all(bench.gimbal.joints_rad >= low - 1e-12)
    assert np.all(bench.gimbal.joints_rad <= high + 1e-12)
    bench.gimbal.command(BODY, pitch_rad=0.1)
    bench.run(4.0)
    assert bench.gimbal.limits_reached == (False, False, False)
    np.testing.assert_allclose(bench.gimbal.joints_rad, (0.0, 0.1, 0.0), atol=1e-6)


def test_yaw_without_end_takes_the_short_way_and_a_stop_makes_it_go_back() -> None:
    endless = Bench(three())
    endless.gimbal.command(BODY, yaw_rad=math.radians(170.0))
    endless.run(4.0)
    endless.gimbal.command(BODY, yaw_rad=math.radians(-170.0))
    endless.run(0.1)
    assert abs(endless.gimbal.joints_rad[2]) > math.radians(170.0)
    stopped = Bench(three(yaw_limit_rad=math.radians(175.0)))
    stopped.gimbal.command(BODY, yaw_rad=math.radians(170.0))
    stopped.run(4.0)
    stopped.gimbal.command(BODY, yaw_rad=math.radians(-170.0))
    stopped.run(1.0)
    assert abs(stopped.gimbal.joints_rad[2]) < math.radians(60.0)
    stopped.run(4.0)
    assert stopped.gimbal.joints_rad[2] == pytest.approx(math.radians(-170.0), abs=1e-3)


def test_rates_turn_it_and_stop_at_the_limit() -> None:
    bench = Bench(three())
    bench.gimbal.command(LEVEL, pitch_rate_rad_s=-0.2, yaw_rate_rad_s=0.3)
    bench.run(2.0)
    lag_s = bench.gimbal.parameters.time_constant_s
    roll, pitch, yaw = np.radians(bench.euler_deg())
    assert roll == pytest.approx(0.0, abs=1e-6)
    assert pitch == pytest.approx(-0.4, abs=0.02)
    assert yaw == pytest.approx(0.6, abs=0.3 * (lag_s + 0.04))
    bench.gimbal.command(LEVEL, pitch_rad=math.nan, yaw_rad=math.nan)
    bench.run(2.0)
    held = bench.euler_deg().copy()
    np.testing.assert_allclose(bench.run(2.0).euler_deg(), held, atol=1e-3)
    np.testing.assert_allclose(np.radians(held), (0.0, -0.4, 0.6), atol=0.02)
    bench.gimbal.command(LEVEL, pitch_rad=math.nan, pitch_rate_rad_s=-2.0)
    bench.run(5.0)
    assert bench.gimbal.joints_rad[1] == pytest.approx(bench.gimbal.parameters.pitch_min_rad, abs=1e-6)


@pytest.mark.parametrize(
    ("flags", "given_deg", "held_deg", "after_turn_deg"),
    [
        (LEVEL, 30.0, 80.0, 100.0),
        (NORTH, 30.0, 30.0, 30.0),
        (NORTH | GimbalFlags.YAW_IN_VEHICLE_FRAME, 30.0, 80.0, 80.0),
        (LEVEL | GimbalFlags.YAW_IN_EARTH_FRAME, 30.0, 30.0, 50.0),
    ],
    ids=["follow", "lock", "lock, given from the nose", "follow, given from north"],
)
def test_frames_of_the_yaw_command(
    flags: GimbalFlags, given_deg: float, held_deg: float, after_turn_deg: float
) -> None:
    """Heading 50, then 70 degrees."""
    bench = Bench(three())
    bench.truth[t.Q_NED_FROM_FRD] = attitude(0.0, 0.0, 50.0)
    bench.run(0.1)
    bench.gimbal.command(flags, yaw_rad=math.radians(given_deg))
    bench.run(3.0)
    assert bench.euler_deg()[2] == pytest.approx(held_deg, abs=1e-3)
    bench.truth[t.Q_NED_FROM_FRD] = attitude(0.0, 0.0, 70.0)
    bench.run(3.0)
    assert bench.euler_deg()[2] == pytest.approx(after_turn_deg, abs=1e-3)


def test_keeping_the_angles_while_the_lock_changes_keeps_the_sight() -> None:
    bench = Bench(three())
    bench.truth[t.Q_NED_FROM_FRD] = attitude(0.0, 0.0, 50.0)
    bench.gimbal.command(LEVEL, pitch_rad=-0.5, yaw_rad=0.3)
    bench.run(3.0)
    sight = bench.euler_deg().copy()
    bench.gimbal.command(NORTH, pitch_rad=math.nan, yaw_rad=math.nan)
    np.testing.assert_allclose(bench.run(2.0).euler_deg(), sight, atol=1e-3)


@pytest.mark.parametrize("flag", [GimbalFlags.NEUTRAL, GimbalFlags.RETRACT])
def test_neutral_and_retracted(flag: GimbalFlags) -> None:
    bench = Bench(three())
    bench.truth[t.Q_NED_FROM_FRD] = attitude(15.0, 5.0, 50.0)
    bench.gimbal.command(NORTH, pitch_rad=-0.5, yaw_rad=0.3)
    bench.run(2.0)
    bench.gimbal.command(flag)
    bench.run(3.0)
    np.testing.assert_allclose(bench.gimbal.joints_rad, 0.0, atol=1e-6)
    assert bench.gimbal.retracted == (flag == GimbalFlags.RETRACT)


def test_angular_velocity_is_that_of_the_attitude() -> None:
    """Finite differences of the true attitude while vehicle and joints turn."""
    bench = Bench(three())
    bench.gimbal.command(BODY, pitch_rate_rad_s=-0.3, yaw_rate_rad_s=0.8, roll_rad=0.2)
    previous: Array | None = None
    errors = []
    rate = np.array([0.3, -0.2, 0.4])
    for step in range(250):
        bench.truth[t.RATES_FRD_RAD_S] = rate
        bench.truth[t.Q_NED_FROM_FRD] = quaternion(Rotation.from_rotvec(rate * step / 250.0))
        if bench.gimbal.step(step * STEP_US):
            q = bench.gimbal.q_ned_from_gimbal.copy()
            if previous is not None and step > 100:
                turned = (rotation(previous).inv() * rotation(q)).as_rotvec() * 50.0
                errors.append(np.linalg.norm(turned - bench.gimbal.rates_gimbal_rad_s))
            previous = q
    assert len(errors) > 20 and max(errors) < 0.02  # the mean of a step against its end
    np.testing.assert_array_equal(bench.gimbal.measured_rates_rad_s, bench.gimbal.rates_gimbal_rad_s)


def test_what_it_measures_is_honest_about_its_errors() -> None:
    """Many gimbals: tilt and heading errors as specified; it steadies by its own wrong reference."""
    parameters = GimbalParameters(tilt_error_rad=0.01, heading_error_rad=0.03)
    tilts, headings, tracking = [], [], []
    for seed in range(150):
        bench = Bench(parameters, seed)
        bench.gimbal.command(NORTH, pitch_rad=-0.5, yaw_rad=0.7)
        bench.run(1.5)
        gimbal = bench.gimbal
        error = (
            rotation(gimbal.measured_q_ned_from_gimbal) * rotation(gimbal.q_ned_from_gimbal).inv()
        ).as_rotvec()
        tilts.extend(error[:2])
        headings.append(error[2])
        wanted = Rotation.from_euler("ZYX", [0.7, -0.5, 0.0])
        tracking.append((rotation(gimbal.measured_q_ned_from_gimbal) * wanted.inv()).magnitude())
    assert np.std(tilts) == pytest.approx(0.01, rel=0.25)
    assert np.std(headings) == pytest.approx(0.03, rel=0.25)
    assert max(tracking) < 0.006  # jitter and noise only


def test_attitude_from_the_nose_is_that_from_north_turned_back() -> None:
    bench = Bench(three())
    bench.truth[t.Q_NED_FROM_FRD] = attitude(20.0, 10.0, 120.0)
    bench.gimbal.command(NORTH, pitch_rad=-0.5, yaw_rad=2.5)
    bench.run(3.0)
    seen = rotation(bench.gimbal.measured_q_heading_from_gimbal)
    expected = Rotation.from_euler("z", -120.0, degrees=True) * rotation(bench.gimbal.q_ned_from_gimbal)
    assert (seen * expected.inv()).magnitude() < 1e-9
    np.testing.assert_array_equal(bench.gimbal.measured_joints_rad, bench.gimbal.joints_rad)


def test_same_seed_same_bits() -> None:
    def fly(seed: int) -> bytes:
        bench = Bench(GimbalParameters(), seed)
        bench.gimbal.command(LEVEL, pitch_rad=-0.5)
        bench.run(8.0)
        return bench.gimbal.measured_q_ned_from_gimbal.tobytes() + bench.gimbal.joints_rad.tobytes()

    assert fly(1) == fly(1) != fly(2)


@pytest.mark.parametrize(
    ("flags", "options", "named"),
    [
        (128, {}, "gimbal flags 128"),
        (GimbalFlags.YAW_IN_EARTH_FRAME | GimbalFlags.YAW_IN_VEHICLE_FRAME, {}, "not in both"),
        (LEVEL, {"pitch_rad": math.inf}, "pitch_rad = inf"),
        (LEVEL, {"yaw_rate_rad_s": -math.inf}, "yaw_rate_rad_s = -inf"),
        (LEVEL, {"roll_rad": math.nan}, "roll_rad = nan"),
    ],
)
def test_bad_commands_change_nothing(flags: int, options: dict[str, float], named: str) -> None:
    bench = Bench(three())
    with pytest.raises(ValueError, match=named):
        bench.gimbal.command(flags, **options)
    bench.run(1.0)
    np.testing.assert_allclose(bench.gimbal.joints_rad, 0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"axes": 1}, "axes = 1"),
        ({"pitch_min_rad": 1.0, "pitch_max_rad": 0.5}, r"pitch_min_rad, pitch_max_rad = 1\.0, 0\.5"),
        ({"axes": 2, "pitch_min_rad": -2.0}, r"pitch_min_rad, pitch_max_rad = -2\.0"),
        ({"roll_limit_rad": 1.6}, r"roll_limit_rad = 1\.6"),
        ({"max_rate_rad_s": 0.0}, r"max_rate_rad_s 0"),
    ],
)
def test_bad_parameters_are_named(changes: dict[str, float], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        GimbalParameters(**changes)  # type: ignore[arg-type]


def test_a_rate_that_does_not_divide_is_refused() -> None:
    with pytest.raises(ValueError, match="60 Hz does not divide the physics rate of 250 Hz"):
        Bench(GimbalParameters(rate_hz=60))
