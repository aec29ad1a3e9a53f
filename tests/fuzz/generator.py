"""Endless malformed and out-of-range MAVLink messages, from a seed: every message of the dialect, with fields
from plausible to absurd, and the sequences of messages that the services take.

A message is either *harmless* (an autopilot in hold must keep its place, whatever it answers) or an *order*
(it may rightly move the vehicle, disarm it, change how it flies, or make it deaf).
"""

import random
import struct
from collections.abc import Callable, Iterator, Sequence
from typing import Final

from pymavlink.generator.mavcrc import x25crc

from autopilot_bridge.mavlink import DEFINITIONS, FrameEncoder, MAVLinkMessage, MessageDefinition, dialect
from autopilot_bridge.parameters import INTEGER_LIMITS, ParameterDefinition

VEHICLE: Final = 1
ABSENT_SYSTEM: Final = 77
AUTOPILOT: Final = 1
CAMERA: Final = 100
GIMBAL: Final = 154
_FLOATS: Final = (
    *(0.0, -0.0, 1.0, -1.0, 0.5, 2.0, 10.0, -100.0, 1e-40, 1e9, 3.4e38, -3.4e38),
    *(float("nan"), float("inf"), -float("inf"), 21196.0, 290876.0),
)
_SMALL: Final = (0, 1, 2, 3, 4, 5, 6, 7, 10, 16, 21, 22, 50, 100, 128, 254, 255)
_TEXTS: Final = (
    *(b"", b"A" * 300, b"\xff" * 300, b"%s%n%x" * 50, b"../" * 90, b"/etc/passwd\0", b"@SYS/../../x\0"),
    *(b"MPC_XY_VEL_MAX", b"WPNAV_SPEED\0\0\0\0\0", b"_HASH_CHECK\0", b"\0" * 16, b"\x80\x81\xfe\0\xff"),
)

ORDER_MESSAGES: Final = frozenset(
    {
        "COMMAND_INT",
        "COMMAND_LONG",
        "HEARTBEAT",  # of the vehicle's own system id and a flight controller's component it could be
        "HIL_ACTUATOR_CONTROLS",
        "HIL_CONTROLS",
        "MANUAL_CONTROL",
        "MISSION_CLEAR_ALL",
        "MISSION_COUNT",
        "MISSION_ITEM",  # ArduPilot takes one with current = 2 as a guided target
        "MISSION_ITEM_INT",
        "MISSION_WRITE_PARTIAL_LIST",
        "PARAM_EXT_SET",
        "PARAM_SET",
        "RC_CHANNELS_OVERRIDE",
        "SETUP_SIGNING",
        "SET_ACTUATOR_CONTROL_TARGET",
        "SET_ATTITUDE_TARGET",
        "SET_HOME_POSITION",
        "SET_MODE",
        "SET_POSITION_TARGET_GLOBAL_INT",
        "SET_POSITION_TARGET_LOCAL_NED",
    }
)
"""Messages to the vehicle's own address that may rightly change how it flies."""

HARMLESS_COMMANDS: Final = (
    "DO_SET_ROI_NONE",
    "DO_DIGICAM_CONTROL",
    "DO_TRIGGER_CONTROL",
    "DO_GIMBAL_MANAGER_PITCHYAW",
    "DO_GIMBAL_MANAGER_CONFIGURE",
    "DO_MOUNT_CONTROL",
    "DO_SET_CAM_TRIGG_DIST",
    "GET_HOME_POSITION",
    "GET_MESSAGE_INTERVAL",
    "SET_MESSAGE_INTERVAL",
    "REQUEST_MESSAGE",
    "REQUEST_PROTOCOL_VERSION",
    "REQUEST_AUTOPILOT_CAPABILITIES",
    "REQUEST_CAMERA_INFORMATION",
    "REQUEST_CAMERA_SETTINGS",
    "REQUEST_STORAGE_INFORMATION",
    "REQUEST_CAMERA_CAPTURE_STATUS",
    "RESET_CAMERA_SETTINGS",
    "SET_CAMERA_MODE",
    "SET_CAMERA_ZOOM",
    "SET_CAMERA_FOCUS",
    "IMAGE_START_CAPTURE",
    "IMAGE_STOP_CAPTURE",
    "REQUEST_CAMERA_IMAGE_CAPTURE",
    "VIDEO_START_CAPTURE",
    "VIDEO_STOP_CAPTURE",
    "VIDEO_START_STREAMING",
    "VIDEO_STOP_STREAMING",
    "REQUEST_VIDEO_STREAM_INFORMATION",
    "LOGGING_START",
    "LOGGING_STOP",
    "RUN_PREARM_CHECKS",
    "CONTROL_HIGH_LATENCY",
)
"""MAV_CMDs that ask and never move anything but a camera."""


class Generator:
    """Frames as they come over a wire.

    Args:
        seed: all of it follows from this.
        parameters: of the vehicle.
        orders: orders as well; else what is harmless alone.
        bytewise: whole numbers of parameters travel as bit patterns (PX4).
    """

    def __init__(
        self, seed: int, parameters: Sequence[ParameterDefinition], *, orders: bool, bytewise: bool
    ) -> None:
        self._rng = random.Random(seed)
        self._parameters = parameters
        self._names = [parameter.name for parameter in parameters]
        self._bytewise = bytewise
        self._orders = orders
        self._encoders = [FrameEncoder(*ids) for ids in ((255, 190), (254, 1), (VEHICLE, 191), (51, 68))]
        self._definitions = list(DEFINITIONS.values())
        self._commands = sorted(dialect.enums["MAV_CMD"])
        self._harmless_commands = [getattr(dialect, f"MAV_CMD_{name}") for name in HARMLESS_COMMANDS]
        services: list[Callable[[], Iterator[MAVLinkMessage]]] = [
            self._downloads,
            self._files,
            self._logs,
            self._parameter_reads,
            self._requests,
            self._devices,
            self._positions,
            self._strangers,
        ]
        if orders:
            services += [self._uploads, self._parameter_sets, self._all_commands, self._setpoints]
        self._services = services

    def batch(self, count: int) -> list[bytes]:
        """At least so many frames, half of them from the whole dialect, half in sequences of services."""
        frames: list[bytes] = []
        while len(frames) < count:
            if self._rng.random() < 0.5:
                frames.append(self._any())
            else:
                sequence = self._rng.choice(self._services)()
                encoder = self._rng.choice(self._encoders)
                frames += [encoder.encode(message) for message in sequence]
        return [self._dressed(frame) for frame in frames]

    def _dressed(self, frame: bytes) -> bytes:
        """The frame, sometimes as MAVLink 1, sometimes with a signature of an unknown key."""
        kind = self._rng.random()
        if kind > 0.1:
            return frame
        message_id = int.from_bytes(frame[7:10], "little")
        item = DEFINITIONS[message_id]
        if kind < 0.05 and message_id < 256:
            payload = frame[10:-2]
            head = bytes((0xFE, len(payload), frame[4], frame[5], frame[6], message_id)) + payload
            return head + _checksum(head[1:], item)
        head = frame[:2] + b"\1" + frame[3:-2]
        return head + _checksum(head[1:], item) + self._rng.randbytes(13)

    # any message

    def _any(self) -> bytes:
        rng = self._rng
        item = rng.choice(self._definitions)
        order = item.name in ORDER_MESSAGES
        target = (
            VEHICLE
            if (self._orders or not order) and rng.random() < 0.8
            else rng.choice((ABSENT_SYSTEM, 255))
        )
        payload = self._payload(item, target)
        return rng.choice(self._encoders).encode_payload(item.message_id, payload)

    def _payload(self, item: MessageDefinition, target: int) -> bytes:
        rng = self._rng
        payload = bytearray(rng.randbytes(item.size))
        if rng.random() < 0.8:
            for field in item.wire_fields:
                size = struct.calcsize(f"<{field.code}") if field.code != "s" else 1
                if field.code == "s":
                    text = self._text()[: field.length]
                    payload[field.offset : field.offset + len(text)] = text
                    continue
                for index in range(max(1, field.length)):
                    struct.pack_into(
                        f"<{field.code}", payload, field.offset + index * size, self._number(field.code)
                    )
        for field in item.wire_fields:
            if field.name in ("target_system", "target") and field.code == "B":
                payload[field.offset] = target
            elif field.name == "target_component":
                payload[field.offset] = rng.choice((0, AUTOPILOT, AUTOPILOT, CAMERA, GIMBAL, 190, 255))
        return bytes(payload)

    def _number(self, code: str) -> float:
        if code in "fd":
            return self._float()
        bits = struct.calcsize(f"<{code}") * 8
        low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if code.islower() else (0, (1 << bits) - 1)
        rng = self._rng
        kind = rng.random()
        if kind < 0.5:
            return min(high, rng.choice(_SMALL))
        return rng.choice((low, high, high - 1)) if kind < 0.8 else rng.randint(low, high)

    def _float(self) -> float:
        rng = self._rng
        return rng.choice(_FLOATS) if rng.random() < 0.6 else rng.uniform(-1e3, 1e3)

    def _text(self) -> bytes:
        rng = self._rng
        return rng.choice(_TEXTS) if rng.random() < 0.7 else rng.randbytes(rng.randrange(64))

    def _name(self) -> bytes:
        rng = self._rng
        return rng.choice(self._names).encode() if rng.random() < 0.7 else self._text()[:16]

    def _count(self) -> int:
        return self._rng.choice((0, 1, 2, 3, 5, 20, 255, 256, 650, 10_000, 65_534, 65_535))

    # services, harmless

    def _downloads(self) -> Iterator[MAVLinkMessage]:
        rng = self._rng
        kind = rng.choice((0, 0, 1, 2, 7, 255))
        yield dialect.MAVLink_mission_request_list_message(VEHICLE, rng.choice((0, 1, 190)), kind)
        for _ in range(rng.randrange(6)):
            sequence = self._count()
            if rng.random() < 0.5:
                yield dialect.MAVLink_mission_request_int_message(VEHICLE, 1, sequence, kind)
            else:
                yield dialect.MAVLink_mission_request_message(VEHICLE, 1, sequence, kind)
        if rng.random() < 0.5:
            yield dialect.MAVLink_mission_ack_message(VEHICLE, 1, rng.randrange(256), kind)
        if rng.random() < 0.3:
            yield dialect.MAVLink_mission_set_current_message(VEHICLE, 1, self._count())

    def _files(self) -> Iterator[MAVLinkMessage]:
        rng = self._rng
        for _ in range(rng.randrange(1, 8)):
            data = self._text()[:239] if rng.random() < 0.7 else rng.randbytes(239)
            size = len(data) if rng.random() < 0.6 else rng.randrange(256)
            header = struct.pack(
                "<HBBBBBBI",
                rng.choice((0, 1, 65_535, rng.randrange(65_536))),
                rng.choice((0, 0, 1, 2, 255)),
                rng.choice((*range(16), 128, 129, 255)),
                size,
                rng.randrange(16),
                rng.randrange(2),
                0,
                rng.choice((0, 0, 1, 239, 1 << 20, 0x7FFFFFFF, 0xFFFFFFFF)),
            )
            payload = (header + data).ljust(251, b"\0")[:251]
            yield dialect.MAVLink_file_transfer_protocol_message(0, VEHICLE, 1, payload)

    def _logs(self) -> Iterator[MAVLinkMessage]:
        number = self._count
        yield dialect.MAVLink_log_request_list_message(VEHICLE, 1, number(), number())
        big = self._rng.choice((0, 90, 0xFFFFFFFF, self._rng.getrandbits(32)))
        yield dialect.MAVLink_log_request_data_message(VEHICLE, 1, number(), big, big)
        if self._rng.random() < 0.3:
            yield dialect.MAVLink_log_erase_message(VEHICLE, 1)
        yield dialect.MAVLink_log_request_end_message(VEHICLE, 1)

    def _parameter_reads(self) -> Iterator[MAVLinkMessage]:
        rng = self._rng
        if rng.random() < 0.1:
            yield dialect.MAVLink_param_request_list_message(VEHICLE, 1)
        for _ in range(rng.randrange(1, 5)):
            index = rng.choice((-1, -1, 0, 1, 32_767, -32_768, 400))
            yield dialect.MAVLink_param_request_read_message(VEHICLE, 1, self._name(), index)
        for value in (float("nan"), float("inf")):
            yield dialect.MAVLink_param_set_message(VEHICLE, 1, self._name(), value, rng.randrange(256))
        yield dialect.MAVLink_param_set_message(VEHICLE, 1, b"NO_SUCH_NAME", 1.0, 9)
        yield dialect.MAVLink_param_set_message(ABSENT_SYSTEM, 1, self._name(), self._float(), 9)

    def _requests(self) -> Iterator[MAVLinkMessage]:
        rng = self._rng
        yield dialect.MAVLink_request_data_stream_message(
            VEHICLE, 1, rng.randrange(16), rng.choice((0, 1, 10, 65_535)), rng.randrange(3)
        )
        message_id = float(rng.choice((*self._definitions,)).message_id)
        for command in (dialect.MAV_CMD_SET_MESSAGE_INTERVAL, dialect.MAV_CMD_REQUEST_MESSAGE):
            yield self._command_long(VEHICLE, command, first=message_id)

    def _devices(self) -> Iterator[MAVLinkMessage]:
        rng = self._rng
        for _ in range(rng.randrange(1, 4)):
            yield self._command_long(
                VEHICLE, rng.choice(self._harmless_commands), component=rng.choice((0, 1, CAMERA, GIMBAL))
            )
        numbers = [self._float() for _ in range(7)]
        yield dialect.MAVLink_gimbal_manager_set_attitude_message(
            VEHICLE,
            rng.choice((1, GIMBAL)),
            rng.getrandbits(32),
            rng.randrange(256),
            numbers[:4],
            *numbers[4:],
        )
        yield dialect.MAVLink_gimbal_device_set_attitude_message(
            VEHICLE, GIMBAL, rng.getrandbits(16), numbers[:4], *numbers[4:]
        )
        yield dialect.MAVLink_gimbal_manager_set_pitchyaw_message(
            VEHICLE, 1, rng.getrandbits(32), rng.randrange(256), *numbers[:4]
        )

    def _positions(self) -> Iterator[MAVLinkMessage]:
        """Positions of others, and estimates of another component that can't be."""
        rng = self._rng
        number = self._float
        whole = rng.getrandbits
        floats = [number() for _ in range(21)]
        yield dialect.MAVLink_vision_position_estimate_message(whole(60), *floats[:6], floats)  # type: ignore[call-arg]
        yield dialect.MAVLink_att_pos_mocap_message(whole(60), floats[:4], *floats[4:7], floats)  # type: ignore[call-arg]
        yield dialect.MAVLink_follow_target_message(  # type: ignore[call-arg]
            whole(60), 255, whole(31), -whole(31), *floats[:1], floats[1:4], floats[4:7], floats[7:11],
            floats[11:14], floats[14:17], whole(60),
        )  # fmt: skip
        yield dialect.MAVLink_landing_target_message(whole(60), whole(8), whole(4), *floats[:5])
        yield dialect.MAVLink_adsb_vehicle_message(
            whole(32), whole(31), -whole(31), 0, whole(31), 65_535, 65_535, -32_768, b"\xff" * 9, 255, 255,
            65_535, 65_535,
        )  # fmt: skip
        yield dialect.MAVLink_timesync_message(rng.choice((0, 1, -1, 2**63 - 1, -(2**63))), whole(62))
        yield dialect.MAVLink_ping_message(whole(60), whole(32), rng.choice((0, VEHICLE, ABSENT_SYSTEM)), 0)
        yield dialect.MAVLink_statustext_message(rng.randrange(256), self._text()[:50], whole(16), 255)
        yield dialect.MAVLink_tunnel_message(VEHICLE, 1, whole(16), 255, list(rng.randbytes(128)))
        yield dialect.MAVLink_radio_status_message(0, 0, rng.choice((0, 60, 100, 100, 255)), 0, 0, 0, 0)

    def _strangers(self) -> Iterator[MAVLinkMessage]:
        """Commands to another vehicle."""
        rng = self._rng
        yield self._command_long(ABSENT_SYSTEM, rng.choice(self._commands))
        yield self._command_int(ABSENT_SYSTEM, rng.choice(self._commands))
        yield dialect.MAVLink_set_mode_message(ABSENT_SYSTEM, 1, rng.getrandbits(32))
        yield self._local_setpoint(ABSENT_SYSTEM)
        yield dialect.MAVLink_manual_control_message(ABSENT_SYSTEM, *(1000,) * 4, 0)
        yield dialect.MAVLink_rc_channels_override_message(ABSENT_SYSTEM, 1, *(2000,) * 8)
        yield dialect.MAVLink_mission_clear_all_message(ABSENT_SYSTEM, 1, 0)

    # services, orders

    def _uploads(self) -> Iterator[MAVLinkMessage]:
        rng = self._rng
        kind, count = rng.choice((0, 0, 1, 2, 9, 255)), self._count()
        yield dialect.MAVLink_mission_count_message(VEHICLE, 1, count, kind)
        honest = rng.random() < 0.6
        for k in range(min(count, rng.randrange(1, 12))):
            sequence = k if honest else self._count()
            yield dialect.MAVLink_mission_item_int_message(  # type: ignore[call-arg]
                VEHICLE, 1, sequence, rng.choice((0, 2, 3, 5, 6, 99)),
                rng.choice((16, 17, 18, 19, 20, 21, 22, 82, 177, 189, 5001, 5002, 5003, 5004, 5100, 9999)),
                rng.randrange(3), rng.randrange(2), *(self._float() for _ in range(4)),
                rng.choice((473977418, 0, -(2**31), 2**31 - 1)), rng.choice((85455939, 0, 2**31 - 1)),
                self._float(), kind,
            )  # fmt: skip
        if rng.random() < 0.2:
            yield dialect.MAVLink_mission_clear_all_message(VEHICLE, 1, kind)

    def _parameter_sets(self) -> Iterator[MAVLinkMessage]:
        rng = self._rng
        for _ in range(rng.randrange(1, 4)):
            kind = rng.choice((1, 2, 6, 6, 9, 9, 9, 255))
            yield dialect.MAVLink_param_set_message(VEHICLE, 1, self._name(), self._float(), kind)
            yield self._sensible_parameter()

    def _sensible_parameter(self) -> MAVLinkMessage:
        """A parameter in its own type: within its range, at its ends, somewhat or far beyond them."""
        rng = self._rng
        parameter = rng.choice(self._parameters)
        low = -1000.0 if parameter.minimum is None else parameter.minimum
        high = 1000.0 if parameter.maximum is None else parameter.maximum
        span = max(high - low, 1.0)
        value = rng.choice(
            (rng.uniform(low, high), low, high, low - rng.random() * span, high + rng.random() * span,
             low - 1e4 * span, high + 1e4 * span, 0.0, -parameter.default, 1000.0 * parameter.default)
        )  # fmt: skip
        if parameter.is_integer:
            least, greatest = INTEGER_LIMITS[parameter.type]
            whole = min(max(round(value), least), greatest)
            value = struct.unpack("<f", struct.pack("<i", whole))[0] if self._bytewise else float(whole)
        return dialect.MAVLink_param_set_message(VEHICLE, 1, parameter.name.encode(), value, parameter.type)

    def _all_commands(self) -> Iterator[MAVLinkMessage]:
        rng = self._rng
        yield self._command_long(VEHICLE, rng.choice(self._commands))
        yield self._command_int(VEHICLE, rng.choice(self._commands))
        yield dialect.MAVLink_set_mode_message(VEHICLE, rng.randrange(256), rng.getrandbits(32))

    def _setpoints(self) -> Iterator[MAVLinkMessage]:
        rng = self._rng
        yield self._local_setpoint(VEHICLE)
        yield dialect.MAVLink_set_attitude_target_message(
            0, VEHICLE, 1, rng.randrange(256), [self._float() for _ in range(4)],
            *(self._float() for _ in range(4)),
        )  # fmt: skip
        sticks = [rng.randrange(-32_768, 32_768) for _ in range(4)]
        yield dialect.MAVLink_manual_control_message(VEHICLE, *sticks, rng.getrandbits(16))  # type: ignore[call-arg]
        channels = [rng.choice((0, 1000, 2000, 65_535)) for _ in range(8)]
        yield dialect.MAVLink_rc_channels_override_message(VEHICLE, 1, *channels)

    # parts

    def _local_setpoint(self, target: int) -> MAVLinkMessage:
        rng = self._rng
        return dialect.MAVLink_set_position_target_local_ned_message(
            0,
            target,
            1,
            rng.choice((1, 7, 8, 9, 99)),
            rng.getrandbits(16),
            *(self._float() for _ in range(11)),
        )

    def _command_long(
        self, target: int, command: int, *, component: int = 1, first: float | None = None
    ) -> MAVLinkMessage:
        parameters = [self._float() for _ in range(7)]
        if first is not None:
            parameters[0] = first
        return dialect.MAVLink_command_long_message(
            target, component, command, self._rng.randrange(256), *parameters
        )

    def _command_int(self, target: int, command: int) -> MAVLinkMessage:
        rng = self._rng
        return dialect.MAVLink_command_int_message(  # type: ignore[call-arg]
            target, rng.choice((0, 1)), rng.choice((0, 2, 3, 6, 11, 21, 255)), command, 0, 0,
            *(self._float() for _ in range(4)), rng.randint(-(2**31), 2**31 - 1),
            rng.randint(-(2**31), 2**31 - 1), self._float(),
        )  # fmt: skip


def _checksum(covered: bytes, item: MessageDefinition) -> bytes:
    return x25crc(covered + bytes([item.crc_extra])).crc.to_bytes(2, "little")
