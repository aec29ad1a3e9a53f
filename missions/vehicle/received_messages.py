"""What is received from a vehicle: identity, newest values, texts, streams, and the loss of its link."""

import asyncio
from collections.abc import AsyncIterator, Callable
from typing import Final, TypeVar, cast, overload

from autopilot_bridge.clock import Clock, TelemetryClock
from autopilot_bridge.mavlink import (
    Frame,
    MAVLinkMessage,
    command_name,
    decode,
    decode_as,
    definition,
    dialect,
    enum_name,
    field_reader,
)
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.wire_units import home_of, metres, place
from flightsim.foundation.geodesy import GeodeticPosition
from missions.errors import MissionError, TakenOver, VehicleTimeout
from missions.how_left import height_text
from missions.kind import KIND_OF_TYPE, VehicleKind
from missions.vehicle.command_authority import CommandAuthority
from missions.vehicle.connection import Connection, MessageStream
from missions.vehicle.firmware import Firmware
from missions.vehicle.firmware_records import FIRMWARE_NAMES, FIRMWARES
from missions.vehicle.flight_home import FlightHome
from missions.vehicle.link_watch import QUIET_AFTER_S, LinkWatch
from missions.vehicle.mode_tasks import ModeTasks
from missions.vehicle.notes import FlightNotes, LinkLoss
from missions.vehicle.received_texts import ReceivedTexts
from missions.vehicle.system_id_check import SystemIdCheck
from missions.vehicle.telemetry import source_of

T = TypeVar("T")
MessageT = TypeVar("MessageT", bound=MAVLinkMessage)

_HEARTBEAT: Final = definition("HEARTBEAT").message_id
_read_heartbeat: Final = field_reader("HEARTBEAT", "custom_mode", "type", "autopilot", "base_mode")
_read_position: Final = field_reader("GLOBAL_POSITION_INT", "lat", "lon", "alt")
_ARMED: Final = dialect.MAV_MODE_FLAG_SAFETY_ARMED
# heartbeats come once a second: a second one confirms the first, a third one also against EXTENDED_SYS_STATE
_CONFIRMED_US: Final = 900_000
_CONFIRMED_IN_THE_AIR_US: Final = 1_900_000
IN_THE_AIR: Final = (
    dialect.MAV_LANDED_STATE_IN_AIR,
    dialect.MAV_LANDED_STATE_TAKEOFF,
    dialect.MAV_LANDED_STATE_LANDING,
)
"""Landed states of a flying vehicle. Both firmwares report the ground as soon as they are disarmed."""
_USABLE_FOR_US: Final = 1_000_000
_STOOD_STILL_S: Final = 3.0


class ReceivedMessages:
    """What is received from one vehicle: its identity, newest values, texts and streams.

    Args:
        connection: a started connection.
        system_id: system id of the vehicle; None: the first autopilot received.

    Attributes:
        connection: the connection that was given.
        notes: the mission's record of its phases, its progress and its commands, for the run's summary.
        texts: those of the autopilot.
        first_heartbeat_us: vehicle time of the first heartbeat that was received when vehicle time was known.
        contradiction: why what is received can't come from one vehicle; "": nothing was found.
        on_regained: called when a link that counted as lost is back.
    """

    def __init__(self, connection: Connection, system_id: int | None = None) -> None:
        self.connection = connection
        self.notes = FlightNotes()
        self.texts = ReceivedTexts()
        self._system_id = system_id
        self._firmware: Firmware | None = None
        self._authority: CommandAuthority | None = None
        self._tasks: ModeTasks | None = None
        self._last_ack: dialect.MAVLink_command_ack_message | None = None
        self._heartbeat_us: int | None = None
        self.on_regained: Callable[[], None] = lambda: None
        # newest usable telemetry: its frame, the value, and the time at which it was examined
        self._usable: dict[type, tuple[Frame, object, int]] = {}
        self.first_heartbeat_us = 0
        self._timed = False  # whether that time was a time of the vehicle
        self._check: SystemIdCheck | None = None
        self._flight_home = FlightHome()
        self.contradiction = ""
        self._reported: tuple[int, int] | None = None  # base mode and custom mode of the newest heartbeat
        # when the heartbeats began to report disarmed after armed; None: they did not
        self._disarmed_us: int | None = None
        self._at_silence: dict[int, Frame] = {}  # the newest messages when the heartbeats stopped
        self._watch = LinkWatch(connection.clock, self._received_at_loss)
        self._watch.on_quiet = self._note_silence
        self._watch.on_lost = self._note_loss
        self._watch.on_regained = self._note_regained
        connection.listen("STATUSTEXT", self._on_status_text)
        connection.listen("EVENT", self._on_event)
        connection.listen("COMMAND_ACK", self._on_ack)
        connection.listen("HEARTBEAT", self._on_heartbeat)

    @property
    def clock(self) -> Clock:
        """Vehicle time."""
        return self.connection.clock

    @property
    def system_id(self) -> int:
        """The vehicle's MAVLink system id, known from its first heartbeat on."""
        return self._known(self._system_id)

    @property
    def identified(self) -> bool:
        """Whether a heartbeat of an autopilot was received, so that firmware and system id are known."""
        return self._firmware is not None

    @property
    def firmware(self) -> Firmware:
        """The conventions of the vehicle's firmware, known from its first heartbeat on."""
        return self._known(self._firmware)

    @property
    def kind(self) -> VehicleKind:
        """Class of vehicle: multicopter or fixed wing."""
        return self.firmware.kind

    @staticmethod
    def _known(value: T | None) -> T:
        if value is None:
            raise VehicleTimeout("no heartbeat was received yet: call wait_heartbeat first")
        return value

    def _on_heartbeat(self, frame: Frame) -> None:
        if frame.component_id != AUTOPILOT_COMPONENT:
            return
        if self._system_id is not None and frame.system_id != self._system_id:
            return
        custom_mode, type_, autopilot, base_mode = _read_heartbeat(frame)
        name, kind = FIRMWARE_NAMES.get(autopilot), KIND_OF_TYPE.get(type_)
        sender = f"{name or f'autopilot {autopilot}'} {kind or f'of type {type_}'}"
        if self._firmware is None:
            if name is None or kind is None:
                return
            self._identify(FIRMWARES[name, kind], frame.system_id)
            self._check = SystemIdCheck(sender)
        armed = bool(base_mode & _ARMED)
        assert self._check is not None
        self._contradict(self._check.on_heartbeat(sender, armed=armed))
        if (name, kind) != (self.firmware.name, self.firmware.kind):
            return  # of another vehicle
        if isinstance(self.clock, TelemetryClock):
            steps = self.clock.reboots + self.clock.jumps
            self._contradict(self._check.on_time_steps(steps, asyncio.get_running_loop().time()))
        if armed:
            self._disarmed_us = None
        elif self._reported is not None and self._reported[0] & _ARMED:
            self._disarmed_us = self.clock.time_us
        self._reported = (base_mode, custom_mode)
        if not self._timed:
            clock = self.clock
            self._timed = not isinstance(clock, TelemetryClock) or clock.vehicle_time_us is not None
            self.first_heartbeat_us = clock.time_us
        self._heartbeat_us = self.clock.time_us
        self._watch.on_heartbeat()
        self._judge_mode(decode_as(frame, dialect.MAVLink_heartbeat_message))

    def _identify(self, firmware: Firmware, system_id: int) -> None:
        self._firmware, self._system_id = firmware, system_id
        self.connection.keep(system_id)
        self._tasks = tasks = ModeTasks(firmware)
        self._authority = CommandAuthority(firmware, system_id, tasks.done)

        def listen(name: str, take: Callable[[Frame], None]) -> None:
            def on_frame(frame: Frame) -> None:
                if frame.system_id == system_id and frame.component_id == AUTOPILOT_COMPONENT:
                    take(frame)

            self.connection.listen(name, on_frame, in_order=False)

        for name in ("MISSION_CURRENT", "MISSION_ITEM_REACHED"):
            listen(name, lambda frame: tasks.on_mission_message(decode(frame), self.clock.stamp_us))
        listen("EXTENDED_SYS_STATE", self._on_landed_state)
        listen("HOME_POSITION", self._on_home)
        listen("GLOBAL_POSITION_INT", self._on_position)

    def _on_landed_state(self, frame: Frame) -> None:
        state = decode_as(frame, dialect.MAVLink_extended_sys_state_message).landed_state
        self.tasks.on_landed_state(state)
        self._flight_home.on_landed_state(state)

    def _on_home(self, frame: Frame) -> None:
        reported = home_of(decode_as(frame, dialect.MAVLink_home_position_message))
        if reported is not None:
            self._flight_home.on_home(reported, armed=self.armed)

    def _on_position(self, frame: Frame) -> None:
        at = place(*_read_position(frame))
        if at is not None:
            self.tasks.on_position(at.lat_deg, at.lon_deg, at.alt_m, self.clock.stamp_us)

    def _judge_mode(self, heartbeat: dialect.MAVLink_heartbeat_message) -> None:
        """Decide who commands the vehicle. After a take-over all waits end."""
        authority = self.authority
        was_ours = authority.take_over is None
        authority.on_heartbeat(heartbeat, self.clock.time_us, just_back=self.just_back)
        if authority.mode is not None:
            self.tasks.on_mode(authority.mode)
        if was_ours:
            self._end_if_taken(authority)

    def _end_if_taken(self, authority: CommandAuthority) -> None:
        take_over = authority.take_over
        if take_over is not None:
            self._watch.end_all(lambda: TakenOver(take_over))

    @property
    def heartbeat_us(self) -> int | None:
        """Vehicle time of the newest heartbeat; None before the first.

        A heartbeat has no time stamp: one that was received before the first message with one has the time
        that is known by now.
        """
        if self._timed or self._heartbeat_us is None or not isinstance(self.clock, TelemetryClock):
            return self._heartbeat_us
        return self._heartbeat_us + self.clock.first_step_us

    @property
    def authority(self) -> CommandAuthority:
        """Who commands the vehicle, known from its first heartbeat on."""
        return self._known(self._authority)

    @property
    def tasks(self) -> ModeTasks:
        """What the modes of the vehicle have done, known from its first heartbeat on."""
        return self._known(self._tasks)

    def _contradict(self, found: str) -> None:
        """End the waits for the first contradiction in the messages of the vehicle."""
        if not found or self.contradiction:
            return
        self.contradiction = (
            f"the messages of system {self.system_id} are not those of one vehicle: {found}; give each "
            f"vehicle its own system id ({self.firmware.system_id_parameter})"
        )
        self._watch.end_waits(self.contradiction)

    @property
    def signs(self) -> bool:
        """Whether the newest heartbeat was signed."""
        if self._system_id is None:
            return False
        heartbeat = self.connection.newest_frame(_HEARTBEAT, self._system_id)
        return heartbeat is not None and heartbeat.signed

    @property
    def answered(self) -> bool:
        """Whether a command was ever answered."""
        return self._last_ack is not None

    @property
    def regain_s(self) -> float:
        """Longest time for which a lost link may stay lost, in seconds of this machine's clock; 0: none."""
        return self._watch.regain_s

    @regain_s.setter
    def regain_s(self, seconds: float) -> None:
        self._watch.regain_s = seconds

    @property
    def quiet(self) -> bool:
        """Whether no message was received from the vehicle for three seconds, while a task waits for one."""
        return self._watch.quiet

    @property
    def lost(self) -> bool:
        """Whether the link counts as lost, and may still come back."""
        return self._watch.lost

    @property
    def just_back(self) -> bool:
        """Whether a silence of the vehicle ended a moment ago."""
        return self._watch.just_back

    def _note_silence(self) -> None:
        self._at_silence = {} if self._system_id is None else dict(self.connection.newest(self._system_id))

    def _received_at_loss(self) -> str:
        """What was received, for the error of a wait that ends without heartbeats."""
        text = self.last_received(silence=False)
        now = {} if self._system_id is None else self.connection.newest(self._system_id)
        others = [number for number, frame in now.items() if self._at_silence.get(number) is not frame]
        if not self._watch.quiet or not others:
            return text
        names = ", ".join(sorted(definition(number).name for number in others)[:3])
        return f"{text}; other messages of it are still received ({names})"

    def _note_loss(self) -> None:
        since_us = self.clock.time_us if self.heartbeat_us is None else self.heartbeat_us
        self.notes.link_losses.append(LinkLoss(start_us=since_us))

    def _note_regained(self) -> None:
        loss = self.notes.link_losses[-1]
        self.notes.link_losses[-1] = LinkLoss(start_us=loss.start_us, end_us=self.clock.time_us)
        lost_s = (self.clock.time_us - loss.start_us) * 1e-6
        self.notes.warn(
            f"the link was lost for {lost_s:.0f} s at {loss.start_us * 1e-6:.0f} s, and came back"
        )
        self.on_regained()

    def _on_status_text(self, frame: Frame) -> None:
        if frame.system_id == self._system_id and frame.component_id == AUTOPILOT_COMPONENT:
            message = decode_as(frame, dialect.MAVLink_statustext_message)
            text = self.texts.add(message, self.clock.time_us)
            if text is not None and self._authority is not None:
                # not events: most are checks for modes that changed with it
                self.tasks.on_text(text.text)
                self._authority.on_text(text.severity, text.text, self.clock.time_us)

    def _on_event(self, frame: Frame) -> None:
        if frame.system_id == self._system_id and frame.component_id == AUTOPILOT_COMPONENT:
            self.texts.add_event(decode_as(frame, dialect.MAVLink_event_message), self.clock.time_us)

    def _on_ack(self, frame: Frame) -> None:
        if frame.system_id == self._system_id:
            self._last_ack = ack = decode_as(frame, dialect.MAVLink_command_ack_message)
            if self._authority is not None and self.addressed_here(ack):
                self._authority.on_ack(ack)

    @overload
    def message(self, kind: type[MessageT]) -> MessageT | None: ...

    @overload
    def message(self, kind: str) -> MAVLinkMessage | None: ...

    def message(self, kind: type[MessageT] | str) -> MAVLinkMessage | None:
        """Newest message of a class, or of a name, from the autopilot, or None."""
        return self.connection.latest(kind, self.system_id)

    def latest(self, kind: type[T]) -> T | None:
        """Newest telemetry of a kind, for example `latest(Position)`; None before the first.

        Kinds: `Position`, `LocalPosition`, `Attitude`, `AirData`, `Pressure`, `Battery`, `Gps`,
        `MissionProgress`. A message with NaN or infinite values is ignored: for one second the message before
        it is returned, then None.
        """
        source = source_of(kind)
        frame = self.connection.newest_frame(source.kind.id, self.system_id)
        if frame is None:
            return None
        before = self._usable.get(kind)
        known = before is not None and before[0] is frame  # converted once
        usable = cast(T, before[1]) if before is not None else None
        value = usable if known else source.read(frame)
        now_us = self.clock.time_us
        if value is not None:
            self._usable[kind] = (frame, value, now_us)
            return value
        return usable if before is not None and now_us - before[2] <= _USABLE_FOR_US else None

    def home_or_none(self) -> GeodeticPosition | None:
        """Home as reported by the vehicle, or None; see `home`."""
        if self._flight_home.place is not None:
            return self._flight_home.place
        message = self.message(dialect.MAVLink_home_position_message)  # from before the first heartbeat
        return None if message is None else home_of(message)

    @property
    def home(self) -> GeodeticPosition:
        """Home as reported by the vehicle; in flight that from before the take-off (`FlightHome`)."""
        place = self.home_or_none()
        if place is None:
            raise VehicleTimeout("the vehicle has not reported its home position: call wait_ready first")
        return place

    async def telemetry(self, kind: type[T]) -> AsyncIterator[T]:
        """Stream of telemetry: `async for position in vehicle.telemetry(Position)`."""
        source = source_of(kind)
        with self.messages(source.kind) as stream:
            while True:
                value = source.read(await stream.frame())
                if value is not None:
                    yield value

    def listen(self, kind: type[T], listener: Callable[[T], None]) -> Callable[[], None]:
        """Call `listener` with each usable telemetry of a kind, in the order of all messages, also of those
        that arrive together; returns a function that ends this. The listener must send nothing.
        """
        source, system_id = source_of(kind), self.system_id

        def on_frame(frame: Frame) -> None:
            if frame.system_id == system_id and frame.component_id == AUTOPILOT_COMPONENT:
                value = source.read(frame)
                if value is not None:
                    listener(value)

        return self.connection.listen(source.kind.msgname, on_frame, in_order=False)

    def messages(self, *kinds: type[MessageT]) -> MessageStream[MessageT]:
        """Stream of the autopilot's messages of these classes."""
        return self.connection.messages(*kinds, system_id=self.system_id, component_id=AUTOPILOT_COMPONENT)

    @property
    def armed(self) -> bool:
        """Whether the vehicle is armed: by the newest heartbeat, where that reports armed.

        One heartbeat that reports disarmed after others reported armed may be wrong. It counts when the
        vehicle reports that it is on the ground, and else with a heartbeat that confirms it, or two when it
        reports that it is in the air.
        """
        if self._reported is None:
            heartbeat = self.message(dialect.MAVLink_heartbeat_message)
            return heartbeat is not None and bool(heartbeat.base_mode & _ARMED)
        if self._reported[0] & _ARMED:
            return True
        return self.disarming and self.landed_state != dialect.MAV_LANDED_STATE_ON_GROUND

    def require_armed(self, where: str) -> None:
        """Raise MissionError when the vehicle has disarmed.

        Args:
            where: when this ended the flight, for the error: "before item 7".
        """
        if not self.armed:
            raise MissionError(f"the vehicle disarmed {where}; {self.last_received()}")

    @property
    def disarming(self) -> bool:
        """Whether a heartbeat reports disarmed after others reported armed, and none has confirmed it yet."""
        if self._disarmed_us is None or self.heartbeat_us is None:
            return False
        in_the_air = self.landed_state in IN_THE_AIR
        confirmed_us = _CONFIRMED_IN_THE_AIR_US if in_the_air else _CONFIRMED_US
        return self.heartbeat_us - self._disarmed_us < confirmed_us

    @property
    def disarmed_in_the_air(self) -> bool:
        """Whether heartbeats report disarmed after others reported armed, and the vehicle that it flies."""
        return self._disarmed_us is not None and self.landed_state in IN_THE_AIR

    @property
    def custom_mode(self) -> int:
        """HEARTBEAT.custom_mode, in the firmware's numbering."""
        if self._reported is not None:
            return self._reported[1]
        heartbeat = self.message(dialect.MAVLink_heartbeat_message)
        return 0 if heartbeat is None else int(heartbeat.custom_mode)

    @property
    def mode(self) -> str:
        """Flight mode of the newest heartbeat, with the firmware's name."""
        return self.firmware.mode_name(self.custom_mode)

    @property
    def landed_state(self) -> int:
        """MAV_LANDED_STATE: 0 not known, 1 on the ground, 2 in the air, 3 taking off, 4 landing."""
        message = self.message(dialect.MAVLink_extended_sys_state_message)
        return 0 if message is None else int(message.landed_state)

    def time_stamp_faults(self) -> str:
        """What was wrong with the time stamps of a vehicle that is not embedded, as text; "": nothing."""
        clock = self.clock
        if not isinstance(clock, TelemetryClock):
            return ""
        faults = []
        if clock.stood_still_s >= _STOOD_STILL_S:
            faults.append(f"stood still for {clock.stood_still_s:.0f} s")
        if clock.reboots or clock.jumps:
            faults.append(f"stepped back {clock.reboots} times and ahead {clock.jumps} times")
        if clock.wraps:
            faults.append("began again at 0 after 49.7 days")
        return f"the vehicle's time stamps {' and '.join(faults)}" if faults else ""

    def addressed_here(self, message: MAVLinkMessage) -> bool:
        """Whether a reply is for this mission: addressed to all, or to its own ids."""
        own = (0, self.connection.system_id), (0, self.connection.component_id)
        return (
            getattr(message, "target_system", 0) in own[0]
            and getattr(message, "target_component", 0) in own[1]
        )

    def last_received(self, *, silence: bool = True) -> str:
        """What was received last, as text for error messages; with `silence`, also how long ago, when that is
        long.
        """
        if self._firmware is None or self.heartbeat_us is None:
            return "nothing was received from an autopilot"
        parts = [f"last received: mode {self.mode}, {'armed' if self.armed else 'disarmed'}"]
        position = self.message(dialect.MAVLink_global_position_int_message)
        if position is not None:
            older_s = self.older_s(position.time_boot_ms * 1000)
            parts.append(height_text(metres(position.relative_alt), older_s, " above home"))
        silent_s = (self.clock.time_us - self.heartbeat_us) * 1e-6
        if silence and silent_s > 3.0:
            parts.append(f"no heartbeat for {silent_s:.0f} s")
        if self._last_ack is not None:
            parts.append(f"answer {describe_ack(self._last_ack)}")
        if self.notes.link_losses and self.notes.link_losses[-1].end_us is not None:
            loss = self.notes.link_losses[-1]
            parts.append(f"the link had been lost for {((loss.end_us or 0) - loss.start_us) * 1e-6:.0f} s")
        texts = self.texts.recent()
        if texts:
            parts.append("texts " + " / ".join(map(repr, texts)))
        return ", ".join(parts)

    def older_s(self, time_us: int) -> float:
        """How much older telemetry of a vehicle time is than the newest heartbeat, when that is long; else 0:
        a height that was received before others still were must not be stated as the present one.
        """
        older_s = 0.0 if self.heartbeat_us is None else (self.heartbeat_us - time_us) * 1e-6
        return older_s if older_s > QUIET_AFTER_S else 0.0


def describe_ack(ack: dialect.MAVLink_command_ack_message) -> str:
    """A COMMAND_ACK as text: "NAV_TAKEOFF: TEMPORARILY_REJECTED"."""
    return f"{command_name(ack.command)}: {enum_name('MAV_RESULT', ack.result) or f'result {ack.result}'}"
