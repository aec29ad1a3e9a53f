"""Who commands a vehicle: this program, or a pilot, another ground station or a failsafe. Sans-IO.

A mode that this program did not command is a take-over. It is recognised by the first heartbeat that reports
it, and it is final: from then on nothing is sent to the vehicle.

* A mode is commanded by DO_SET_MODE, or by a command that leads to it (`Firmware.modes_of_command`). While
  the autopilot has not answered by a heartbeat, the mode before counts as commanded too; once the commanded
  mode was reported, it does not.
* Some modes follow by themselves when another one has done its task (`Firmware.modes_following`): the hold
  after a take-off, the mode after a mission's last item. They count only with evidence that the task is done,
  because a pilot may command the same mode before. The evidence may arrive shortly after the heartbeat; until
  then nothing is sent, and after three heartbeats without evidence it is a take-over.
* The program has the command from the time at which it arms the vehicle, or commands an armed one, until the
  vehicle is disarmed. Modes before that are the choice of the operator, but one that is reported while the
  program's own mode command is pending is a take-over: a repetition would override it.
* A vehicle that reported disarmed and is armed without a command of the program is the pilot's: the first
  message that would move it or change its plan is not sent, and is a take-over (`others_may_arm` allows it).
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from missions.how_left import TakeOver
from missions.vehicle.firmware import Firmware, Mode, ModeCommand

HEARTBEATS_UNEXPLAINED: Final = 3
"""After so many without evidence, a mode that may have followed by itself is a take-over."""
_HEARTBEATS_DISARMED: Final = 3
"""In a row: after so many the flight is over. A single one may be a glitch."""
_HEARTBEATS_PENDING: Final = 5
"""After so many in other modes, a mode that was commanded once is no longer expected."""
_HEARTBEATS_REFUSED: Final = 2
"""The same, after it was refused."""
_TEXTS_BEFORE_US: Final = 4_000_000
_TEXTS_AFTER_US: Final = 3_000_000
_TEXTS_KEPT: Final = 64
"""Texts that may be the reason of a take-over; a vehicle may send thousands in a second."""
_WORST_TEXT: Final = dialect.MAV_SEVERITY_WARNING  # and worse: smaller numbers
_SETPOINTS: Final = frozenset(
    ("SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT", "SET_ATTITUDE_TARGET")
)
_MOTIONS: Final = frozenset(
    (
        dialect.MAV_CMD_NAV_TAKEOFF,
        dialect.MAV_CMD_DO_CHANGE_SPEED,
        dialect.MAV_CMD_GUIDED_CHANGE_SPEED,
        dialect.MAV_CMD_GUIDED_CHANGE_ALTITUDE,
        dialect.MAV_CMD_GUIDED_CHANGE_HEADING,
    )
)
"""Commands that move the vehicle without a change of its mode."""
_PLANS: Final = frozenset(("MISSION_COUNT", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT"))
_ARM: Final = dialect.MAV_CMD_COMPONENT_ARM_DISARM
_ARMING: Final = (_ARM, dialect.MAV_CMD_MISSION_START)
"""Commands that may arm the vehicle: PX4 arms for MISSION_START too (Commander.cpp)."""
_CommandMessage = dialect.MAVLink_command_long_message | dialect.MAVLink_command_int_message
_SET_MODE: Final = dialect.MAV_CMD_DO_SET_MODE
_UNANSWERED: Final = (dialect.MAV_RESULT_ACCEPTED, dialect.MAV_RESULT_IN_PROGRESS)
_FAILSAFE_STATES: Final = (dialect.MAV_STATE_CRITICAL, dialect.MAV_STATE_EMERGENCY)

Explains = Callable[[int, int], bool]
"""(custom mode before, custom mode after) -> whether the first one has done its task."""


class Command(Enum):
    """Who commands the vehicle."""

    OURS = "ours"
    UNEXPLAINED = "unexplained"
    """The mode may follow from ours, and nothing shows it yet: nothing is sent."""
    RETURNING = "returning"
    """The link was silent, PX4's failsafe has left the guided mode, and setpoints bring it back: nothing else
    is sent.
    """
    TAKEN = "taken"


@dataclass(slots=True)
class _Pending:
    """Modes that a command of ours leads to, and that no heartbeat has reported yet."""

    command: int
    modes: tuple[int, ...]
    heartbeats: int = 0


class CommandAuthority:
    """Watches the modes of one vehicle.

    Args:
        firmware: of the vehicle.
        system_id: of the vehicle.
        explains: evidence that a mode has done its task.

    Attributes:
        state: who commands the vehicle.
        take_over: the take-over; None: there was none.
        engaged: this program has armed the vehicle, or commanded it in flight, since it was disarmed.
        others_may_arm: whether the program may command a vehicle that a pilot arms.
        commands: number of commands that were sent to move the vehicle, or to change its mode, or to arm or
            disarm it.
        mode: the newest custom mode that was commanded or has followed by itself; None: no heartbeat yet.
    """

    def __init__(self, firmware: Firmware, system_id: int, explains: Explains) -> None:
        self.state = Command.OURS
        self.take_over: TakeOver | None = None
        self.engaged = False
        self.others_may_arm = False
        self.commands = 0
        self._firmware, self._system_id, self._explains = firmware, system_id, explains
        self.mode: int | None = None
        self._reported: int | None = None
        self._armed = False
        self._status = 0
        self._pending: list[_Pending] = []
        self._unexplained = 0
        self._disarmed = 0
        self._at_rest = (
            _HEARTBEATS_DISARMED - 1
        )  # heartbeats in a row that reported disarmed; the first counts
        self._armed_by_another = False
        self._time_us = 0
        self._texts: deque[tuple[int, str]] = deque(maxlen=_TEXTS_KEPT)

    @property
    def failsafe_acts(self) -> bool:
        """Whether a failsafe flies the vehicle, in whatever mode.

        PX4 reports MAV_STATE_CRITICAL only then. ArduPilot reports it also for a failsafe that only warns, so
        that it counts in the modes with which failsafes act.
        """
        if self._status == dialect.MAV_STATE_CRITICAL and not self._firmware.failsafe_status_acts:
            modes = self._firmware.modes
            return self._reported in (modes[Mode.RETURN], modes[Mode.LAND])
        return self._status in _FAILSAFE_STATES

    def may_send(self, message: MAVLinkMessage) -> bool:
        """Whether a message may be sent to the vehicle; it is noted as sent."""
        if self.state is Command.UNEXPLAINED:
            self._explain()
        if self.state is Command.RETURNING:
            return message.get_type() in _SETPOINTS
        if self.state is not Command.OURS:
            return False
        kind = message.get_type()
        commanding = message if isinstance(message, _CommandMessage) else None
        command = None if commanding is None else commanding.command
        modes = () if commanding is None else self._modes_of(commanding)
        moves = bool(modes) or kind in _SETPOINTS or command in _MOTIONS
        if self._armed_by_another and not self.others_may_arm and (moves or kind in _PLANS):
            self._take_over(self._reported or 0, self._time_us, armed=True)
            return False
        self.engaged = self.engaged or (moves and self._armed)
        self.commands += command is not None and (moves or command in _ARMING)
        if commanding is not None and command in _ARMING:
            self.engaged = self.engaged or command != _ARM or commanding.param1 > 0.5
        if command is not None and modes:
            self._pending = [p for p in self._pending if (p.command, p.modes) != (command, modes)]
            self._pending.append(_Pending(command, modes))
        return True

    def _modes_of(self, message: _CommandMessage) -> tuple[int, ...]:
        """The custom modes that a command leads to; empty: it leads to none."""
        firmware = self._firmware
        if message.command != _SET_MODE:
            return firmware.modes_of_command.get(message.command, ())
        mode = firmware.mode_commanded(ModeCommand(main=message.param2, sub=message.param3))
        return (mode, *firmware.modes_instead.get(mode, ()))

    def on_ack(self, ack: dialect.MAVLink_command_ack_message) -> None:
        """Process a COMMAND_ACK that is addressed to this program."""
        if ack.result in _UNANSWERED:
            return
        if ack.command in _ARMING and not self._armed:
            self.engaged = False
        for pending in self._pending:
            # not at once: it may answer an earlier sending of a command that is accepted now
            if pending.command == ack.command:
                pending.heartbeats = max(pending.heartbeats, _HEARTBEATS_PENDING - _HEARTBEATS_REFUSED)

    def on_text(self, severity: int, text: str, time_us: int) -> None:
        """Process a text of the autopilot."""
        if severity > _WORST_TEXT:
            return
        over = self.take_over
        if over is None:
            self._texts.append((time_us, text))
        elif (
            len(over.texts) < _TEXTS_KEPT
            and time_us <= over.time_us + _TEXTS_AFTER_US
            and text not in over.texts
        ):
            over.texts.append(text)

    def on_heartbeat(
        self, heartbeat: dialect.MAVLink_heartbeat_message, time_us: int, *, just_back: bool = False
    ) -> None:
        """Process a heartbeat of the vehicle's autopilot.

        Args:
            time_us: vehicle time.
            just_back: a silence of the link ended a moment ago.
        """
        mode = int(heartbeat.custom_mode)
        self._reported, self._status, self._time_us = mode, int(heartbeat.system_status), time_us
        was_armed, self._armed = self._armed, bool(heartbeat.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)
        self._note_arming()
        if self.state is Command.TAKEN:
            return
        if self._armed:
            self._disarmed = 0
        elif self.engaged and (was_armed or self._disarmed):
            self._disarmed += 1
            self.engaged = self._disarmed < _HEARTBEATS_DISARMED
        if not self.engaged and (mode == self.mode or not self._pending):
            self._enter(mode)
        elif self.engaged and self._disarmed:
            pass  # a glitch, or the end of the flight
        elif mode == self.mode:
            self._enter_again()
        elif any(mode in pending.modes for pending in self._pending):
            self._enter(mode)
        elif self._follows(mode):
            self._weigh(mode, time_us)
        elif just_back and self._comes_back(mode):
            self.state = Command.RETURNING
        else:
            self._take_over(mode, time_us)
        for pending in self._pending:
            pending.heartbeats += 1
        self._pending = [p for p in self._pending if p.heartbeats < _HEARTBEATS_PENDING]

    def _note_arming(self) -> None:
        """Note whether another one has armed a vehicle that had reported disarmed."""
        if not self._armed:
            self._at_rest += 1
            self._armed_by_another = self._armed_by_another and self._at_rest < _HEARTBEATS_DISARMED
            return
        if self._at_rest >= _HEARTBEATS_DISARMED and not self.engaged:
            self._armed_by_another = True
        self._at_rest = 0

    def _follows(self, mode: int) -> bool:
        return self.mode is not None and mode in self._firmware.modes_following.get(self.mode, ())

    def _comes_back(self, mode: int) -> bool:
        """Whether setpoints bring the vehicle back to the guided mode: PX4's failsafe for their loss."""
        firmware = self._firmware
        return (
            firmware.setpoints_before_guided
            and self.mode == firmware.modes[Mode.GUIDED]
            and self._status in _FAILSAFE_STATES
        )

    def _weigh(self, mode: int, time_us: int) -> None:
        """Decide about a mode that may have followed by itself."""
        self.state = Command.UNEXPLAINED
        self._unexplained += 1
        if not self._explain() and self._unexplained >= HEARTBEATS_UNEXPLAINED:
            self._take_over(mode, time_us)

    def _explain(self) -> bool:
        """Accept the reported mode if there is evidence now that it has followed by itself."""
        before, after = self.mode, self._reported
        if before is None or after is None or not self._explains(before, after):
            return False
        self._enter(after)
        return True

    def _enter_again(self) -> None:
        self.state = Command.OURS
        self._unexplained = 0

    def _enter(self, mode: int) -> None:
        """Accept a mode; commands that were sent before the one that led to it are done."""
        self._enter_again()
        self.mode = mode
        newest = max((k for k, p in enumerate(self._pending) if mode in p.modes), default=-1)
        self._pending = self._pending[newest + 1 :]

    def _take_over(self, mode: int, time_us: int, *, armed: bool = False) -> None:
        self.state = Command.TAKEN
        name = self._firmware.mode_name
        recent = [text for t, text in self._texts if t >= time_us - _TEXTS_BEFORE_US]
        self.take_over = TakeOver(
            system_id=self._system_id,
            time_us=time_us,
            before=name(mode if self.mode is None else self.mode),
            mode=name(mode),
            armed=armed,
            failsafe=self._status in _FAILSAFE_STATES,
            texts=list(dict.fromkeys(recent)),
        )
