"""`flightstack sitl --model aerosonde`: clients come and go, rudely too, and the aircraft flies on."""

import contextlib
import random
import socket
import struct

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mavlink

from tests.clients.sitl_process import free_port, running_sitl
from tests.system.runs import wait_until

TAKEOFF_MODE = {"px4": (4, 2), "ardupilot": (13, 0)}
RETURN_MODE = {"px4": (4, 5), "ardupilot": (11, 0)}
RETURN_NUMBER = {"px4": 0x05040000, "ardupilot": 11}
SPEEDUP = 15.0


class Client:
    """Another person's client on TCP, with mavutil."""

    def __init__(self, port: int) -> None:
        self.link = mavutil.mavlink_connection(f"tcp:127.0.0.1:{port}", dialect="all", source_system=255)

    def ask(self, command: int, *parameters: float) -> None:
        values = (*parameters, *(0.0,) * (7 - len(parameters)))
        self.link.mav.command_long_send(1, 1, command, 0, *values)

    def receive(self, kind: str) -> object:
        """The next message of a kind, or None within a tenth of a second."""
        self.link.mav.heartbeat_send(6, 8, 0, 0, 4)
        return self.link.recv_match(type=kind, blocking=True, timeout=0.1)

    def insists(self, kind: str, requested: int, parameters: tuple[float, ...], **expected: float) -> None:
        """Ask until it is seen."""

        def done() -> bool:
            self.ask(requested, *parameters)
            message = self.receive(kind)
            return message is not None and all(getattr(message, k) == v for k, v in expected.items())

        wait_until(done, 60.0)

    def climbs_above(self, height_m: float) -> None:
        def high() -> bool:
            position = self.receive("GLOBAL_POSITION_INT")
            return position is not None and position.relative_alt > 1000.0 * height_m  # type: ignore[attr-defined]

        wait_until(high, 60.0)

    def leave(self) -> None:
        self.link.close()


def rude(port: int, rng: random.Random) -> None:
    """Connect, perhaps speak nonsense or half a frame, and be gone, with a reset."""
    with contextlib.suppress(ConnectionError), socket.create_connection(("127.0.0.1", port)) as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        client.sendall(rng.randbytes(rng.choice((0, 1, 300))) + b"\xfd\x09")


@pytest.mark.slow
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_clients_come_and_go(flavour: str) -> None:
    port = free_port(socket.SOCK_STREAM)
    rng = random.Random(1)
    options = ["--model", "aerosonde", "--wind", "4@200"]
    with running_sitl(flavour, [f"tcpin:127.0.0.1:{port}"], speedup=SPEEDUP, options=options) as sitl:
        first = Client(port)
        main, sub = TAKEOFF_MODE[flavour]
        first.insists("COMMAND_ACK", 176, (1, main, sub), command=mavlink.MAV_CMD_DO_SET_MODE, result=0)
        first.insists("COMMAND_ACK", 400, (1,), command=mavlink.MAV_CMD_COMPONENT_ARM_DISARM, result=0)
        first.climbs_above(15.0)
        first.leave()
        for _ in range(20):
            rude(port, rng)
        several = [Client(port) for _ in range(4)]
        for client in several:
            client.climbs_above(20.0)
        for client in several:
            client.leave()
        last = Client(port)
        main, sub = RETURN_MODE[flavour]
        last.insists("HEARTBEAT", 176, (1, main, sub), custom_mode=RETURN_NUMBER[flavour])
        last.climbs_above(20.0)
        last.leave()
        assert sitl.process.poll() is None
    assert sitl.process.returncode == 0
    assert not any("Traceback" in line for line in sitl.lines)
    assert any(line.startswith("stopped at") for line in sitl.lines), sitl.lines
