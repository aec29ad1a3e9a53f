"""Standing still, and what is held while nothing aids the position or the height."""

import math

import pytest

from autopilot_bridge.navigation import NavigationParameters, fusion
from autopilot_bridge.navigation import states as s
from autopilot_bridge.navigation.clocks import Clocks
from autopilot_bridge.navigation.solution import Solution
from autopilot_bridge.navigation.standby import Standby

P = NavigationParameters()
NOW_US = 60_000_000
SIGMA = math.sqrt(P.gyro_bias_rad_s**2 + P.zero_rate_noise_rad_s**2)


class Rig:
    """A filter whose position was never aided; the height was, just now."""

    def __init__(self) -> None:
        self.solution, self.clocks = Solution(P, physics_rate_hz=250), Clocks()
        self.core, self.obs = self.solution.core, self.solution.obs
        self.core[s.X_POS : s.X_POS + 3] = 10.0, 20.0, -30.0
        self.core[s.X_VEL : s.X_VEL + 3] = 3.0, -4.0, 0.5
        for axis in range(3):
            self.solution.p[s.GYRO_BIAS + axis, s.GYRO_BIAS + axis] = P.gyro_bias_rad_s**2
        self.clocks.height_us = NOW_US
        self.standby = Standby(self.solution, self.clocks)

    def prepare(
        self, time_us: int = NOW_US, *, at_rest: bool = False, winged: bool = False, flying: bool = False
    ) -> int:
        return self.standby.prepare(P, time_us, at_rest=at_rest, winged=winged, flying=flying)

    def turn(self, *rates: float, span_s: float = 0.04) -> None:
        """The mean gyro reading since the last update."""
        for axis, rate in enumerate(rates):
            self.core[s.SUM_GYRO + axis] = rate * span_s
        self.core[s.SUM_GYRO_TIME] = span_s


def test_a_position_that_nothing_aids_is_held_where_it_is() -> None:
    rig = Rig()
    assert rig.prepare() == fusion.HAS_HOLD
    assert rig.standby.held
    assert rig.obs[fusion.HOLD : fusion.HOLD + 2].tolist() == [10.0, 20.0]
    rig.core[s.X_POS] = 11.0
    rig.prepare(NOW_US + 1)
    assert rig.obs[fusion.HOLD] == 10.0  # there, not wherever it has gone since
    rig.standby.release()
    assert not rig.standby.held


@pytest.mark.parametrize(("age_s", "held"), [(P.no_aid_timeout_s, False), (P.no_aid_timeout_s + 1e-6, True)])
def test_it_is_held_after_the_timeout_of_the_last_aid(age_s: float, held: bool) -> None:
    rig = Rig()
    rig.clocks.horizontal_aid_us = NOW_US - round(age_s * 1e6)
    assert bool(rig.prepare() & fusion.HAS_HOLD) is held
    assert rig.standby.held is held
    # about zero is the best guess of a velocity that nothing has measured lately
    velocity = rig.core[s.X_VEL : s.X_VEL + 3].tolist()
    assert velocity == ([0.0, 0.0, 0.5] if held else [3.0, -4.0, 0.5])
    if held:
        assert rig.solution.p[s.VEL, s.VEL] == rig.solution.p[s.VEL + 1, s.VEL + 1] == 4.0


@pytest.mark.parametrize(
    ("aided_once", "at_rest", "winged", "noise"),
    [
        (False, False, False, P.at_rest_noise_m),
        (False, True, False, P.at_rest_noise_m),
        (False, False, True, P.no_aid_noise_m),
        (False, True, True, P.at_rest_noise_m),
        (True, False, False, P.no_aid_noise_m),
        (True, True, False, P.at_rest_noise_m),
    ],
)
def test_how_firmly_it_is_held(aided_once: bool, at_rest: bool, winged: bool, noise: float) -> None:
    """A vehicle that may have left its place is held loosely."""
    rig = Rig()
    rig.clocks.horizontal_aid_us = 0 if aided_once else -1
    rig.prepare(at_rest=at_rest, winged=winged)
    assert rig.obs[fusion.HOLD_VAR] == pytest.approx(noise**2)


def test_a_wing_in_flight_is_adrift_and_held_again_when_it_no_longer_flies() -> None:
    rig = Rig()
    rig.clocks.horizontal_aid_us = 0
    assert rig.prepare(winged=True, flying=True) == 0
    assert rig.standby.held
    assert rig.core[s.X_VEL] == 3.0  # its velocity is not forgotten in flight
    rig.core[s.X_POS : s.X_POS + 2] = 500.0, 600.0
    assert rig.prepare(NOW_US + 1, winged=True) == fusion.HAS_HOLD
    assert rig.obs[fusion.HOLD : fusion.HOLD + 2].tolist() == [500.0, 600.0]
    assert rig.core[s.X_VEL] == 0.0


@pytest.mark.parametrize(("age_s", "held"), [(P.height_timeout_s, False), (P.height_timeout_s + 1e-6, True)])
def test_height_is_held_after_its_timeout(age_s: float, held: bool) -> None:
    rig = Rig()
    rig.clocks.height_us = NOW_US - round(age_s * 1e6)
    assert bool(rig.prepare() & fusion.HAS_HOLD_HEIGHT) is held
    assert rig.clocks.height_held is held
    if held:
        assert rig.obs[fusion.HOLD + 2] == -30.0
        assert rig.obs[fusion.HOLD_HEIGHT_VAR] == pytest.approx(P.at_rest_noise_m**2)
        rig.core[s.X_POS + 2] = -35.0
        rig.prepare(NOW_US + 1)
        assert rig.obs[fusion.HOLD + 2] == -30.0
        rig.clocks.height_us = NOW_US + 2
        rig.prepare(NOW_US + 2)
        assert not rig.clocks.height_held


def test_rest_counts_from_its_second_update() -> None:
    """The first average of the gyro began in motion."""
    rig = Rig()
    rig.turn(0.5, 0.0, 0.0)
    assert not rig.prepare(at_rest=True) & fusion.HAS_REST
    assert rig.core[s.SUM_GYRO_TIME] == 0.0
    rig.turn(0.0, 0.0, 0.0)
    assert rig.prepare(NOW_US + 1, at_rest=True) & fusion.HAS_REST
    assert not rig.prepare(NOW_US + 2) & fusion.HAS_REST
    assert not rig.prepare(NOW_US + 3, at_rest=True) & fusion.HAS_REST


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_vehicle_that_turns_does_not_rest_for_ten_seconds(axis: int, sign: float) -> None:
    """A gust turns an aircraft on its wheels; a rate that stays the same for longer is a bias."""
    for sigmas, turned in ((4.9, False), (5.1, True)):
        rig = Rig()
        rig.core[s.X_GYRO_BIAS : s.X_GYRO_BIAS + 3] = 0.01
        rates = [0.01, 0.01, 0.01]
        rates[axis] += sign * sigmas * SIGMA
        rig.prepare(at_rest=True)
        for later_us, rests in ((0, False), (9_999_999, False), (10_000_000, True)):
            rig.turn(*rates)
            found = rig.prepare(NOW_US + later_us, at_rest=True)
            assert bool(found & fusion.HAS_REST) is (rests or not turned)


def test_a_turn_at_another_rate_begins_anew() -> None:
    rig = Rig()
    rig.prepare(at_rest=True)
    for later_us, rate in ((0, 0.1), (9_000_000, 0.2), (12_000_000, 0.2), (18_999_999, 0.2)):
        rig.turn(0.0, 0.0, rate)
        assert not rig.prepare(NOW_US + later_us, at_rest=True) & fusion.HAS_REST
    rig.turn(0.0, 0.0, 0.2)
    assert rig.prepare(NOW_US + 19_000_000, at_rest=True) & fusion.HAS_REST


def test_a_still_moment_ends_a_turn() -> None:
    rig = Rig()
    rig.prepare(at_rest=True)
    for later_us, rate, rests in ((0, 0.1, False), (6_000_000, 0.0, True), (12_000_000, 0.1, False)):
        rig.turn(0.0, 0.0, rate)
        assert bool(rig.prepare(NOW_US + later_us, at_rest=True) & fusion.HAS_REST) is rests
