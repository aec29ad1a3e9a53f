"""The camera's own settings: a camera definition file, by MAVLink FTP, and its parameters (PARAM_EXT).

Source: MAVLink camera definition files (mavlink.io/en/services/camera_def.html), extended parameter protocol
(mavlink.io/en/services/parameter_ext.html), MAVLink FTP with the component as its server.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final
from xml.etree import ElementTree

from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.payload.camera_actions import CameraActions
from autopilot_bridge.payload.camera_messages import DEFINITION_FILE, DEFINITION_VERSION
from autopilot_bridge.payload.camera_storage import PHOTO_QUALITY
from autopilot_bridge.payload.component import Sender
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.files.file_transfer import FileTransferService
from autopilot_bridge.storage.generated import GeneratedStore

_TICK_US: Final = 20_000
_UINT8: Final = int(dialect.MAV_PARAM_EXT_TYPE_UINT8)
_ACCEPTED: Final = int(dialect.PARAM_ACK_ACCEPTED)
_UNKNOWN: Final = int(dialect.PARAM_ACK_VALUE_UNSUPPORTED)


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraSetting:
    """One setting: a small number, with a name for each of its values.

    Attributes:
        name: of the parameter.
        description: text for users.
        default: value.
        options: (name, value) of all possible values.
        get, set: read and write the component's value.
    """

    name: str
    description: str
    default: int
    options: tuple[tuple[str, int], ...]
    get: Callable[[], int]
    set: Callable[[int], None]


class CameraDefinition:
    """Serves the definition and the settings of one camera component."""

    def __init__(self, camera: CameraActions) -> None:
        self._camera = camera
        self.name = "bus"
        self.settings = _settings(camera)
        self._files = FileTransferService(
            GeneratedStore({DEFINITION_FILE: lambda _: definition(self.settings)})
        )
        self._next_tick_us: int | None = None  # no file was requested yet
        self._list: list[int] = []

    def send(self, message: MAVLinkMessage) -> None:
        """Send a message of the file service (which uses this object as its channel)."""
        self._camera.send(message)

    @receives(dialect.MAVLink_file_transfer_protocol_message)
    def _on_transfer(
        self, message: dialect.MAVLink_file_transfer_protocol_message, sender: Sender, time_us: int
    ) -> None:
        self._files.on_transfer(message, Source(self, *sender), time_us)
        self._next_tick_us = time_us

    @receives(dialect.MAVLink_param_ext_request_list_message)
    def _on_list(
        self, message: dialect.MAVLink_param_ext_request_list_message, sender: Sender, time_us: int
    ) -> None:
        self._list = list(range(len(self.settings)))

    @receives(dialect.MAVLink_param_ext_request_read_message)
    def _on_read(
        self, message: dialect.MAVLink_param_ext_request_read_message, sender: Sender, time_us: int
    ) -> None:
        index = message.param_index
        if index == -1:
            index = self._index(message.param_id)
        if 0 <= index < len(self.settings):
            self._send_setting(index)

    def step(self, time_us: int) -> None:
        """Continue files and lists."""
        if self._list:
            self._send_setting(self._list.pop(0))
        if self._next_tick_us is not None and time_us >= self._next_tick_us:
            self._next_tick_us = time_us + _TICK_US
            self._files.tick(time_us)

    def report(self, name: str) -> None:
        """Report a setting that a command has changed."""
        self._send_setting(self._index(name))

    def _index(self, name: str) -> int:
        return next((i for i, setting in enumerate(self.settings) if setting.name == name), -1)

    @receives(dialect.MAVLink_param_ext_set_message)
    def _on_set(self, message: dialect.MAVLink_param_ext_set_message, sender: Sender, time_us: int) -> None:
        index = self._index(message.param_id)
        value, result = -1, _UNKNOWN
        if index >= 0:
            setting = self.settings[index]
            new = _number(message.param_value)
            if message.param_type == _UINT8 and any(new == value for _, value in setting.options):
                setting.set(new)
                result = _ACCEPTED
            value = setting.get()
        self._camera.send(
            dialect.MAVLink_param_ext_ack_message(
                param_id=_text(message.param_id),
                param_value=_bytes(max(0, value)),
                param_type=_UINT8,
                param_result=result,
            )
        )

    def _send_setting(self, index: int) -> None:
        setting = self.settings[index]
        self._camera.send(
            dialect.MAVLink_param_ext_value_message(
                param_id=setting.name.encode(),
                param_value=_bytes(setting.get()),
                param_type=_UINT8,
                param_count=len(self.settings),
                param_index=index,
            )
        )


def definition(settings: tuple[CameraSetting, ...]) -> bytes:
    """The camera definition file."""
    root = ElementTree.Element("mavlinkcamera")
    head = ElementTree.SubElement(root, "definition", version=str(DEFINITION_VERSION))
    ElementTree.SubElement(head, "model").text = "simulated camera"
    ElementTree.SubElement(head, "vendor").text = "flightstack"
    parameters = ElementTree.SubElement(root, "parameters")
    for setting in settings:
        item = ElementTree.SubElement(
            parameters, "parameter", name=setting.name, type="uint8", default=str(setting.default)
        )
        if setting.name == "CAM_MODE":  # clients have a separate control for it
            item.set("control", "0")
        ElementTree.SubElement(item, "description").text = setting.description
        options = ElementTree.SubElement(item, "options")
        for name, value in setting.options:
            ElementTree.SubElement(options, "option", name=name, value=str(value))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)


def _settings(camera: CameraActions) -> tuple[CameraSetting, ...]:
    def set_mode(mode: int) -> None:
        camera.mode = mode
        camera.send_settings()

    def set_quality(quality: int) -> None:
        camera.photo_quality = quality

    def set_autofocus(on: int) -> None:
        kind = dialect.FOCUS_TYPE_AUTO_CONTINUOUS if on else dialect.FOCUS_TYPE_AUTO_SINGLE
        if camera.lens.focus(kind, math.nan):
            camera.send_settings()

    return (
        CameraSetting(
            name="CAM_MODE",
            description="Camera mode",
            default=int(dialect.CAMERA_MODE_IMAGE),
            options=(("Photo", 0), ("Video", 1), ("Survey", 2)),
            get=lambda: camera.mode,
            set=set_mode,
        ),
        CameraSetting(
            name="CAM_PHOTOQUAL",
            description="JPEG quality",
            default=PHOTO_QUALITY,
            options=(("Fine", 98), ("Normal", PHOTO_QUALITY), ("Small", 75)),
            get=lambda: camera.photo_quality,
            set=set_quality,
        ),
        CameraSetting(
            name="CAM_AUTOFOCUS",
            description="Autofocus",
            default=1,
            options=(("Once", 0), ("Always", 1)),
            get=lambda: int(camera.device.focus_distance_m is None),
            set=set_autofocus,
        ),
    )


def _number(value: str | bytes) -> int:
    """The first byte of a value, which decoders return as text."""
    if isinstance(value, str):
        value = value.encode("latin-1", "replace")
    return value[0] if len(value) else 0


def _bytes(value: int) -> bytes:
    return bytes((value,)).ljust(128, b"\0")


def _text(name: str | bytes) -> bytes:
    return (name if isinstance(name, bytes) else str(name).encode("ascii", "replace"))[:16]
