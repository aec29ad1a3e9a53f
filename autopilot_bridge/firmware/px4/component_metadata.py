"""Component metadata: COMPONENT_METADATA and the JSON files that it points to, served by MAVLink FTP.

A general file lists the others with their checksums: parameters (from the vehicle's own table), events and
actuators. All are packed with xz, as PX4's are.

Source: mavlink.io/en/services/component_information.html and its JSON schemas (version 1).
"""

import json
import lzma
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Final

from autopilot_bridge.dispatch import on_request
from autopilot_bridge.firmware.event_kinds import definitions
from autopilot_bridge.firmware.px4 import events as px4_events
from autopilot_bridge.firmware.px4.actuators import actuator_metadata, choices
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.parameters import ParameterDefinition, ParameterType
from autopilot_bridge.services.channel import Channel
from autopilot_bridge.services.files.ftp_protocol import crc32
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.storage.generated import GeneratedStore

MOUNT: Final = ("etc", "extras")
GENERAL: Final = "component_general.json.xz"
PARAMETERS: Final = "parameters.json.xz"
EVENTS: Final = "all_events.json.xz"
ACTUATORS: Final = "actuators.json.xz"
_TYPE_PARAMETER: Final = 1  # COMP_METADATA_TYPE
_TYPE_EVENTS: Final = 4
_TYPE_ACTUATORS: Final = 5
_LZMA2: Final = {"id": lzma.FILTER_LZMA2, "preset": 3, "dict_size": 1 << 17}
"""Dictionary size as the files. They are made in flight; this takes a tenth of the time of 8 MiB."""
_TYPES: Final = {
    ParameterType.INT8: "Int8",
    ParameterType.INT16: "Int16",
    ParameterType.UINT32: "Uint32",
    ParameterType.INT32: "Int32",
    ParameterType.REAL32: "Float",
}


class ComponentMetadataService(Microservice):
    """Answers requests for COMPONENT_METADATA, and makes the files at the first request.

    Args:
        parameters: the vehicle's table.
        time_us: returns the current time, microseconds since boot.
    """

    def __init__(self, parameters: tuple[ParameterDefinition, ...], time_us: Callable[[], int]) -> None:
        self._parameters = parameters
        self._time_us = time_us

    @cached_property
    def files(self) -> Mapping[str, bytes]:
        """The files by name."""
        parts = {
            PARAMETERS: packed(parameter_metadata(self._parameters)),
            EVENTS: packed(definitions(px4_events.NAMESPACE, px4_events.KINDS, px4_events.MODE_GROUPS)),
            ACTUATORS: packed(actuator_metadata(self._parameters)),
        }
        types = {_TYPE_PARAMETER: PARAMETERS, _TYPE_EVENTS: EVENTS, _TYPE_ACTUATORS: ACTUATORS}
        general = {
            "version": 1,
            "metadataTypes": [
                {"type": kind, "uri": _uri(name), "fileCrc": crc32(parts[name])}
                for kind, name in types.items()
            ],
        }
        return {GENERAL: packed(general), **parts}

    def store(self) -> GeneratedStore:
        """The files as a store, which makes them at the first access."""
        names = (GENERAL, PARAMETERS, EVENTS, ACTUATORS)
        return GeneratedStore({name: self._content(name) for name in names})

    def _content(self, name: str) -> Callable[[Mapping[str, str]], bytes]:
        return lambda query: self.files[name]

    @on_request(dialect.MAVLink_component_metadata_message)
    def _send(self, channel: Channel, parameter: float) -> None:
        time_ms = self._time_us() // 1000 & 0xFFFFFFFF
        channel.send(
            dialect.MAVLink_component_metadata_message(
                time_ms, crc32(self.files[GENERAL]), _uri(GENERAL).encode()
            )
        )


def parameter_metadata(parameters: tuple[ParameterDefinition, ...]) -> dict[str, object]:
    """The JSON of COMP_METADATA_TYPE_PARAMETER."""
    return {"version": 1, "parameters": [_parameter(definition) for definition in parameters]}


def packed(content: dict[str, object]) -> bytes:
    """JSON in an xz file."""
    text = json.dumps(content, separators=(",", ":"))
    return lzma.compress(text.encode(), format=lzma.FORMAT_XZ, check=lzma.CHECK_CRC32, filters=[_LZMA2])


def _parameter(definition: ParameterDefinition) -> dict[str, object]:
    entry: dict[str, object] = {
        "name": definition.name,
        "type": _TYPES[definition.type],
        "default": definition.convert(definition.default),
        "group": definition.name.partition("_")[0],
        "category": "Standard",
        "shortDesc": definition.description or definition.name,
    }
    if definition.unit:
        entry["units"] = definition.unit
    if definition.minimum is not None:
        entry["min"] = definition.minimum
    if definition.maximum is not None:
        entry["max"] = definition.maximum
    if values := choices(definition.name):
        entry["values"] = [
            {"value": value, "description": description} for value, description in values.items()
        ]
    if definition.reboot_required:
        entry["rebootRequired"] = True
    return entry


def _uri(name: str) -> str:
    return f"mftp://{'/'.join((*MOUNT, name))}"
