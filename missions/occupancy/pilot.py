"""The flight of one searcher: its next cell, the check whether that is reached, and the heading to it."""

import math
from dataclasses import dataclass
from typing import Final

from missions.occupancy.search import Search

_REACHED: Final = 0.35  # of a cell: within this distance of its centre it counts as reached
_SLOWEST_M_S: Final = 3.0  # ground speed, below which the yaw is used as the course
_WIND_SHARE: Final = 0.9  # of the airspeed; a stronger cross wind cannot be compensated
_PATIENCE_S: Final = 12.0  # time for the turn, added to the time limit of a leg
_TURNED_RAD: Final = math.radians(10.0)  # from the commanded course: within it the turn is flown
_OFF_COURSE_RAD: Final = math.radians(4.0)  # from the commanded course to the goal: more is corrected


def heading_for_course(course_rad: float, airspeed_m_s: float, wind_ne_m_s: tuple[float, float]) -> float:
    """The heading that gives a course over ground in wind (wind triangle).

    Args:
        course_rad: desired course, clockwise from north.
        airspeed_m_s: true airspeed.
        wind_ne_m_s: velocity of the air, north and east.

    Returns:
        Heading, 0..2 pi. When the cross wind is too strong to hold the course, the largest correction is
        used.
    """
    across_m_s = wind_ne_m_s[1] * math.cos(course_rad) - wind_ne_m_s[0] * math.sin(course_rad)
    share = across_m_s / airspeed_m_s if airspeed_m_s > 0.0 else 0.0
    return (course_rad - math.asin(min(_WIND_SHARE, max(-_WIND_SHARE, share)))) % math.tau


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """A searcher's motion from its telemetry, in the frame of the search.

    Attributes:
        time_us: vehicle time of the position.
        north_m, east_m: position.
        vel_ne_m_s: velocity over ground.
        yaw_rad: yaw, clockwise from north.
        airspeed_m_s: true airspeed; 0: not known.
        wind_ne_m_s: velocity of the air, north and east; zeros: not known.
    """

    time_us: int
    north_m: float
    east_m: float
    vel_ne_m_s: tuple[float, float]
    yaw_rad: float
    airspeed_m_s: float = 0.0
    wind_ne_m_s: tuple[float, float] = (0.0, 0.0)

    @property
    def ground_speed_m_s(self) -> float:
        """Ground speed."""
        return math.hypot(*self.vel_ne_m_s)

    @property
    def course_rad(self) -> float:
        """Course over ground; when nearly at rest, the yaw."""
        if self.ground_speed_m_s < _SLOWEST_M_S:
            return self.yaw_rad
        return math.atan2(self.vel_ne_m_s[1], self.vel_ne_m_s[0])


@dataclass(frozen=True, slots=True, kw_only=True)
class HeadingCommand:
    """One heading command that was sent to a searcher.

    Attributes:
        time_us: vehicle time.
        heading_rad: 0..2 pi.
        goal_ne_m: the goal of the command.
    """

    time_us: int
    heading_rad: float
    goal_ne_m: tuple[float, float]


class Pilot:
    """Flies one searcher: to its start, then from cell to cell.

    Attributes:
        commands: all commanded headings, in the order of time.
    """

    def __init__(self, search: Search, searcher: int, *, start_ne_m: tuple[float, float]) -> None:
        """Initialise the pilot.

        Args:
            search: the team's search.
            searcher: number of the searcher in the team.
            start_ne_m: place at which its part of the search begins.
        """
        self.commands: list[HeadingCommand] = []
        self._search = search
        self._searcher = searcher
        self._start_ne_m = start_ne_m
        self._goal_ne_m: tuple[float, float] | None = None
        self._from_ne_m = (0.0, 0.0)
        self._course_rad = 0.0  # that the newest command gives
        self._on_pass = False
        self._deadline_us = 0

    def update(self, motion: Motion) -> HeadingCommand | None:
        """Process the newest telemetry; returns a command when the next leg begins, else None.

        A leg from cell to cell is one heading. On a pass over a suspect the heading is corrected when the
        turn is flown: the turn has moved the vehicle aside, and the pass would miss what it is for.
        """
        if self._goal_ne_m is None:
            return self._fly_to(self._start_ne_m, motion)
        done = self._done(self._goal_ne_m, motion)
        leg_ne_m = self._search.next_leg(self._searcher, motion.time_us, done=done)
        if leg_ne_m is not None:
            self._on_pass = True
            return self._fly_to(leg_ne_m, motion)
        if self._on_pass and not done and self._search.flies_pass(self._searcher):
            return self._correction(self._goal_ne_m, motion)
        if not done and not self._on_pass:
            return None
        self._on_pass = False  # at its end, or because the suspect is decided
        decision = self._search.next_cell(
            self._searcher, motion.north_m, motion.east_m, motion.course_rad % math.tau
        )
        return self._fly_to(self._search.map.layout.centre_of(decision.cell), motion)

    def _done(self, goal_ne_m: tuple[float, float], motion: Motion) -> bool:
        """Whether a goal is reached or abeam, or its time limit has passed."""
        to_n, to_e = goal_ne_m[0] - motion.north_m, goal_ne_m[1] - motion.east_m
        leg_n, leg_e = goal_ne_m[0] - self._from_ne_m[0], goal_ne_m[1] - self._from_ne_m[1]
        reached = math.hypot(to_n, to_e) <= _REACHED * self._search.map.layout.cell_m
        return reached or to_n * leg_n + to_e * leg_e <= 0.0 or motion.time_us >= self._deadline_us

    def _correction(self, goal_ne_m: tuple[float, float], motion: Motion) -> HeadingCommand | None:
        """The heading to the goal, when the turn of the last command is flown and has led off the course."""
        bearing_rad = math.atan2(goal_ne_m[1] - motion.east_m, goal_ne_m[0] - motion.north_m)
        turned = abs(math.remainder(motion.course_rad - self._course_rad, math.tau)) <= _TURNED_RAD
        off = abs(math.remainder(bearing_rad - self._course_rad, math.tau)) > _OFF_COURSE_RAD
        return self._command(goal_ne_m, motion) if turned and off else None

    def _fly_to(self, goal_ne_m: tuple[float, float], motion: Motion) -> HeadingCommand:
        to_n, to_e = goal_ne_m[0] - motion.north_m, goal_ne_m[1] - motion.east_m
        speed_m_s = max(motion.ground_speed_m_s, _SLOWEST_M_S)
        self._goal_ne_m, self._from_ne_m = goal_ne_m, (motion.north_m, motion.east_m)
        self._deadline_us = motion.time_us + round(
            1e6 * (2.0 * math.hypot(to_n, to_e) / speed_m_s + _PATIENCE_S)
        )
        return self._command(goal_ne_m, motion)

    def _command(self, goal_ne_m: tuple[float, float], motion: Motion) -> HeadingCommand:
        """The command of the course to a goal."""
        self._course_rad = math.atan2(goal_ne_m[1] - motion.east_m, goal_ne_m[0] - motion.north_m)
        command = HeadingCommand(
            time_us=motion.time_us,
            heading_rad=heading_for_course(self._course_rad, motion.airspeed_m_s, motion.wind_ne_m_s),
            goal_ne_m=goal_ne_m,
        )
        self.commands.append(command)
        return command
