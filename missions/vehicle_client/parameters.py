"""A vehicle's parameters through MAVSDK: read, set, save, load and compare."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Final

import numpy as np
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.plugins.param import ParamError, ParamResult

from autopilot_bridge.parameter_files import MAVPROXY_SUFFIXES, QGC_SUFFIX, format_mavproxy, format_qgc
from autopilot_bridge.parameters import INTEGER_LIMITS, ParameterDefinition, ParameterType
from missions.errors import CommandRejected, MissionError, PlanError, VehicleTimeout
from missions.vehicle_client.client import VehicleClient

_LIST_TRIES: Final = 3
_TYPES_S: Final = 1.0
_INTEGERS: Final = frozenset((1, 2, 3, 4, 5, 6))
_INT32: Final = INTEGER_LIMITS[ParameterType.INT32]
_SIX_DIGITS: Final = 5e-6 + 6e-8  # half of the last of six digits, plus single precision
_LARGEST_FLOAT: Final = float(np.finfo(np.float32).max)


@dataclass(frozen=True, slots=True, kw_only=True)
class Value:
    """A parameter's value as the vehicle stores it.

    Attributes:
        number: an int, or a float in single precision.
        type: MAV_PARAM_TYPE.
    """

    number: float
    type: int

    def __str__(self) -> str:
        """The shortest decimal that converts back to the same value."""
        return str(self.number) if isinstance(self.number, int) else str(np.float32(self.number))


def same(a: float, b: float) -> bool:
    """Whether two numbers are the same value on a vehicle, which stores single precision."""
    if math.isnan(a) or math.isnan(b):
        return math.isnan(a) and math.isnan(b)
    return a == b or np.float32(a) == np.float32(b)


def _rounds_to(number: float, rounded: float) -> bool:
    """Whether a number in single precision may have been rounded to another number of six digits."""
    return not isinstance(number, int) and math.isclose(number, rounded, rel_tol=_SIX_DIGITS)


async def read_all(client: VehicleClient) -> dict[str, Value]:
    """Read all parameters by name, in alphabetical order.

    MAVSDK distinguishes only int and float; the exact types are taken from the PARAM_VALUE messages that it
    requested.

    Raises:
        VehicleTimeout: the vehicle doesn't list them.
    """
    plugin = ParamAsync(client.system)
    for _ in range(_LIST_TRIES):
        listed = await plugin.get_all_params()
        if listed.int_params or listed.float_params:
            break
    else:
        raise VehicleTimeout(
            f"vehicle {client.system_id} did not list its parameters ({_LIST_TRIES} attempts)"
        )
    await client.wait_for_types([p.name for p in listed.int_params], timeout_s=_TYPES_S)
    values = {
        p.name: Value(number=int(p.value), type=client.parameter_types.get(p.name, int(ParameterType.INT32)))
        for p in listed.int_params
    }
    values |= {
        p.name: Value(number=float(p.value), type=int(ParameterType.REAL32)) for p in listed.float_params
    }
    return dict(sorted(values.items()))


async def read_one(client: VehicleClient, name: str) -> Value:
    """Read one parameter.

    Raises:
        PlanError: the vehicle has no parameter of that name.
    """
    plugin = ParamAsync(client.system)
    try:
        return Value(number=float(await plugin.get_param_float(name)), type=int(ParameterType.REAL32))
    except ParamError as error:
        if error.result is not ParamResult.WRONG_TYPE:
            raise PlanError(await _unknown(client, name, error)) from error
    try:
        number = int(await plugin.get_param_int(name))
    except ParamError as error:
        raise PlanError(await _unknown(client, name, error)) from error
    return Value(number=number, type=client.parameter_types.get(name, int(ParameterType.INT32)))


async def _unknown(client: VehicleClient, name: str, error: ParamError) -> str:
    if len(name) > 16 or not name.isascii() or not name:
        return f"parameter {name!r}: accepted: names of 1 to 16 ASCII characters"
    try:
        known: Iterable[str] = await read_all(client)
    except MissionError:
        known = ()
    close = get_close_matches(name.upper(), list(known), n=3, cutoff=0.6)
    hint = f"; did you mean {' or '.join(close)}?" if close else ""
    return f"parameter {name}: the vehicle does not answer for it ({error.result.name.lower()}){hint}"


async def write_one(client: VehicleClient, name: str, number: float, type_: int) -> Value:
    """Set a parameter, read it back and return its value.

    Raises:
        PlanError: the number is not a value of this type.
        CommandRejected: the vehicle kept another value.
    """
    plugin = ParamAsync(client.system)
    try:
        if type_ in _INTEGERS:
            low, high = _whole_range(type_)
            if not low <= number <= high or number != int(number):
                raise PlanError(f"parameter {name} = {number:g}: accepted: a whole number, {low} to {high}")
            await plugin.set_param_int(name, int(number))
        else:
            if not abs(number) <= _LARGEST_FLOAT:
                raise PlanError(f"parameter {name} = {number:g}: accepted: a number of single precision")
            await plugin.set_param_float(name, float(number))
    except ParamError as error:
        raise CommandRejected(
            f"the vehicle did not take {name} = {number:g}: {error.result.name.lower()}", 0
        ) from error
    kept = await read_one(client, name)
    if not same(kept.number, number):
        raise CommandRejected(f"the vehicle kept {name} = {kept} instead of {number:g}", 0)
    return kept


def _whole_range(type_: int) -> tuple[int, int]:
    """Range of a type, limited to the signed 32-bit integers that MAVSDK can set."""
    low, high = INTEGER_LIMITS.get(_known_type(type_), _INT32)
    return low, min(high, _INT32[1])


def format_values(path: Path, values: Mapping[str, Value], system_id: int) -> str:
    """Values as text in the format of a file's suffix; types are included if the format has them.

    Raises:
        PlanError: the suffix is unknown.
    """
    numbers = {name: value.number for name, value in values.items()}
    suffix = path.suffix.lower()
    if suffix == QGC_SUFFIX:
        definitions = [
            ParameterDefinition(name=name, type=_known_type(value.type), default=value.number)
            for name, value in values.items()
            if math.isfinite(value.number)
        ]
        finite = {name: number for name, number in numbers.items() if math.isfinite(number)}
        return format_qgc(finite, definitions, system_id=system_id)
    if suffix in MAVPROXY_SUFFIXES:
        return format_mavproxy(numbers)
    accepted = ", ".join((QGC_SUFFIX, *MAVPROXY_SUFFIXES))
    raise PlanError(f"parameter file {path}: suffix {path.suffix!r}; accepted: {accepted}")


def _known_type(type_: int) -> ParameterType:
    try:
        return ParameterType(type_)
    except ValueError:
        return ParameterType.INT32


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """A parameter that differs between two sides; None: that side has no such parameter."""

    name: str
    vehicle: Value | None
    other: float | None


def differences(
    values: Mapping[str, Value], other: Mapping[str, float], *, rounded: bool = False
) -> list[Difference]:
    """All differences, by name. Parameters that only the vehicle has are not differences, because a file may
    contain only a part.

    Args:
        values: the vehicle's.
        other: values that they are compared with.
        rounded: whether the other values have six digits; differences within their rounding are then ignored.
    """
    found = []
    for name, number in sorted(other.items()):
        own = values.get(name)
        if own is None or not (same(own.number, number) or (rounded and _rounds_to(own.number, number))):
            found.append(Difference(name=name, vehicle=own, other=number))
    return found


async def load(
    client: VehicleClient, changes: Iterable[Difference], on_change: Callable[[str], None]
) -> list[str]:
    """Set all parameters that differ; returns the names that the vehicle did not accept, with its reasons."""
    refused = []
    for change in changes:
        if change.vehicle is None or change.other is None:
            continue
        try:
            kept = await write_one(client, change.name, change.other, change.vehicle.type)
        except (MissionError, PlanError) as error:
            refused.append(str(error))
            continue
        on_change(f"{change.name}: {change.vehicle} -> {kept}")
    return refused
