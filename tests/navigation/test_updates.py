"""Every measurement update against the textbook's Kalman filter with dense matrices.

State, covariance, history and measurements are random; each row of H is written down here from what its
sensor measures. A group of axes is updated at once, where the kernels go scalar by scalar.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot_bridge.navigation import air_fusion, covariance, external_fusion, fusion, mechanisation
from autopilot_bridge.navigation import states as s
from flightsim.foundation.random_streams import RandomStreams
from tests.rotations import rotation_matrix

Array = NDArray[np.float64]
WIDE_GATE = 1e4
DELAY_S = 0.13
ROW = 2
"""Of the history, at which the delayed measurements were taken."""
SIZES = pytest.mark.parametrize("size", [s.ERROR_SIZE, s.ERROR_SIZE_WITH_WIND], ids=["copter", "wing"])


def cross_matrix(v: Array) -> Array:
    """[v]x, so that [v]x w = v x w."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def turned(q: Array, theta_ned_rad: Array) -> Array:
    """exp([theta]x) applied to the attitude q, for a small theta."""
    angle = float(np.linalg.norm(theta_ned_rad))
    axis = theta_ned_rad / angle if angle else np.zeros(3)
    x = np.array([math.cos(0.5 * angle), *(math.sin(0.5 * angle) * axis)])
    return np.array([x[0] * q[0] - x[1:] @ q[1:], *(x[0] * q[1:] + q[0] * x[1:] + np.cross(x[1:], q[1:]))])


@dataclass
class Case:
    """A filter in flight, and the textbook's filter beside it."""

    size: int
    seed: int = 7
    p: Array = field(init=False)
    core: Array = field(init=False)
    history: Array = field(init=False)
    work: Array = field(init=False)

    def __post_init__(self) -> None:
        rng = RandomStreams(self.seed).generator("update")
        root = rng.normal(size=(self.size, self.size)) * 0.02
        self.p = root @ root.T + 1e-4 * np.eye(self.size)
        core = self.core = np.zeros(s.CORE_SIZE)
        core[: self.size + 1] = rng.normal(size=self.size + 1) * 0.3
        core[s.Q : s.Q + 4] = rng.normal(size=4)
        core[s.Q : s.Q + 4] /= np.linalg.norm(core[s.Q : s.Q + 4])
        core[s.X_VEL : s.X_VEL + 3] = 14.0, -6.0, 1.5
        core[s.X_POS : s.X_POS + 3] = 30.0, 40.0, -50.0
        core[s.CORRECTION_POS : s.CORRECTION_POS + 3] = 0.7, -1.1, 0.4
        core[s.CORRECTION_VEL : s.CORRECTION_VEL + 3] = -0.2, 0.5, 0.3
        core[s.GRAVITY] = 9.81
        mechanisation.refresh_rotation(core)
        self.history = rng.normal(size=(4, s.HISTORY_COLUMNS))
        self.history[:, s.HISTORY_VEL : s.HISTORY_VEL + 3] = core[s.X_VEL : s.X_VEL + 3] + rng.normal(
            size=(4, 3)
        )
        for row in self.history[:, s.HISTORY_Q : s.HISTORY_Q + 4]:
            row /= np.linalg.norm(row)
        self.work = np.zeros(s.WORK_SIZE)
        self.expected_p = self.p.copy()
        self.expected_dx = np.zeros(self.size)

    @property
    def r_now(self) -> Array:
        return rotation_matrix(self.core[s.Q : s.Q + 4])

    @property
    def r_past(self) -> Array:
        return rotation_matrix(self.history[ROW, s.HISTORY_Q : s.HISTORY_Q + 4])

    @property
    def past_pos(self) -> Array:
        """Position at the time of the measurement, as the filter sees it now."""
        return (
            self.history[ROW, s.HISTORY_POS : s.HISTORY_POS + 3]
            + self.core[s.CORRECTION_POS : s.CORRECTION_POS + 3]
        )

    @property
    def past_vel(self) -> Array:
        return (
            self.history[ROW, s.HISTORY_VEL : s.HISTORY_VEL + 3]
            + self.core[s.CORRECTION_VEL : s.CORRECTION_VEL + 3]
        )

    def rows(self, **blocks: Array | float) -> Array:
        """H of three axes: 3 x 3 blocks by the first state's name, or a multiple of the identity."""
        h = np.zeros((3, self.size))
        for name, block in blocks.items():
            first = getattr(s, name)
            h[:, first : first + 3] = np.eye(3) * block if isinstance(block, float) else block
        return h

    def position_rows(self, *, by_gps: bool) -> Array:
        """p(t - d) = p - d v; a GPS adds its own error."""
        return self.rows(POS=1.0, VEL=-DELAY_S, GPS_ERROR=1.0 if by_gps else 0.0)

    def velocity_rows(self) -> Array:
        """v(t - d) error = v error + u x theta + d R b, u the integral of the specific force since."""
        u = self.core[s.X_VEL : s.X_VEL + 3] - self.past_vel - [0.0, 0.0, 9.81 * DELAY_S]
        return self.rows(VEL=1.0, ATT=cross_matrix(u), ACCEL_BIAS=DELAY_S * self.r_now)

    def expect(self, h: Array, innovation: Array, variance: Array, gate: float = WIDE_GATE) -> float:
        """Update the textbook's filter; returns the worst innovation over its gate."""
        left = innovation - h @ self.expected_dx
        spread = h @ self.expected_p @ h.T + np.diag(variance)
        ratio = float((np.abs(left) / (gate * np.sqrt(np.diag(spread)))).max())
        if ratio <= 1.0:
            gain = self.expected_p @ h.T @ np.linalg.inv(spread)
            self.expected_dx = self.expected_dx + gain @ left
            self.expected_p = self.expected_p - gain @ h @ self.expected_p
        return ratio

    def expect_wind_only(self, h: Array, innovation: Array, variance: float) -> None:
        """Schmidt's update: a gain for the wind, the other states are considered. Joseph's form."""
        left = innovation - h @ self.expected_dx
        spread = h @ self.expected_p @ h.T + variance
        gain = self.expected_p @ h.T / spread
        gain[: s.WIND] = 0.0
        self.expected_dx = self.expected_dx + gain @ left
        rest = np.eye(self.size) - gain @ h
        self.expected_p = rest @ self.expected_p @ rest.T + variance * gain @ gain.T

    def check(self, before: Array) -> None:
        """The covariance, and the nominal state with the error estimate injected."""
        np.testing.assert_allclose(self.p, self.expected_p, rtol=1e-8, atol=1e-10)
        np.testing.assert_array_equal(self.p, self.p.T)
        moved = self.core[4 : self.size + 1] - before[4 : self.size + 1]
        np.testing.assert_allclose(moved, self.expected_dx[3:], rtol=1e-8, atol=1e-10)
        q = turned(before[s.Q : s.Q + 4], self.expected_dx[:3])
        np.testing.assert_allclose(self.core[s.Q : s.Q + 4], q, atol=1e-5)
        for correction, state in ((s.CORRECTION_POS, s.POS), (s.CORRECTION_VEL, s.VEL)):
            np.testing.assert_allclose(
                self.core[correction : correction + 3] - before[correction : correction + 3],
                self.expected_dx[state : state + 3],
                rtol=1e-8,
                atol=1e-12,
            )
        assert not self.work[: s.PH].any()


def observation(case: Case, *, gate: float = WIDE_GATE) -> Array:
    """Measurements of everything, each off by its own amount, with variances of their own."""
    obs = np.zeros(fusion.OBS_SIZE)
    gps_error = case.core[s.X_GPS_ERROR : s.X_GPS_ERROR + 3]
    obs[fusion.GPS_POS : fusion.GPS_POS + 3] = case.past_pos + gps_error + np.array([0.4, -0.3, 0.6])
    obs[fusion.GPS_VEL : fusion.GPS_VEL + 3] = case.past_vel + np.array([0.2, -0.1, 0.15])
    obs[fusion.GPS_POS_VAR : fusion.GPS_POS_VAR + 3] = 0.8, 0.9, 1.7
    obs[fusion.GPS_VEL_VAR : fusion.GPS_VEL_VAR + 3] = 0.05, 0.07, 0.11
    obs[fusion.GPS_DELAY_S] = obs[fusion.BARO_DELAY_S] = DELAY_S
    obs[fusion.BARO_HEIGHT] = -case.past_pos[2] + case.core[s.X_BARO_OFFSET] + 0.35
    obs[fusion.BARO_VAR] = 0.3
    field_ned = np.array([0.21, 0.03, 0.43])
    bias = case.core[s.X_MAG_BIAS : s.X_MAG_BIAS + 3]
    obs[fusion.MAG : fusion.MAG + 3] = case.r_past.T @ field_ned + bias + [0.01, -0.02, 0.015]
    obs[fusion.MAG_VAR] = 0.002
    obs[fusion.MAG_NED : fusion.MAG_NED + 3] = field_ned
    obs[fusion.HOLD : fusion.HOLD + 3] = case.core[s.X_POS : s.X_POS + 3] + np.array([0.05, -0.06, 0.07])
    obs[fusion.HOLD_VAR], obs[fusion.HOLD_HEIGHT_VAR] = 0.4, 0.6
    obs[fusion.REST_VEL_VAR], obs[fusion.REST_RATE_VAR] = 0.02, 1e-4
    obs[fusion.GATE_GPS : fusion.GATE_MAG + 1] = gate
    return obs


def update(case: Case, obs: Array, has: int) -> int:
    return fusion.update(
        case.p, case.core, case.history, case.work, obs, np.zeros(covariance.PROCESS_SIZE), has, ROW, ROW, ROW
    )


def expect_velocity(case: Case, obs: Array, gate: float = WIDE_GATE) -> float:
    innovation = obs[fusion.GPS_VEL : fusion.GPS_VEL + 3] - case.past_vel
    variance = obs[fusion.GPS_VEL_VAR : fusion.GPS_VEL_VAR + 3]
    return case.expect(case.velocity_rows(), innovation, variance, gate)


def expect_position(case: Case, obs: Array, axes: slice, gate: float = WIDE_GATE) -> float:
    gps_error = case.core[s.X_GPS_ERROR : s.X_GPS_ERROR + 3]
    innovation = obs[fusion.GPS_POS : fusion.GPS_POS + 3] - case.past_pos - gps_error
    variance = obs[fusion.GPS_POS_VAR : fusion.GPS_POS_VAR + 3]
    rows = case.position_rows(by_gps=True)
    return case.expect(rows[axes], innovation[axes], variance[axes], gate)


def expect_magnetometer(case: Case, obs: Array, gate: float = WIDE_GATE) -> float:
    """z = R^T m + bias; an attitude error theta (NED) changes R^T m by R^T (m x theta)."""
    field_ned = obs[fusion.MAG_NED : fusion.MAG_NED + 3]
    rows = case.rows(ATT=case.r_past.T @ cross_matrix(field_ned), MAG_BIAS=1.0)
    bias = case.core[s.X_MAG_BIAS : s.X_MAG_BIAS + 3]
    innovation = obs[fusion.MAG : fusion.MAG + 3] - case.r_past.T @ field_ned - bias
    return case.expect(rows, innovation, np.full(3, obs[fusion.MAG_VAR]), gate)


def expect_barometer(case: Case, obs: Array, gate: float = WIDE_GATE) -> float:
    row = np.zeros((1, case.size))
    row[0, [s.POS + 2, s.VEL + 2, s.BARO_OFFSET]] = -1.0, DELAY_S, 1.0
    innovation = obs[fusion.BARO_HEIGHT] + case.past_pos[2] - case.core[s.X_BARO_OFFSET]
    return case.expect(row, np.array([innovation]), obs[[fusion.BARO_VAR]], gate)


@SIZES
def test_gps(size: int) -> None:
    case = Case(size)
    before, obs = case.core.copy(), observation(case)
    ratios = [
        expect_velocity(case, obs),
        expect_position(case, obs, slice(0, 2)),
        expect_position(case, obs, slice(2, 3)),
    ]
    assert update(case, obs, fusion.HAS_GPS) == (
        fusion.ACCEPTED_GPS_VEL | fusion.ACCEPTED_GPS_POS | fusion.ACCEPTED_GPS_HEIGHT
    )
    case.check(before)
    assert obs[[fusion.RATIO_VEL, fusion.RATIO_POS, fusion.RATIO_GPS_HEIGHT]] == pytest.approx(ratios)


@SIZES
def test_barometer(size: int) -> None:
    case = Case(size)
    before, obs = case.core.copy(), observation(case)
    ratio = expect_barometer(case, obs)
    assert update(case, obs, fusion.HAS_BARO) == fusion.ACCEPTED_BARO
    case.check(before)
    assert obs[fusion.RATIO_BARO] == pytest.approx(ratio)


@SIZES
def test_magnetometer(size: int) -> None:
    case = Case(size)
    before, obs = case.core.copy(), observation(case)
    ratio = expect_magnetometer(case, obs)
    assert update(case, obs, fusion.HAS_MAG) == fusion.ACCEPTED_MAG
    case.check(before)
    assert obs[fusion.RATIO_MAG] == pytest.approx(ratio)


@SIZES
def test_all_sensors_of_one_update_follow_each_other(size: int) -> None:
    """What one sensor has corrected is not corrected again by the next."""
    case = Case(size)
    before, obs = case.core.copy(), observation(case)
    expect_velocity(case, obs)
    expect_position(case, obs, slice(0, 2))
    expect_position(case, obs, slice(2, 3))
    expect_barometer(case, obs)
    expect_magnetometer(case, obs)
    accepted = update(case, obs, fusion.HAS_GPS | fusion.HAS_BARO | fusion.HAS_MAG)
    assert accepted == (
        fusion.ACCEPTED_GPS_VEL
        | fusion.ACCEPTED_GPS_POS
        | fusion.ACCEPTED_GPS_HEIGHT
        | fusion.ACCEPTED_BARO
        | fusion.ACCEPTED_MAG
    )
    case.check(before)


@pytest.mark.parametrize("height", [False, True])
def test_held_position(height: bool) -> None:
    case = Case(s.ERROR_SIZE)
    before, obs = case.core.copy(), observation(case)
    axes, has, variance = [s.POS, s.POS + 1], fusion.HAS_HOLD, [0.4, 0.4]
    innovation = np.array([0.05, -0.06])
    if height:
        axes, has, variance, innovation = [s.POS + 2], fusion.HAS_HOLD_HEIGHT, [0.6], np.array([0.07])
    case.expect(np.eye(case.size)[axes], innovation, np.array(variance))
    assert update(case, obs, has) == 0
    case.check(before)


@pytest.mark.parametrize("averaged_s", [0.0, 0.5])
def test_standing_still(averaged_s: float) -> None:
    """The velocity is zero, and the mean gyro reading is the bias and the Earth's rotation in the body's
    axes."""
    case = Case(s.ERROR_SIZE)
    mean, earth = np.array([0.31, -0.12, 0.23]), np.array([4e-3, -2e-3, -6e-3])
    case.core[s.SUM_GYRO : s.SUM_GYRO + 3] = mean * averaged_s
    case.core[s.SUM_GYRO_TIME] = averaged_s
    case.core[s.EARTH_RATE : s.EARTH_RATE + 3] = earth
    before, obs = case.core.copy(), observation(case)
    case.expect(case.rows(VEL=1.0), -before[s.X_VEL : s.X_VEL + 3], np.full(3, 0.02))
    if averaged_s:
        bias = mean - case.r_now.T @ earth
        innovation = bias - before[s.X_GYRO_BIAS : s.X_GYRO_BIAS + 3]
        case.expect(case.rows(GYRO_BIAS=1.0), innovation, np.full(3, 1e-4))
    assert update(case, obs, fusion.HAS_REST) == 0
    np.testing.assert_allclose(case.p, case.expected_p, rtol=1e-8, atol=1e-10)
    moved = case.core[4 : case.size + 1] - before[4 : case.size + 1]
    np.testing.assert_allclose(moved, case.expected_dx[3:], rtol=1e-8, atol=1e-10)
    assert not case.core[s.SUM_GYRO : s.SUM_GYRO_TIME + 1].any()  # a new average begins


def test_a_longer_average_says_the_same_of_the_bias() -> None:
    moved = []
    for averaged_s in (0.5, 2.0):
        case = Case(s.ERROR_SIZE)
        case.core[s.SUM_GYRO : s.SUM_GYRO + 3] = np.array([0.31, -0.12, 0.23]) * averaged_s
        case.core[s.SUM_GYRO_TIME] = averaged_s
        update(case, observation(case), fusion.HAS_REST)
        moved.append(case.core.copy())
    np.testing.assert_allclose(moved[0], moved[1], rtol=1e-12)


GATED: list[tuple[int, tuple[int, ...], int, int, Callable[[Case, Array, float], float]]] = [
    (
        fusion.HAS_GPS,
        (fusion.GPS_VEL, fusion.GPS_VEL + 1, fusion.GPS_VEL + 2),
        fusion.ACCEPTED_GPS_VEL,
        fusion.GATE_GPS_VEL,
        expect_velocity,
    ),
    (
        fusion.HAS_GPS,
        (fusion.GPS_POS, fusion.GPS_POS + 1),
        fusion.ACCEPTED_GPS_POS,
        fusion.GATE_GPS,
        lambda case, obs, gate: expect_position(case, obs, slice(0, 2), gate),
    ),
    (
        fusion.HAS_GPS,
        (fusion.GPS_POS + 2,),
        fusion.ACCEPTED_GPS_HEIGHT,
        fusion.GATE_GPS,
        lambda case, obs, gate: expect_position(case, obs, slice(2, 3), gate),
    ),
    (fusion.HAS_BARO, (fusion.BARO_HEIGHT,), fusion.ACCEPTED_BARO, fusion.GATE_BARO, expect_barometer),
    (
        fusion.HAS_MAG,
        (fusion.MAG, fusion.MAG + 1, fusion.MAG + 2),
        fusion.ACCEPTED_MAG,
        fusion.GATE_MAG,
        expect_magnetometer,
    ),
]


@pytest.mark.parametrize(("has", "places", "accepted", "gate", "expect"), GATED)
@pytest.mark.parametrize("bad", [1e3, -1e3])
def test_one_axis_outside_the_gate_refuses_its_group_alone(
    has: int,
    places: tuple[int, ...],
    accepted: int,
    gate: int,
    expect: Callable[[Case, Array, float], float],
    bad: float,
) -> None:
    """Of the groups of one receiver the others are fused; nothing else of the filter changes."""
    for place in places:
        case = Case(s.ERROR_SIZE)
        before, obs = case.core.copy(), observation(case)
        obs[gate] = 5.0
        obs[place] += bad
        if has == fusion.HAS_GPS:
            if accepted != fusion.ACCEPTED_GPS_VEL:
                expect_velocity(case, obs)
            if accepted != fusion.ACCEPTED_GPS_POS:
                expect_position(case, obs, slice(0, 2))
            if accepted != fusion.ACCEPTED_GPS_HEIGHT:
                expect_position(case, obs, slice(2, 3))
        assert not update(case, obs, has) & accepted
        case.check(before)


@pytest.mark.parametrize(("has", "places", "accepted", "gate", "expect"), GATED)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_gate_is_in_standard_deviations_of_the_innovation(
    has: int,
    places: tuple[int, ...],
    accepted: int,
    gate: int,
    expect: Callable[[Case, Array, float], float],
    sign: float,
) -> None:
    """Fused just inside of the gate, refused just outside."""
    for inside in (True, False):
        case = Case(s.ERROR_SIZE)
        obs = observation(case)
        obs[places[-1]] += 5.0 * sign
        # the groups before it in the same receiver are fused first
        if accepted in (fusion.ACCEPTED_GPS_POS, fusion.ACCEPTED_GPS_HEIGHT):
            expect_velocity(case, obs)
        if accepted == fusion.ACCEPTED_GPS_HEIGHT:
            expect_position(case, obs, slice(0, 2))
        ratio = expect(case, obs, 1.0)
        if accepted == fusion.ACCEPTED_GPS_HEIGHT:
            # the gate is that of the horizontal position, too, which shall pass
            assert ratio > 1.0
        obs[gate] = ratio * (1.001 if inside else 0.999)
        assert bool(update(case, obs, has) & accepted) is inside


def external_sample(case: Case) -> Array:
    obs = np.zeros(external_fusion.EXT_SIZE)
    nose = case.r_past[:, 0]
    obs[external_fusion.EXT_POS : external_fusion.EXT_POS + 3] = case.past_pos + np.array([0.2, -0.3, 0.25])
    obs[external_fusion.EXT_VEL : external_fusion.EXT_VEL + 3] = case.past_vel + np.array([0.1, 0.2, -0.15])
    obs[external_fusion.EXT_YAW] = math.atan2(nose[1], nose[0]) + 0.05
    obs[external_fusion.EXT_POS_VAR : external_fusion.EXT_POS_VAR + 3] = 0.1, 0.2, 0.3
    obs[external_fusion.EXT_VEL_VAR : external_fusion.EXT_VEL_VAR + 3] = 0.02, 0.03, 0.04
    obs[external_fusion.EXT_YAW_VAR] = 0.01
    obs[external_fusion.EXT_DELAY_S] = DELAY_S
    for gate in (external_fusion.EXT_GATE_POS, external_fusion.EXT_GATE_VEL, external_fusion.EXT_GATE_YAW):
        obs[gate] = WIDE_GATE
    return obs


def external_update(case: Case, obs: Array, has: int) -> int:
    return external_fusion.fuse_external(case.p, case.core, case.history, case.work, obs, has, ROW)


def expect_heading(case: Case, innovation: float, variance: float) -> float:
    """Heading of the nose, atan2(r10, r00): a rotation by theta (NED) moves the nose by theta x nose."""
    n, e, d = case.r_past[:, 0]
    row = np.zeros((1, case.size))
    row[0, s.ATT : s.ATT + 3] = -d * n / (n * n + e * e), -d * e / (n * n + e * e), 1.0
    return case.expect(row, np.array([innovation]), np.array([variance]))


EXTERNAL_PARTS = {
    "heading": external_fusion.EXT_HAS_YAW,
    "velocity": external_fusion.EXT_HAS_VEL,
    "position": external_fusion.EXT_HAS_POS,
    "height": external_fusion.EXT_HAS_HEIGHT,
}


@SIZES
@pytest.mark.parametrize(
    "parts",
    [
        ("heading",),
        ("velocity",),
        ("position",),
        ("height",),
        ("position", "height"),
        ("heading", "velocity", "position", "height"),
    ],
    ids=" ".join,
)
@pytest.mark.parametrize("turns", [0.0, 1.0, -2.0])
def test_external_odometry(size: int, parts: tuple[str, ...], turns: float) -> None:
    case = Case(size)
    before, obs = case.core.copy(), external_sample(case)
    obs[external_fusion.EXT_YAW] += turns * 2.0 * math.pi  # the same heading
    ratios = {}
    if "heading" in parts:
        ratios[external_fusion.EXT_RATIO_YAW] = expect_heading(case, 0.05, 0.01)
    if "velocity" in parts:
        ratios[external_fusion.EXT_RATIO_VEL] = case.expect(
            case.velocity_rows(), np.array([0.1, 0.2, -0.15]), np.array([0.02, 0.03, 0.04])
        )
    position = case.position_rows(by_gps=False)
    if "position" in parts:
        ratios[external_fusion.EXT_RATIO_POS] = case.expect(
            position[:2], np.array([0.2, -0.3]), np.array([0.1, 0.2])
        )
    if "height" in parts:
        ratios[external_fusion.EXT_RATIO_HEIGHT] = case.expect(
            position[2:], np.array([0.25]), np.array([0.3])
        )
    has = sum(EXTERNAL_PARTS[part] for part in parts)
    assert external_update(case, obs, has) == has
    case.check(before)
    for place, ratio in ratios.items():
        assert obs[place] == pytest.approx(ratio)
    unused = {
        external_fusion.EXT_RATIO_POS,
        external_fusion.EXT_RATIO_HEIGHT,
        external_fusion.EXT_RATIO_VEL,
        external_fusion.EXT_RATIO_YAW,
    } - ratios.keys()
    assert not obs[sorted(unused)].any()


@pytest.mark.parametrize(
    ("part", "place", "gate"),
    [
        ("heading", external_fusion.EXT_YAW, external_fusion.EXT_GATE_YAW),
        ("velocity", external_fusion.EXT_VEL + 1, external_fusion.EXT_GATE_VEL),
        ("position", external_fusion.EXT_POS, external_fusion.EXT_GATE_POS),
        ("height", external_fusion.EXT_POS + 2, external_fusion.EXT_GATE_POS),
    ],
)
def test_external_part_outside_its_gate_is_refused(part: str, place: int, gate: int) -> None:
    case = Case(s.ERROR_SIZE)
    before, obs = case.core.copy(), external_sample(case)
    obs[gate] = 3.0
    obs[place] += 2.5 if part == "heading" else 60.0
    assert external_update(case, obs, EXTERNAL_PARTS[part]) == 0
    case.check(before)


@pytest.mark.parametrize("pitch_rad", [math.pi / 2.0, -math.pi / 2.0])
def test_a_vertical_nose_has_no_heading(pitch_rad: float) -> None:
    case = Case(s.ERROR_SIZE)
    before, obs = case.core.copy(), external_sample(case)
    case.history[ROW, s.HISTORY_Q : s.HISTORY_Q + 4] = (
        math.cos(0.5 * pitch_rad),
        0.0,
        math.sin(0.5 * pitch_rad),
        0.0,
    )
    assert external_update(case, obs, external_fusion.EXT_HAS_YAW) == 0
    case.check(before)


@pytest.mark.parametrize("angle", np.linspace(-25.0, 25.0, 41))
def test_wrapped_angle_is_the_same_direction(angle: float) -> None:
    wrapped = external_fusion.wrapped(angle)
    assert -math.pi <= wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-12)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-12)
    if abs(angle) < math.pi:
        assert wrapped == angle


def air_sample(case: Case) -> Array:
    air = np.zeros(air_fusion.AIR_SIZE)
    wind = np.array([*case.core[s.X_WIND : s.X_WIND + 2], 0.0])
    air[air_fusion.AIRSPEED] = np.linalg.norm(case.past_vel - wind) + 0.4
    air[air_fusion.AIRSPEED_VAR], air[air_fusion.AIRSPEED_GATE_VAR] = 2.0, 0.7
    air[air_fusion.SIDESLIP_VAR], air[air_fusion.SIDESLIP_GATE_VAR] = 3.0, 0.9
    air[air_fusion.GATE_AIRSPEED] = air[air_fusion.GATE_SIDESLIP] = WIDE_GATE
    return air


def airspeed_row(case: Case) -> Array:
    """|v - w| changes with the part of v - w along itself."""
    through_air = case.past_vel - [*case.core[s.X_WIND : s.X_WIND + 2], 0.0]
    direction = through_air / np.linalg.norm(through_air)
    row = np.zeros((1, case.size))
    row[0, s.VEL : s.VEL + 3] = direction
    row[0, s.WIND : s.WIND + 2] = -direction[:2]
    return row


def sideslip_row(case: Case) -> tuple[Array, float]:
    """y . (v - w), y the body's right; theta turns y by theta x y, so the row is y x (v - w)."""
    right = case.r_now[:, 1]
    through_air = case.core[s.X_VEL : s.X_VEL + 3] - [*case.core[s.X_WIND : s.X_WIND + 2], 0.0]
    row = np.zeros((1, case.size))
    row[0, s.VEL : s.VEL + 3] = right
    row[0, s.WIND : s.WIND + 2] = -right[:2]
    row[0, s.ATT : s.ATT + 3] = np.cross(right, through_air)
    return row, float(right @ through_air)


@pytest.mark.parametrize("wind_only", [False, True])
def test_airspeed(wind_only: bool) -> None:
    case = Case(s.ERROR_SIZE_WITH_WIND)
    before, air, row = case.core.copy(), air_sample(case), airspeed_row(case)
    state_variance = float((row @ case.p @ row.T)[0, 0])
    if wind_only:
        case.expect_wind_only(row, np.array([0.4]), 2.0)
    else:
        case.expect(row, np.array([0.4]), np.array([2.0]))
    todo = air_fusion.HAS_AIRSPEED | (air_fusion.WIND_ONLY if wind_only else 0)
    accepted = air_fusion.update(case.p, case.core, case.history, case.work, air, ROW, todo)
    assert accepted == air_fusion.ACCEPTED_AIRSPEED
    case.check(before)
    assert air[air_fusion.AIRSPEED_INNOVATION] == pytest.approx(0.4)
    assert air[air_fusion.AIRSPEED_STATE_VAR] == pytest.approx(state_variance)
    spread = math.sqrt(state_variance + 0.7)
    assert air[air_fusion.AIRSPEED_RATIO] == pytest.approx(0.4 / (WIDE_GATE * spread))


@pytest.mark.parametrize("wind_only", [False, True])
def test_sideslip(wind_only: bool) -> None:
    case = Case(s.ERROR_SIZE_WITH_WIND)
    before, air = case.core.copy(), air_sample(case)
    row, sideways = sideslip_row(case)
    state_variance = float((row @ case.p @ row.T)[0, 0])
    if wind_only:
        case.expect_wind_only(row, np.array([-sideways]), 3.0)
    else:
        case.expect(row, np.array([-sideways]), np.array([3.0]))
    todo = air_fusion.HAS_SIDESLIP | (air_fusion.WIND_ONLY if wind_only else 0)
    accepted = air_fusion.update(case.p, case.core, case.history, case.work, air, ROW, todo)
    assert accepted == air_fusion.ACCEPTED_SIDESLIP
    np.testing.assert_allclose(case.p, case.expected_p, rtol=1e-8, atol=1e-10)
    moved = case.core[4 : case.size + 1] - before[4 : case.size + 1]
    np.testing.assert_allclose(moved, case.expected_dx[3:], rtol=1e-8, atol=1e-10)
    assert air[air_fusion.SIDESLIP_INNOVATION] == pytest.approx(-sideways)
    assert air[air_fusion.SIDESLIP_STATE_VAR] == pytest.approx(state_variance)
    spread = math.sqrt(state_variance + 0.9)
    assert air[air_fusion.SIDESLIP_RATIO] == pytest.approx(abs(sideways) / (WIDE_GATE * spread))


def test_sideslip_after_airspeed_uses_what_is_left() -> None:
    case = Case(s.ERROR_SIZE_WITH_WIND)
    before, air = case.core.copy(), air_sample(case)
    case.core[s.Q : s.Q + 4] = before[s.Q : s.Q + 4] = 1.0, 0.0, 0.0, 0.0
    mechanisation.refresh_rotation(case.core)
    row, sideways = sideslip_row(case)
    case.expect(airspeed_row(case), np.array([0.4]), np.array([2.0]))
    case.expect(row, np.array([-sideways]), np.array([3.0]))
    todo = air_fusion.HAS_AIRSPEED | air_fusion.HAS_SIDESLIP
    air_fusion.update(case.p, case.core, case.history, case.work, air, ROW, todo)
    np.testing.assert_allclose(case.p, case.expected_p, rtol=1e-8, atol=1e-10)
    moved = case.core[4 : case.size + 1] - before[4 : case.size + 1]
    np.testing.assert_allclose(moved, case.expected_dx[3:], rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_air_data_outside_the_gate_are_refused(sign: float) -> None:
    for todo, gate in (
        (air_fusion.HAS_AIRSPEED, air_fusion.GATE_AIRSPEED),
        (air_fusion.HAS_SIDESLIP, air_fusion.GATE_SIDESLIP),
    ):
        case = Case(s.ERROR_SIZE_WITH_WIND)
        air = air_sample(case)
        air[air_fusion.AIRSPEED] += sign * 5.0
        air[gate] = 0.01
        before = case.core.copy()
        assert air_fusion.update(case.p, case.core, case.history, case.work, air, ROW, todo) == 0
        case.check(before)


def test_airspeed_is_judged_without_being_fused() -> None:
    case = Case(s.ERROR_SIZE_WITH_WIND)
    before, air = case.core.copy(), air_sample(case)
    todo = air_fusion.JUDGE_AIRSPEED
    assert air_fusion.update(case.p, case.core, case.history, case.work, air, ROW, todo) == 0
    case.check(before)
    assert air[air_fusion.AIRSPEED_INNOVATION] == pytest.approx(0.4)


def test_air_at_rest_has_no_direction_to_fuse() -> None:
    case = Case(s.ERROR_SIZE_WITH_WIND)
    case.core[s.X_WIND : s.X_WIND + 2] = case.past_vel[:2]
    case.history[ROW, s.HISTORY_VEL + 2] = -case.core[s.CORRECTION_VEL + 2] + 0.5
    before, air = case.core.copy(), air_sample(case)
    todo = air_fusion.HAS_AIRSPEED
    assert air_fusion.update(case.p, case.core, case.history, case.work, air, ROW, todo) == 0
    case.check(before)


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (s.X_VEL, 1e3),
        (s.X_VEL + 1, -1e3),
        (s.X_VEL + 2, 1e3),
        (s.X_POS, 1e6),
        (s.X_POS + 1, -1e6),
        (s.X_POS + 2, 1e6),
        (s.X_VEL + 2, math.nan),
        (s.X_ACCEL_BIAS, 1e6),
        (s.X_MAG_BIAS + 2, math.nan),
        (s.Q, 1.2),
        (s.Q, math.nan),
    ],
)
def test_absurd_states_are_unsound(place: int, value: float) -> None:
    case = Case(s.ERROR_SIZE)
    assert covariance.is_sound(case.p, case.core)
    case.core[place] = value
    assert not covariance.is_sound(case.p, case.core)
    has_nothing = update(case, observation(case), 0)
    assert has_nothing == fusion.UNSOUND


@pytest.mark.parametrize("index", [0, 5, s.ERROR_SIZE - 1])
@pytest.mark.parametrize("variance", [-1e-9, math.nan, 1e12])
def test_variances_that_none_can_be_are_unsound(index: int, variance: float) -> None:
    case = Case(s.ERROR_SIZE)
    case.p[index, index] = variance
    assert not covariance.is_sound(case.p, case.core)


def test_speeds_and_places_of_a_flight_are_sound() -> None:
    case = Case(s.ERROR_SIZE)
    case.core[s.X_VEL : s.X_VEL + 3] = 300.0, -300.0, 300.0
    case.core[s.X_POS : s.X_POS + 3] = 3e5, -3e5, 3e5
    assert covariance.is_sound(case.p, case.core)
    case.core[s.X_VEL : s.X_VEL + 3] = 340.0, -340.0, 340.0  # together above 1 km/s
    assert not covariance.is_sound(case.p, case.core)


def test_forgotten_state_is_correlated_with_nothing() -> None:
    case = Case(s.ERROR_SIZE)
    before = case.p.copy()
    covariance.forget(case.p, 4, 7.0)
    others = [k for k in range(case.size) if k != 4]
    assert case.p[4, 4] == 7.0
    assert not case.p[4, others].any()
    assert not case.p[others, 4].any()
    np.testing.assert_array_equal(case.p[np.ix_(others, others)], before[np.ix_(others, others)])


@pytest.mark.parametrize(
    ("first", "correction"), [(s.POS, s.CORRECTION_POS), (s.VEL, s.CORRECTION_VEL)], ids=["pos", "vel"]
)
def test_a_jump_moves_the_state_and_its_history(first: int, correction: int) -> None:
    case = Case(s.ERROR_SIZE)
    expected = case.core.copy()
    for place in (first + 1, correction):
        expected[place : place + 3] += [1.0, -2.0, 4.0]
    covariance.shift(case.core, first, 1.0, -2.0, 4.0)
    np.testing.assert_array_equal(case.core, expected)


def test_nothing_is_predicted_over_no_time() -> None:
    case = Case(s.ERROR_SIZE)
    before = case.p.copy()
    case.core[s.SUM_TURN : s.SUM_TURN + 3] = 1.0
    covariance.predict(case.p, case.core, np.ones(covariance.PROCESS_SIZE))
    np.testing.assert_array_equal(case.p, before)
    assert case.core[s.SUM_TURN] == 1.0


PROCESS = np.linspace(0.2, 1.0, covariance.PROCESS_SIZE)


@SIZES
def test_prediction(size: int) -> None:
    """P' = F P F^T + Q with the transition of the module's docstring, and biases that decay in the mean."""
    case = Case(size)
    t = 0.3
    rng = RandomStreams(2).generator("sums")
    turned = np.array([0.3, 0.5, 0.9])
    sum_r, sum_force = rng.normal(size=(3, 3)), rng.normal(size=3)
    case.core[s.SUM_TIME] = t
    case.core[s.SUM_R : s.SUM_R + 9] = sum_r.ravel()
    case.core[s.SUM_FORCE : s.SUM_FORCE + 3] = sum_force
    case.core[s.SUM_TURN : s.SUM_TURN + 3] = turned
    before = case.core.copy()

    f = np.eye(size)
    att, vel, pos = slice(s.ATT, s.ATT + 3), slice(s.VEL, s.VEL + 3), slice(s.POS, s.POS + 3)
    gyro, accel = slice(s.GYRO_BIAS, s.GYRO_BIAS + 3), slice(s.ACCEL_BIAS, s.ACCEL_BIAS + 3)
    f[att, gyro] = -sum_r
    f[vel, att] = -cross_matrix(sum_force)  # theta x u
    f[vel, accel] = -sum_r
    f[pos, vel] = t * np.eye(3)
    f[pos, att], f[pos, accel] = 0.5 * t * f[vel, att], 0.5 * t * f[vel, accel]

    def of(name: str) -> float:
        return float(PROCESS[getattr(covariance, name)])

    rotated = turned.sum() / of("MAG_BIAS_TURN")
    horizontal, vertical = of("GPS_VAR_HORIZONTAL"), of("GPS_VAR_VERTICAL")
    factors, q = np.ones(size), np.zeros(size)
    for first, exponent, variance in (
        (s.GYRO_BIAS, t / of("GYRO_BIAS_TAU"), [of("GYRO_BIAS_VAR")] * 3),
        (s.ACCEL_BIAS, t / of("ACCEL_BIAS_TAU"), [of("ACCEL_BIAS_VAR")] * 3),
        (s.GPS_ERROR, t / of("GPS_TAU"), [horizontal, horizontal, vertical]),
        (s.MAG_BIAS, t / of("MAG_BIAS_TAU") + rotated, [of("MAG_BIAS_VAR")] * 3),
    ):
        factors[first : first + 3] = math.exp(-exponent)
        q[first : first + 3] = (1.0 - math.exp(-2.0 * exponent)) * np.array(variance)
    tilt, cross, scale = of("TURN_TILT"), of("TURN_CROSS"), of("TURN_SCALE")
    q[att] = of("NOISE_ATT") * t + np.array(
        [tilt * turned[0] + cross * turned[2], tilt * turned[1] + cross * turned[2], scale * turned[2]]
    )
    q[vel], q[pos] = of("NOISE_VEL") * t, of("NOISE_VEL") * t**3 / 3.0
    q[s.BARO_OFFSET] = of("BARO_WALK") * t
    q[s.WIND :] = of("WIND_WALK") * t
    full = np.diag(factors) @ f
    expected = full @ case.p @ full.T + np.diag(q)

    covariance.predict(case.p, case.core, PROCESS)
    np.testing.assert_allclose(case.p, expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(case.p, case.p.T)
    np.testing.assert_allclose(case.core[4 : size + 1], factors[3:] * before[4 : size + 1], rtol=1e-12)
    cleared = slice(s.SUM_TIME, s.SUM_TURN + 3)
    assert not case.core[cleared].any()
    np.testing.assert_array_equal(case.core[cleared.stop :], before[cleared.stop :])
