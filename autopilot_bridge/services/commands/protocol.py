"""The MAVLink command protocol, autopilot side: COMMAND_LONG, COMMAND_INT, SET_MODE, acknowledgements."""

from collections.abc import Mapping

from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import dialect as mavlink
from autopilot_bridge.services.channel import NO_CLIENT, AddressRule, Source
from autopilot_bridge.services.commands.command import Command, Handler, command_from_message
from autopilot_bridge.services.commands.handlers import CommandHandlers
from autopilot_bridge.services.microservice import Microservice


class CommandService(Microservice):
    """Executes commands and acknowledges them, on the requesting channel only.

    Args:
        handlers: the flavour's commands.
        address: the target ids of this autopilot.
        more: commands of other services, by MAV_CMD.
    """

    def __init__(
        self, handlers: CommandHandlers, address: AddressRule, more: Mapping[int, Handler] | None = None
    ) -> None:
        self._handlers = handlers
        self._address = address
        self._table = {**handlers.commands, **(more or {})}

    @receives(mavlink.MAVLINK_MSG_ID_SET_MODE)
    def _on_set_mode(self, message: mavlink.MAVLink_set_mode_message, source: Source, time_us: int) -> None:
        if self._address.accepts(message):
            result = self._handlers.set_mode_message(message.base_mode, message.custom_mode, source)
            if result is not None:
                _acknowledge(mavlink.MAV_CMD_DO_SET_MODE, result, source)

    def knows(self, command: int) -> bool:
        """A handler for this MAV_CMD exists."""
        return command in self._table

    def carry_out(self, command: Command, source: Source | None = None) -> Result | None:
        """Execute a command without an acknowledgement; without a source, replies are dropped."""
        sender = NO_CLIENT if source is None else source
        handler = self._table.get(command.id)
        return Result.UNSUPPORTED if handler is None else handler(command, sender)

    @receives(mavlink.MAVLINK_MSG_ID_COMMAND_LONG, mavlink.MAVLINK_MSG_ID_COMMAND_INT)
    def _on_command(
        self,
        message: mavlink.MAVLink_command_long_message | mavlink.MAVLink_command_int_message,
        source: Source,
        time_us: int,
    ) -> None:
        if not self._address.accepts(message):
            return
        command = command_from_message(message)
        if command.id in self._handlers.double_ack:
            _acknowledge(command.id, Result.ACCEPTED, source)
        result = self.carry_out(command, source)
        if result is not None:
            _acknowledge(command.id, result, source)


def _acknowledge(command: int, result: Result, source: Source) -> None:
    source.channel.send(
        mavlink.MAVLink_command_ack_message(command, int(result), 0, 0, source.system_id, source.component_id)
    )
