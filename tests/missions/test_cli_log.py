"""`flightstack log`: what a person types, and what is said of it."""

import contextlib
import json
import socket
import threading

import pytest

from autopilot_bridge.mavlink import FrameParser
from autopilot_bridge.tlog import TlogReader
from estimators.logs import open_log
from missions.cli.main import run_command_line
from tests.clients.sitl_process import free_port
from tests.estimators.logs.flight_log import RATE_HZ, SECONDS, write

COUNT = SECONDS * RATE_HZ


@pytest.fixture
def flight(tmp_path):
    return write(tmp_path / "flight.tlog")


@pytest.fixture
def log(capsys):
    def run(*arguments):
        code = run_command_line(["log", *map(str, arguments)])
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


def test_info(log, flight):
    code, out, _ = log("info", flight)
    assert code == 0
    assert "vehicle 1: ARDUPILOTMEGA QUADROTOR" in out and "GUIDED" in out
    assert any(
        line.split()[:5] == ["1/1", "RAW_IMU", str(COUNT), "20.00", "0.05"] for line in out.splitlines()
    )
    code, out, _ = log("info", flight, "--json")
    report = json.loads(out)
    assert code == 0 and sum(report["bytes_by_kind"].values()) == report["size_bytes"]


def test_export(log, flight, tmp_path):
    code, out, _ = log(
        "export", flight, "--types", "ATTITUDE,RAW_IMU", "--format", "parquet", "--source-system", 1
    )
    assert code == 0 and "2 files in" in out
    names = sorted(path.name for path in (tmp_path / "flight-parquet").iterdir())
    assert names == ["ATTITUDE_1_1.parquet", "RAW_IMU_1_1.parquet"]
    code, _, err = log("export", flight, "--format", "parquet")
    assert code == 1 and "overwritten" in err


def test_what_is_not_there_is_reported(log, flight, tmp_path):
    code, _, err = log("cut", flight, tmp_path / "part.tlog", "--types", "ATTITUDE,HIGHRES_IMU")
    assert code == 0 and err.endswith("flight.tlog has no HIGHRES_IMU\n")


def test_cut_by_time_and_condition(log, flight, tmp_path):
    out = tmp_path / "guided.tlog"
    code, said, _ = log("cut", flight, out, "--condition", "HEARTBEAT.custom_mode == 4", "--to", 13)
    assert code == 0 and f"of {len(open_log(flight))} messages" in said
    cut = open_log(out)
    assert cut.table("HEARTBEAT")["custom_mode"].tolist() == [4] * 3
    assert cut.duration_s == pytest.approx(2.95)
    assert cut.systems == (1,)  # of vehicle 2 no mode is known


def test_mutate(log, flight, tmp_path):
    out = tmp_path / "bad.tlog"
    code, _, _ = log(
        "mutate", flight, out, "--fault", "gps:off@7-11", "--fault", "gyro:noise=0.1", "--seed", 3
    )
    assert code == 0
    assert len(open_log(out).table("GPS_RAW_INT")) < len(open_log(flight).table("GPS_RAW_INT"))
    again = tmp_path / "again.tlog"
    log("mutate", flight, again, "--fault", "gps:off@7-11", "--fault", "gyro:noise=0.1", "--seed", 3)
    assert again.read_bytes() == out.read_bytes()


def test_play_to_a_link(log, flight):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        receiver.settimeout(10.0)
        parser, received = FrameParser(), []

        def listen():
            while len(received) < 150:
                received.extend(parser.feed(receiver.recv(4096)))

        listener = threading.Thread(target=listen)
        listener.start()
        url = f"udpout:127.0.0.1:{receiver.getsockname()[1]}"
        code, out, _ = log(
            "play", flight, "--link", url, "--speed", 20, "--from", 10, "--types", "ATTITUDE,HEARTBEAT"
        )
        listener.join()
    assert code == 0 and "played: 205 frames" in out
    expected = [frame.raw for _, frame in TlogReader(flight) if frame.message_id in (0, 30)]
    assert [frame.raw for frame in received[:150]] == expected[-205:][:150]


def test_play_as_a_server_waits_for_a_client_and_loses_nothing(log, flight):
    """As fast as the client reads, though its window is small and it reads in bits."""
    port = free_port(socket.SOCK_STREAM)
    parser, received = FrameParser(), []

    def listen():
        deadline = threading.Event()
        for _ in range(5000):
            with contextlib.suppress(ConnectionRefusedError):
                client = socket.create_connection(("127.0.0.1", port))
                break
            deadline.wait(0.02)
        with client:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            while data := client.recv(1500):
                received.extend(frame.raw for frame in parser.feed(data))

    listener = threading.Thread(target=listen)
    listener.start()
    code, out, err = log("play", flight, "--link", f"tcpin:127.0.0.1:{port}", "--speed", "max")
    listener.join()
    expected = [frame.raw for _, frame in TlogReader(flight)]
    assert code == 0 and received == expected
    assert f"played: {len(expected)} frames, " in out and "waiting for a client" in err


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (("info", "nowhere.tlog"), 2, "nowhere.tlog does not exist"),
        (("info", "."), 2, "is a directory"),
        (("info", "{flight}", "--dialect", "klingon"), 2, "no MAVLink dialect 'klingon'"),
        (("info", "{empty}"), 1, "is empty"),
        (("info", "{junk}"), 1, "no valid"),
        (("export", "{flight}", "--types", "ATITUDE"), 2, "no message 'ATITUDE'"),
        (("export", "{flight}", "--types", ","), 2, "names no message"),
        (("export", "{flight}", "--condition", "os.system('x')"), 2, "is not possible"),
        (("export", "{flight}", "--condition", "ATTITUDE.bank > 1"), 2, "it has"),
        (("export", "{flight}", "--types", "HIGHRES_IMU"), 1, "nothing of"),
        (("cut", "{flight}", "{flight}"), 1, "is not overwritten"),
        (("cut", "{flight}", "out.tlog", "--from", "50"), 1, "it has 5.0 to 14.9 s"),
        (("cut", "{flight}", "out.tlog", "--from", "-1"), 2, "-1"),
        (("cut", "{flight}", "out.tlog", "--from", "5", "--to", "2"), 2, "--to 2 is not behind --from 5"),
        (("mutate", "{flight}", "out.tlog", "--fault", "gps:melt"), 2, "no kind 'melt'"),
        (("mutate", "{flight}", "out.tlog"), 2, "--fault"),
        (("play", "{flight}", "--link", "pigeon:1"), 2, "pigeon"),
        (("play", "{flight}", "--link", "udpout:127.0.0.1:9", "--speed", "0.01"), 2, "--speed 0.01"),
        (("play", "{flight}", "--link", "udpout:127.0.0.1:9", "--speed", "nan"), 2, "--speed nan"),
        (("melt", "{flight}"), 2, "melt"),
    ],
)
def test_bad_input_is_one_line(log, flight, tmp_path, monkeypatch, arguments, code, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.tlog").touch()
    (tmp_path / "junk.tlog").write_bytes(b"no log at all" * 100)
    before = flight.read_bytes()
    files = {"{flight}": flight, "{empty}": "empty.tlog", "{junk}": "junk.tlog"}
    got, out, err = log(*(files.get(text, text) for text in arguments))
    assert (got, out) == (code, "")
    assert says in err and err.count("\n") == 1
    assert flight.read_bytes() == before and not (tmp_path / "out.tlog").exists()
