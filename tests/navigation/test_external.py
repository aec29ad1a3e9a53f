"""External odometry in the filter: frames, delay, resets, gates, and what of it is refused."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot_bridge.navigation import layout
from autopilot_bridge.navigation.external import (
    POSITION_M,
    Q_LOCAL_FROM_FRD,
    SAMPLE_SIZE,
    VELOCITY_M_S,
    ExternalFrame,
    ExternalSample,
)
from autopilot_bridge.navigation.external_parameters import ExternalParameters
from flightsim import truth as t
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.random_streams import RandomStreams
from flightsim.sensors.fault_kinds import FaultType, SensorUnit
from tests.navigation.bench import PARAMETERS, Bench
from tests.navigation.kinematic_flight import HOME, fly
from tests.rotations import rotation_matrix, yaw_rad

Array = NDArray[np.float64]

ALL = ExternalParameters(
    use_position=True, use_height=True, use_velocity=True, use_yaw=True, height_reference=True
)
NO_GPS = replace(PARAMETERS, use_gps=False, external=ALL)
RATE_HZ = 25
_FRAME = LocalFrame(HOME)
_UNKNOWN = (math.nan, math.nan, math.nan)


@pytest.fixture(scope="module")
def flight() -> Array:
    return fly(60.0)


class Odometry:
    """Sends what a tracker beside the truth would say, from a bench's `each`.

    Attributes:
        turn_rad: heading of its frame against north.
        late_us: age of a sample when it comes.
        change: spoils samples.
    """

    def __init__(self, bench: Bench, *, frame: ExternalFrame = ExternalFrame.NED) -> None:
        self.bench = bench
        self.frame = frame
        self.turn_rad = 0.0
        self.late_us = 0
        self.stamped = True
        self.reset_counter = 0
        self.quality = 100
        self.on = True
        self.velocity_frame = ExternalFrame.BODY_FRD
        self.change: Callable[[Array], Any] = lambda values: None
        self._rng = np.random.Generator(np.random.PCG64(RandomStreams(3).child("odometry")))
        self._waiting: list[tuple[int, ExternalSample]] = []

    def true_ned(self) -> Array:
        truth = self.bench.truth
        lat, lon = math.degrees(truth[t.LAT_RAD]), math.degrees(truth[t.LON_RAD])
        return np.array(_FRAME.ned_from_geodetic(lat, lon, float(truth[t.ALT_M])))

    def __call__(self) -> None:
        bench = self.bench
        now_us = bench.step * bench.period_us
        if self.on and bench.step % (bench.rate_hz // RATE_HZ) == 0:
            c, s = math.cos(-self.turn_rad), math.sin(-self.turn_rad)
            turn = np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
            q = bench.truth[t.Q_NED_FROM_FRD]
            half = np.array((math.cos(-0.5 * self.turn_rad), 0.0, 0.0, math.sin(-0.5 * self.turn_rad)))
            values = np.full(SAMPLE_SIZE, math.nan)
            values[POSITION_M] = turn @ self.true_ned() + self._rng.normal(0.0, 0.02, 3)
            values[Q_LOCAL_FROM_FRD] = _product(half, q)
            velocity = bench.truth[t.VEL_NED_M_S]
            if self.velocity_frame is ExternalFrame.BODY_FRD:
                velocity = rotation_matrix(q).T @ velocity
            values[VELOCITY_M_S] = velocity + self._rng.normal(0.0, 0.02, 3)
            self.change(values)
            sample = ExternalSample(
                time_us=now_us if self.stamped else now_us + self.late_us,
                values=values,
                frame=self.frame,
                velocity_frame=self.velocity_frame,
                position_variance_m2=_UNKNOWN,
                velocity_variance_m2_s2=_UNKNOWN,
                yaw_variance_rad2=math.nan,
                reset_counter=self.reset_counter,
                quality=self.quality,
            )
            self._waiting.append((now_us + self.late_us, sample))
        while self._waiting and self._waiting[0][0] <= now_us:
            bench.filter.take_external(self._waiting.pop(0)[1])


def _product(a: Array, b: Array) -> Array:
    w, x, y, z = a
    return np.array(
        (
            w * b[0] - x * b[1] - y * b[2] - z * b[3],
            w * b[1] + x * b[0] + y * b[3] - z * b[2],
            w * b[2] - x * b[3] + y * b[0] + z * b[1],
            w * b[3] + x * b[2] - y * b[1] + z * b[0],
        )
    )


def position_error_m(odometry: Odometry) -> float:
    state = odometry.bench.filter.state
    return float(np.linalg.norm(state[layout.POS_NED_M] - odometry.true_ned()))


def yaw_error_rad(odometry: Odometry) -> float:
    yaw = yaw_rad(odometry.bench.truth[t.Q_NED_FROM_FRD])
    return math.remainder(float(odometry.bench.filter.state[layout.EULER_RAD][2]) - yaw, math.tau)


@pytest.mark.parametrize("late_ms", [0, 120])
@pytest.mark.parametrize("use_yaw", [True, False])
@pytest.mark.sampled(2)
def test_flies_by_odometry_alone(flight: Array, use_yaw: bool, late_ms: int) -> None:
    bench = Bench(flight, parameters=replace(NO_GPS, external=replace(ALL, use_yaw=use_yaw)))
    odometry = Odometry(bench)
    odometry.late_us = late_ms * 1000
    worst: list[float] = []
    bench.run(20.0, odometry)
    for until in range(21, 50):
        bench.run(float(until), odometry)
        worst.append(position_error_m(odometry))
    health = bench.filter.health
    assert max(worst) < 0.3 and abs(yaw_error_rad(odometry)) < 0.05
    assert np.linalg.norm(bench.error()[3:6]) < 0.15
    assert health.position_horizontal_relative and health.external_in_use and not health.gps_in_use
    assert health.external_yaw_in_use is use_yaw
    assert not (health.position_horizontal_absolute or health.dead_reckoning)  # no origin
    bench.filter.set_origin(HOME)
    bench.run(51.0, odometry)
    assert health.position_horizontal_absolute


def test_a_wrong_delay_shows_and_the_parameter_mends_it(flight: Array) -> None:
    def error(delay_s: float) -> float:
        bench = Bench(flight, parameters=replace(NO_GPS, external=replace(ALL, delay_s=delay_s)))
        odometry = Odometry(bench)
        odometry.late_us, odometry.stamped = 150_000, False
        errors: list[float] = []
        bench.run(22.0, odometry)
        for until in range(23, 40):
            bench.run(float(until), odometry)
            errors.append(position_error_m(odometry))
        return float(np.mean(errors))

    assert error(0.15) < 0.15 < 1.0 < error(0.0)


@pytest.mark.parametrize("use_yaw", [True, False])
def test_a_frame_with_a_heading_of_its_own(flight: Array, use_yaw: bool) -> None:
    """Fused, the heading is the sender's and so are the axes; else its frame is turned to north."""
    bench = Bench(flight, parameters=replace(NO_GPS, external=replace(ALL, use_yaw=use_yaw)))
    odometry = Odometry(bench, frame=ExternalFrame.LOCAL_FRD)
    odometry.turn_rad = 1.0
    bench.run(45.0, odometry)
    if use_yaw:
        assert math.remainder(yaw_error_rad(odometry) + 1.0, math.tau) == pytest.approx(0.0, abs=0.05)
        x, y, _ = odometry.true_ned()
        c, s = math.cos(-1.0), math.sin(-1.0)
        here = bench.filter.state[layout.POS_NED_M][:2]
        assert here == pytest.approx((c * x - s * y, s * x + c * y), abs=0.3)
        odometry.on = False
        bench.run(50.0)
        assert abs(yaw_error_rad(odometry)) < 0.2  # back to the compass
    else:
        assert abs(yaw_error_rad(odometry)) < 0.06
        assert position_error_m(odometry) < 3.0  # a compass error of two degrees over forty metres


def test_lost_odometry_is_known_and_its_return_mended(flight: Array) -> None:
    bench = Bench(flight, parameters=NO_GPS)
    odometry = Odometry(bench)
    bench.run(25.0, odometry)
    health = bench.filter.health
    odometry.on = False
    bench.run(27.0)
    assert health.position_horizontal_relative and not health.external_in_use
    bench.run(31.0)
    assert not health.position_horizontal_relative and health.constant_position
    odometry.on = True
    bench.run(33.0, odometry)
    assert health.external_in_use and position_error_m(odometry) < 0.3


def test_odometry_takes_over_where_gps_was_lost(flight: Array) -> None:
    """Its origin is elsewhere: while there is GPS the difference is learnt."""
    bench = Bench(flight, parameters=replace(PARAMETERS, external=replace(ALL, height_reference=False)))
    odometry = Odometry(bench)

    def elsewhere(values: Array) -> None:
        values[POSITION_M] += (100.0, -50.0, 7.0)

    odometry.change = elsewhere
    bench.run(30.0, odometry)
    before = bench.filter.health.position_resets
    bench.suite.faults.inject(SensorUnit.GPS, FaultType.OFF)
    bench.run(55.0, odometry)
    health = bench.filter.health
    assert health.external_in_use and health.position_horizontal_absolute
    assert np.linalg.norm(bench.error()[6:9]) < 3.0 and health.position_resets == before


def test_a_jump_with_its_counter_is_followed_and_without_it_refused(flight: Array) -> None:
    bench = Bench(flight, parameters=NO_GPS)
    odometry = Odometry(bench)
    bench.run(20.0, odometry)
    counts = bench.filter.external_counts
    assert counts is not None and counts.refused == 0

    def jump(values: Array) -> None:
        values[POSITION_M] += (20.0, 0.0, 0.0)

    odometry.change = jump
    bench.run(23.0, odometry)
    assert counts.refused == 0 or position_error_m(odometry) < 1.0
    assert position_error_m(odometry) < 1.0  # position refused; velocity and heading go on
    resets = counts.resets
    odometry.reset_counter = 1
    bench.run(23.3, odometry)
    assert counts.resets == resets + 1
    assert position_error_m(odometry) == pytest.approx(20.0, abs=0.5)
    assert bench.filter.health.position_reset_ne_m[0] == pytest.approx(20.0, abs=0.5)


def test_a_jump_that_stays_is_gone_over_to_after_seven_seconds(flight: Array) -> None:
    bench = Bench(flight, parameters=NO_GPS)
    odometry = Odometry(bench)
    bench.run(20.0, odometry)

    def jump(values: Array) -> None:
        values[POSITION_M] += (20.0, 0.0, 0.0)

    odometry.change = jump
    bench.run(26.5, odometry)
    assert position_error_m(odometry) < 2.0
    bench.run(28.0, odometry)
    assert position_error_m(odometry) == pytest.approx(20.0, abs=0.5)


def spoil(name: str, rng: np.random.Generator) -> Callable[[Array], Any]:
    frozen: list[Array] = []

    def freeze(values: Array) -> None:
        if not frozen:
            frozen.append(values.copy())
        values[:] = frozen[0]

    def garbage(values: Array) -> None:
        values[:] = rng.uniform(-50.0, 50.0, SAMPLE_SIZE)

    def not_a_number(values: Array) -> None:
        values[:] = math.nan

    def infinite(values: Array) -> None:
        values[:] = math.inf

    def huge(values: Array) -> None:
        values[POSITION_M] = 1e30
        values[VELOCITY_M_S] = -1e30
        values[Q_LOCAL_FROM_FRD] = 1e30

    spoilers = {
        "frozen": freeze,
        "garbage": garbage,
        "not_finite": not_a_number,
        "infinite": infinite,
        "huge": huge,
    }
    return spoilers[name]


@pytest.mark.parametrize("name", ["frozen", "garbage", "not_finite", "infinite", "huge"])
def test_nonsense_is_counted_and_moves_nothing(flight: Array, name: str) -> None:
    bench = Bench(flight, parameters=NO_GPS)
    odometry = Odometry(bench)
    bench.run(20.0, odometry)
    counts = bench.filter.external_counts
    assert counts is not None
    fused = counts.fused
    odometry.change = spoil(name, np.random.Generator(np.random.PCG64(7)))
    bench.run(23.0, odometry)
    assert counts.fused - fused < 12  # those that can't yet be distinguished from good ones
    assert position_error_m(odometry) < 3.0  # inertial for three seconds
    bench.run(40.0, odometry)
    health = bench.filter.health
    assert not health.position_horizontal_relative and health.attitude
    assert np.isfinite(bench.filter.state[:28]).all()
    assert abs(yaw_error_rad(odometry)) < 0.5
    said = {"frozen": counts.frozen, "garbage": counts.incoherent + counts.refused}
    assert said.get(name, counts.not_finite) > 300
    odometry.change = lambda values: None
    bench.run(44.0, odometry)
    assert health.external_in_use and position_error_m(odometry) < 0.5


def test_speeds_of_a_message_of_their_own(flight: Array) -> None:
    """VISION_SPEED_ESTIMATE beside VISION_POSITION_ESTIMATE: another counter of resets is no reset."""
    bench = Bench(flight, parameters=NO_GPS)
    odometry = Odometry(bench)
    odometry.velocity_frame = ExternalFrame.NED
    halves = [0]

    def one_half(values: Array) -> None:
        halves[0] += 1
        if halves[0] % 2:
            values[VELOCITY_M_S] = math.nan
            odometry.reset_counter = 3
        else:
            values[POSITION_M] = math.nan
            values[Q_LOCAL_FROM_FRD] = math.nan
            odometry.reset_counter = 0

    odometry.change = one_half
    bench.run(35.0, odometry)
    counts = bench.filter.external_counts
    assert counts is not None and counts.resets == 1
    assert position_error_m(odometry) < 0.3


def test_poor_and_late_samples_are_refused(flight: Array) -> None:
    bench = Bench(flight, parameters=replace(NO_GPS, external=replace(ALL, least_quality=40)))
    odometry = Odometry(bench)
    odometry.quality = 39
    bench.run(5.0, odometry)
    counts = bench.filter.external_counts
    assert counts is not None and counts.poor > 100 and counts.fused == 0
    odometry.quality, odometry.late_us = 40, 600_000
    bench.run(10.0, odometry)
    assert counts.late > 100 and counts.fused == 0
    odometry.late_us = 0
    bench.run(12.0, odometry)
    assert counts.fused > 30


def test_no_parameters_no_effect(flight: Array) -> None:
    """Messages that were not requested change no bit of the estimate."""
    reported, quiet = Bench(flight), Bench(flight)
    reported.run(30.0, Odometry(reported))
    quiet.run(30.0)
    assert reported.filter.state.tobytes() == quiet.filter.state.tobytes()


def test_the_sensor_sits_off_the_centre(flight: Array) -> None:
    arm = (0.5, -0.3, 0.2)
    errors = []
    for offset in (arm, (0.0, 0.0, 0.0)):
        bench = Bench(flight, parameters=replace(NO_GPS, external=replace(ALL, offset_frd_m=offset)))
        odometry = Odometry(bench)

        def on_arm(values: Array, bench: Bench = bench) -> None:
            values[POSITION_M] += rotation_matrix(bench.truth[t.Q_NED_FROM_FRD]) @ arm
            values[VELOCITY_M_S] += np.cross(bench.truth[t.RATES_FRD_RAD_S], arm)

        odometry.change = on_arm
        bench.run(40.0, odometry)
        errors.append(position_error_m(odometry))
    assert errors[0] < 0.1 and errors[1] == pytest.approx(math.hypot(*arm), abs=0.1)


@pytest.mark.parametrize(
    "wrong",
    [
        {"position_noise_m": 0.0},
        {"yaw_gate": math.nan},
        {"delay_s": -0.1},
        {"offset_frd_m": (0.0, math.inf, 0.0)},
        {"least_quality": 101},
    ],
)
def test_parameters_name_what_is_wrong(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        ExternalParameters(**wrong)
