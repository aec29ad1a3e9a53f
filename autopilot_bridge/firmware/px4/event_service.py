"""MAVLink's events interface, sending side: EVENT, CURRENT_EVENT_SEQUENCE, REQUEST_EVENT and its answers.

Events are numbered and the newest are kept, so that a client can request an event that it has missed. The
report of health and arming checks is sent when it has changed, when a command was refused, when a ground
station connects (again) before a flight, and when a client requests the checks.

Sources: mavlink.io/en/services/events.html; PX4 1.16, Commander (RUN_PREARM_CHECKS, and a ground station that
connects, bring the report also when nothing has changed).
"""

from collections import deque
from collections.abc import Callable
from typing import Final

from autopilot_bridge.commander import Commander
from autopilot_bridge.commander.arming import arming_reasons, shortfalls
from autopilot_bridge.commander.events import ArmingDenied, Event
from autopilot_bridge.commander.verdict import Reason, Result
from autopilot_bridge.dispatch import command, receives, streams
from autopilot_bridge.firmware.event_kinds import Occurrence
from autopilot_bridge.firmware.px4 import events as px4_events
from autopilot_bridge.firmware.texts import Notice
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import Broadcast, Source, send_to_all
from autopilot_bridge.services.commands.command import Command
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.telemetry.streams import Values

KEPT: Final = 64
"""Number of events that clients can request again."""
_FIRST_SEQUENCE: Final = 65535 - 10  # near the wrap, as in PX4, so that clients meet the wrap early
_REPORT_US: Final = 2_000_000
_MODULO: Final = 0x10000
_UNAVAILABLE: Final = 0  # MAV_EVENT_ERROR_REASON


class EventService(Microservice):
    """Sends the events of a PX4.

    Args:
        commander: the arming checks read its state.
        broadcast: all channels.
        notices: the texts of an event.
    """

    def __init__(
        self, commander: Commander, broadcast: Broadcast, notices: Callable[[Event], tuple[Notice, ...]]
    ) -> None:
        self._commander = commander
        self._broadcast = broadcast
        self._notices = notices
        self._sequence = _FIRST_SEQUENCE
        self._kept: deque[dialect.MAVLink_event_message] = deque(maxlen=KEPT)
        self._time_us = 0
        self._next_report_us = 0
        self._reported: tuple[Occurrence, ...] = ()
        self._station_connected = False

    @streams(dialect.MAVLink_current_event_sequence_message)
    def _current(self) -> Values:
        return (self._sequence, 0)

    @receives(dialect.MAVLink_request_event_message)
    def _on_request(
        self, message: dialect.MAVLink_request_event_message, source: Source, time_us: int
    ) -> None:
        """REQUEST_EVENT: ranges may wrap. An event that is no longer kept gets one error reply."""
        count = (message.last_sequence - message.first_sequence) % _MODULO + 1
        kept = {event.sequence: event for event in self._kept}
        oldest = self._kept[0].sequence if self._kept else self._sequence
        for step in range(min(count, KEPT)):
            sequence = (message.first_sequence + step) % _MODULO
            source.channel.send(
                kept.get(sequence)
                or dialect.MAVLink_response_event_error_message(
                    source.system_id, source.component_id, sequence, oldest, _UNAVAILABLE
                )
            )

    def tick(self, time_us: int) -> None:
        """Report the checks when they have changed, and when a ground station connects."""
        self._time_us = time_us
        if time_us >= self._next_report_us:
            self._next_report_us = time_us + _REPORT_US
            report = self._report()
            if self._station_comes() or report != self._reported:
                self._send_report(report)

    def _station_comes(self) -> bool:
        """Before a flight, a ground station is connected that was not connected at the last tick."""
        situation, before = self._commander.situation, self._station_connected
        self._station_connected = situation.gcs_age_s < self._commander.parameters.gcs_loss_s
        return self._station_connected and not before and not self._commander.armed

    @command(dialect.MAV_CMD_RUN_PREARM_CHECKS)
    def _run_checks(self, command: Command, source: Source) -> Result:
        """RUN_PREARM_CHECKS; failed checks are sent as texts too, which brings the report."""
        if not self._commander.check_arming():
            self._send_report(self._report())
        return Result.ACCEPTED

    def follow(self, event: Event) -> None:
        """Send the events that belong to a vehicle event."""
        for occurrence in px4_events.occurrences(event, self._notices(event)):
            self._send(occurrence)
        if isinstance(event, ArmingDenied):
            self._send_report(self._report())

    def _send_report(self, report: tuple[Occurrence, ...]) -> None:
        self._reported = report
        for occurrence in report:
            self._send(occurrence)

    def _send(self, occurrence: Occurrence) -> None:
        kind, values, level = occurrence
        level = kind.level if level is None else level
        self._sequence = (self._sequence + 1) % _MODULO
        message = dialect.MAVLink_event_message(
            0,  # to all systems
            0,
            kind.event_id,
            self._time_us // 1000 & 0xFFFFFFFF,
            self._sequence,
            level << 4 | level,
            kind.pack(values),
        )
        self._kept.append(message)
        send_to_all(self._broadcast, message)

    def _report(self) -> tuple[Occurrence, ...]:
        """The modes that can be armed and flown, and the failed checks."""
        commander = self._commander
        situation, policy, parameters = commander.situation, commander.policy, commander.parameters
        can_arm = can_run = 0
        against: dict[Reason, int] = {}
        for mode, bit in px4_events.MODE_BITS.items():
            reasons = arming_reasons(mode, situation, policy, parameters)
            for reason in reasons:
                against[reason] = against.get(reason, 0) | bit
            can_arm |= 0 if reasons else bit
            if mode in policy.flown_modes and not shortfalls(mode, situation, policy, parameters):
                can_run |= bit
        ordered = {reason: against[reason] for reason in Reason if reason in against}
        return px4_events.report(can_arm, can_run, ordered)
