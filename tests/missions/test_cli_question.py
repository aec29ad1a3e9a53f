"""Questions at a terminal: what is typed there, Ctrl-C, and the end of the input."""

import subprocess
import sys

import pytest

from tests.terminal import CTRL_C, END_OF_FILE, at_terminal

FLY = """
import asyncio, sys
from missions.cli.bodies.confirm import confirmation
from missions.process.ending import EndingSignals
from missions.errors import MissionError
from missions.preflight.before_flight import Look, confirmed

async def flight():
    confirm = confirmation(["serial:/dev/ttyACM0:57600"], yes=False, check=False)
    heartbeats = asyncio.create_task(count())
    try:
        await confirmed([Look(system_id=1, findings=())], confirm)
        print("flown")
    finally:
        print("left safe")

async def count():
    while True:
        print(".", end="", flush=True)
        await asyncio.sleep(0.01)

with EndingSignals() as ending:
    try:
        ending.run(flight(), asyncio.new_event_loop())
    except KeyboardInterrupt:
        sys.exit(130)
    except MissionError as error:
        sys.exit(str(error))
"""
FLY_WITH_PROGRESS = """
import asyncio
from types import SimpleNamespace
from missions.cli.bodies.confirm import confirmation
from missions.cli.bodies.fly_report import ProgressLine
from missions.preflight.before_flight import Look, confirmed

async def flight():
    line = ProgressLine()
    line._last_wall_s = -1e9
    progress = asyncio.create_task(count_up(line))
    await asyncio.sleep(0.3)
    confirm = confirmation(["serial:/dev/ttyACM0:57600"], yes=False, check=False, screen=line.held)
    await confirmed([Look(system_id=1, findings=())], confirm)
    await asyncio.sleep(0.3)
    progress.cancel()
    line.end()
    print("flown")

async def count_up(line):
    while True:
        line(SimpleNamespace(clock=object(), vehicles=[], elapsed_s=1.0))
        await asyncio.sleep(0.02)

asyncio.run(flight())
"""
ERASE = """
from contextlib import asynccontextmanager
import missions.vehicle_client.client, missions.vehicle_client.logs
from missions.cli import main as cli

class Client:
    system_id = 1
    async def require_answers(self):
        pass

@asynccontextmanager
async def open_client(*_, **__):
    yield Client()
    print("client closed")

class Logs:
    def __init__(self, client):
        pass
    async def entries(self):
        return [1, 2, 3]
    async def erase(self):
        print("they are gone")

missions.vehicle_client.client.open_client = open_client
missions.vehicle_client.logs.VehicleLogs = Logs
cli.main(["vehicle", "logs", "erase", "--connect", "udpin:127.0.0.1:1"])
"""
FLY_QUESTION = "Fly? Type yes (or y): "
ERASE_QUESTION = "delete all logs (3) of vehicle 1? Type yes (or y): "


@pytest.mark.parametrize(
    ("answer", "code", "reported"),
    [
        ("yes\n", 0, "flown"),
        ("  Yes \r", 0, "flown"),
        ("\n", 1, "not flown: not confirmed"),
        ("y\n", 0, "flown"),
        ("no\n", 1, "not flown: not confirmed"),
        ("yse\n", 1, "not flown: not confirmed"),
        (END_OF_FILE, 1, "not flown: not confirmed"),
    ],
)
@pytest.mark.sampled(1)
def test_what_is_typed_is_the_answer_and_the_link_is_kept_up_meanwhile(
    answer: str, code: int, reported: str
) -> None:
    with at_terminal("-c", FLY) as terminal:
        terminal.wait_for(FLY_QUESTION)
        terminal.wait_for("....")
        terminal.type(answer)
        assert terminal.wait_for_end() == code
        assert reported in terminal.seen
        assert "left safe" in terminal.seen


def test_the_progress_line_stays_away_from_an_open_question() -> None:
    with at_terminal("-c", FLY_WITH_PROGRESS) as terminal:
        terminal.wait_for(FLY_QUESTION)
        before, _, after = terminal.seen.partition(FLY_QUESTION)
        assert "waiting" in before and before.endswith("vehicle 1:\r\n")
        assert before.rpartition("waiting")[2].startswith("\r  ")  # wiped off
        assert not after
        terminal.type("y")
        terminal.wait_for("(or y): y")  # several turns of the progress line later
        assert terminal.seen.endswith("(or y): y")
        terminal.type("\n")
        assert terminal.wait_for_end() == 0
        assert "waiting" in terminal.seen.partition("(or y): y")[2]


def test_ctrl_c_at_the_question_before_a_flight_ends_it() -> None:
    with at_terminal("-c", FLY) as terminal:
        terminal.wait_for(FLY_QUESTION)
        terminal.type(CTRL_C)
        assert terminal.wait_for_end() == 130
        assert "left safe" in terminal.seen
        assert "flown" not in terminal.seen and "Error" not in terminal.seen


@pytest.mark.parametrize(
    ("answer", "code", "reported"),
    [
        ("yes\n", 0, "they are gone"),
        ("Y\n", 0, "they are gone"),
        ("no\n", 1, "not confirmed, nothing was done"),
    ],
)
@pytest.mark.sampled(1)
def test_a_vehicle_s_logs_are_erased_after_a_yes(answer: str, code: int, reported: str) -> None:
    pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")
    with at_terminal("-c", ERASE) as terminal:
        terminal.wait_for(ERASE_QUESTION)
        terminal.type(answer)
        assert terminal.wait_for_end() == code
        assert reported in terminal.seen
        assert ("they are gone" in terminal.seen) == (code == 0)


def test_ctrl_c_at_a_question_about_a_vehicle_is_no_answer_and_the_end() -> None:
    pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")
    with at_terminal("-c", ERASE) as terminal:
        terminal.wait_for(ERASE_QUESTION)
        terminal.type(CTRL_C)
        terminal.type("yes\n")
        assert terminal.wait_for_end() == 130
        assert "interrupted" in terminal.seen
        assert "they are gone" not in terminal.seen


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (
            "fly lissajous --connect serial:/dev/ttyNONE:57600",
            "may be a real vehicle, and there is no terminal to confirm the flight; give --yes",
        ),
        (
            "fly lissajous --connect udpin:127.0.0.1:1 --check",
            "no terminal to confirm the flight; give --yes",
        ),
    ],
)
@pytest.mark.sampled(1)
def test_where_the_input_is_closed_no_user_can_be_asked(words: str, reported: str) -> None:
    done = subprocess.run(
        ["/bin/sh", "-c", f'exec "{sys.executable}" -m missions {words} <&-'],
        capture_output=True,
        text=True,
        timeout=120.0,
    )
    assert done.returncode == 2
    assert reported in done.stderr and done.stderr.count("\n") == 1
