"""Which method is for which MAVLink number: decorators at the methods, and the tables that they make.

    class Gripper(Microservice):
        @command(mavlink.MAV_CMD_DO_GRIPPER)
        def _grip(self, command: Command, source: Source) -> Result: ...

A subclass that overrides a method keeps its numbers; one that declares a number for another method replaces
the method of that number.
"""

from collections.abc import Callable
from functools import cache
from typing import Any, Final, TypeVar

MethodT = TypeVar("MethodT", bound=Callable[..., Any])

COMMANDS: Final = "commands"
RECEIVERS: Final = "receivers"
BUILDERS: Final = "builders"
ON_DEMAND: Final = "on_demand"
_MARK: Final = "_mavlink_numbers"


def command(*numbers: int) -> Callable[[MethodT], MethodT]:
    """The method executes these MAV_CMDs."""
    return _marked(COMMANDS, numbers)


def receives(*message_ids: int) -> Callable[[MethodT], MethodT]:
    """The method handles these messages."""
    return _marked(RECEIVERS, message_ids)


def streams(*message_ids: int) -> Callable[[MethodT], MethodT]:
    """The method makes these messages, which can be streamed and requested."""
    return _marked(BUILDERS, message_ids)


def on_request(*message_ids: int) -> Callable[[MethodT], MethodT]:
    """The method sends these messages, which are sent on REQUEST_MESSAGE only."""
    return _marked(ON_DEMAND, message_ids)


def table_of(owner: object, kind: str) -> dict[int, Any]:
    """The methods that `owner` declares for one kind of number: number -> bound method."""
    names = _names(type(owner), kind)  # type: ignore[arg-type]  # mypy does not see that a type is hashable
    return {number: getattr(owner, name) for number, name in names.items()}


def _marked(kind: str, numbers: tuple[int, ...]) -> Callable[[MethodT], MethodT]:
    def mark(method: MethodT) -> MethodT:
        # a method may be for several kinds: one that is streamed and answers a command
        setattr(method, _MARK, {**getattr(method, _MARK, {}), kind: numbers})
        return method

    return mark


@cache
def _names(owner: type, kind: str) -> dict[int, str]:
    return {
        number: name
        for base in reversed(owner.__mro__)
        for name, member in vars(base).items()
        for number in getattr(member, _MARK, {}).get(kind, ())
    }
