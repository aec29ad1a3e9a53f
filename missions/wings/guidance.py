"""From a path to a bank angle, for an autopilot that holds altitude and airspeed by itself.

The distance from the path obeys d'' + 2 zeta omega d' + omega^2 d = 0 around the acceleration that the path's
own curvature takes, looked up as far ahead as the bank needs to build up. A slow integral takes out what a
wing that hangs a little leaves.
"""

import math
from dataclasses import dataclass
from typing import Final

from missions.atmosphere import GRAVITY_M_S2
from missions.planning.flyable import FlyablePath
from missions.wings.place import PlaceOnPath

_LEAST_COS_CRAB: Final = 0.5
_LEAST_CURVE: Final = 0.3  # of the radius: how far inside a bend its centre still counts
_INTEGRAL_WITHIN_M: Final = 15.0
_INTEGRAL_MAX_M_S2: Final = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PathRollParameters:
    """Gains and limits.

    Attributes:
        frequency_rad_s, damping: of the distance from the path.
        integral_per_s: how fast a lasting distance is taken out, of the frequency's share.
        lead_s: from a roll command to the bank.
        approach_max_rad: steepest angle to the path.
        bank_max_rad: steepest bank.
    """

    frequency_rad_s: float = 0.6
    damping: float = 0.9
    integral_per_s: float = 0.06
    lead_s: float = 0.4
    approach_max_rad: float = math.radians(45.0)
    bank_max_rad: float = math.radians(45.0)

    def __post_init__(self) -> None:
        for name in ("frequency_rad_s", "damping", "lead_s", "approach_max_rad", "bank_max_rad"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} = {getattr(self, name)} is not possible; it must be more than 0")


class PathRoll:
    """Bank angles that follow a path.

    Args:
        path: with its leads.
        parameters: gains and limits.
    """

    def __init__(self, path: FlyablePath, parameters: PathRollParameters) -> None:
        self._path = path
        self._parameters = parameters
        self._integral_m_s2 = 0.0
        self._time_us: int | None = None

    def roll_rad(self, place: PlaceOnPath, heading_rad: float, time_us: int) -> float:
        """The bank for a moment.

        Args:
            place: where along the path the aircraft is.
            heading_rad: of the nose.
            time_us: of the vehicle.
        """
        p = self._parameters
        speed, across = place.ground_speed_m_s, place.across_m
        over_ground = math.atan2(place.vel_east_m_s, place.vel_north_m_s)
        _, course, _ = self._path.at(place.arc_m)
        _, _, curvature = self._path.at(place.arc_m + p.lead_s * speed)
        off = math.remainder(over_ground - course, math.tau)
        away_m_s = speed * math.sin(off)
        # of the parallel curve the aircraft is on
        bend = speed * speed * math.cos(off) * curvature / max(_LEAST_CURVE, 1.0 - curvature * across)
        steepest = speed * math.sin(p.approach_max_rad)
        back_m_s = p.frequency_rad_s / (2.0 * p.damping) * across
        back_m_s = max(-steepest, min(steepest, back_m_s))
        push = bend - 2.0 * p.damping * p.frequency_rad_s * (back_m_s + away_m_s)
        push -= self._integrated(across, time_us)
        crab = math.remainder(over_ground - heading_rad, math.tau)
        roll = math.atan(push / (GRAVITY_M_S2 * max(_LEAST_COS_CRAB, math.cos(crab))))
        return max(-p.bank_max_rad, min(p.bank_max_rad, roll))

    def _integrated(self, across_m: float, time_us: int) -> float:
        p = self._parameters
        if self._time_us is not None and abs(across_m) < _INTEGRAL_WITHIN_M:
            dt = min(0.5, max(0.0, (time_us - self._time_us) * 1e-6))
            step = p.integral_per_s * p.frequency_rad_s**2 * across_m * dt
            limit = _INTEGRAL_MAX_M_S2
            self._integral_m_s2 = max(-limit, min(limit, self._integral_m_s2 + step))
        self._time_us = time_us
        return self._integral_m_s2
