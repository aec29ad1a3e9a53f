"""The MAVLink parameter protocol, autopilot side, of PX4 and ArduPilot.

Source: MAVLink parameter protocol (mavlink.io/en/services/parameter.html). Where the firmwares differ, or
deviate from the document (no answer instead of an error, no range check), their behaviour is emulated;
`ParameterPolicy` holds every difference.
"""

import math
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.parameters import (
    INTEGER_LIMITS,
    ParameterDefinition,
    ParameterError,
    ParameterStore,
    ParameterType,
)
from autopilot_bridge.services.channel import Broadcast, Channel, Source, is_congested, send_to_all
from autopilot_bridge.services.microservice import Microservice

HASH_NAME: Final = "_HASH_CHECK"
NO_INDEX: Final = 65535
_AS_FLOAT: Final = struct.Struct("<f")
_AS_INT32: Final = struct.Struct("<i")
_AS_UINT32: Final = struct.Struct("<I")
_ROUNDING: Final = 0.01  # ArduPilot adds this away from zero before it truncates to a whole number


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterPolicy:
    """The differences of one firmware.

    Attributes:
        bytewise: integers travel as their bit pattern in the float field (PX4), else as a float (ArduPilot).
        strict_type: a PARAM_SET of another type than the parameter's is ignored (PX4).
        ignore_case: names match in any case, and a reply repeats the name as requested (ArduPilot).
        index_by_name: replies to requests by name carry the index (PX4), else 65535 (ArduPilot).
        set_echo_to_all: every PARAM_SET is answered on all channels (ArduPilot); else on the requesting
            channel, and on all channels once more if the value changed (PX4).
        hash_parameter: the list starts with `_HASH_CHECK`, and setting it ends the list (PX4).
        identity: the parameters with the system id, and with the component id 1. They keep their values while
            the vehicle runs, and a change is refused: real vehicles apply a change at the next boot.
        list_per_tick: parameters sent per 50 Hz tick and channel while listing.
    """

    bytewise: bool
    strict_type: bool
    ignore_case: bool
    index_by_name: bool
    set_echo_to_all: bool
    hash_parameter: bool
    identity: tuple[str, ...]
    list_per_tick: int

    def __post_init__(self) -> None:
        if self.list_per_tick < 1:
            raise ValueError(f"list_per_tick {self.list_per_tick} is not at least 1")


def fix_identity(store: ParameterStore, policy: ParameterPolicy, system_id: int) -> None:
    """Set the identity parameters to the vehicle's ids, whatever a file contains."""
    for name, value in zip(policy.identity, (system_id, AUTOPILOT_COMPONENT), strict=False):
        if name in store:
            store.fix(name, value)


class _Listing:
    """Progress of one PARAM_REQUEST_LIST on one channel."""

    def __init__(self, channel: Channel, next_index: int) -> None:
        self.channel = channel
        self.next_index = next_index  # -1: the hash comes first


class ParameterService(Microservice):
    """Answers PARAM_REQUEST_READ, PARAM_REQUEST_LIST and PARAM_SET from a `ParameterStore`.

    A changed parameter is announced on every channel, whether a client or the autopilot has changed it.

    Args:
        store: the values.
        policy: the firmware's behaviour.
        broadcast: all channels of the autopilot.
        on_list: called with the requesting channel for each PARAM_REQUEST_LIST (ArduPilot sends its banner
            then).
        on_fixed: called with the name of a parameter that a client tried to change and that can't be changed.
    """

    def __init__(
        self,
        store: ParameterStore,
        policy: ParameterPolicy,
        broadcast: Broadcast,
        *,
        on_list: Callable[[Channel], None] | None = None,
        on_fixed: Callable[[str], None] | None = None,
    ) -> None:
        self._store = store
        self._policy = policy
        self._broadcast = broadcast
        self._on_list = on_list
        self._on_fixed = on_fixed
        self._listings: list[_Listing] = []
        self._setting: str | None = None  # being set by PARAM_SET; the echo replaces the announcement
        store.subscribe(self._announce_change)

    @property
    def hash_check(self) -> int:
        """CRC-32 over all names and values: equal sets of values have equal hashes."""
        crc = 0
        for name, value in self._store.as_dict().items():
            definition = self._store.find(name)
            packed = _AS_FLOAT.pack(value) if not definition or not definition.is_integer else _raw_int(value)
            crc = zlib.crc32(packed, zlib.crc32(name.encode(), crc))
        return crc

    def tick(self, time_us: int) -> None:
        """Send the next parameters of every running list."""
        if not self._listings:
            return
        for listing in self._listings:
            self._continue_list(listing)
        self._listings = [listing for listing in self._listings if listing.next_index < self._store.count]

    @receives(dialect.MAVLink_param_request_list_message)
    def _on_list_request(
        self, message: dialect.MAVLink_param_request_list_message, source: Source, time_us: int
    ) -> None:
        self.list_on(source.channel)

    @receives(dialect.MAVLink_param_request_read_message)
    def _on_read(
        self, message: dialect.MAVLink_param_request_read_message, source: Source, time_us: int
    ) -> None:
        channel = source.channel
        if message.param_index >= 0:
            if message.param_index < self._store.count:
                definition = self._store.by_index(message.param_index)
                channel.send(self._value_message(definition, index=message.param_index))
            return
        name = _name_of(message)
        if self._policy.hash_parameter and name == HASH_NAME:
            channel.send(self._hash_message())
            return
        found = self._store.find(name, ignore_case=self._policy.ignore_case)
        if found is not None:
            channel.send(self._value_message(found, index=self._index_in_reply(found), name=name))

    def list_on(self, channel: Channel) -> None:
        """Send all parameters on a channel, from the next tick on."""
        running = next((listing for listing in self._listings if listing.channel is channel), None)
        if running is not None:
            running.next_index = 0  # PX4 leaves the hash out when a list is requested again before its end
        else:
            self._listings.append(_Listing(channel, -1 if self._policy.hash_parameter else 0))
        if self._on_list is not None:
            self._on_list(channel)

    def _continue_list(self, listing: _Listing) -> None:
        for _ in range(self._policy.list_per_tick):
            if listing.next_index >= self._store.count or is_congested(listing.channel):
                return
            if listing.next_index < 0:
                listing.channel.send(self._hash_message())
            else:
                definition = self._store.by_index(listing.next_index)
                listing.channel.send(self._value_message(definition, index=listing.next_index))
            listing.next_index += 1

    @receives(dialect.MAVLink_param_set_message)
    def _on_set(self, message: dialect.MAVLink_param_set_message, source: Source, time_us: int) -> None:
        channel = source.channel
        name = _name_of(message)
        if self._policy.hash_parameter and name == HASH_NAME:
            # The ground station has the whole list in its cache: stop sending it.
            self._listings = [listing for listing in self._listings if listing.channel is not channel]
            return
        definition = self._store.find(name, ignore_case=self._policy.ignore_case)
        if definition is None:
            return
        value = self._decode(definition, message)
        if value is None:
            return
        self._setting = definition.name
        try:
            changed = self._store.set(definition.name, value, check_range=False)
        except ParameterError:
            if self._store.is_fixed(definition.name):  # the reply with the unchanged value shows the refusal
                channel.send(self._value_message(definition, index=self._index_in_reply(definition)))
                if self._on_fixed is not None:
                    self._on_fixed(definition.name)
            return  # outside the storage type: refused without an answer, as in the firmwares
        finally:
            self._setting = None
        reply = self._value_message(definition, index=self._index_in_reply(definition))
        if self._policy.set_echo_to_all:
            send_to_all(self._broadcast, reply)
            return
        channel.send(reply)
        if changed:
            send_to_all(
                self._broadcast, self._value_message(definition, index=self._index_in_reply(definition))
            )

    def _decode(
        self, definition: ParameterDefinition, message: dialect.MAVLink_param_set_message
    ) -> float | None:
        """The value in a PARAM_SET; None when the firmware would ignore it."""
        value = message.param_value
        if self._policy.strict_type and message.param_type != definition.type:
            return None
        if self._policy.bytewise and definition.is_integer:
            try:
                whole: int = _AS_INT32.unpack(_AS_FLOAT.pack(value))[0]
            except OverflowError:  # not a single-precision value: no frame can have carried it
                return None
            return whole
        if not math.isfinite(value):
            return None
        if not definition.is_integer:
            return float(value)
        low, high = INTEGER_LIMITS[definition.type]
        return min(max(math.trunc(value + math.copysign(_ROUNDING, value)), low), high)

    def _announce_change(self, name: str, value: float) -> None:
        if name == self._setting:
            return
        definition = self._store.by_index(self._store.index_of(name))
        send_to_all(self._broadcast, self._value_message(definition, index=self._index_in_reply(definition)))

    def _index_in_reply(self, definition: ParameterDefinition) -> int:
        return self._store.index_of(definition.name) if self._policy.index_by_name else NO_INDEX

    def _value_message(
        self, definition: ParameterDefinition, *, index: int, name: str | None = None
    ) -> MAVLinkMessage:
        value = self._store.get(definition.name)
        if self._policy.bytewise and definition.is_integer:
            value = _AS_FLOAT.unpack(_raw_int(value))[0]
        return dialect.MAVLink_param_value_message(
            (name or definition.name).encode("ascii", "replace"),
            float(value),
            int(definition.type),
            self._store.count,
            index,
        )

    def _hash_message(self) -> MAVLinkMessage:
        value = _AS_FLOAT.unpack(_AS_UINT32.pack(self.hash_check))[0]
        return dialect.MAVLink_param_value_message(
            HASH_NAME.encode(), value, int(ParameterType.UINT32), self._store.count, NO_INDEX
        )


def _raw_int(value: float) -> bytes:
    return _AS_UINT32.pack(int(value) & 0xFFFFFFFF)


def _name_of(message: dialect.MAVLink_param_set_message | dialect.MAVLink_param_request_read_message) -> str:
    """The parameter name of a message, up to the first NUL."""
    name = message.param_id
    if isinstance(name, bytes):
        name = name.split(b"\0", 1)[0].decode("ascii", "replace")
    return str(name)
