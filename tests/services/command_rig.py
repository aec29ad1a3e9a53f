"""Services around a commander rig, on a channel that keeps what was sent."""

from types import SimpleNamespace
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.autopilot.status_text import StatusTextService
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.firmware.ardupilot import services as ardupilot_services
from autopilot_bridge.firmware.ardupilot.copter.commands import ArduCopterCommands
from autopilot_bridge.firmware.ardupilot.copter.setpoints import ArduCopterSetpoints
from autopilot_bridge.firmware.ardupilot.plane.commands import ArduPlaneCommands
from autopilot_bridge.firmware.ardupilot.plane.setpoints import ArduPlaneSetpoints
from autopilot_bridge.firmware.px4 import services as px4_services
from autopilot_bridge.firmware.px4.commands import Px4Commands, Px4PlaneCommands
from autopilot_bridge.firmware.px4.event_service import EventService
from autopilot_bridge.firmware.px4.setpoints import Px4Setpoints
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.protocol import CommandService
from autopilot_bridge.services.equipment.payload_commands import PayloadCommands
from autopilot_bridge.services.inputs.manual import ManualService
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.plans.geofence import ArdupilotGeofence
from flightsim.airframe import AirframeKind
from tests.commander.rig import Rig
from tests.services.dispatch import deliver

NAN = float("nan")
MANUAL = {
    ("px4", AirframeKind.MULTICOPTER): px4_services.MANUAL,
    ("px4", AirframeKind.FIXED_WING): px4_services.MANUAL,
    ("ardupilot", AirframeKind.MULTICOPTER): ardupilot_services.COPTER_MANUAL,
    ("ardupilot", AirframeKind.FIXED_WING): ardupilot_services.PLANE_MANUAL,
}


COMMANDS: dict[tuple[str, AirframeKind], tuple[Any, Any]] = {
    ("px4", AirframeKind.MULTICOPTER): (Px4Commands, Px4Setpoints),
    ("px4", AirframeKind.FIXED_WING): (Px4PlaneCommands, Px4Setpoints),
    ("ardupilot", AirframeKind.MULTICOPTER): (ArduCopterCommands, ArduCopterSetpoints),
    ("ardupilot", AirframeKind.FIXED_WING): (ArduPlaneCommands, ArduPlaneSetpoints),
}


class Channel:
    """Keeps what is sent; every message must pack."""

    def __init__(self, name: str = "test") -> None:
        self.name = name
        self.sent: list[Any] = []
        self._packer = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)

    def send(self, message: Any) -> None:
        message.pack(self._packer)
        self.sent.append(message)

    def texts(self) -> list[str]:
        return [
            m.text if isinstance(m.text, str) else m.text.decode() for m in self.sent if m.get_msgId() == 253
        ]


class Intervals:
    """Remembers what was requested."""

    def __init__(self) -> None:
        self.calls: list[tuple[Any, ...]] = []

    def set_interval(self, source: Source, message_id: int, interval_us: float) -> Result:
        self.calls.append(("set", message_id, interval_us))
        return Result.ACCEPTED

    def get_interval(self, source: Source, message_id: int) -> Result:
        self.calls.append(("get", message_id))
        return Result.ACCEPTED

    def request(self, source: Source, message_id: int, parameter: float = 0.0) -> Result:
        self.calls.append(("request", message_id, parameter))
        return Result.ACCEPTED


class ServiceRig(Rig):
    """A commander with its command, setpoint, manual and text services."""

    def __init__(self, flavour: str = "px4", **arguments: Any) -> None:
        super().__init__(flavour, **arguments)
        self.connect()

    def connect(self) -> None:
        """Services around the commander."""
        flavour = self.flavour.name
        self.channel = Channel()
        self.channels = [self.channel]
        self.source = Source(self.channel, 255, 190)
        self.intervals = Intervals()
        self.failures: list[tuple[int, int, int]] = []
        self.status = StatusTextService(self.flavour, self)
        parts: Any = SimpleNamespace(
            commander=self.commander,
            system_id=1,
            parameters=self.store,
            broadcast=self,
            intervals=self.intervals,
            announce=self.status.announce,
            banner=self.status.banner,
            set_current_item=self._set_current,
            inject_failure=self._inject,
        )
        more: tuple[Microservice, ...]
        if flavour == "ardupilot":
            more = (ArdupilotGeofence(self.commander, self.store, self),)
        else:
            more = (
                PayloadCommands(parts, px4_services.PAYLOAD),
                EventService(self.commander, self, lambda event: ()),
            )
        make_commands, make_setpoints = COMMANDS[flavour, self.flavour.kind]
        self.handlers = make_commands(parts)
        table = {
            number: take for service in (self.handlers, *more) for number, take in service.commands.items()
        }
        self.commands = CommandService(self.flavour.command_address(1), table)
        self.setpoints = make_setpoints(parts)
        self.manual = ManualService(parts, MANUAL[flavour, self.flavour.kind])

    def handle(self, message: Any) -> bool:
        services = (self.setpoints, self.manual, self.commands, self.handlers, self.status)
        return deliver(message, self.source, self.time_us, *services)

    def long(self, command: int, *parameters: float, system: int = 1, component: int = 1) -> list[int]:
        """Results acknowledged for a COMMAND_LONG."""
        values = [*parameters, *[0.0] * (7 - len(parameters))]
        return self._acks(mavlink.MAVLink_command_long_message(system, component, command, 0, *values))

    def int(
        self,
        command: int,
        p1: float,
        p2: float,
        p3: float,
        p4: float,
        x: int,
        y: int,
        z: float,
        *,
        frame: int,
    ) -> list[int]:
        """Results acknowledged for a COMMAND_INT."""
        return self._acks(
            mavlink.MAVLink_command_int_message(1, 1, frame, command, 0, 0, p1, p2, p3, p4, x, y, z)
        )

    def set_mode(self, base_mode: int, custom_mode: int) -> list[int]:  # type: ignore[valid-type]
        return self._acks(mavlink.MAVLink_set_mode_message(1, base_mode, custom_mode))

    def _acks(self, message: Any) -> list:
        self.channel.sent.clear()
        assert self.handle(message)
        for event in self.commander.drain_events():
            self.events.append(event)
            self.status.follow(event)
        return [sent.result for sent in self.channel.sent if sent.get_msgId() == 77]

    def _set_current(self, item: int) -> bool:  # type: ignore[valid-type]
        self.missions.current = item
        return True

    def _inject(self, unit: int, kind: int, instance: int) -> Result:  # type: ignore[valid-type]
        self.failures.append((unit, kind, instance))
        return Result.ACCEPTED

    def fly(self) -> "ServiceRig":
        """Airborne in the mode that goes to places."""
        if self.flavour.name == "ardupilot":
            from autopilot_bridge.commander.modes import FlightMode

            self.commander.set_mode(FlightMode.GUIDED)
        self.put_in_air()
        return self
