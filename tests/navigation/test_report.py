"""What the filter reports of itself: which sensors are in use, and when its estimate is unusable."""

import math
from typing import Any

import numpy as np
import pytest

from autopilot_bridge.navigation import NavigationParameters, fusion
from autopilot_bridge.navigation import covariance as cov
from autopilot_bridge.navigation import states as s
from autopilot_bridge.navigation.clocks import Clocks
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.navigation.report import report
from autopilot_bridge.navigation.solution import Solution
from tests.navigation.matched import MATCHED

PARAMETERS = NavigationParameters(**MATCHED)
NOW_US = 60_000_000
NAMES = ("gps_us", "baro_us", "mag_us", "height_us", "horizontal_aid_us", "gps_position_us")


def reported(*, held: bool = False, at_rest: bool = False, age_s: float = 0.0, **ages_us: int) -> Any:
    """The health when every sensor aided just now, except those with an age; a negative age: never."""
    solution, clocks, health = Solution(PARAMETERS, physics_rate_hz=250), Clocks(), NavigationHealth()
    solution.p[:] = 0.0
    solution.core[s.SAMPLE_AGE_S] = age_s
    for name in NAMES:
        age_us = ages_us.get(name, 0)
        setattr(clocks, name, -1 if age_us < 0 else NOW_US - age_us)
    report(health, PARAMETERS, solution, clocks, NOW_US, held=held, at_rest=at_rest)
    return health


@pytest.mark.parametrize(
    ("clock", "limit_s", "flag"),
    [
        ("gps_us", 1.0, "gps_in_use"),
        ("baro_us", 1.0, "barometer_in_use"),
        ("mag_us", 5.0, "magnetometer_in_use"),
        ("height_us", 5.0, "position_vertical_absolute"),
        ("horizontal_aid_us", 5.0, "position_horizontal_relative"),
        ("horizontal_aid_us", 5.0, "position_horizontal_absolute"),
        ("horizontal_aid_us", 5.0, "velocity_horizontal"),
    ],
)
def test_an_aid_is_in_use_until_it_is_too_old(clock: str, limit_s: float, flag: str) -> None:
    limit_us = round(limit_s * 1e6)
    assert getattr(reported(), flag) and getattr(reported(**{clock: limit_us}), flag)
    assert not getattr(reported(**{clock: limit_us + 1}), flag)
    assert not getattr(reported(**{clock: -1}), flag)


def test_an_aided_position_without_gps_is_dead_reckoning() -> None:
    assert not reported().dead_reckoning
    health = reported(gps_us=1_000_001)
    assert health.dead_reckoning and health.time_since_gps_us == 1_000_001
    assert not reported(gps_us=-1, horizontal_aid_us=-1).dead_reckoning
    assert reported(gps_us=-1).time_since_gps_us == -1


def test_a_position_is_on_earth_only_with_a_gps() -> None:
    health = reported(gps_position_us=-1)
    assert health.position_horizontal_relative and not health.position_horizontal_absolute


def test_a_held_position_is_no_position_and_its_velocity_is_known_at_rest() -> None:
    for at_rest in (False, True):
        health = reported(held=True, at_rest=at_rest)
        assert health.constant_position and not health.position_horizontal_relative
        assert health.velocity_horizontal == at_rest


@pytest.mark.parametrize(("age_s", "alive"), [(0.2, True), (0.21, False)])
def test_nothing_is_valid_without_the_inertial_sensor(age_s: float, alive: bool) -> None:
    health = reported(age_s=age_s)
    flags = (health.attitude, health.position_vertical_absolute, health.position_horizontal_relative)
    assert flags == (alive,) * 3 and health.accel_error is not alive


@pytest.mark.parametrize(("index", "limit"), [(s.X_GYRO_BIAS, 1e6), (s.X_MAG_BIAS + 2, 1e6), (s.X_VEL, 1e3)])
def test_an_absurd_state_is_unsound(index: int, limit: float) -> None:
    for sign in (1.0, -1.0):
        for value, sound in ((limit - 0.5, True), (limit, False), (math.nan, False)):
            solution = Solution(PARAMETERS, physics_rate_hz=250)
            solution.p[:] = 0.0
            solution.core[: s.NOMINAL_SIZE] = 0.0
            solution.core[index] = sign * value
            assert bool(cov.is_sound(solution.p, solution.core)) == sound


@pytest.mark.parametrize(
    ("variance", "sound"), [(0.0, True), (-1e-9, False), (0.99e12, True), (1e12, False), (math.nan, False)]
)
def test_an_absurd_variance_is_unsound(variance: float, sound: bool) -> None:
    solution = Solution(PARAMETERS, physics_rate_hz=250)
    solution.p[:] = 0.0
    solution.core[: s.NOMINAL_SIZE] = 0.0
    for index in (0, s.ERROR_SIZE - 1):
        solution.p[:] = 0.0
        solution.p[index, index] = variance
        assert bool(cov.is_sound(solution.p, solution.core)) == sound


def test_accuracies_are_those_of_the_covariance() -> None:
    solution, clocks, health = Solution(PARAMETERS, physics_rate_hz=250), Clocks(), NavigationHealth()
    variances = np.linspace(1e-4, 3e-3, len(solution.p))
    solution.p[:] = np.diag(variances)
    report(health, PARAMETERS, solution, clocks, NOW_US, held=False, at_rest=False)
    assert health.position_horizontal_accuracy_m == pytest.approx(
        math.sqrt(variances[s.POS : s.POS + 2].sum())
    )
    assert health.position_vertical_accuracy_m == pytest.approx(math.sqrt(variances[s.POS + 2]))
    assert health.velocity_accuracy_m_s == pytest.approx(math.sqrt(variances[s.VEL : s.VEL + 2].sum()))
    assert health.attitude_accuracy_rad == pytest.approx(
        (math.sqrt(variances[s.ATT : s.ATT + 2].sum()), math.sqrt(variances[s.ATT + 2]))
    )


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize(("sigma_deg", "known"), [(9.9, True), (10.1, False)])
def test_attitude_is_known_within_ten_degrees_of_tilt(axis: int, sigma_deg: float, known: bool) -> None:
    solution, clocks, health = Solution(PARAMETERS, physics_rate_hz=250), Clocks(), NavigationHealth()
    solution.p[s.ATT + axis, s.ATT + axis] = math.radians(sigma_deg) ** 2
    solution.p[s.ATT + 2, s.ATT + 2] = 4.0  # whatever the heading
    report(health, PARAMETERS, solution, clocks, NOW_US, held=False, at_rest=False)
    assert health.attitude is known


@pytest.mark.parametrize(
    ("speed", "sigma", "known"), [(0.49, 0.1, True), (0.51, 0.1, False), (0.0, 0.51, False)]
)
@pytest.mark.parametrize("axis", [0, 1])
def test_velocity_at_rest_is_known_once_it_is_about_zero(
    axis: int, speed: float, sigma: float, known: bool
) -> None:
    solution, clocks, health = Solution(PARAMETERS, physics_rate_hz=250), Clocks(), NavigationHealth()
    solution.core[s.X_VEL + axis] = -speed
    solution.p[s.VEL + axis, s.VEL + axis] = sigma**2
    report(health, PARAMETERS, solution, clocks, NOW_US, held=True, at_rest=True)
    assert health.velocity_horizontal is known
    report(health, PARAMETERS, solution, clocks, NOW_US, held=True, at_rest=False)
    assert not health.velocity_horizontal


@pytest.mark.parametrize(
    ("baro", "gps", "age_us", "error"),
    [
        (1.1, 1.1, 1_000_001, True),
        (1.1, 1.1, 1_000_000, False),
        (0.9, 1.1, 1_000_001, False),
        (1.1, 0.9, 1_000_001, False),
        (1.1, 1.1, None, False),
    ],
)
def test_the_accelerometer_is_suspected_when_both_heights_are_refused(
    baro: float, gps: float, age_us: int | None, error: bool
) -> None:
    solution, clocks, health = Solution(PARAMETERS, physics_rate_hz=250), Clocks(), NavigationHealth()
    solution.obs[fusion.RATIO_BARO], solution.obs[fusion.RATIO_GPS_HEIGHT] = baro, gps
    clocks.height_us = -1 if age_us is None else NOW_US - age_us
    report(health, PARAMETERS, solution, clocks, NOW_US, held=False, at_rest=False)
    assert health.accel_error is error
