"""`flightstack sitl` as a process: links shared, lost and refused, and how it ends."""

import signal
import socket
import struct
import time
from collections.abc import Callable
from typing import Any

import pytest
from pymavlink import mavutil

from tests.clients.forked_process import flightstack_done
from tests.clients.mavutil_link import mavutil_link
from tests.clients.sitl_process import free_port, running_sitl

mavlink = mavutil.mavlink
WALL_DEADLINE_S = 100.0


def connect(url: str, system_id: int = 255) -> Any:
    return mavutil_link(url, source_system=system_id)


def until(link: Any, kind: str, found: Callable[[Any], bool] = lambda message: True) -> Any:
    """The first such message, with a deadline."""
    deadline_s = time.monotonic() + WALL_DEADLINE_S
    while time.monotonic() < deadline_s:
        link.mav.heartbeat_send(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)
        message = link.recv_match(type=kind, blocking=True, timeout=0.2)
        if message is not None and found(message):
            return message
    raise AssertionError(f"no such {kind} from {link.address}")


def reset(port: int) -> None:
    """A TCP client that goes away as a killed process does: without reading, without a word."""
    client = socket.create_connection(("127.0.0.1", port))
    client.recv(64)
    client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    client.close()


def test_clients_share_links_and_one_that_dies_in_flight_disturbs_no_other() -> None:
    tcp, udp = free_port(socket.SOCK_STREAM), free_port()
    with running_sitl("px4", [f"tcpin:127.0.0.1:{tcp}", f"udpin:127.0.0.1:{udp}"]) as sitl:
        first, second = connect(f"tcp:127.0.0.1:{tcp}"), connect(f"tcp:127.0.0.1:{tcp}", 254)
        third = connect(f"udpout:127.0.0.1:{udp}", 253)
        prearm = mavlink.MAV_SYS_STATUS_PREARM_CHECK
        for link in (first, second, third):
            until(link, "SYS_STATUS", lambda m: bool(m.onboard_control_sensors_health & prearm))
        first.mav.command_long_send(1, 1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 1, *(0.0,) * 6)
        assert until(first, "COMMAND_ACK").result == mavlink.MAV_RESULT_ACCEPTED
        nan = float("nan")
        first.mav.command_long_send(1, 1, mavlink.MAV_CMD_NAV_TAKEOFF, 0, *(nan,) * 7)
        until(third, "GLOBAL_POSITION_INT", lambda m: m.relative_alt > 500)
        reset(tcp)
        first.close()
        until(second, "GLOBAL_POSITION_INT", lambda m: m.relative_alt > 2000)
        until(third, "HEARTBEAT", lambda m: m.get_srcSystem() == 1 and m.base_mode & 128)
        third.recv_match(type="COMMAND_ACK")  # answers go only where the question came from
        assert "COMMAND_ACK" not in third.messages
        second.close()
        third.close()
        assert sitl.process.poll() is None


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_cleanly(number: signal.Signals) -> None:
    with running_sitl("ardupilot", [f"tcpin:127.0.0.1:{free_port(socket.SOCK_STREAM)}"]) as sitl:
        sitl.process.send_signal(number)
        assert sitl.process.wait(60.0) == 0
    assert sitl.lines[-1].startswith("stopped at")
    assert any("tcpin:127.0.0.1" in line for line in sitl.lines)


def test_a_busy_port_is_one_line_and_no_flight() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        link = f"udpin:127.0.0.1:{taken.getsockname()[1]}"
        done = flightstack_done("sitl", "--link", link, timeout=60.0)
    assert done.returncode in (1, 2)
    *_, last = done.stderr.splitlines()
    assert link in last and "in use" in last
    assert "Traceback" not in done.stderr and "ready" not in done.stdout
