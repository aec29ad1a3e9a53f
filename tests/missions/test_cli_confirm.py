"""The question before a flight with a real vehicle: when it is asked, and what the answers do."""

import asyncio
import sys
from collections.abc import Iterator

import pytest
from click.testing import CliRunner

from missions.cli.bodies.confirm import confirmation, leaves_this_machine
from missions.cli.fly import fly
from missions.errors import MissionError
from missions.preflight.before_flight import Confirm, Look
from missions.preflight.finding import ok, problem

SERIAL = ["serial:/dev/ttyACM0:57600"]
FINE = Look(system_id=1, findings=(ok("GPS", "3D fix"),))
SICK = Look(system_id=1, findings=(ok("GPS", "3D fix"), problem("home", "not set", "wait")))


@pytest.mark.parametrize(
    ("connections", "leaves"),
    [
        (SERIAL, True),
        (["/dev/ttyUSB0,57600"], True),
        (["udpin:0.0.0.0:14550"], True),
        (["udpout:192.168.1.2:14550"], True),
        (["udpin:127.0.0.1:14550"], False),
        (["tcp:localhost:5760"], False),
        (["tcp:127.0.0.1:5760", *SERIAL], True),
    ],
)
def test_which_links_leave_this_machine(connections: list[str], leaves: bool) -> None:
    assert leaves_this_machine(connections) is leaves


def test_on_a_link_of_this_machine_the_vehicle_decides_whether_it_is_asked() -> None:
    """It may forward a real aircraft: without a terminal it is not flown."""
    confirm = confirmation(["udpin:127.0.0.1:14550"], yes=False, check=False)
    with pytest.raises(MissionError, match="no terminal to confirm the flight; give --yes"):
        asyncio.run(confirm([FINE]))


@pytest.mark.parametrize("connection", [*SERIAL, "udpin:0.0.0.0:14550"])
def test_where_no_user_can_be_asked_nothing_flies(connection: str) -> None:
    result = CliRunner().invoke(fly, ["lissajous", "--connect", connection])
    assert result.exit_code == 2
    assert "there is no terminal to confirm the flight; give --yes" in " ".join(result.output.split())


@pytest.mark.parametrize("option", [["--yes"], ["--check"], ["--regain", "5"]])
def test_options_for_real_vehicles_are_refused_without_one(option: list[str]) -> None:
    result = CliRunner().invoke(fly, ["lissajous", *option])
    assert result.exit_code == 2
    assert f"{option[0]}: for vehicles elsewhere" in " ".join(result.output.split())


def test_yes_flies_only_when_nothing_is_found(capsys: pytest.CaptureFixture[str]) -> None:
    confirm = confirmation(SERIAL, yes=True, check=False)
    assert asyncio.run(confirm([FINE]))
    assert not asyncio.run(confirm([FINE, SICK]))
    assert "problem  home: not set; wait" in capsys.readouterr().err


@pytest.fixture
def confirm(monkeypatch: pytest.MonkeyPatch) -> Iterator[Confirm]:
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    confirm = confirmation(SERIAL, yes=False, check=False)
    yield confirm


@pytest.mark.parametrize(
    ("look", "answer", "flies"),
    [
        (FINE, "yes", True),
        (FINE, "YES", True),
        (FINE, "y", True),
        (FINE, "Y", True),
        (FINE, "no", False),
        (FINE, "", False),
        (SICK, "yes", False),
        (SICK, "y", False),
        (SICK, "fly anyway", True),
    ],
)
def test_what_the_answers_do(
    confirm: Confirm, look: Look, answer: str, flies: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def typed(_question: str) -> str:
        return answer

    monkeypatch.setattr("missions.cli.bodies.confirm.ask", typed)
    assert asyncio.run(confirm([look])) is flies
