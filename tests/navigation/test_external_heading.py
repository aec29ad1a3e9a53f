"""The heading of external odometry: when it is taken over, refused, given back."""

import math
from typing import Any

import numpy as np
import pytest

from autopilot_bridge.navigation import external_fusion as e
from autopilot_bridge.navigation import states as s
from autopilot_bridge.navigation.external import ExternalFrame
from autopilot_bridge.navigation.external_heading import ExternalHeading
from autopilot_bridge.navigation.external_parameters import ExternalParameters
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.navigation.solution import Solution
from flightsim.foundation.rotations import quaternion_from_euler
from tests.rotations import yaw_rad

NOW_US = 60_000_000
P = ExternalParameters(use_yaw=True)
OURS = 0.4


class Sample:
    """What the heading needs of a sample."""

    def __init__(self, frame: ExternalFrame) -> None:
        self.frame = frame
        self.yaw_variance_rad2 = math.nan


class Rig:
    """A filter at heading 0.4 that flies north-east with 5 m/s."""

    def __init__(self, frame: ExternalFrame = ExternalFrame.LOCAL_FRD) -> None:
        self.solution = Solution(NavigationParameters(), physics_rate_hz=250)
        core = self.solution.core
        quaternion_from_euler(0.0, 0.0, OURS, core[s.Q : s.Q + 4])
        self.solution.history[:, s.HISTORY_Q : s.HISTORY_Q + 4] = core[s.Q : s.Q + 4]
        core[s.X_VEL : s.X_VEL + 3] = 3.0, 4.0, 1.0
        self.health, self.obs, self.frame = NavigationHealth(), np.zeros(e.EXT_SIZE), frame
        self.heading = ExternalHeading(solution=self.solution, health=self.health, obs=self.obs)

    def take(self, yaw: float, time_us: int = NOW_US, **how: bool) -> tuple[int, bool]:
        sample: Any = Sample(self.frame)
        return self.heading.take(P, sample, yaw, 0, time_us, **({"jumped": False, "placed": True} | how))

    def begin(self, yaw: float = 1.5) -> None:
        for _ in range(6):
            self.take(yaw)
        assert self.heading.in_use


def test_it_begins_after_five_headings_that_agree_among_themselves() -> None:
    rig = Rig()
    for _ in range(5):
        assert rig.take(1.5) == (0, False)
        assert not rig.heading.in_use
    assert rig.take(1.5) == (e.EXT_HAS_YAW, True)
    assert rig.heading.in_use and rig.heading.own
    assert yaw_rad(rig.solution.core[s.Q : s.Q + 4]) == pytest.approx(1.5)


def test_the_estimate_turns_with_its_velocity() -> None:
    rig = Rig()
    rig.begin()
    angle = 1.5 - OURS
    c, sn = math.cos(angle), math.sin(angle)
    assert rig.solution.core[s.X_VEL : s.X_VEL + 3] == pytest.approx(
        [3.0 * c - 4.0 * sn, 3.0 * sn + 4.0 * c, 1.0]
    )
    assert rig.solution.p[s.VEL, s.VEL] == rig.solution.p[s.VEL + 1, s.VEL + 1] == 100.0
    assert rig.solution.p[s.ATT + 2, s.ATT + 2] == pytest.approx(P.yaw_noise_rad**2)
    assert rig.health.yaw_aligned
    assert (rig.health.yaw_resets, rig.health.yaw_reset_rad) == (1, pytest.approx(angle))


@pytest.mark.parametrize(("step", "begins"), [(0.19, True), (0.21, False), (-0.19, True), (-0.21, False)])
def test_headings_that_move_against_the_gyro_are_not_begun_with(step: float, begins: bool) -> None:
    rig = Rig()
    for k in range(8):
        rig.take(1.5 + k * step)
    assert rig.heading.in_use is begins


def test_a_sender_that_moves_otherwise_is_not_begun_with() -> None:
    rig = Rig()
    for _ in range(10):
        assert rig.take(1.5, placed=False) == (0, False)
    assert not rig.heading.in_use


def test_a_heading_of_north_that_agrees_with_the_compass_turns_nothing() -> None:
    for off, turned in ((2.9, False), (-2.9, False), (3.1, True), (-3.1, True)):
        rig = Rig(ExternalFrame.NED)
        for _ in range(6):
            found = rig.take(OURS + off * P.yaw_noise_rad)
        assert found == (e.EXT_HAS_YAW, turned)
        assert rig.health.yaw_resets == int(turned)
        assert not rig.heading.own


def test_a_jump_of_the_sender_turns_the_estimate_at_once_while_in_use() -> None:
    rig = Rig()
    rig.begin()
    assert rig.take(1.6) == (e.EXT_HAS_YAW, False)
    assert rig.take(2.5, jumped=True) == (e.EXT_HAS_YAW, True)
    assert rig.health.yaw_resets == 2
    other = Rig()
    assert other.take(2.5, jumped=True) == (0, False)


def test_a_heading_refused_for_long_is_gone_over_to() -> None:
    rig = Rig()
    rig.begin()
    rig.heading.note(False, NOW_US)
    reset_us = round(P.reset_after_s * 1e6)
    for later_us, turned in ((0, False), (reset_us, False), (reset_us + 1, True)):
        for _ in range(5):
            found = rig.take(2.9, NOW_US + later_us)
        rig.heading.note(False, NOW_US + later_us)
        assert (rig.health.yaw_resets == 2) is turned
    assert found[0] == e.EXT_HAS_YAW


def test_an_accepted_heading_ends_the_refusal() -> None:
    rig = Rig()
    rig.begin()
    rig.heading.note(False, NOW_US)
    rig.heading.note(True, NOW_US + 1)
    late_us = NOW_US + 10 * round(P.reset_after_s * 1e6)
    for _ in range(8):
        rig.take(2.9, late_us)
    assert rig.health.yaw_resets == 1


@pytest.mark.parametrize("frame", [ExternalFrame.NED, ExternalFrame.LOCAL_FRD])
def test_a_silent_sender_gives_the_heading_back(frame: ExternalFrame) -> None:
    timeout_us = round(P.timeout_s * 1e6)
    for later_us, in_use in ((timeout_us, True), (timeout_us + 1, False)):
        rig = Rig(frame)
        rig.begin()
        rig.heading.watch(P, NOW_US + later_us)
        assert rig.heading.in_use is in_use
        # where it was not north, the compass aligns anew
        assert rig.health.yaw_aligned is (in_use or frame is ExternalFrame.NED)
    rig = Rig()
    rig.begin()
    rig.heading.watch(ExternalParameters(use_yaw=False), NOW_US)
    assert not rig.heading.in_use


def test_the_turn_between_the_frames_is_a_mean_of_differences() -> None:
    rig = Rig()
    sample: Any = Sample(ExternalFrame.LOCAL_FRD)
    assert rig.heading.turn_to_ned(sample, 1.0, 0) == pytest.approx(OURS - 1.0)
    assert rig.heading.turn_to_ned(sample, 1.2, 0) == pytest.approx(OURS - 1.0 - 0.1 * 0.2)
    assert math.isnan(rig.heading.turn_to_ned(sample, math.nan, 0))
    north: Any = Sample(ExternalFrame.NED)
    assert rig.heading.turn_to_ned(north, 1.0, 0) == 0.0
    rig.begin()
    assert rig.heading.turn_to_ned(sample, 1.0, 0) == 0.0
