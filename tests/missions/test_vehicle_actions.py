"""`flightstack vehicle return|land|hold|disarm|watch`: what is commanded, printed and refused."""

import asyncio
from contextlib import asynccontextmanager

import pytest

from autopilot_bridge.clock import LoopClock, run
from missions.cli.bodies import vehicle_actions, vehicle_link
from missions.cli.main import run_command_line
from missions.errors import CommandRejected, MissionError
from missions.vehicle import Mode, Vehicle
from missions.vehicle.connection import Connection
from missions.vehicle_client import actions

FLAVOURS = pytest.mark.parametrize("flavour", ["px4", "ardupilot"])


def up(autopilot):
    """In flight, in a mission that nothing watches any more."""
    autopilot.armed, autopilot.pos = True, [30.0, 0.0, -12.0]


@FLAVOURS
@pytest.mark.parametrize("mode", [Mode.RETURN, Mode.LAND, Mode.HOLD])
def test_a_mode_is_commanded_and_the_state_then_is_reported(flown, flavour, mode):
    async def script(vehicle, autopilot):
        await vehicle.wait_heartbeat()
        now = await actions.set_mode(vehicle, mode)
        assert autopilot.kind == str(mode)
        assert (now.armed, now.landed) == (True, False)
        assert now.height_m == pytest.approx(12.0, abs=2.0)
        assert vehicle.mode in str(now) and "armed, in the air" in str(now)

    flown(script, flavour, ready=False, setup=up)


def test_a_refused_mode_and_a_mute_vehicle_end_within_their_time(flown):
    async def script(vehicle, autopilot):
        await vehicle.wait_heartbeat()
        autopilot.refuse_modes = {"return"}
        with pytest.raises(CommandRejected, match=r"refused mode return.* 12\.0 m above home"):
            await actions.set_mode(vehicle, Mode.RETURN)
        autopilot.mute_commands = {176}
        with pytest.raises(MissionError, match="land"):
            await actions.set_mode(vehicle, Mode.LAND)
        assert vehicle.clock.time_us < 30_000_000

    flown(script, ready=False, setup=up)


@FLAVOURS
def test_disarming_in_the_air_is_refused_and_nothing_is_commanded(flown, flavour):
    async def script(vehicle, autopilot):
        await vehicle.wait_heartbeat()
        with pytest.raises(CommandRejected, match="was not disarmed: it is in the air"):
            await actions.disarm(vehicle)
        assert autopilot.armed
        assert not [command for command, _ in autopilot.commands if command == 400]

    flown(script, flavour, ready=False, setup=up)


@FLAVOURS
def test_on_the_ground_it_is_disarmed_and_no_mode_that_flies_is_commanded(flown, flavour):
    async def script(vehicle, autopilot):
        await vehicle.wait_heartbeat()
        autopilot.armed = True
        assert not (await actions.disarm(vehicle)).armed
        with pytest.raises(MissionError, match=r"was not commanded to return: .*disarmed, on the ground"):
            await actions.set_mode(vehicle, Mode.RETURN)

    flown(script, flavour, ready=False)


# the command line


@pytest.fixture
def linked(make_sitl, monkeypatch):
    """The commands reach a scripted autopilot, on its time."""
    sitl = make_sitl(truth=False)

    @asynccontextmanager
    async def connected_vehicle(_address, **_):
        async with Connection(sitl.links[0], LoopClock()) as connection:
            vehicle = Vehicle(connection)
            await vehicle.wait_heartbeat()
            yield vehicle

    monkeypatch.setattr(vehicle_actions, "connected_vehicle", connected_vehicle)
    monkeypatch.setattr(vehicle_link.asyncio, "run", lambda work: run(work, sitl.loop))  # type: ignore[attr-defined]
    return sitl.autopilots[0]


def command(*words):
    return run_command_line(["vehicle", *words, "--connect", "udpin:127.0.0.1:14550"])


def test_the_command_prints_what_was_commanded_answered_and_is_so_now(linked, capsys):
    up(linked)
    assert command("hold") == 0
    printed = capsys.readouterr().out
    assert printed.startswith(
        "vehicle 1: commanded to hold, accepted; now mode Hold, 12.0 m above home, armed"
    )


def test_a_refusal_is_one_line_and_exit_code_1(linked, capsys):
    up(linked)
    assert command("disarm") == 1
    reported = capsys.readouterr().err
    assert "vehicle 1 was not disarmed: it is in the air" in reported and reported.count("\n") == 1


@pytest.mark.parametrize(("answer", "code"), [("stop the motors", 0), ("yes", 1), ("", 1)])
def test_motors_in_the_air_are_stopped_only_by_typing_it(linked, monkeypatch, answer, code):
    up(linked)
    linked._command = lambda command, p: (
        setattr(linked, "armed", False) if command == 400 and p[1] == 21196.0 else None,  # type: ignore[func-returns-value]
        linked.ack(command, 0),
    )
    asked = []

    async def typed(question):
        asked.append(question)
        return answer

    monkeypatch.setattr(vehicle_actions, "ask", typed)
    monkeypatch.setattr(vehicle_actions, "can_ask", lambda: True)
    assert command("disarm", "--force") == code
    assert "Its motors will stop, and it falls" in asked[0]
    assert linked.armed == (code == 1)


def test_without_a_terminal_the_motors_are_not_stopped(linked, capsys):
    up(linked)
    assert command("disarm", "--force") == 2
    assert linked.armed and "give --yes" in capsys.readouterr().err


def test_watching_prints_the_state_and_texts_until_ctrl_c(linked, monkeypatch, capsys):
    up(linked)
    looks = 0
    sleep = asyncio.sleep

    async def counted(seconds):
        nonlocal looks
        looks += seconds == vehicle_actions._LOOK_S
        if looks == 3:
            linked.text("Low battery")
        if looks > 20:
            raise KeyboardInterrupt
        await sleep(seconds)

    monkeypatch.setattr(vehicle_actions.asyncio, "sleep", counted)  # type: ignore[attr-defined]
    assert command("watch") == 0
    lines = capsys.readouterr().out.splitlines()
    assert "vehicle 1: mode Hold, 12.0 m above home, armed, in the air, battery 100 %" in lines
    assert "Low battery" in lines
    assert not linked.items and linked.armed
