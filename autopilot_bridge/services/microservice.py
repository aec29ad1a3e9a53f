"""The one kind of service of an autopilot: what it may receive, execute, stream and follow."""

from collections.abc import Callable, Iterable, Mapping
from typing import ClassVar

from autopilot_bridge.commander.events import Event
from autopilot_bridge.dispatch import BUILDERS, COMMANDS, ON_DEMAND, RECEIVERS, table_of
from autopilot_bridge.services.channel import Channel, Receiver
from autopilot_bridge.services.commands.command import Handler
from autopilot_bridge.telemetry.streams import Builder


class Microservice:
    """One microservice; by default it does nothing.

    What it executes, handles and sends is declared at its methods, by the decorators of
    `autopilot_bridge.dispatch`. All methods are called between two steps of the autopilot, and never raise
    because of a message's contents.

    Attributes:
        coarse_timers: `tick` is called at 10 Hz only, so timers may be late by a tenth of a second.
    """

    coarse_timers: ClassVar[bool] = False

    @property
    def receivers(self) -> Mapping[int, Receiver]:
        """The messages that it handles: message id -> method, by `@receives`. Read once."""
        return table_of(self, RECEIVERS)

    @property
    def commands(self) -> Mapping[int, Handler]:
        """The MAV_CMDs that it executes, by `@command`. Read once."""
        return table_of(self, COMMANDS)

    @property
    def builders(self) -> Mapping[int, Builder]:
        """Messages that can be requested and streamed, by `@streams`: message id -> field values, packed
        payload, or None. Read once.
        """
        return table_of(self, BUILDERS)

    @property
    def on_demand(self) -> Mapping[int, Callable[[Channel, float], None]]:
        """Messages that are sent on REQUEST_MESSAGE only, with its param2, by `@on_request`. Read once."""
        return table_of(self, ON_DEMAND)

    def tick(self, time_us: int) -> None:
        """Timers and queues, at 50 Hz of vehicle time, or at 10 Hz with `coarse_timers`."""

    def follow(self, event: Event) -> None:
        """Something happened to the vehicle."""

    def close(self) -> None:
        """The autopilot goes down: files are closed, what waits to be stored is stored."""


def receivers_by_id(services: Iterable[Microservice]) -> dict[int, tuple[Receiver, ...]]:
    """The methods that handle each message id, in the order of the services."""
    table: dict[int, tuple[Receiver, ...]] = {}
    for service in services:
        for message_id, receiver in service.receivers.items():
            table[message_id] = (*table.get(message_id, ()), receiver)
    return table
