"""What a user can get wrong: one clear line that names the value and what is accepted, the right exit code,
no traceback, and nothing overwritten.
"""

import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from missions.cli.main import run_command_line
from tests.clients.sitl_process import free_port
from tests.system.runs import SHORT, Run, start, started

USAGE, FAILED = 2, 1

FLY = {
    # arguments: what the line must say
    "nosuch": ("'nosuch' is not known", "lissajous, sector"),
    "nosuch.py": ("nosuch.py does not exist",),
    "lissajous --pattern L9": ("'L9' is not known", "L1, L2, L3, L4"),
    "lissajous --size 0": ("width 0 m", "more than 0"),
    "lissajous --size 0.001": ("--size 0.001 m", "1 m or more"),
    "lissajous --size 100x0": ("height 0 m", "more than 0"),
    "lissajous --size -5": ("width -5 m", "more than 0"),
    "lissajous --size nan": ("'--size': 'nan'", "two numbers"),
    "lissajous --size inf": ("'--size': 'inf'", "two numbers"),
    "lissajous --size 1x2x3": ("'--size': '1x2x3'", "two numbers"),
    "lissajous --size 1e9": ("km long", "100 km", "--size"),
    "lissajous --amplitude-x nan": ("--size nan is not a finite number",),
    "lissajous --amplitude-y inf": ("--size inf is not a finite number",),
    "lissajous --altitude nan": ("--altitude nan is not a finite number",),
    "lissajous --altitude inf": ("--altitude inf is not a finite number",),
    "lissajous --altitude -5": ("altitude -5 m", "1.5..120 m"),
    "lissajous --altitude 500": ("altitude 500 m", "1.5..120 m"),
    "lissajous --speed nan": ("--speed nan",),
    "lissajous --speed nan --search-time 60": ("--speed nan",),
    "lissajous --speed inf": ("--speed inf",),
    "lissajous --speed 0": ("--speed 0 m/s", "0.1..150 m/s"),
    "lissajous --speed -1": ("--speed -1 m/s", "0.1..150 m/s"),
    "lissajous --speed 0.01": ("--speed 0.01 m/s", "0.1..150 m/s"),
    "lissajous --speed 30": ("speed 30 m/s", "..12 m/s"),
    "lissajous --autopilot ardupilot --speed 11": ("speed 11 m/s", "..10 m/s"),
    "lissajous --period 60": ("--period needs --via setpoints",),
    "lissajous --via setpoints --period nan": ("--period nan",),
    "lissajous --via setpoints --period 0.001": ("period 0.001 s", "ask for --period"),
    "lissajous --periods nan": ("--periods nan",),
    "lissajous --periods inf": ("--periods inf",),
    "lissajous --periods 1e12": ("--periods 1e+12", "more than 0, up to 1000"),
    "lissajous --periods 900": ("km long", "--periods"),
    "lissajous --search-time nan": ("--search-time nan",),
    "lissajous --search-time -1": ("--search-time -1",),
    "lissajous --search-time 1e12": ("--search-time 1e+12", "up to 86400 s"),
    "lissajous --search-time 80000": ("km long", "--search-time"),
    "lissajous --ratio 0:1": ("--ratio 0 is not possible", "more than 0"),
    "lissajous --ratio 1:-3": ("--ratio -3 is not possible", "more than 0"),
    "lissajous --ratio nan": ("'--ratio': 'nan'",),
    "lissajous --ratio abc": ("'--ratio': 'abc'",),
    "lissajous --ratio 1:1e9": ("km long", "--ratio"),
    "lissajous --phase nan": ("'--phase': 'nan'",),
    "lissajous --phase 1e300": ("--phase 1e+300", "3600"),
    "lissajous --heading nan": ("--heading is for sector", "not for lissajous"),
    "sector --heading inf": ("'--heading': inf", "degrees"),
    "sector --periods 1.5": ("--periods 1.5", "whole passes"),
    "sector --periods 1000": ("km long", "--periods"),
    "parallel-sweep --spacing nan": ("--spacing nan",),
    "parallel-sweep --spacing 1e-9": ("km long", "--spacing"),
    "parallel-sweep --spacing 1e9": ("track spacing 1e+09 m", "below 100 m"),
    "expanding-square --spacing 1e-9": ("km long", "--spacing"),
    "lissajous --acceptance nan": ("--acceptance nan",),
    "lissajous --acceptance 1e300": ("--acceptance 1e+300 m", "0.1..1000 m"),
    "lissajous --rate nan": ("--rate nan Hz", "2.5..100 Hz"),
    "lissajous --rate 1e9": ("--rate 1e+09 Hz", "2.5..100 Hz"),
    "lissajous --vehicles 0": ("--vehicles 0 is not in 1..250",),
    "lissajous --vehicles 2 --separation nan": ("--separation nan",),
    "lissajous --vehicles 2 --separation 1e9": ("altitude 1e+09 m", "1.5..120 m"),
    "lissajous --autopilot foo": ("'foo'", "'px4', 'ardupilot'"),
    "lissajous --model nosuch": ("'nosuch' is unknown", "iris"),
    "lissajous --model /tmp": ("/tmp",),
    "lissajous --home 1,2": ("home '1,2'", "lat,lon,alt"),
    "lissajous --home nan,0,0": ("home latitude nan", "-89.9..89.9"),
    "lissajous --home 100,0,0": ("home latitude 100", "-89.9..89.9"),
    "lissajous --home 47,8,inf": ("home altitude inf", "9000 m"),
    "lissajous --home 47,8,489,nan": ("home heading nan", "360"),
    "lissajous --home ,,,": ("home ',,,'", "lat,lon,alt"),
    "lissajous --seed -1": ("--seed -1 is not possible", "0 or more"),
    "lissajous --seed x": ("'x'",),
    "lissajous --wind nan": ("wind 'nan'", "0..40 m/s"),
    "lissajous --wind 5@nan": ("wind '5@nan'", "degrees"),
    "lissajous --wind -3": ("wind '-3'", "0..40 m/s"),
    "lissajous --wind 1000": ("wind '1000'", "0..40 m/s"),
    "lissajous --wind strong": ("wind 'strong'", "5@270"),
    "lissajous --turbulence foo": ("'foo'", "'moderate'"),
    "lissajous --speedup 0": ("--speedup 0 is not in 0.001..1e+06",),
    "lissajous --speedup nan": ("--speedup nan is not in 0.001..1e+06",),
    "lissajous --speedup inf": ("inf",),
    "lissajous --speedup 1e-300": ("--speedup 1e-300 is not in 0.001..1e+06",),
    "lissajous --arg foo=1": ("--arg is for a mission of your own",),
    "lissajous --on-failure foo": ("'foo'", "'return', 'land', 'hold'"),
    "lissajous --bogus": ("--bogus",),
    "lissajous --params /nosuch.params": ("/nosuch.params can't be read", "No such file"),
    "lissajous --params /": ("/ can't be read", "directory"),
    "lissajous --connect foo": ("'foo'", "udpin:HOST:PORT"),
    "lissajous --connect udpin:127.0.0.1:99999": ("port '99999'", "65535"),
    "lissajous --connect tcp:127.0.0.1:1": ("tcp:127.0.0.1:1", "nothing listens there"),
    "lissajous --yes --connect serial:/dev/nosuch:57600": ("serial:/dev/nosuch:57600", "no such device"),
    "lissajous --yes --connect /dev/null,57600": ("/dev/null", "check the device"),
    "lissajous --connect /dev/null,0": ("baud rate '0'",),
    "lissajous --connect nosuch.tlog": ("nosuch.tlog", "a log can't be flown"),
    "lissajous --yes --connect udpin:192.0.2.1:14550": ("192.0.2.1", "no interface"),
    "lissajous --connect udpout:127.0.0.1:9 --vehicles 2": ("1 connections for 2 vehicles", "--connect"),
    "": ("Missing argument 'MISSION'",),
}

SITL = {
    "--link foo": ("'foo'", "udpin:HOST:PORT"),
    "--link serial:/dev/nosuch:57600": ("/dev/nosuch", "no such device"),
    "--link tcp:127.0.0.1:1": ("tcp:127.0.0.1:1", "nothing listens there"),
    "--link udpin:127.0.0.1:0 --speedup nan": ("--speedup nan is not in 0..1e+06",),
    "--link udpin:127.0.0.1:0 --speedup inf": ("inf",),
    "--link udpin:127.0.0.1:0 --speedup 1e-300": ("1e-300", "0 is as fast as possible"),
    "--link udpin:127.0.0.1:0 --duration nan": ("--duration nan is not possible",),
    "--link udpin:127.0.0.1:0 --home 1": ("home '1'", "lat,lon,alt"),
    "--link udpin:127.0.0.1:0 --model x": ("'x' is unknown", "iris"),
    "--link udpin:127.0.0.1:0 --wind nan": ("wind 'nan'", "0..40 m/s"),
    "--link udpin:127.0.0.1:0 --params /nosuch.params": ("/nosuch.params",),
    "--count 0": ("--count 0 is not in 1..250",),
}


def refused(capsys: pytest.CaptureFixture[str], arguments: list[str], exit_code: int = USAGE) -> str:
    """Run the command line; the one line it says on stderr, without notices (slow start, open link)."""
    assert run_command_line(arguments) == exit_code
    out, err = capsys.readouterr()
    notices = ("starting", "compiling the flight code", "flightstack: warning: ")
    lines = [line for line in err.splitlines() if not line.startswith(notices)]
    assert len(lines) == 1, err
    assert lines[0].startswith("flightstack: ")
    assert out == "" or exit_code == FAILED
    return lines[0]


@pytest.mark.parametrize("arguments", FLY)
def test_fly_says_what_is_wrong(
    arguments: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    line = refused(capsys, ["fly", *arguments.split()])
    for words in FLY[arguments]:
        assert words in line
    assert list(tmp_path.iterdir()) == []  # nothing was begun


@pytest.mark.parametrize("arguments", SITL)
def test_sitl_says_what_is_wrong(arguments: str, capsys: pytest.CaptureFixture[str]) -> None:
    line = refused(capsys, ["sitl", *arguments.split()])
    for words in SITL[arguments]:
        assert words in line


def test_unknown_command_and_none(capsys: pytest.CaptureFixture[str]) -> None:
    assert "no command 'swim'; there are fly, sitl" in refused(capsys, ["swim"])
    assert run_command_line([]) == USAGE
    assert "Usage: flightstack" in capsys.readouterr().err


PARAMETER_FILES = {
    b"MPC_XY_VEL_MAX\n": ("line 1", "NAME VALUE"),
    b"# comment\nMPC_XY_VEL_MAX fast\n": ("line 2", "MPC_XY_VEL_MAX", "fast"),
    b"MPC_XY_VEL_MAX nan\n": ("line 1",),
    b"MPC_XY_VEL_MAX inf\n": ("line 1",),
    b"MPC_XY_VEL_MAX -1\n": ("MPC_XY_VEL_MAX", "-1"),
    b"MPC_XY_VEL_MAX 1e30\n": ("MPC_XY_VEL_MAX", "1e+30"),
    b"A_NAME_OF_SEVENTEEN 1\n": ("line 1",),
    b"\xff\xfe\x00\x01": ("can't be read", "text"),
}


@pytest.mark.parametrize("content", PARAMETER_FILES)
def test_malformed_parameter_file(content: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "vehicle.params"
    path.write_bytes(content)
    line = refused(capsys, ["fly", "lissajous", "--params", str(path), "--out", str(tmp_path / "run")])
    for words in PARAMETER_FILES[content]:
        assert words in line
    assert not (tmp_path / "run").exists()


def test_a_run_folder_is_never_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kept = tmp_path / "flight.tlog"
    kept.write_bytes(b"precious")
    line = refused(capsys, ["fly", "lissajous", "--out", str(tmp_path)])
    assert str(tmp_path) in line and "overwritten" in line and "--out" in line
    assert list(tmp_path.iterdir()) == [kept] and kept.read_bytes() == b"precious"
    line = refused(capsys, ["fly", "lissajous", "--out", str(kept)])
    assert str(kept) in line
    assert kept.read_bytes() == b"precious"
    assert "can't make the run folder" in refused(capsys, ["fly", "lissajous", "--out", "/proc/run"])


@pytest.mark.parametrize("kind", ["udp", "tcp"])
def test_busy_port(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket(socket.AF_INET, {"udp": socket.SOCK_DGRAM, "tcp": socket.SOCK_STREAM}[kind]) as busy:
        busy.bind(("127.0.0.1", 0))
        if kind == "tcp":
            busy.listen()
        address = f"{kind}in:127.0.0.1:{busy.getsockname()[1]}"
        for arguments in (["fly", "lissajous", "--connect", address], ["sitl", "--link", address]):
            line = refused(capsys, arguments)
            assert address in line and "in use" in line


@pytest.fixture(scope="module")
def no_vehicle_there(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Run]:
    """A flight that waits for a vehicle that never comes."""
    folder = tmp_path_factory.mktemp("no_vehicle") / "run"
    address = f"udpin:127.0.0.1:{free_port()}"
    with started(folder, *SHORT, "--connect", address) as run:
        yield run


@pytest.mark.parametrize("arguments", ["fly lissajous --altitude nan", "sitl --link foo"])
@pytest.mark.sampled(1)
def test_as_a_process(arguments: str) -> None:
    """The same from a real process: one line, exit code 2, nothing on stdout."""
    command = [sys.executable, "-m", "missions", *arguments.split()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100.0, check=False)
    lines = [line for line in done.stderr.splitlines() if not line.startswith(("starting", "compiling"))]
    assert (done.returncode, done.stdout, len(lines)) == (USAGE, "", 1)


def test_a_parameter_out_of_range_is_refused(tmp_path: Path) -> None:
    """By the tables of the flavour that flies."""
    path = tmp_path / "vehicle.parm"
    path.write_text("ATC_RAT_RLL_P 1e12\n")
    run = start(tmp_path / "run", "lissajous", "--autopilot", "ardupilot", "--params", str(path))
    assert "ATC_RAT_RLL_P" in run.finish(exit_code=USAGE)


@pytest.mark.slow
def test_no_heartbeat(no_vehicle_there: Run) -> None:
    """Fails with a line that says where no vehicle was received, leaves a whole run folder, exit code 1."""
    text = no_vehicle_there.finish(exit_code=FAILED)
    assert "no vehicle was received on udpin:127.0.0.1" in text
    assert len([line for line in text.splitlines() if line.startswith("flightstack: ")]) == 1
    summary = no_vehicle_there.summary
    assert summary["outcome"] == "failed"
    assert "no vehicle was received" in summary["reason"]
    assert set(summary["message_counts"]) <= {"HEARTBEAT"}
