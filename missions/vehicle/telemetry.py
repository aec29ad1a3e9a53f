"""Telemetry for missions: immutable values in SI units and radians, made from MAVLink messages."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, TypeVar

from flightsim.foundation.geodesy import GeodeticPosition

T = TypeVar("T")

_CHUNK: Final = 50
_UNFINISHED_TEXTS: Final = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Position:
    """Global position estimate (GLOBAL_POSITION_INT).

    Attributes:
        time_us: vehicle time.
        lat_deg, lon_deg: WGS84.
        alt_m: altitude above mean sea level.
        height_m: height above home.
        vel_ned_m_s: ground velocity.
    """

    time_us: int
    lat_deg: float
    lon_deg: float
    alt_m: float
    height_m: float
    vel_ned_m_s: tuple[float, float, float]

    @property
    def ground_speed_m_s(self) -> float:
        return math.hypot(self.vel_ned_m_s[0], self.vel_ned_m_s[1])


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalPosition:
    """Local position estimate (LOCAL_POSITION_NED), NED at the autopilot's own origin."""

    time_us: int
    pos_ned_m: tuple[float, float, float]
    vel_ned_m_s: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Attitude:
    """Attitude estimate (ATTITUDE): ZYX Euler angles of q_ned_from_frd, and body rates."""

    time_us: int
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    rates_frd_rad_s: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class AirData:
    """Air data of a pilot's head-up display (VFR_HUD; the message has no time stamp).

    Attributes:
        airspeed_m_s: equivalent airspeed.
        climb_m_s: climb rate, positive upwards.
        throttle: throttle, 0..1.
    """

    airspeed_m_s: float
    climb_m_s: float
    throttle: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Pressure:
    """Static pressure at the vehicle (SCALED_PRESSURE)."""

    time_us: int
    static_pa: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Battery:
    """Battery (SYS_STATUS). NaN for values that the vehicle does not know."""

    voltage_v: float
    current_a: float
    remaining: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Gps:
    """GPS receiver (GPS_RAW_INT): fix type (MAVLink GPS_FIX_TYPE, 3 is 3D), satellites, dilution
    (NaN: unknown).
    """

    time_us: int
    fix_type: int
    satellites: int
    hdop: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StatusText:
    """A text for the pilot: severity as MAV_SEVERITY (3 error, 4 warning, 6 information)."""

    severity: int
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionProgress:
    """MISSION_CURRENT: the present item, with its sequence number on the link."""

    sequence: int


def position(m: Any) -> Position:
    """From GLOBAL_POSITION_INT."""
    return Position(
        time_us=m.time_boot_ms * 1000,
        lat_deg=m.lat * 1e-7,
        lon_deg=m.lon * 1e-7,
        alt_m=m.alt * 1e-3,
        height_m=m.relative_alt * 1e-3,
        vel_ned_m_s=(m.vx * 0.01, m.vy * 0.01, m.vz * 0.01),
    )


def local_position(m: Any) -> LocalPosition | None:
    """From LOCAL_POSITION_NED; None when the position is invalid."""
    if not math.isfinite(m.x + m.y + m.z + m.vx + m.vy + m.vz):
        return None
    return LocalPosition(
        time_us=m.time_boot_ms * 1000, pos_ned_m=(m.x, m.y, m.z), vel_ned_m_s=(m.vx, m.vy, m.vz)
    )


def attitude(m: Any) -> Attitude | None:
    """From ATTITUDE; None when its angles are invalid."""
    if not math.isfinite(m.roll + m.pitch + m.yaw):
        return None
    return Attitude(
        time_us=m.time_boot_ms * 1000,
        roll_rad=m.roll,
        pitch_rad=m.pitch,
        yaw_rad=m.yaw,
        rates_frd_rad_s=(m.rollspeed, m.pitchspeed, m.yawspeed),
    )


def air_data(m: Any) -> AirData | None:
    """From VFR_HUD; None when airspeed or climb rate is not a number."""
    if not math.isfinite(m.airspeed + m.climb):
        return None
    return AirData(airspeed_m_s=m.airspeed, climb_m_s=m.climb, throttle=0.01 * m.throttle)


def pressure(m: Any) -> Pressure:
    """From SCALED_PRESSURE."""
    return Pressure(time_us=m.time_boot_ms * 1000, static_pa=100.0 * m.press_abs)


def battery(m: Any) -> Battery:
    """From SYS_STATUS."""
    return Battery(
        voltage_v=m.voltage_battery * 1e-3 if m.voltage_battery != 0xFFFF else math.nan,
        current_a=m.current_battery * 0.01 if m.current_battery >= 0 else math.nan,
        remaining=m.battery_remaining * 0.01 if m.battery_remaining >= 0 else math.nan,
    )


def gps(m: Any) -> Gps:
    """From GPS_RAW_INT."""
    return Gps(
        time_us=m.time_usec,
        fix_type=m.fix_type,
        satellites=m.satellites_visible if m.satellites_visible != 255 else 0,
        hdop=m.eph * 0.01 if m.eph != 0xFFFF else math.nan,
    )


def home(m: Any) -> GeodeticPosition:
    """From HOME_POSITION."""
    return GeodeticPosition(lat_deg=m.latitude * 1e-7, lon_deg=m.longitude * 1e-7, alt_m=m.altitude * 1e-3)


def progress(m: Any) -> MissionProgress:
    """From MISSION_CURRENT."""
    return MissionProgress(sequence=m.seq)


SOURCES: Final[Mapping[type, tuple[str, Callable[[Any], Any]]]] = MappingProxyType(
    {
        Position: ("GLOBAL_POSITION_INT", position),
        LocalPosition: ("LOCAL_POSITION_NED", local_position),
        Attitude: ("ATTITUDE", attitude),
        AirData: ("VFR_HUD", air_data),
        Pressure: ("SCALED_PRESSURE", pressure),
        Battery: ("SYS_STATUS", battery),
        Gps: ("GPS_RAW_INT", gps),
        MissionProgress: ("MISSION_CURRENT", progress),
    }
)
"""The source message of each kind of telemetry, and the conversion; an unusable message gives None."""


class StatusTextAssembler:
    """Joins STATUSTEXTs that were sent in chunks of 50 characters (id, chunk_seq).

    A text whose end is lost is dropped when its id is used again, or when 8 other texts are unfinished.
    """

    def __init__(self) -> None:
        self._parts: dict[int, dict[int, str]] = {}

    def add(self, m: Any) -> StatusText | None:
        """Add one message; returns the text when it is complete."""
        text = str(m.text)
        if not m.id:
            return StatusText(severity=m.severity, text=text.rstrip("\t"))
        parts = self._parts.pop(m.id, {})
        newest = max(parts, default=-1)
        if m.chunk_seq < newest or parts.get(m.chunk_seq, text) != text:
            parts = {}  # chunks come in order, so the id is now used for another text
        parts[m.chunk_seq] = text
        if len(text) >= _CHUNK:
            self._parts[m.id] = parts  # stored as the newest
            if len(self._parts) > _UNFINISHED_TEXTS:
                del self._parts[next(iter(self._parts))]
            return None
        return StatusText(severity=m.severity, text="".join(parts[k] for k in sorted(parts)).rstrip("\t"))
