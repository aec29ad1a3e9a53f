"""Which method is for which MAVLink number: decorators at the methods, and the tables that they make.

    class Gripper(Microservice):
        @command(dialect.MAV_CMD_DO_GRIPPER)
        def _grip(self, command: Command, source: Source) -> Result: ...

        @receives(dialect.MAVLink_heartbeat_message)
        def _on_heartbeat(self, message: dialect.MAVLink_heartbeat_message, source: Source, time_us: int): ...

A subclass that overrides a method keeps its numbers; one that declares a number for another method replaces
the method of that number.
"""

from collections.abc import Callable
from functools import cache
from typing import Any, Final, TypeVar, get_args

from autopilot_bridge.mavlink import MAVLinkMessage

MethodT = TypeVar("MethodT", bound=Callable[..., Any])

COMMANDS: Final = "commands"
RECEIVERS: Final = "receivers"
BUILDERS: Final = "builders"
ON_DEMAND: Final = "on_demand"
_MARK: Final = "_mavlink_numbers"


def command(*numbers: int) -> Callable[[MethodT], MethodT]:
    """The method executes these MAV_CMDs."""
    return _marked(COMMANDS, numbers)


def receives(*kinds: type[MAVLinkMessage]) -> Callable[[MethodT], MethodT]:
    """The method handles the messages of these classes, which its first parameter names too.

    Raises (what is returned):
        TypeError: the parameter's annotation names other classes.
    """
    mark = _marked(RECEIVERS, _ids(kinds))

    def checked(method: MethodT) -> MethodT:
        code, annotations = method.__code__, method.__annotations__
        annotated = annotations.get(code.co_varnames[1])
        if set(kinds) != set(get_args(annotated) or (annotated,)):
            declared = " | ".join(kind.__name__ for kind in kinds)
            raise TypeError(
                f"{method.__qualname__} receives {declared}, but its message is annotated {annotated!r}"
            )
        return mark(method)

    return checked


def streams(*kinds: type[MAVLinkMessage]) -> Callable[[MethodT], MethodT]:
    """The method makes these messages, which can be streamed and requested."""
    return _marked(BUILDERS, _ids(kinds))


def on_request(*kinds: type[MAVLinkMessage]) -> Callable[[MethodT], MethodT]:
    """The method sends these messages, which are sent on REQUEST_MESSAGE only."""
    return _marked(ON_DEMAND, _ids(kinds))


def table_of(owner: object, kind: str) -> dict[int, Any]:
    """The methods that `owner` declares for one kind of number: number -> bound method."""
    names = _names(type(owner), kind)  # type: ignore[arg-type]  # mypy does not see that a type is hashable
    return {number: getattr(owner, name) for number, name in names.items()}


def _ids(kinds: tuple[type[MAVLinkMessage], ...]) -> tuple[int, ...]:
    return tuple(kind.id for kind in kinds)


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
