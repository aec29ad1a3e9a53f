"""What `flightstack vehicle` does."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from typing import Any, Final

import click

from missions.cli.bodies.confirm import ask, can_ask
from missions.cli.bodies.signing import key_from
from missions.cli.bodies.status_line import StatusLine
from missions.cli.bodies.vehicle_link import address, print_json, run
from missions.cli.declared_options import specified
from missions.vehicle import Mode, Vehicle
from missions.vehicle_client import actions
from missions.vehicle_client.actions import VehicleState, connected_vehicle, set_mode, state, watched
from missions.vehicle_client.options import ConnectionOptions

_STOP_MOTORS: Final = "stop the motors"
_LOOK_S: Final = 0.2
_LINE_S: Final = 1.0
_LATE_S: Final = 3.0


def _with_vehicle(given: dict[str, Any], work: Callable[[Vehicle], Any]) -> Any:
    """Run `work` with the vehicle that the options name."""
    link, key = address(given["connect"]), key_from(given["signing_key"])

    async def whole() -> Any:
        async with connected_vehicle(link, options=specified(ConnectionOptions), signing_key=key) as vehicle:
            return await work(vehicle)

    return run(whole())


def _report(given: dict[str, Any], commanded: str, now: VehicleState) -> int:
    """Print what was done, and the vehicle's state then."""
    if given["as_json"]:
        print_json({"commanded": commanded, "answer": "accepted", **asdict(now)})
    else:
        click.echo(f"vehicle {now.system_id}: commanded to {commanded}, accepted; now {now}")
    return 0


def _change_mode(given: dict[str, Any], mode: Mode) -> int:
    return _report(given, str(mode), _with_vehicle(given, lambda vehicle: set_mode(vehicle, mode)))


def return_(**given: Any) -> int:
    """`flightstack vehicle return`."""
    return _change_mode(given, Mode.RETURN)


def land(**given: Any) -> int:
    """`flightstack vehicle land`."""
    return _change_mode(given, Mode.LAND)


def hold(**given: Any) -> int:
    """`flightstack vehicle hold`."""
    return _change_mode(given, Mode.HOLD)


def disarm(force: bool, yes: bool, **given: Any) -> int:
    """`flightstack vehicle disarm`."""
    if yes and not force:
        raise click.UsageError("--yes: has no effect without --force")

    async def work(vehicle: Vehicle) -> VehicleState:
        if force:
            await _confirm_fall(vehicle, yes=yes)
        return await actions.disarm(vehicle, in_the_air=force)

    return _report(given, "disarm", _with_vehicle(given, work))


async def _confirm_fall(vehicle: Vehicle, *, yes: bool) -> None:
    """Ask before the motors are stopped, unless the vehicle is on the ground."""
    now = await state(vehicle)
    if now.landed or yes:
        return
    question = f"vehicle {now.system_id}: {now}. Its motors will stop, and it falls"
    if not can_ask():
        raise click.UsageError(f"{question}: not confirmed; there is no terminal to ask on: give --yes")
    if (await ask(f"{question}. Type {_STOP_MOTORS}")).lower() != _STOP_MOTORS:
        raise click.ClickException("not confirmed, nothing was commanded")


def watch(**given: Any) -> int:
    """`flightstack vehicle watch`."""
    with suppress(KeyboardInterrupt):  # Ctrl-C is how it ends
        _with_vehicle(given, lambda vehicle: _watch(vehicle, as_json=given["as_json"]))
    return 0


async def _watch(vehicle: Vehicle, *, as_json: bool) -> None:
    line, shown, texts = StatusLine(), 0.0, vehicle.link.texts.newest
    await state(vehicle)  # requests what is not streamed
    known: set[int] = set()
    try:
        while True:
            for text in [text for text in texts if id(text) not in known]:
                line.erase()
                click.echo(text.text, err=not as_json and line.terminal)
            known = {id(text) for text in texts}
            now = watched(vehicle)
            loop_s = asyncio.get_running_loop().time()
            if line.terminal and not as_json:
                line.show(_line(now))
            elif loop_s - shown >= _LINE_S:
                shown = loop_s
                print_json(asdict(now), one_line=True) if as_json else click.echo(_line(now))
            await asyncio.sleep(_LOOK_S)
    finally:
        line.end()


def _line(now: VehicleState) -> str:
    battery = "" if now.battery is None else f", battery {100.0 * now.battery:.0f} %"
    silence = f", NO HEARTBEAT for {now.silent_s:.0f} s" if now.silent_s > _LATE_S else ""
    return f"vehicle {now.system_id}: {now}{battery}{silence}"
