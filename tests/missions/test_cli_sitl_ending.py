"""`flightstack sitl`: terminated while it starts or runs, and what it leaves behind when it can't start."""

import os
import shutil
import signal
import socket
import tempfile
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from autopilot_bridge.sitl import Sitl, SitlServer
from autopilot_bridge.tlog import TlogReader
from missions.cli.bodies.storage import Losses
from missions.cli.main import command_line, run_command_line

QUICK = ("sitl", "--speedup", "0", "--no-wait", "--link", "udpin:127.0.0.1:0")
ASKING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@pytest.fixture(autouse=True)
def cards(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where temporary memory cards are."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """As on a terminal, though the tests are run by nohup; and whatever happens, handled as before."""
    outside = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    before = {number: signal.getsignal(number) for number in ASKING}
    yield
    after = {number: signal.getsignal(number) for number in ASKING}
    for number, handler in before.items():
        signal.signal(number, handler)
    signal.signal(signal.SIGHUP, outside)
    assert after == before


@pytest.fixture
def in_flight(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[], object]], None]:
    """Have something done once, after a second of flight."""

    def arrange(what: Callable[[], object]) -> None:
        advance, run, left = Sitl.advance, SitlServer.run, [what]

        def advanced(sitl: Sitl) -> None:
            advance(sitl)
            if sitl.time_us >= 1_000_000 and left:
                left.pop()()

        def running(server: SitlServer, *arguments: Any, **more: Any) -> None:
            monkeypatch.setattr(Sitl, "advance", advanced)  # from here on: others are flown to compile
            run(server, *arguments, **more)

        monkeypatch.setattr(SitlServer, "run", running)

    return arrange


def sitl(*arguments: str) -> Result:
    return CliRunner().invoke(command_line, [*QUICK, *arguments], standalone_mode=False)


@pytest.mark.parametrize("number", ASKING)
def test_terminated_while_it_starts_it_leaves_nothing(
    number: signal.Signals,
    cards: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def requested(_: Any) -> None:
        assert list(cards.iterdir())
        os.kill(os.getpid(), number)

    monkeypatch.setattr("missions.cli.bodies.sitl.compile_flight_code", requested)
    log = tmp_path / "said.tlog"
    assert run_command_line([*QUICK, "--duration", "3", "--log", str(log)]) == 130
    assert capsys.readouterr().err.endswith("interrupted\n")
    assert not list(cards.iterdir()) and not log.exists()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_terminated_where_nothing_can_be_raised_it_does_not_start(
    cards: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Dying:
        def __del__(self) -> None:
            os.kill(os.getpid(), signal.SIGTERM)
            for _ in range(1000):  # the interpreter looks for signals now and then
                pass

    def clean_up(_: Any) -> None:
        Dying()

    monkeypatch.setattr("missions.cli.bodies.sitl.compile_flight_code", clean_up)
    assert run_command_line([*QUICK, "--duration", "3"]) == 130
    assert not list(cards.iterdir())


@pytest.mark.parametrize("number", ASKING)
@pytest.mark.sampled(1)
def test_terminated_in_flight_it_ends_in_good_order(
    number: signal.Signals, cards: Path, tmp_path: Path, in_flight: Callable[..., None]
) -> None:
    in_flight(lambda: os.kill(os.getpid(), number))
    log = tmp_path / "said.tlog"
    done = sitl("--duration", "60", "--log", str(log))
    assert done.return_value == 0 and "stopped at 1.0 s" in done.output
    assert not list(cards.iterdir())
    times_us = [time_us for time_us, _ in TlogReader(log)]
    assert times_us[-1] - times_us[0] > 900_000


@pytest.mark.slow
def test_an_ignored_hangup_stays_ignored(in_flight: Callable[..., None]) -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as by nohup
    try:
        in_flight(lambda: os.kill(os.getpid(), signal.SIGHUP))
        done = sitl("--duration", "2")
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)
    assert done.return_value == 0 and "stopped at 2.0 s" in done.output


@pytest.mark.slow
def test_a_busy_port_leaves_no_log_in_the_way(cards: Path, tmp_path: Path) -> None:
    log = tmp_path / "said.tlog"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as busy:
        busy.bind(("127.0.0.1", 0))
        port = busy.getsockname()[1]
        words = [*QUICK[:-1], f"udpin:127.0.0.1:{port}", "--duration", "1", "--log", str(log)]
        assert run_command_line(words) == 2
        assert not log.exists() and not list(cards.iterdir())
    assert run_command_line(words) == 0
    assert log.stat().st_size


# what can't be kept


@pytest.fixture
def key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, ...]:
    """A key, and a calendar that goes a second at each look."""
    path = tmp_path / "key"
    path.write_text("pass phrase\n")
    seconds = count(1_000_000)
    monkeypatch.setattr("missions.cli.bodies.sitl_signing.now", lambda: next(seconds) * 100_000)
    return "--signing-key", str(path), "--duration", "2"


def test_keys_that_can_not_be_stored_are_refused_at_once(key: tuple[str, ...], tmp_path: Path) -> None:
    store = tmp_path / "nowhere" / "store"
    done = CliRunner().invoke(command_line, [*QUICK, *key, "--signing-store", str(store)])
    assert done.exit_code == 2
    assert f"can't write {store}: No such file or directory" in done.output
    assert "starting" not in done.output


@pytest.mark.slow
def test_keys_that_can_not_be_stored_any_more_do_not_end_the_flight(
    key: tuple[str, ...], tmp_path: Path, in_flight: Callable[..., None]
) -> None:
    folder = tmp_path / "stored"
    folder.mkdir()
    in_flight(lambda: shutil.rmtree(folder))
    done = sitl(*key, "--signing-store", str(folder / "store"))
    assert done.return_value == 1 and "stopped at 2.0 s" in done.output
    reported = (
        f"flightstack: can't write {folder / 'store'}: No such file or directory; signing keys and times"
    )
    assert done.output.count(reported) == 1


@pytest.mark.slow
def test_pictures_that_are_lost_are_reported_and_the_command_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    def lose(
        world: Sitl, video: str | None, rate_hz: float, pictures: Path | None, on_loss: Callable[[str], None]
    ) -> None:
        assert rate_hz == 5.0
        on_loss("can't write photo IMG_0000.jpg: No space left on device")

    monkeypatch.setattr("missions.cli.bodies.sitl.start_video", lose)
    done = sitl("--duration", "1", "--video-rate", "5")
    assert done.return_value == 1 and "stopped at 1.0 s" in done.output
    assert "flightstack: can't write photo IMG_0000.jpg: No space left on device\n" in done.output


def test_a_log_ends_once(capsys: pytest.CaptureFixture[str]) -> None:
    losses = Losses()
    assert not losses.any
    losses.log_ended("full")
    losses.log_ended("full")
    assert losses.any and capsys.readouterr().err.count("full") == 1
