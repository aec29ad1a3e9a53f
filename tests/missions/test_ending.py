"""What ends a flight early: SIGTERM and SIGHUP as Ctrl-C, in whatever order they come."""

import json
import os
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import common as mavlink

from missions.base.options import FlightOptions
from missions.cli import main as cli
from missions.process.ending import EndedBySignal, EndingSignals
from missions.runs import session
from missions.runs.session import Flight, RunRequest, RunResult

OPTIONS = FlightOptions(width_m=40.0, height_m=30.0, pattern="L2")
ENDING = [signal.SIGTERM, signal.SIGHUP]


def sending(*numbers: signal.Signals) -> Callable[[Flight], None]:
    """Signals to this process, in flight, one each second of vehicle time."""
    left = list(numbers)

    def send(flight: Flight) -> None:
        if left and flight.clock is not None and flight.clock.time_us > 30_000_000:
            os.kill(os.getpid(), left.pop(0))

    return send


def flown(folder: Path, on_progress: Callable[[Flight], None]) -> RunResult:
    request = RunRequest(options=OPTIONS, connect=["udpin:127.0.0.1:1"], out=folder, picture=False)
    return session.fly("lissajous", request, on_progress)


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """As of a program that was started at a terminal, however the tests were started."""
    usual = {number: signal.SIG_DFL for number in ENDING} | {signal.SIGINT: signal.default_int_handler}
    before = {number: signal.signal(number, handler) for number, handler in usual.items()}
    yield
    after = {number: signal.getsignal(number) for number in usual}
    for number, handler in before.items():
        signal.signal(number, handler)
    assert after == usual


@pytest.mark.parametrize("number", [*ENDING, signal.SIGINT])
def test_who_asks_a_flight_to_end_leaves_the_vehicle_safe(
    number: signal.Signals, elsewhere: Any, tmp_path: Path
) -> None:
    result = flown(tmp_path / "run", sending(number))
    assert (result.outcome, result.signal) == ("interrupted", number)
    assert elsewhere.kind == "return"
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert (summary["outcome"], summary["reason"]) == ("interrupted", result.reason)
    assert result.left[0].text.startswith("was commanded to return and does; it is in Return at ")
    assert summary["vehicles"][0]["left"] == result.left[0].record()


@pytest.mark.parametrize("number", ENDING)
def test_it_is_obeyed_in_the_background_where_ctrl_c_is_ignored(
    number: signal.Signals, elsewhere: Any, tmp_path: Path
) -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        result = flown(tmp_path / "run", sending(number))
    finally:
        signal.signal(signal.SIGINT, before)
    assert (result.outcome, result.signal) == ("interrupted", number)
    assert elsewhere.kind == "return"


def test_what_is_sent_twice_at_once_is_sent_once(
    elsewhere: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("missions.process.ending.wall_time_s", lambda: 5.0)
    elsewhere.refuse_modes = {"return"}  # so that it takes a while

    def send(flight: Flight) -> None:
        if flight.clock is not None and flight.clock.time_us > 30_000_000:
            for number in ENDING:
                os.kill(os.getpid(), number)

    result = flown(tmp_path / "run", send)
    assert (result.outcome, result.signal) == ("interrupted", signal.SIGTERM)
    assert elsewhere.kind == "land"
    assert result.left[0].text.startswith(
        "refused to return, was commanded to land and does; it is in Land at "
    )


@pytest.mark.parametrize("second", [*ENDING, signal.SIGINT])
def test_a_second_one_stops_at_once(
    second: signal.Signals, elsewhere: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = [0.0]

    def later() -> float:
        now_s[0] += 10.0
        return now_s[0]

    monkeypatch.setattr("missions.process.ending.wall_time_s", later)
    send = sending(signal.SIGTERM, second)

    def deafen_and_send(flight: Flight) -> None:
        if elsewhere.pos[2] < -5.0:
            elsewhere.mute_commands = {mavlink.MAV_CMD_DO_SET_MODE}  # it would take long to give up
            send(flight)

    result = flown(tmp_path / "run", deafen_and_send)
    assert (result.outcome, result.signal) == ("interrupted", signal.SIGTERM)
    assert result.left[0].text.startswith("did not answer the command to return; it is in ")
    assert (tmp_path / "run" / "summary.json").exists()


@pytest.mark.parametrize("number", ENDING)
def test_one_that_is_ignored_stays_ignored(number: signal.Signals, elsewhere: Any, tmp_path: Path) -> None:
    before = signal.signal(number, signal.SIG_IGN)
    try:
        result = flown(tmp_path / "run", sending(number))
        assert signal.getsignal(number) is signal.SIG_IGN
    finally:
        signal.signal(number, before)
    assert (result.outcome, result.reason, result.signal) == ("completed", "", 0)


def test_a_handler_of_another_module_stays_theirs() -> None:
    received: list[int] = []
    before = signal.signal(signal.SIGTERM, lambda number, _frame: received.append(number))
    try:
        with EndingSignals():
            signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert received == [signal.SIGTERM]


def test_a_thread_leaves_signals_alone() -> None:
    handlers: list[Any] = []

    def work() -> None:
        with EndingSignals():
            handlers.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert handlers == [signal.SIG_DFL]


@pytest.mark.parametrize("number", ENDING)
def test_before_anything_has_begun_nothing_stays(
    number: signal.Signals, elsewhere: Any, tmp_path: Path
) -> None:
    request = RunRequest(
        options=OPTIONS,
        connect=["udpin:127.0.0.1:1"],
        out=tmp_path / "run",
        on_open=lambda: signal.raise_signal(number),
    )
    with pytest.raises(EndedBySignal) as ended:
        session.fly("lissajous", request)
    assert ended.value.number == number
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)]
)
@pytest.mark.parametrize("export", [False, True])
def test_the_exit_code_tells_the_signal(
    number: signal.Signals,
    code: int,
    export: bool,
    elsewhere: Any,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def sent_in_the_loop(_parameters: object) -> None:
        os.kill(os.getpid(), number)

    elsewhere.on_param_request_read = sent_in_the_loop
    words = [
        "fly",
        "lissajous",
        "--connect",
        "udpin:127.0.0.1:1",
        "--no-picture",
        "--out",
        str(tmp_path / "run"),
    ]
    words += ["--export-plan", str(tmp_path / "x.plan")] if export else []
    assert cli.run_command_line(words) == code
    said = capsys.readouterr()
    lines = said.err.splitlines()
    reported = lines if export else [line for line in lines if line.startswith("flightstack: ")]
    assert (said.out, len(reported)) == ("", 1 if export else 2)  # how the vehicle was left
    assert "interrupted" in said.err
    assert {path.name for path in tmp_path.iterdir()} == (set() if export else {"run"})
