"""Another aircraft by the motion that it reports over a link with delays and losses.

The reports hold sums since the start (`autopilot_bridge.mavlink.vehicle_motion`), so the way between two of
them is known from these two. Up to the present it is extrapolated by the newest velocity and yaw rate; what
was extrapolated wrongly is put right with the next report.
"""

import math
from collections import Counter
from collections.abc import Callable
from typing import Final

from autopilot_bridge.mavlink.vehicle_motion import VehicleMotion
from estimators.interface import Outcome
from estimators.relative_pose.belief import LevelMotion
from estimators.vehicle_time import FAR_BACK_US

_LATE_US: Final = 5_000_000
"""A report that is older by more, and has less than half of the newest time, is of a sender that has started
again; so is one that is older by `FAR_BACK_US`."""
_FASTEST_M_S: Final = 150.0
_DRIFT: Final = 5e-5  # of two clocks against each other

Sums = tuple[float, ...]


class ReportedAircraft:
    """What is known about the other aircraft.

    The offset between both clocks is the least time from a report until its arrival: the least delay of the
    link counts as offset.

    Attributes:
        on_motion: called with the sender's time of each report, the time since the one before, and the motion
            in it; None: not called.
        heading_rad, height_m: magnetic heading and pressure altitude at the time up to which `motion` was
            called; NaN: not known.
        counts: reports that were "used", "late" or "repeated", and "restarts" of the sender.
        OLD_US: a newest report that is older is not extrapolated.
    """

    OLD_US: Final = 1_000_000

    def __init__(self) -> None:
        self.on_motion: Callable[[int, float, LevelMotion], None] | None = None
        self.counts: Counter[str] = Counter()
        self.reset()

    def reset(self) -> None:
        """Discard everything but the counts."""
        self.heading_rad = self.height_m = math.nan
        self.offset_us = 0
        self._newest: VehicleMotion | None = None
        self._used: Sums | None = None
        self._used_us = 0

    def take(self, arrived_us: int, report: VehicleMotion) -> Outcome:
        """Process a report.

        Args:
            arrived_us: own time of its arrival.
            report: of the other aircraft.

        Returns:
            `TIME_JUMP` when the sender has started again: its sums began anew.
        """
        before, offset_us = self._newest, arrived_us - report.time_us
        if before is None:
            self.offset_us = offset_us
        else:
            step_us = report.time_us - before.time_us
            early = step_us < -_LATE_US and 2 * report.time_us < before.time_us
            if step_us <= 0 and not early and step_us > -FAR_BACK_US:
                self.counts["late" if step_us else "repeated"] += 1
                return Outcome.LATE
            way_m = math.dist(report.sums[:3], before.sums[:3])
            if step_us < 0 or way_m > _FASTEST_M_S * step_us * 1e-6:
                self.counts["restarts"] += 1
                self.reset()
                return Outcome.TIME_JUMP
            self.offset_us = min(offset_us, self.offset_us + math.ceil(_DRIFT * step_us))
            if self.on_motion is not None:
                step_s = step_us * 1e-6
                self.on_motion(report.time_us, step_s, _mean(before.sums, report.sums, step_s))
        self._newest = report
        self.counts["used"] += 1
        return Outcome.USED

    @property
    def newest_us(self) -> int | None:
        """Time of the newest report, by the own clock; None: there is none yet."""
        return None if self._newest is None else self._newest.time_us + self.offset_us

    @property
    def moved(self) -> bool:
        """Whether there is a motion."""
        return self._newest is not None

    def since_report(self, until_us: int) -> tuple[float, LevelMotion]:
        """Time from the newest report up to an own time, s, and the motion in it. There must be a report."""
        newest = self._newest
        assert newest is not None, "no report yet"
        forward, right, down, turn = newest.rates
        return (until_us - newest.time_us - self.offset_us) * 1e-6, LevelMotion(
            forward_m_s=forward, right_m_s=right, down_m_s=down, yaw_rate_rad_s=turn
        )

    def motion(self, until_us: int) -> LevelMotion:
        """Mean motion since the time of the last call, up to an own time. There must be a report."""
        newest = self._newest
        assert newest is not None, "no report yet"
        since_s, present = self.since_report(until_us)
        self.heading_rad = newest.heading_rad + since_s * present.yaw_rate_rad_s
        self.height_m = newest.height_m - since_s * present.down_m_s
        sums = tuple(s + since_s * rate for s, rate in zip(newest.sums, newest.rates, strict=True))
        used, self._used = self._used, sums
        span_s, self._used_us = (until_us - self._used_us) * 1e-6, until_us
        return present if used is None or span_s <= 0.0 else _mean(used, sums, span_s)


def _mean(begin: Sums, end: Sums, span_s: float) -> LevelMotion:
    forward, right, down, turn = ((b - a) / span_s for a, b in zip(begin, end, strict=True))
    return LevelMotion(forward_m_s=forward, right_m_s=right, down_m_s=down, yaw_rate_rad_s=turn)
