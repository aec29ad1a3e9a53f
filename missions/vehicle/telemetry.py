"""Telemetry for missions: immutable values in SI units and radians, made from MAVLink messages."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from inspect import signature
from types import MappingProxyType
from typing import Final, Generic, NamedTuple, TypeVar, cast

from autopilot_bridge.mavlink import Frame, MAVLinkMessage, dialect, field_reader
from autopilot_bridge.mavlink.wire_units import UNKNOWN_UINT16, m_s, metres, place

T = TypeVar("T")


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
class MissionProgress:
    """MISSION_CURRENT: the present item, with its sequence number on the link."""

    sequence: int


def position(
    time_boot_ms: int, lat: int, lon: int, alt: int, relative_alt: int, vx: int, vy: int, vz: int
) -> Position | None:
    """From GLOBAL_POSITION_INT; None when the position is not on the Earth."""
    at = place(lat, lon, alt)
    if at is None:
        return None
    return Position(
        time_us=time_boot_ms * 1000,
        lat_deg=at.lat_deg,
        lon_deg=at.lon_deg,
        alt_m=at.alt_m,
        height_m=metres(relative_alt),
        vel_ned_m_s=(m_s(vx), m_s(vy), m_s(vz)),
    )


def local_position(
    time_boot_ms: int, x: float, y: float, z: float, vx: float, vy: float, vz: float
) -> LocalPosition | None:
    """From LOCAL_POSITION_NED; None when the position is invalid."""
    if not math.isfinite(x + y + z + vx + vy + vz):
        return None
    return LocalPosition(time_us=time_boot_ms * 1000, pos_ned_m=(x, y, z), vel_ned_m_s=(vx, vy, vz))


def attitude(
    time_boot_ms: int,
    roll: float,
    pitch: float,
    yaw: float,
    rollspeed: float,
    pitchspeed: float,
    yawspeed: float,
) -> Attitude | None:
    """From ATTITUDE; None when its angles are invalid."""
    if not math.isfinite(roll + pitch + yaw):
        return None
    return Attitude(
        time_us=time_boot_ms * 1000,
        roll_rad=roll,
        pitch_rad=pitch,
        yaw_rad=yaw,
        rates_frd_rad_s=(rollspeed, pitchspeed, yawspeed),
    )


def air_data(airspeed: float, climb: float, throttle: int) -> AirData | None:
    """From VFR_HUD; None when airspeed or climb rate is not a number."""
    if not math.isfinite(airspeed + climb):
        return None
    return AirData(airspeed_m_s=airspeed, climb_m_s=climb, throttle=0.01 * throttle)


def pressure(time_boot_ms: int, press_abs: float) -> Pressure:
    """From SCALED_PRESSURE."""
    return Pressure(time_us=time_boot_ms * 1000, static_pa=100.0 * press_abs)


def battery(voltage_battery: int, current_battery: int, battery_remaining: int) -> Battery:
    """From SYS_STATUS."""
    return Battery(
        voltage_v=voltage_battery * 1e-3 if voltage_battery != UNKNOWN_UINT16 else math.nan,
        current_a=current_battery * 0.01 if current_battery >= 0 else math.nan,
        remaining=battery_remaining * 0.01 if battery_remaining >= 0 else math.nan,
    )


def gps(time_usec: int, eph: int, fix_type: int, satellites_visible: int) -> Gps:
    """From GPS_RAW_INT."""
    return Gps(
        time_us=time_usec,
        fix_type=fix_type,
        satellites=satellites_visible if satellites_visible != 255 else 0,
        hdop=eph * 0.01 if eph != UNKNOWN_UINT16 else math.nan,
    )


def progress(seq: int) -> MissionProgress:
    """From MISSION_CURRENT."""
    return MissionProgress(sequence=seq)


class Source(NamedTuple, Generic[T]):
    """Where a kind of telemetry comes from.

    Attributes:
        kind: class of the message.
        read: the value in a frame of that message; None: not usable.
    """

    kind: type[MAVLinkMessage]
    read: Callable[[Frame], T | None]

    @classmethod
    def of(cls, kind: type[MAVLinkMessage], convert: Callable[..., T | None]) -> "Source[T]":
        """By a function of some fields, whose arguments are those fields in the order on the wire."""
        fields = field_reader(kind.msgname, *signature(convert).parameters)
        return cls(kind, lambda frame: convert(*fields(frame)))


_SOURCES: Final[Mapping[type, Source[object]]] = MappingProxyType(
    {
        Position: Source.of(dialect.MAVLink_global_position_int_message, position),
        LocalPosition: Source.of(dialect.MAVLink_local_position_ned_message, local_position),
        Attitude: Source.of(dialect.MAVLink_attitude_message, attitude),
        AirData: Source.of(dialect.MAVLink_vfr_hud_message, air_data),
        Pressure: Source.of(dialect.MAVLink_scaled_pressure_message, pressure),
        Battery: Source.of(dialect.MAVLink_sys_status_message, battery),
        Gps: Source.of(dialect.MAVLink_gps_raw_int_message, gps),
        MissionProgress: Source.of(dialect.MAVLink_mission_current_message, progress),
    }
)


def source_of(kind: type[T]) -> Source[T]:
    """The source of a kind of telemetry."""
    return cast(Source[T], _SOURCES[kind])
