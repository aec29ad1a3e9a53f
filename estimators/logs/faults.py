"""Faults for recorded logs: the affected messages and fields, the kind of fault, and the time.

The kinds are those of the simulator's sensors (MAVLink's FAILURE_TYPE and drift), and faults that only a link
or a log can have: spikes, noise, drops.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Final

from estimators.errors import LogError

_IMUS: Final = ("HIGHRES_IMU", "RAW_IMU", "SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3")
_PRESSURES: Final = ("SCALED_PRESSURE", "SCALED_PRESSURE2", "SCALED_PRESSURE3")
_RECEIVERS: Final = ("GPS_RAW_INT", "GPS2_RAW")


def _all(messages: tuple[str, ...], *fields: str) -> dict[str, tuple[str, ...]]:
    return dict.fromkeys(messages, fields)


def _axes(kind: str) -> dict[str, tuple[str, ...]]:
    return _all(_IMUS, *(f"{axis}{kind}" for axis in "xyz"))


UNITS: Final[Mapping[str, dict[str, tuple[str, ...]]]] = MappingProxyType(
    {
        "gyro": _axes("gyro"),
        "accel": _axes("acc"),
        "mag": _axes("mag"),
        "baro": {**_all(_PRESSURES, "press_abs"), "HIGHRES_IMU": ("abs_pressure",)},
        "gps": _all(_RECEIVERS, "lat", "lon", "alt", "vel", "cog"),
        "airspeed": {
            "VFR_HUD": ("airspeed",),
            "AIRSPEED": ("airspeed", "raw_press"),
            **_all(_PRESSURES, "press_diff"),
            "HIGHRES_IMU": ("diff_pressure",),
        },
        "distance_sensor": {"DISTANCE_SENSOR": ("current_distance",), "RANGEFINDER": ("distance",)},
        "battery": {"SYS_STATUS": ("voltage_battery",)},
    }
)
"""Sensors by the names of MAVLink's FAILURE_UNIT: the messages and fields that contain their values."""


class FaultKind(StrEnum):
    """Kinds of faults. Values are in SI units and radians (GPS positions: metres)."""

    OFF = "off"
    """The messages are missing. A unit that is one of several in its message repeats its last values."""
    STUCK = "stuck"
    """The value at the beginning of the fault is repeated."""
    GARBAGE = "garbage"
    """Random values between -VALUE and VALUE."""
    WRONG = "wrong"
    """VALUE is added."""
    DRIFT = "drift"
    """VALUE is added for every second since the beginning."""
    NOISE = "noise"
    """White noise with the standard deviation VALUE."""
    SPIKE = "spike"
    """VALUE is added in one of a hundred messages."""
    SLOW = "slow"
    """Only one of VALUE messages is kept."""
    DELAYED = "delayed"
    """Messages arrive VALUE seconds later; their own time stamps are not changed."""
    DROP = "drop"
    """The share VALUE of the messages is lost."""
    INTERMITTENT = "intermittent"
    """The messages are alternately missing and present, for VALUE seconds each on average."""


DEFAULTS: Final = MappingProxyType(
    {FaultKind.SLOW: 5.0, FaultKind.DELAYED: 0.2, FaultKind.DROP: 0.2, FaultKind.INTERMITTENT: 1.0}
)
"""VALUE of the kinds that have one default for all messages."""

_WITHOUT_VALUE: Final = frozenset({FaultKind.OFF, FaultKind.STUCK})
_SYNTAX: Final = "WHAT:KIND[=VALUE][@FROM-TO], as in gps:off@60-120 or RAW_IMU.xgyro:noise=0.02"
_SPEC: Final = re.compile(r"([A-Za-z0-9_.]+):([a-z]+)(?:=([^@]+))?(?:@([0-9.]*)-([0-9.]*))?")


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """One fault.

    Attributes:
        fields: fields by message name; no fields: the whole message.
        kind: kind of the fault.
        value: size of the fault; None if the kind has none.
        from_s, to_s: beginning and end, in seconds of the log's clock (`Log.clock`).
    """

    fields: MappingProxyType[str, tuple[str, ...]]
    kind: FaultKind
    value: float | None = None
    from_s: float = 0.0
    to_s: float = math.inf


_MEANINGS: Final = {
    FaultKind.DROP: ", the share of the messages that is lost",
    FaultKind.SLOW: ": one message of so many is left",
    FaultKind.DELAYED: " s",
    FaultKind.INTERMITTENT: " s",
}


def parse_fault(text: str) -> Fault:
    """Parse a fault from text.

    Args:
        text: `WHAT:KIND[=VALUE][@FROM-TO]`; WHAT is one of `UNITS`, a message, or MESSAGE.field; the times
            are seconds since the first record, each of them may be omitted.

    Raises:
        LogError: it can't be parsed; the message names what is accepted.
    """
    match = _SPEC.fullmatch(text.strip())
    if match is None:
        raise LogError(f"fault {text!r} can't be read; accepted: {_SYNTAX}")
    what, kind_text, value_text, from_text, to_text = match.groups()
    try:
        kind = FaultKind(kind_text)
    except ValueError:
        raise LogError(f"fault {text!r}: no kind {kind_text!r}; accepted: {', '.join(FaultKind)}") from None
    value = _value(text, kind, value_text)
    from_s = _time(text, from_text, 0.0)
    to_s = _time(text, to_text, math.inf)
    if to_s <= from_s:
        raise LogError(
            f"fault {text!r} ends before it begins; give @FROM-TO in seconds since the first record"
        )
    return Fault(fields=_fields(text, what), kind=kind, value=value, from_s=from_s, to_s=to_s)


def _fields(text: str, what: str) -> MappingProxyType[str, tuple[str, ...]]:
    unit = UNITS.get(what.lower())
    if unit is not None:
        return MappingProxyType(unit)
    message, _, field = what.partition(".")
    if message != message.upper():
        raise LogError(
            f"fault {text!r}: {what!r} is neither one of {', '.join(UNITS)} nor a message; {_SYNTAX}"
        )
    return MappingProxyType({message: (field,) if field else ()})


def _value(text: str, kind: FaultKind, value_text: str | None) -> float | None:
    if kind in _WITHOUT_VALUE:
        if value_text is not None:
            raise LogError(f"fault {text!r}: {kind} has no value; leave ={value_text} out")
        return None
    if value_text is None:
        if kind in DEFAULTS:
            return DEFAULTS[kind]
        raise LogError(f"fault {text!r}: {kind} needs a value, in SI units: {kind}=0.1")
    try:
        value = float(value_text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise LogError(f"fault {text!r}: {value_text!r} is no number; accepted: {_SYNTAX}")
    low, high = {
        FaultKind.DROP: (0.0, 1.0),
        FaultKind.SLOW: (2.0, 1e6),
        FaultKind.DELAYED: (1e-6, 3600.0),
        FaultKind.INTERMITTENT: (1e-3, 3600.0),
        FaultKind.NOISE: (0.0, math.inf),
        FaultKind.GARBAGE: (0.0, math.inf),
    }.get(kind, (-math.inf, math.inf))
    if not low <= value <= high:
        meaning = _MEANINGS.get(kind, "")
        raise LogError(f"fault {text!r}: {value:g} is not in {low:g}..{high:g}{meaning}")
    return value


def _time(text: str, time_text: str | None, default: float) -> float:
    if not time_text:
        return default
    try:
        return float(time_text)
    except ValueError:
        raise LogError(f"fault {text!r}: {time_text!r} is no time in seconds; accepted: {_SYNTAX}") from None
