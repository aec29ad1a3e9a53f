"""The manoeuvres of a compensation flight: rolls, pitches and yaws on four headings; without I/O.

The figure of merit of a survey aircraft is flown the same way (Reeves 2005, "Aeromagnetic Surveys", chapter
3). An autopilot that is commanded by attitude has no rudder of its own, so the yaws are slow turns to both
sides, in which the nose swings and the bank leads it by a quarter of a period.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from estimators.survey.compensation import CYCLES
from missions.vehicle.piloting import HeadingController

__all__ = ["BOXES", "HEADINGS", "AttitudeCommand", "Manoeuvre", "Programme", "box_side_m", "manoeuvres"]

HEADINGS: Final = 4
BOXES: Final = 2
"""The first box is fitted, the second one judges the fit."""

_SETTLED_RAD: Final = math.radians(4.0)
_SETTLE_S: Final = 4.0
_PAUSE_S: Final = 2.0
_TURN_BANK_RAD: Final = math.radians(25.0)
_TURN_S: Final = 25.0


class Axis(StrEnum):
    """Axes of the manoeuvres."""

    ROLL = "roll"
    PITCH = "pitch"
    YAW = "yaw"


_AMPLITUDE_RAD: Final = {
    Axis.ROLL: math.radians(12.0),
    Axis.PITCH: math.radians(6.0),
    Axis.YAW: math.radians(12.0),
}
"""Of the commanded bank or pitch."""
_PERIOD_S: Final = {Axis.ROLL: 4.0, Axis.PITCH: 5.0, Axis.YAW: 8.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class Manoeuvre:
    """One of the manoeuvres.

    Attributes:
        box: number of the box, from 0.
        heading_rad: heading of the leg.
        axis: axis.
    """

    box: int
    heading_rad: float
    axis: Axis

    @property
    def duration_s(self) -> float:
        return CYCLES * _PERIOD_S[self.axis]

    @property
    def label(self) -> str:
        """Name of its phase in the flight's notes."""
        degrees = round(math.degrees(self.heading_rad)) % 360
        return f"box {self.box + 1} heading {degrees:03d} {self.axis}"


@dataclass(frozen=True, slots=True, kw_only=True)
class AttitudeCommand:
    """What the aircraft is commanded.

    Attributes:
        roll_rad: bank.
        pitch_offset_rad: to be added to the pitch that holds the height.
    """

    roll_rad: float
    pitch_offset_rad: float = 0.0


def manoeuvres(direction_rad: float) -> tuple[Manoeuvre, ...]:
    """All manoeuvres in order: two boxes with four legs and three manoeuvres on each.

    Args:
        direction_rad: heading of the first leg: that of the survey's lines.
    """
    return tuple(
        Manoeuvre(
            box=box, heading_rad=math.remainder(direction_rad + 0.5 * math.pi * leg, math.tau), axis=axis
        )
        for box in range(BOXES)
        for leg in range(HEADINGS)
        for axis in Axis
    )


def box_side_m(speed_m_s: float) -> float:
    """Length of a leg, over ground, at most so long."""
    return speed_m_s * (
        _SETTLE_S + _TURN_S + sum(CYCLES * period + _PAUSE_S for period in _PERIOD_S.values())
    )


class Programme:
    """Goes through the manoeuvres; every `command` moves it on.

    Attributes:
        current: manoeuvre that is being flown; None: between two.
        done: number of finished manoeuvres.
    """

    def __init__(self, flown: Sequence[Manoeuvre]) -> None:
        self.current: Manoeuvre | None = None
        self.done = 0
        self._flown = tuple(flown)
        self._controller = HeadingController(bank_max_rad=_TURN_BANK_RAD)
        self._since_s = math.nan  # begin of the manoeuvre, or of the time on the heading
        self._wait_s = _SETTLE_S

    @property
    def count(self) -> int:
        """Number of all manoeuvres."""
        return len(self._flown)

    @property
    def over(self) -> bool:
        return self.done >= len(self._flown)

    def command(self, time_s: float, *, yaw_rad: float, airspeed_m_s: float) -> AttitudeCommand | None:
        """The command at a time; None when all manoeuvres are flown.

        Args:
            time_s: increasing.
            yaw_rad: reported heading.
            airspeed_m_s: true airspeed; NaN: not known.
        """
        if self.over:
            return None
        manoeuvre = self._flown[self.done]
        hold_rad = self._controller.roll_rad(
            heading_rad=yaw_rad,
            wanted_rad=manoeuvre.heading_rad,
            airspeed_m_s=airspeed_m_s if math.isfinite(airspeed_m_s) else 15.0,
        )
        if self.current is None:
            off_rad = abs(math.remainder(yaw_rad - manoeuvre.heading_rad, math.tau))
            if off_rad > _SETTLED_RAD or math.isnan(self._since_s):
                self._since_s = time_s
            if time_s - self._since_s < self._wait_s:
                return AttitudeCommand(roll_rad=hold_rad)
            self.current, self._since_s = manoeuvre, time_s
        elapsed_s = time_s - self._since_s
        if elapsed_s >= manoeuvre.duration_s:
            self.current, self._since_s = None, math.nan
            self.done += 1
            same_leg = not self.over and self._flown[self.done].heading_rad == manoeuvre.heading_rad
            self._wait_s = _PAUSE_S if same_leg else _SETTLE_S
            return AttitudeCommand(roll_rad=hold_rad)
        swing = _AMPLITUDE_RAD[manoeuvre.axis] * math.sin(math.tau * elapsed_s / _PERIOD_S[manoeuvre.axis])
        if manoeuvre.axis is Axis.PITCH:
            return AttitudeCommand(roll_rad=hold_rad, pitch_offset_rad=swing)
        # the heading is not held meanwhile: a cosine of heading has the mean that the leg has
        return AttitudeCommand(roll_rad=swing)
