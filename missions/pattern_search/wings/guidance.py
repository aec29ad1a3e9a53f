"""Computes bank angles that follow a path, for an autopilot that holds altitude and airspeed by itself.

The distance from the path obeys d'' + 2 zeta omega d' + omega^2 d = 0 around the acceleration for the path's
own curvature, which is looked up ahead by the time in which a bank builds up. A slow integral removes the
offset of a wing that is not exactly level. The acceleration of a bank is measured in flight (`TurnEffect`):
an aircraft that slips in its turns must bank more.
"""

import math
from dataclasses import dataclass
from typing import Final

from flightsim.foundation.atmosphere import GRAVITY_M_S2
from missions.pattern_search.wings.place import PlaceOnPath
from missions.planning.flyable import FlyablePath

_LEAST_COS_CRAB: Final = 0.5
_LEAST_CURVE: Final = 0.3  # share of the radius: limit of the distance inside a bend
_INTEGRAL_WITHIN_M: Final = 15.0
_INTEGRAL_MAX_M_S2: Final = 1.0
_PRIOR_M2_S3: Final = 10.0  # equal to one second at 18 degrees of bank
_LEAST_EFFECT: Final = 0.5
_LARGEST_EFFECT: Final = 1.3
_LEAST_BANK_M_S2: Final = 0.8  # 5 degrees; smaller values would mainly contain noise
_LONGEST_GAP_S: Final = 0.5
_EFFECT_MEMORY_S: Final = 30.0  # time of banked flight


class TurnEffect:
    """Acceleration that a bank gives, as a share of a coordinated turn's; least squares over telemetry.

    It compares the acceleration across the course (speed times rate of the course) with g tan(bank).
    Coordinated turns give 1; the plane model in ArduPilot 4.6.3, which slips in turns, gives 0.7.
    """

    def __init__(self) -> None:
        self._banked = self._turned = _PRIOR_M2_S3  # the initial estimate is 1
        self._last: tuple[int, float] | None = None

    @property
    def share(self) -> float:
        """The estimate, limited to values that are possible for an aircraft."""
        return max(_LEAST_EFFECT, min(_LARGEST_EFFECT, self._turned / self._banked))

    def update(self, time_us: int, vel_ne_m_s: tuple[float, float], roll_rad: float, yaw_rad: float) -> None:
        """Process the velocity of a position message, and the present attitude.

        Args:
            time_us: time of the velocity; a velocity that was already processed is ignored.
            vel_ne_m_s: velocity over ground.
            roll_rad, yaw_rad: roll and yaw.
        """
        speed, course = math.hypot(*vel_ne_m_s), math.atan2(vel_ne_m_s[1], vel_ne_m_s[0])
        last, self._last = self._last, (time_us, course)
        if last is None or not 0.0 < (dt := (time_us - last[0]) * 1e-6) < _LONGEST_GAP_S:
            return
        turned = speed * math.remainder(course - last[1], math.tau) / dt
        crab = math.remainder(course - yaw_rad, math.tau)
        banked = GRAVITY_M_S2 * math.tan(max(-1.4, min(1.4, roll_rad))) * max(_LEAST_COS_CRAB, math.cos(crab))
        kept = math.exp(-dt / _EFFECT_MEMORY_S) if abs(banked) > _LEAST_BANK_M_S2 else 1.0
        if kept < 1.0:
            self._turned = kept * self._turned + turned * banked * dt
            self._banked = kept * self._banked + banked * banked * dt


@dataclass(frozen=True, slots=True, kw_only=True)
class PathRollParameters:
    """Gains and limits.

    Attributes:
        frequency_rad_s, damping: frequency and damping of the distance from the path.
        integral_per_s: rate at which a constant distance is removed, relative to the frequency's share.
        lead_s: delay from a roll command to the bank.
        approach_max_rad: largest angle to the path.
        bank_max_rad: largest bank.
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
        path: path with entry and exit.
        parameters: gains and limits.
        effect: effect of banks; the owner of the telemetry continues to update it.
    """

    def __init__(
        self, path: FlyablePath, parameters: PathRollParameters, effect: TurnEffect | None = None
    ) -> None:
        self._path = path
        self._effect = TurnEffect() if effect is None else effect
        self._parameters = parameters
        self._integral_m_s2 = 0.0
        self._time_us: int | None = None

    def roll_rad(self, place: PlaceOnPath, heading_rad: float, time_us: int) -> float:
        """The bank for the present state.

        Args:
            place: place of the aircraft along the path.
            heading_rad: heading of the aircraft.
            time_us: vehicle time.
        """
        p = self._parameters
        speed, across = place.ground_speed_m_s, place.across_m
        over_ground = math.atan2(place.vel_east_m_s, place.vel_north_m_s)
        _, course, _ = self._path.at(place.arc_m)
        _, _, curvature = self._path.at(place.arc_m + p.lead_s * speed)
        off = math.remainder(over_ground - course, math.tau)
        away_m_s = speed * math.sin(off)
        # curvature of the parallel curve on which the aircraft is
        bend = speed * speed * math.cos(off) * curvature / max(_LEAST_CURVE, 1.0 - curvature * across)
        steepest = speed * math.sin(p.approach_max_rad)
        back_m_s = p.frequency_rad_s / (2.0 * p.damping) * across
        back_m_s = max(-steepest, min(steepest, back_m_s))
        push = bend - 2.0 * p.damping * p.frequency_rad_s * (back_m_s + away_m_s)
        push -= self._integrated(across, time_us)
        crab = math.remainder(over_ground - heading_rad, math.tau)
        given = self._effect.share * GRAVITY_M_S2 * max(_LEAST_COS_CRAB, math.cos(crab))
        roll = math.atan(push / given)
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
