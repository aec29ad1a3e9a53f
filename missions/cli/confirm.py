"""The confirmation before a flight with a real vehicle."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Final

import click

from missions.cli.question import YES_WORDS, ask, is_yes, somebody_is_there

if TYPE_CHECKING:
    from missions.preflight.before_flight import Confirm, Look

_AGAINST_ADVICE: Final = "fly anyway"


def is_hardware(connections: Sequence[str]) -> bool:
    """Whether a link may lead to a real vehicle: serial, or a network beyond this machine.

    Raises:
        AddressError: a connection string is invalid.
    """
    from autopilot_bridge.links import VEHICLE_FORMS, SerialPort, parse_address
    from autopilot_bridge.links.reach import Reach, reach_of

    addresses = [parse_address(text, VEHICLE_FORMS) for text in connections]
    return any(isinstance(a, SerialPort) or reach_of(a) is Reach.NETWORK for a in addresses)


def confirmation(
    connections: Sequence[str],
    *,
    yes: bool,
    check: bool,
    screen: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> "Confirm | None":
    """Return how the flight is confirmed; None: no confirmation is needed, on links of this machine.

    Args:
        connections: connection strings of the vehicles.
        yes: ask no question; fly when the checks find no problem.
        check: also check vehicles on links of this machine.
        screen: makes a context in which nothing else writes to the terminal.

    Raises:
        click.UsageError: the vehicle is real, there is no terminal to ask on, and --yes is missing.
    """
    hardware = is_hardware(connections)
    if not (hardware or check):
        return None
    if not yes and not somebody_is_there():
        raise click.UsageError(
            f"{', '.join(connections)}: may be a real vehicle, and there is no terminal to confirm the "
            "flight; give --yes to fly it when the checks find no problem"
        )

    async def confirm(looks: "Sequence[Look]") -> bool:
        problems = sum(len(look.problems) for look in looks)
        with screen():
            for look in looks:
                click.echo(f"vehicle {look.system_id}:", err=True)
                for finding in look.findings:
                    click.echo(f"  {finding}", err=True)
            if yes:
                return not problems
            if not problems:
                return is_yes(await ask(f"Fly? Type {YES_WORDS}"))
            count = "1 problem" if problems == 1 else f"{problems} problems"
            return (await ask(f"{count}. Fly? Type {_AGAINST_ADVICE}")).lower() == _AGAINST_ADVICE

    return confirm
