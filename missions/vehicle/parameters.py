"""Reads and sets a vehicle's parameters (MAVLink parameter protocol)."""

import math
import struct
from collections.abc import Mapping
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from flightsim.foundation.plain_text import plain_text
from missions.errors import CommandRejected, MissionError, VehicleTimeout
from missions.vehicle.limits import Limits
from missions.vehicle.link import VehicleLink

_TRIES: Final = 4
_WAIT_S: Final = 0.8
_LIST_PAUSE_S: Final = 3.0  # without another parameter the list has ended, or the rest was lost
_WORTH_A_LIST: Final = 8  # values; fewer are requested one by one
_INTEGER_CODES: Final = {1: "<B3x", 2: "<b3x", 3: "<H2x", 4: "<h2x", 5: "<I", 6: "<i"}


class UnknownParameter(VehicleTimeout):
    """A vehicle did not answer for a parameter: autopilots don't answer requests for unknown names."""


def value_from_wire(value: float, kind: int, bytewise: bool) -> float:
    """The number in PARAM_VALUE: PX4 stores the bytes of integers in the float, ArduPilot converts them."""
    if bytewise and kind in _INTEGER_CODES:
        return float(struct.unpack(_INTEGER_CODES[kind], struct.pack("<f", value))[0])
    return value


def value_to_wire(value: float, kind: int, bytewise: bool) -> float:
    """The float for PARAM_SET."""
    if bytewise and kind in _INTEGER_CODES:
        packed: float = struct.unpack("<f", struct.pack(_INTEGER_CODES[kind], round(value)))[0]
        return packed
    return value


def _name(message: dialect.MAVLink_param_value_message) -> str:
    return plain_text(str(message.param_id).rstrip("\0"))


class VehicleParameters:
    """The parameters that a vehicle stores.

    Args:
        link: messages of the vehicle.
    """

    def __init__(self, link: VehicleLink) -> None:
        self._link = link

    async def read(self, name: str) -> float:
        """Read a parameter.

        Raises:
            VehicleTimeout: no answer was received; autopilots don't answer requests for unknown names.
        """
        value, _ = await self._read(name)
        return value

    async def read_or(self, name: str, default: float) -> float:
        """Read a parameter; returns `default` when the vehicle doesn't answer."""
        try:
            return await self.read(name)
        except VehicleTimeout:
            return default

    async def limits(self) -> Limits:
        """The limits for a planner, from the vehicle's parameters.

        Raises:
            MissionError: one of them is not a number.
        """
        firmware = self._link.firmware
        values = {
            name: await self.read_or(name, default) for name, default in firmware.limiting_parameters.items()
        }
        for name, value in values.items():
            if not math.isfinite(value):
                raise MissionError(f"the vehicle reports {name} = {value}; set it to a number")
        return firmware.limits(values)

    async def _read(self, name: str, *, tries: int = _TRIES) -> tuple[float, int]:
        """Read value and MAV_PARAM_TYPE of a parameter."""
        message = dialect.MAVLink_param_request_read_message(
            self._link.system_id, 1, name.encode("ascii", "replace")[:16], -1
        )
        with self._link.messages(dialect.MAVLink_param_value_message) as replies:
            for _ in range(tries):
                self._link.send(message)
                try:
                    async with self._link.deadline(_WAIT_S, f"parameter {name}"):
                        async for reply in replies:
                            if _name(reply).upper() == name.upper():
                                bytewise = self._link.firmware.bytewise_parameters
                                value = value_from_wire(reply.param_value, reply.param_type, bytewise)
                                return value, reply.param_type
                except TimeoutError:
                    continue
        raise UnknownParameter(f"the vehicle did not answer for parameter {name}: it may not have it")

    async def write(self, name: str, value: float) -> None:
        """Set a parameter and wait for the confirmation.

        Raises:
            CommandRejected: the vehicle kept another value.
            VehicleTimeout: no answer was received.
        """
        if not math.isfinite(value):
            raise CommandRejected(f"parameter {name} = {value} is not a number a vehicle can take", 0)
        _, kind = await self._read(name)
        bytewise = self._link.firmware.bytewise_parameters
        message = dialect.MAVLink_param_set_message(
            self._link.system_id, 1, name.encode("ascii"), value_to_wire(value, kind, bytewise), kind
        )
        kept = math.nan
        with self._link.messages(dialect.MAVLink_param_value_message) as replies:
            for _ in range(_TRIES):
                self._link.send(message)
                try:
                    async with self._link.deadline(_WAIT_S, f"parameter {name}"):
                        async for reply in replies:
                            if _name(reply).upper() != name.upper():
                                continue
                            kept = value_from_wire(reply.param_value, reply.param_type, bytewise)
                            if math.isclose(kept, value, rel_tol=1e-5, abs_tol=1e-6):
                                return
                except TimeoutError:
                    continue
        if math.isnan(kept):
            raise VehicleTimeout(f"setting parameter {name} was not answered; {self._link.last_received()}")
        raise CommandRejected(f"the vehicle kept {name} = {kept:g} instead of {value:g}", 0)

    async def write_known(self, values: Mapping[str, float]) -> tuple[str, ...]:
        """Set the parameters that the vehicle has, in order; returns the names that it does not have.

        Raises:
            CommandRejected: the vehicle kept other values, all in one message.
        """
        listed = await self._names() if len(values) >= _WORTH_A_LIST else frozenset(values)
        unknown, kept = [], []
        for name, value in values.items():
            if name not in listed:  # PX4 lists only the parameters that something uses
                try:
                    await self._read(name, tries=1)
                except VehicleTimeout:
                    unknown.append(name)
                    continue
            try:
                await self.write(name, value)
            except UnknownParameter:
                unknown.append(name)
            except CommandRejected as error:
                kept.append(str(error))
        if kept:
            raise CommandRejected("; ".join(kept), 0)
        return tuple(unknown)

    async def _names(self) -> frozenset[str]:
        """Names in the vehicle's list of parameters, as far as they were received."""
        names: set[str] = set()
        with self._link.messages(dialect.MAVLink_param_value_message) as replies:
            self._link.send(
                dialect.MAVLink_param_request_list_message(self._link.system_id, AUTOPILOT_COMPONENT)
            )
            while True:
                try:
                    async with self._link.deadline(_LIST_PAUSE_S, "the list of parameters"):
                        reply = await anext(replies)
                except TimeoutError:
                    return frozenset(names)
                names.add(_name(reply))
                if len(names) >= reply.param_count:
                    return frozenset(names)

    async def write_all(self, values: Mapping[str, float]) -> None:
        """Set several parameters in order."""
        for name, value in values.items():
            await self.write(name, value)
