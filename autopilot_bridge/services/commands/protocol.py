"""The MAVLink command protocol, autopilot side: COMMAND_LONG, COMMAND_INT, SET_MODE, acknowledgements."""

from collections.abc import Mapping

from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import NO_CLIENT, AddressRule, Source
from autopilot_bridge.services.commands.command import Command, Handler, acknowledge, command_from_message
from autopilot_bridge.services.microservice import Microservice


class CommandService(Microservice):
    """Executes commands and acknowledges them, on the requesting channel only.

    Args:
        address: the target ids of this autopilot.
        table: the commands of all services, by MAV_CMD.
    """

    def __init__(self, address: AddressRule, table: Mapping[int, Handler]) -> None:
        self._address = address
        self._table = table

    def knows(self, command: int) -> bool:
        """A handler for this MAV_CMD exists."""
        return command in self._table

    def carry_out(self, command: Command, source: Source | None = None) -> Result | None:
        """Execute a command without an acknowledgement; without a source, replies are dropped."""
        sender = NO_CLIENT if source is None else source
        handler = self._table.get(command.id)
        return Result.UNSUPPORTED if handler is None else handler(command, sender)

    @receives(dialect.MAVLink_command_long_message, dialect.MAVLink_command_int_message)
    def _on_command(
        self,
        message: dialect.MAVLink_command_long_message | dialect.MAVLink_command_int_message,
        source: Source,
        time_us: int,
    ) -> None:
        if not self._address.accepts(message):
            return
        command = command_from_message(message)
        result = self.carry_out(command, source)
        if result is not None:
            acknowledge(command.id, result, source)
