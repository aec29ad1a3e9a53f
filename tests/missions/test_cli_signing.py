"""Signing on the command line: keys from files, and the warning for links that are open to a network."""

import hashlib
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from autopilot_bridge.links import Reach, listens_to_network, open_link, parse_address, reach_of
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, LinkSigning, SigningState, dialect
from autopilot_bridge.tlog import TlogWriter
from missions.cli.main import command_line
from missions.vehicle.signing import read_key

SHORT = ("--speedup", "0", "--duration", "2", "--no-wait")
NETWORK = "udpin:0.0.0.0:0"


def flightstack(*arguments: str) -> Result:
    return CliRunner().invoke(command_line, list(arguments))


@pytest.fixture
def key_file(tmp_path: Path) -> Path:
    path = tmp_path / "key"
    path.write_text("pass phrase\n")
    return path


@pytest.mark.parametrize(
    ("address", "reach", "listens"),
    [
        ("udpin:127.0.0.1:1", Reach.MACHINE, False),
        ("udpin:localhost:1", Reach.MACHINE, False),
        ("tcpin:[::1]:1", Reach.MACHINE, False),
        ("udpin:0.0.0.0:1", Reach.NETWORK, True),
        ("tcpin:[::]:1", Reach.NETWORK, True),
        ("udppeer:0.0.0.0:1,127.0.0.1:2", Reach.NETWORK, True),
        ("udppeer:127.0.0.1:1,192.168.1.2:2", Reach.MACHINE, False),
        ("udpout:192.168.1.2:1", Reach.NETWORK, False),
        ("tcp:drone.local:5760", Reach.NETWORK, False),
        ("/dev/ttyACM0,57600", Reach.CABLE, False),
        ("flight.tlog", Reach.CABLE, False),
    ],
)
def test_who_can_get_at_a_link(address: str, reach: Reach, listens: bool) -> None:
    assert reach_of(parse_address(address)) is reach
    assert listens_to_network(parse_address(address)) is listens


def test_a_link_open_to_the_network_is_warned_of_in_one_line() -> None:
    done = flightstack("sitl", *SHORT, "--link", NETWORK)
    assert done.exit_code == 0
    (line,) = [line for line in done.output.splitlines() if "warning" in line]
    assert NETWORK in line and "unsigned" in line and "--signing-key" in line


@pytest.mark.parametrize(
    ("options", "warned", "how"),
    [
        (("--link", "udpin:127.0.0.1:0"), False, ", signatures required"),
        (("--link", "tcpin:127.0.0.1:0"), False, ", signatures required"),
        (("--link", "udpin:127.0.0.1:0", "--unsigned", "none"), False, ", signatures required"),
        (
            ("--link", "udpin:127.0.0.1:0", "--unsigned", "local"),
            False,
            ", signed; takes unsigned frames too",
        ),
        (("--link", NETWORK), False, ", signatures required"),
        (("--link", NETWORK, "--unsigned", "all"), True, ", signed; takes unsigned frames too"),
    ],
)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_the_links_of_a_sitl_say_what_they_take(
    options: tuple[str, ...], warned: bool, how: str, key_file: Path
) -> None:
    done = flightstack("sitl", *SHORT, "--signing-key", str(key_file), *options)
    assert done.exit_code == 0
    assert ("warning" in done.output) is warned
    assert f"onboard{how}\n" in done.output


COMMANDS = {
    "sitl": ("sitl", *SHORT, "--link", "udpin:127.0.0.1:0"),
    "fly": ("fly", "lissajous", "--connect", "udpin:127.0.0.1:0"),
    "estimate": ("estimate", "attitude", "--connect", "udpin:127.0.0.1:0"),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_link_that_does_not_open_is_not_warned_of(command: str) -> None:
    busy = open_link("udpin:0.0.0.0:0")
    port = busy.port  # type: ignore[attr-defined, union-attr]
    unasked = ("--yes",) if command == "fly" else ()
    words = [word.replace("127.0.0.1:0", f"0.0.0.0:{port}") for word in COMMANDS[command]]
    done = flightstack(*words, *unasked)
    busy.close()
    assert done.exit_code == 2 and str(port) in done.output
    assert "warning" not in done.output


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("content", [None, b"", b"\0" * 32, b"two\nlines"])
def test_a_file_without_a_key_is_refused_by_name(command: str, content: bytes | None, tmp_path: Path) -> None:
    path = tmp_path / "no.key"
    if content is not None:
        path.write_bytes(content)
    done = flightstack(*COMMANDS[command], "--signing-key", str(path))
    assert done.exit_code == 2
    assert str(path) in done.output and "Traceback" not in done.output


def test_an_embedded_flight_has_no_signatures(key_file: Path) -> None:
    done = flightstack("fly", "lissajous", "--signing-key", str(key_file))
    assert done.exit_code == 2 and "--connect" in done.output


def test_a_store_of_keys_that_is_none_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "store"
    path.write_text("what?\n")
    done = flightstack("sitl", *SHORT, "--link", "udpin:127.0.0.1:0", "--signing-store", str(path))
    assert done.exit_code == 2 and str(path) in done.output and path.read_text() == "what?\n"


def test_a_log_is_played_under_a_key(tmp_path: Path, key_file: Path) -> None:
    """Frames that were signed with another key get the signature of the player."""
    other = LinkSigning(SigningState(read_key(key_file), clock=lambda: 5), link_id=3)
    encoder = FrameEncoder(1, 1)
    with TlogWriter(tmp_path / "flight.tlog") as log:
        for number in range(40):
            raw = encoder.encode(dialect.MAVLink_attitude_message(number, 0, 0, 0, 0, 0, 0))
            log.write(1_700_000_000_000_000 + number * 1000, other.sign(raw) if number % 2 else raw)
    listening = open_link("udpin:127.0.0.1:0")
    arguments = (
        *("log", "play", str(tmp_path / "flight.tlog"), "--speed", "max"),
        *("--link", f"udpout:127.0.0.1:{listening.port}", "--signing-key", str(key_file)),  # type: ignore[attr-defined, union-attr]
    )
    assert "played: 40 frames" in flightstack(*arguments).output
    parser = FrameParser()
    frames = [frame for _, data in listening.receive() for frame in parser.feed(data)]
    listening.close()
    checking = LinkSigning(SigningState(read_key(key_file), clock=lambda: 0), link_id=0)
    assert len(checking.admit(frames)) == len(frames) == 40


def test_the_key_is_that_of_other_ground_stations(key_file: Path) -> None:
    assert read_key(key_file).secret == hashlib.sha256(b"pass phrase").digest()


def test_a_key_that_other_users_can_read_is_warned_of(key_file: Path) -> None:
    key_file.chmod(0o644)
    done = flightstack("sitl", *SHORT, "--link", "udpin:127.0.0.1:0", "--signing-key", str(key_file))
    (line,) = [line for line in done.output.splitlines() if "warning" in line]
    assert f"chmod 600 {key_file}" in line
    key_file.chmod(0o600)
    done = flightstack("sitl", *SHORT, "--link", "udpin:127.0.0.1:0", "--signing-key", str(key_file))
    assert "warning" not in done.output
