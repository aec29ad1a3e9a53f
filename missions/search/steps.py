"""How a multicopter flies from one place of the search to the next: two laws of motion. Without I/O.

`TrajectoryLaw` moves a reference point within the vehicle's limits and sends it with its velocity and
acceleration. `BacksteppingLaw` sends velocities that a backstepping law makes from the step to the place, as
the paper's piecewise constant references need it; docs/multi_target.md has its derivation.
"""

import math
from dataclasses import dataclass
from typing import Final, Protocol

from flightsim.foundation.vectors import Vector
from missions.errors import PlanError
from missions.vehicle.limits import MulticopterLimits
from missions.vehicle.setpoint import Setpoint

__all__ = ["BacksteppingGains", "BacksteppingLaw", "StepLaw", "TrajectoryLaw"]

_LONGEST_STEP_S: Final = 0.5
_RESPONSE_S: Final = 0.35  # time constant with which the reference point takes up a velocity
_AT_M: Final = 1e-6


class StepLaw(Protocol):
    """A law of motion to a place that changes from time to time."""

    def aim(self, place_ned_m: Vector, yaw_rad: float | None = None) -> None:
        """Fly to another place, with another heading unless it is None."""
        ...

    def setpoint(self, time_s: float, place_ned_m: Vector, velocity_ned_m_s: Vector) -> Setpoint:
        """The setpoint at a time; times must not decrease.

        Args:
            time_s: time since the start.
            place_ned_m, velocity_ned_m_s: of the vehicle, as it reports them.
        """
        ...


class TrajectoryLaw:
    """A reference point whose speed and acceleration are limited; it slows down for the place, so that it
    does not overshoot.

    Args:
        place_ned_m: start, at rest.
        speed_m_s: largest speed.
        limits: of the vehicle.
        yaw_rad: heading of the vehicle.
    """

    def __init__(
        self, *, place_ned_m: Vector, speed_m_s: float, limits: MulticopterLimits, yaw_rad: float
    ) -> None:
        self._aim = self._place = place_ned_m
        self._velocity: Vector = (0.0, 0.0, 0.0)
        self._speed_m_s = speed_m_s
        self._slowing_m_s2 = limits.tangential_m_s2
        self._most_m_s2 = limits.acceleration_m_s2
        self._yaw_rad = yaw_rad
        self._time_s = 0.0

    def aim(self, place_ned_m: Vector, yaw_rad: float | None = None) -> None:
        self._aim = place_ned_m
        self._yaw_rad = self._yaw_rad if yaw_rad is None else yaw_rad

    def setpoint(self, time_s: float, place_ned_m: Vector, velocity_ned_m_s: Vector) -> Setpoint:
        dt_s = min(_LONGEST_STEP_S, max(0.0, time_s - self._time_s))
        self._time_s = time_s
        left = _minus(self._aim, self._place)
        away_m = _norm(left)
        # the speed from which the rest of the way is enough to stop, with the time to take up a velocity
        lag_m = self._slowing_m_s2 * _RESPONSE_S
        speed_m_s = min(self._speed_m_s, math.sqrt(lag_m * lag_m + 2.0 * self._slowing_m_s2 * away_m) - lag_m)
        wanted = _times(left, speed_m_s / away_m) if away_m > _AT_M else (0.0, 0.0, 0.0)
        change = _bounded(_times(_minus(wanted, self._velocity), 1.0 / _RESPONSE_S), self._most_m_s2)
        middle = _plus(self._velocity, _times(change, 0.5 * dt_s))
        self._velocity = _plus(self._velocity, _times(change, dt_s))
        self._place = _plus(self._place, _times(middle, dt_s))
        return Setpoint(
            position_ned_m=self._place,
            velocity_ned_m_s=self._velocity,
            acceleration_ned_m_s2=change,
            yaw_rad=self._yaw_rad,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class BacksteppingGains:
    """Gains of the backstepping law (docs/multi_target.md).

    With the defaults a small error has a double pole at -1.2 1/s: no overshoot.

    Attributes:
        position_per_s: K1, of the virtual velocity.
        velocity_per_s: K2, of the velocity error.
        coupling_per_s2: lambda, weight of the place in the Lyapunov function.
        response_s: time constant of the autopilot's velocity loop: 1 / MPC_XY_VEL_P_ACC of PX4 is 0.56 s,
            1 / PSC_VELXY_P of ArduPilot 0.5 s.
    """

    position_per_s: float = 0.8
    velocity_per_s: float = 1.6
    coupling_per_s2: float = 0.16
    response_s: float = 0.5

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise PlanError(f"`{name}` {value:g} is not possible; ask for more than 0")


class BacksteppingLaw:
    """Velocity setpoints by backstepping, with the autopilot's velocity loop in it.

    Args:
        place_ned_m: start.
        speed_m_s: largest speed.
        limits: of the vehicle.
        yaw_rad: heading of the vehicle.
        gains: of the law.
    """

    def __init__(
        self,
        *,
        place_ned_m: Vector,
        speed_m_s: float,
        limits: MulticopterLimits,
        yaw_rad: float,
        gains: BacksteppingGains | None = None,
    ) -> None:
        self._aim = place_ned_m
        g = self._gains = gains or BacksteppingGains()
        # far from the place the coupling adds a constant share to the virtual velocity
        self._virtual_m_s = speed_m_s / (1.0 + g.coupling_per_s2 / (g.position_per_s * g.velocity_per_s))
        self._most_m_s2 = limits.acceleration_m_s2
        self._yaw_rad = yaw_rad

    def aim(self, place_ned_m: Vector, yaw_rad: float | None = None) -> None:
        self._aim = place_ned_m
        self._yaw_rad = self._yaw_rad if yaw_rad is None else yaw_rad

    def setpoint(self, time_s: float, place_ned_m: Vector, velocity_ned_m_s: Vector) -> Setpoint:
        g = self._gains
        off = _minus(place_ned_m, self._aim)  # z1
        away_m, velocity = _norm(off), velocity_ned_m_s
        if g.position_per_s * away_m <= self._virtual_m_s:
            near = off
            virtual_rate = _times(velocity, -g.position_per_s)
        else:  # at the largest speed towards the place: only its direction changes
            unit = _times(off, 1.0 / away_m)
            near = _times(unit, self._virtual_m_s / g.position_per_s)
            across = _minus(velocity, _times(unit, _dot(unit, velocity)))
            virtual_rate = _times(across, -self._virtual_m_s / away_m)
        virtual = _times(near, -g.position_per_s)
        error = _minus(velocity, virtual)  # z2
        acceleration = _minus(
            _minus(virtual_rate, _times(near, g.coupling_per_s2)), _times(error, g.velocity_per_s)
        )
        command = _plus(velocity, _times(_bounded(acceleration, self._most_m_s2), g.response_s))
        return Setpoint(velocity_ned_m_s=command, yaw_rad=self._yaw_rad)


def _plus(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _times(a: Vector, factor: float) -> Vector:
    return factor * a[0], factor * a[1], factor * a[2]


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _norm(a: Vector) -> float:
    return math.sqrt(_dot(a, a))


def _bounded(a: Vector, most: float) -> Vector:
    size = _norm(a)
    return a if size <= most else _times(a, most / size)
