"""The checks of a receiver's fix, one limit at a time (PX4's EKF2_REQ_*)."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot_bridge.navigation import NavigationParameters
from autopilot_bridge.navigation.gps_aiding import GpsQuality
from flightsim.interface import (
    GPS_ALT_M,
    GPS_EPH_M,
    GPS_EPV_M,
    GPS_FIX_TYPE,
    GPS_HDOP,
    GPS_LAT_DEG,
    GPS_LON_DEG,
    GPS_SATELLITES,
    GPS_SIZE,
    GPS_SPEED_ACCURACY_M_S,
    GPS_VEL_NED_M_S,
)

Array = NDArray[np.float64]
PERIOD_US = 200_000
VEL = GPS_VEL_NED_M_S.start
M_PER_DEG = 111_200.0


def sample(**changes: float) -> Array:
    """A good fix at 47 N, 8 E."""
    out = np.zeros(GPS_SIZE)
    out[GPS_FIX_TYPE], out[GPS_SATELLITES] = 3.0, 10.0
    out[GPS_EPH_M], out[GPS_EPV_M] = 0.5, 0.8
    out[GPS_SPEED_ACCURACY_M_S], out[GPS_HDOP] = 0.2, 0.9
    out[GPS_LAT_DEG], out[GPS_LON_DEG], out[GPS_ALT_M] = 47.0, 8.0, 500.0
    return out


def at(north_m: float, east_m: float, down_m: float, velocity: tuple[float, float, float]) -> Array:
    out = sample()
    out[GPS_LAT_DEG] += north_m / M_PER_DEG
    out[GPS_LON_DEG] += east_m / (M_PER_DEG * math.cos(math.radians(47.0)))
    out[GPS_ALT_M] -= down_m
    out[GPS_VEL_NED_M_S] = velocity
    return out


def judge(quality: GpsQuality, samples: list[Array], start_us: int = 1_000_000) -> list[bool]:
    return [
        quality.judge(each, start_us + k * PERIOD_US, start_us + k * PERIOD_US)
        for k, each in enumerate(samples)
    ]


def trembling(count: int) -> list[Array]:
    """A receiver at rest, whose last digits change."""
    return [at(0.01 * (k % 3), 0.0, 0.0, (0.0, 0.0, 0.0)) for k in range(count)]


P = NavigationParameters()


@pytest.mark.parametrize(
    ("place", "passes", "fails"),
    [
        (GPS_FIX_TYPE, 3.0, 2.0),
        (GPS_FIX_TYPE, 6.0, 0.0),
        (GPS_SATELLITES, P.gps_required_satellites, P.gps_required_satellites - 1),
        (GPS_EPH_M, P.gps_required_eph_m, P.gps_required_eph_m + 0.01),
        (GPS_EPH_M, 0.0, -0.01),
        (GPS_EPV_M, P.gps_required_epv_m, P.gps_required_epv_m + 0.01),
        (GPS_EPV_M, 0.0, -0.01),
        (GPS_SPEED_ACCURACY_M_S, P.gps_required_speed_accuracy_m_s, P.gps_required_speed_accuracy_m_s + 0.01),
        (GPS_SPEED_ACCURACY_M_S, 0.0, -0.01),
        (GPS_HDOP, P.gps_required_hdop, P.gps_required_hdop + 0.01),
        (GPS_HDOP, 0.0, -0.01),
        (GPS_LAT_DEG, 90.0, 90.01),
        (GPS_LAT_DEG, -90.0, -90.01),
        (GPS_LON_DEG, 180.0, 180.01),
        (GPS_LON_DEG, -180.0, -180.01),
        (GPS_ALT_M, 1e5, 1.001e5),
        (GPS_ALT_M, -1e5, -1.001e5),
        (VEL, 999.0, 1001.0),
        (VEL + 1, -999.0, -1001.0),
        (VEL + 2, math.nan, 1001.0),
        (GPS_EPH_M, 1.0, math.nan),
        (GPS_LAT_DEG, 10.0, math.nan),
        (GPS_ALT_M, 10.0, math.nan),
    ],
)
def test_limits(place: int, passes: float, fails: float) -> None:
    for value, good in ((passes, True), (fails, False)):
        quality = GpsQuality(P)
        fix = sample()
        fix[place] = value
        quality.judge(fix, 0, 0)
        assert quality.good is good
        assert quality.good_since_us == (0 if good else -1)


def test_checks_must_hold_for_their_time() -> None:
    quality = GpsQuality(P)
    held = round(P.gps_check_time_s * 1e6) // PERIOD_US
    assert judge(quality, trembling(held + 2)) == [False] * held + [True, True]
    assert quality.good_since_us == 1_000_000
    bad = sample()
    bad[GPS_FIX_TYPE] = 2.0
    assert not quality.judge(bad, 9_000_000, 9_000_000)
    assert quality.good_since_us == -1


@pytest.mark.parametrize(("silence_us", "goes_on"), [(2_000_000, True), (2_000_001, False)])
def test_silence_ends_a_series(silence_us: int, goes_on: bool) -> None:
    quality = GpsQuality(P)
    judge(quality, trembling(10))
    newest_us = 1_000_000 + 9 * PERIOD_US
    quality.silent(newest_us + silence_us)
    assert quality.good is goes_on
    later_us = newest_us + silence_us
    assert quality.judge(at(0.02, 0.0, 0.0, (0.0, 0.0, 0.0)), later_us, later_us) is goes_on


def test_a_receiver_that_repeats_itself_no_longer_measures() -> None:
    for may_repeat in (False, True):
        quality = GpsQuality(NavigationParameters(gps_may_repeat=may_repeat))
        judge(quality, [sample()] * 5)
        assert quality.good
        judge(quality, [sample()], 3_000_000)
        assert quality.good is may_repeat
        judge(quality, [at(0.01, 0.0, 0.0, (0.0, 0.0, 0.0))], 3_200_000)
        assert quality.good


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_position_and_velocity_agree_over_two_seconds(axis: int, sign: float) -> None:
    """Within 4 sigma of the position (here of 0.943 m) and 1.5 m."""
    velocity = [0.0, 0.0, 0.0]
    velocity[axis] = sign * 5.0
    allowed_m = 4.0 * math.hypot(0.5, 0.8) + 1.5

    def flight(rate_m_s: float, count: int) -> list[Array]:
        places = []
        for k in range(count):
            place = [0.0, 0.0, 0.0]
            place[axis] = rate_m_s * k * 0.2
            places.append(at(*place, tuple(velocity)))  # type: ignore[arg-type, call-arg]
        return places

    honest = GpsQuality(P)
    assert judge(honest, flight(sign * 5.0, 40))[-1]
    slightly = GpsQuality(P)
    judge(slightly, flight(sign * 5.0 + 0.95 * allowed_m / 2.0, 40))
    assert slightly.good_since_us == 1_000_000  # good all the time
    wrong = GpsQuality(P)
    assert not any(judge(wrong, flight(sign * 5.0 + 1.2 * allowed_m / 2.0, 40))[12:])
    assert wrong.good_since_us != 1_000_000


def test_an_accelerating_vehicle_agrees_with_itself() -> None:
    """The trapezoidal rule follows 4 m/s^2 exactly."""
    quality = GpsQuality(P)
    times = [0.2 * k for k in range(30)]
    path = [at(2.0 * t * t, 0.0, 0.0, (4.0 * t, 0.0, 0.0)) for t in times]
    judge(quality, path)
    assert quality.good_since_us == 1_000_000


def test_a_liar_is_not_trusted_for_two_seconds() -> None:
    quality = GpsQuality(NavigationParameters(gps_check_time_s=0.2))
    judge(quality, trembling(20))
    start_us = 1_000_000 + 20 * PERIOD_US
    assert judge(quality, [at(50.0, 0.0, 0.0, (0.0, 0.0, 0.0))], start_us) == [False]
    again = judge(
        quality,
        [at(50.0 + 0.01 * (k % 3), 0.0, 0.0, (0.0, 0.0, 0.0)) for k in range(14)],
        start_us + PERIOD_US,
    )
    assert again == [False] * 10 + [True] * 4


def test_unknown_velocity_contradicts_nothing() -> None:
    quality = GpsQuality(P)
    unknown = (math.nan, math.nan, math.nan)
    judge(quality, [at(3.0 * k, 0.0, 0.0, unknown) for k in range(20)])
    assert quality.good_since_us == 1_000_000


def test_the_date_line_is_no_jump() -> None:
    quality = GpsQuality(P)
    fixes = []
    for k in range(20):
        fix = at(0.0, 0.0, 0.0, (0.0, 5.0 * math.cos(math.radians(47.0)), 0.0))
        fix[GPS_LON_DEG] = (179.99999 + k * 1.0 / M_PER_DEG + 180.0) % 360.0 - 180.0
        fixes.append(fix)
    judge(quality, fixes)
    assert quality.good_since_us == 1_000_000


def test_restart_forgets_and_new_thresholds_count() -> None:
    quality = GpsQuality(P)
    judge(quality, trembling(10))
    quality.restart()
    assert not quality.good
    assert quality.good_since_us == -1
    quality.set_parameters(NavigationParameters(gps_required_satellites=11))
    quality.judge(sample(), 5_000_000, 5_000_000)
    assert not quality.good
