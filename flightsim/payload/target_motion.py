"""How ground targets move: parameters, and the trajectories they start.

A trajectory is a function of vehicle time alone: the number of calls has no effect.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flightsim.foundation.checks import NotNegative, NotNegativeOrInf, Positive
from flightsim.foundation.options import Options

State = tuple[float, float, float, float]
"""north m, east m, north m/s, east m/s"""


class Trajectory(Protocol):
    """Where a target is at a time."""

    def at(self, time_s: float) -> State:
        """State at a time, seconds since boot; times do not go back."""


class TargetMotion(Protocol):
    """A kind of motion: a parameter set that starts a trajectory."""

    def start(self, rng: np.random.Generator) -> Trajectory:
        """The trajectory of one target; what is random about it comes from `rng`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Static(Options):
    """Stays where it is.

    Attributes:
        north_m, east_m: place, local NED of home.
    """

    north_m: float
    east_m: float

    def start(self, rng: np.random.Generator) -> Trajectory:
        """Nothing is random."""
        return self

    def at(self, time_s: float) -> State:
        """The place."""
        return self.north_m, self.east_m, 0.0, 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstantVelocity(Options):
    """Straight on.

    Attributes:
        north_m, east_m: place at boot, local NED of home.
        speed_m_s: over ground.
        course_rad: clockwise from north.
    """

    north_m: float
    east_m: float
    speed_m_s: NotNegative
    course_rad: float

    def start(self, rng: np.random.Generator) -> Trajectory:
        """Nothing is random."""
        return self

    def at(self, time_s: float) -> State:
        """The place reached."""
        north_m_s = self.speed_m_s * math.cos(self.course_rad)
        east_m_s = self.speed_m_s * math.sin(self.course_rad)
        return self.north_m + north_m_s * time_s, self.east_m + east_m_s * time_s, north_m_s, east_m_s


@dataclass(frozen=True, slots=True, kw_only=True)
class Circle(Options):
    """Round and round.

    Attributes:
        north_m, east_m: centre, local NED of home.
        radius_m: of the circle.
        speed_m_s: over ground.
        bearing_rad: of the target from the centre at boot, clockwise from north.
        clockwise: seen from above.
    """

    north_m: float
    east_m: float
    radius_m: Positive
    speed_m_s: NotNegative
    bearing_rad: float = 0.0
    clockwise: bool = True

    def start(self, rng: np.random.Generator) -> Trajectory:
        """Nothing is random."""
        return self

    def at(self, time_s: float) -> State:
        """The point of the circle."""
        sense = 1.0 if self.clockwise else -1.0
        bearing_rad = self.bearing_rad + sense * self.speed_m_s * time_s / self.radius_m
        cosine, sine = math.cos(bearing_rad), math.sin(bearing_rad)
        speed_m_s = sense * self.speed_m_s
        return (
            self.north_m + self.radius_m * cosine,
            self.east_m + self.radius_m * sine,
            -speed_m_s * sine,
            speed_m_s * cosine,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomWalk(Options):
    """Fixed speed, straight legs, a random turn between them, within a box whose edges reflect.

    Attributes:
        south_m, west_m, north_m, east_m: edges of the box, local NED of home.
        speed_m_s: over ground.
        leg_s: duration of a leg.
        turn_rad: one sigma of the turn; infinite: any direction is as likely as any other.
        start_m: (north, east) at boot; None: uniform in the box.
        course_rad: at boot, clockwise from north; None: any.
    """

    south_m: float
    west_m: float
    north_m: float
    east_m: float
    speed_m_s: NotNegative
    leg_s: Positive = 10.0
    turn_rad: NotNegativeOrInf = 0.5
    start_m: tuple[float, float] | None = None
    course_rad: float | None = None

    def check_together(self) -> None:
        for low, high, names in (
            (self.south_m, self.north_m, "south_m and north_m"),
            (self.west_m, self.east_m, "west_m and east_m"),
        ):
            if not low < high:
                raise ValueError(f"{names} = {low}, {high} are not accepted: the first below the second is")
        if self.start_m is not None:
            north_m, east_m = self.start_m
            inside = self.south_m <= north_m <= self.north_m and self.west_m <= east_m <= self.east_m
            if not inside:
                raise ValueError(
                    f"start_m = {self.start_m} is not accepted: north {self.south_m} to {self.north_m}, "
                    f"east {self.west_m} to {self.east_m} is"
                )

    def start(self, rng: np.random.Generator) -> Trajectory:
        """One walk."""
        return _Walk(self, rng)


class _Walk:
    """Legs from turn to turn; on a leg the place is unfolded at the edges, so no step can miss one."""

    def __init__(self, parameters: RandomWalk, rng: np.random.Generator) -> None:
        p = self._parameters = parameters
        self._rng = rng
        # all is drawn whether it is used or not: a given start changes nothing of the turns
        place = rng.random(2)
        course_rad = 2.0 * math.pi * rng.random()
        if p.start_m is None:
            self._north_m = p.south_m + (p.north_m - p.south_m) * float(place[0])
            self._east_m = p.west_m + (p.east_m - p.west_m) * float(place[1])
        else:
            self._north_m, self._east_m = p.start_m
        self._course_rad = course_rad if p.course_rad is None else p.course_rad
        self._leg = 0

    def at(self, time_s: float) -> State:
        p = self._parameters
        while time_s >= (self._leg + 1) * p.leg_s:
            north_m, east_m, north_m_s, east_m_s = self._on_leg(p.leg_s)
            self._north_m, self._east_m = north_m, east_m
            self._leg += 1
            course_rad = math.atan2(east_m_s, north_m_s)
            if math.isinf(p.turn_rad):
                self._course_rad = 2.0 * math.pi * self._rng.random()
            else:
                self._course_rad = course_rad + p.turn_rad * self._rng.standard_normal()
        return self._on_leg(time_s - self._leg * p.leg_s)

    def _on_leg(self, elapsed_s: float) -> State:
        p = self._parameters
        way_m = p.speed_m_s * elapsed_s
        cosine, sine = math.cos(self._course_rad), math.sin(self._course_rad)
        north_m, north_sense = _reflect(self._north_m + way_m * cosine, p.south_m, p.north_m)
        east_m, east_sense = _reflect(self._east_m + way_m * sine, p.west_m, p.east_m)
        return north_m, east_m, north_sense * p.speed_m_s * cosine, east_sense * p.speed_m_s * sine


def _reflect(unfolded: float, low: float, high: float) -> tuple[float, float]:
    """Place between two mirrors of a point that went straight through them, and the sense it moves in."""
    span = high - low
    phase = (unfolded - low) % (2.0 * span)
    return (low + phase, 1.0) if phase <= span else (low + 2.0 * span - phase, -1.0)
