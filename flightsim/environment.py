"""What the air does: mean wind over height, gusts, turbulence, temperature.

Parameters; `Vehicle` applies them.
"""

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from flightsim.wind_profile import SURFACE_LAYER, WindProfile

_M_S_PER_KNOT: Final = 1852.0 / 3600.0
_MAX_WIND_M_S: Final = 60.0


class Turbulence(StrEnum):
    """Low-altitude turbulence intensity of MIL-F-8785C, paragraph 3.7.3.4: set by the wind at 20 ft."""

    NONE = "none"
    LIGHT = "light"
    MODERATE = "moderate"
    SEVERE = "severe"

    @property
    def wind_at_20_ft_m_s(self) -> float:
        """W20, the mean wind speed at 20 ft that goes with the severity (15, 30, 45 kt)."""
        return _WIND_AT_20_FT_KT[self] * _M_S_PER_KNOT


_WIND_AT_20_FT_KT: Final = {
    Turbulence.NONE: 0.0,
    Turbulence.LIGHT: 15.0,
    Turbulence.MODERATE: 30.0,
    Turbulence.SEVERE: 45.0,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class CosineGust:
    """A discrete gust: the wind grows as (1 - cos)/2, holds and fades (MIL-F-8785C, paragraph 3.7.2.3).

    Attributes:
        start_s: vehicle time at which it begins.
        velocity_ned_m_s: change of the air's velocity over ground at full strength.
        rise_s, hold_s, fall_s: durations of its three parts.
    """

    start_s: float
    velocity_ned_m_s: tuple[float, float, float]
    rise_s: float = 1.0
    hold_s: float = 0.0
    fall_s: float = 1.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.start_s) and self.start_s >= 0.0):
            raise ValueError(f"gust start {self.start_s} s is not a time; accepted are 0 s and later")
        _check_wind("gust velocity", self.velocity_ned_m_s)
        for name, value, smallest in (
            ("rise", self.rise_s, 0.01),
            ("hold", self.hold_s, 0.0),
            ("fall", self.fall_s, 0.01),
        ):
            if not smallest <= value <= 3600.0:
                raise ValueError(
                    f"gust {name} time {value} s is out of range; accepted are {smallest} to 3600 s"
                )

    @property
    def end_s(self) -> float:
        """Vehicle time at which the gust is over."""
        return self.start_s + self.rise_s + self.hold_s + self.fall_s


@dataclass(frozen=True, slots=True, kw_only=True)
class Environment:
    """The air around the vehicles.

    Attributes:
        wind_ned_m_s: mean velocity of the air over ground (where it blows to), at the profile's reference
            height.
        profile: horizontal wind over height; uniform unless another is given. The vertical part is the same
            at all heights.
        turbulence: Dryden intensity, `Turbulence` or its name.
        gusts: discrete gusts, one after the other.
        temperature_offset_k: added to the standard atmosphere's temperature at every height.
        decimal_year: date for the magnetic field (WMM-2025 is valid from 2025.0 to 2030.0).
    """

    wind_ned_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    profile: WindProfile = field(default_factory=WindProfile)
    turbulence: Turbulence = Turbulence.NONE
    gusts: tuple[CosineGust, ...] = field(default=())
    temperature_offset_k: float = 0.0
    decimal_year: float = 2026.0

    def __post_init__(self) -> None:
        _check_wind("wind", self.wind_ned_m_s)
        try:
            object.__setattr__(self, "turbulence", Turbulence(self.turbulence))
        except ValueError:
            accepted = ", ".join(member.value for member in Turbulence)
            raise ValueError(f"turbulence {self.turbulence!r} is unknown; accepted are {accepted}") from None
        for earlier, later in zip(self.gusts, self.gusts[1:], strict=False):
            if later.start_s < earlier.end_s:
                raise ValueError(
                    f"gust at {later.start_s} s begins before the one at {earlier.start_s} s is over "
                    f"(at {earlier.end_s} s); give gusts in order, one after the other"
                )
        if not -60.0 <= self.temperature_offset_k <= 60.0:
            raise ValueError(f"temperature offset {self.temperature_offset_k} K is not in -60..60 K")
        if not 2025.0 <= self.decimal_year <= 2030.0:
            raise ValueError(
                f"decimal year {self.decimal_year} is outside the magnetic model's validity, 2025.0 to 2030.0"
            )

    def wind_ned_m_s_at(self, height_m: float) -> tuple[float, float, float]:
        """Mean wind at a height above ground."""
        north, east, down = self.wind_ned_m_s
        factor = self.profile.factor(height_m)
        return factor * north, factor * east, down

    @property
    def wind_speed_m_s(self) -> float:
        """Horizontal speed of the mean wind at the profile's reference height."""
        return round(math.hypot(*self.wind_ned_m_s[:2]), 9)

    @property
    def wind_from_deg(self) -> float:
        """True direction that the mean wind comes from, clockwise from north, 0..360."""
        north, east, _ = self.wind_ned_m_s
        return round(math.degrees(math.atan2(-east, -north)), 9) % 360.0 if self.wind_speed_m_s else 0.0

    @classmethod
    def from_wind(
        cls,
        *,
        speed_m_s: float,
        from_deg: float,
        profile: WindProfile = SURFACE_LAYER,
        turbulence: Turbulence | str = Turbulence.NONE,
        gusts: tuple[CosineGust, ...] = (),
        temperature_offset_k: float = 0.0,
        decimal_year: float = 2026.0,
    ) -> "Environment":
        """Environment with a horizontal wind as a weather report gives it.

        Args:
            speed_m_s: wind speed at the profile's reference height.
            from_deg: true direction the wind comes from, clockwise from north.
            profile: wind over height; by default the logarithmic law over open ground, with the given wind
                at 10 m.
        """
        if not 0.0 <= speed_m_s <= _MAX_WIND_M_S:
            raise ValueError(
                f"wind speed {speed_m_s} m/s is out of range; accepted are 0 to {_MAX_WIND_M_S} m/s"
            )
        if not math.isfinite(from_deg):
            raise ValueError(f"wind direction {from_deg} deg is not a finite number")
        to_rad = math.radians(from_deg) + math.pi
        return cls(
            wind_ned_m_s=(speed_m_s * math.cos(to_rad), speed_m_s * math.sin(to_rad), 0.0),
            profile=profile,
            turbulence=Turbulence(turbulence),
            gusts=gusts,
            temperature_offset_k=temperature_offset_k,
            decimal_year=decimal_year,
        )


def _check_wind(name: str, velocity: tuple[float, float, float]) -> None:
    if len(velocity) != 3 or not all(math.isfinite(part) for part in velocity):
        raise ValueError(f"{name} {velocity} is not three finite numbers (north, east, down in m/s)")
    if math.hypot(*velocity) > _MAX_WIND_M_S:
        raise ValueError(f"{name} {velocity} m/s is too strong; accepted are up to {_MAX_WIND_M_S} m/s")
