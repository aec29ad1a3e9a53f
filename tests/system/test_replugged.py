"""A serial device that is pulled out and put in again at the vehicle's end: it goes on where it was, deaf for
as long as it takes, and answers again on the same name.
"""

import os
import pty
import tty
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.links import Reach, SerialLink, SerialPort
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode
from autopilot_bridge.sitl import Sitl
from flightsim.world_spec import VehicleSpec, WorldSpec

BAUD = 57600
OUT_S = 5.0


class Cable:
    """A device of a name that stays the same, whatever it stands for; `far` is the other end."""

    def __init__(self, name: Path) -> None:
        self.name = name
        self.plug()

    def plug(self) -> None:
        self.far, self._near = pty.openpty()
        tty.setraw(self._near)
        os.set_blocking(self.far, False)
        self.name.symlink_to(os.ttyname(self._near))

    def unplug(self) -> None:
        self.name.unlink()
        os.close(self.far)
        os.close(self._near)


class Bench:
    """A vehicle at one end of a cable, and a client at the other."""

    def __init__(self, flavour: str, folder: Path) -> None:
        self.cable = Cable(folder / "ttyVehicle")
        self.sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(autopilot=flavour),)))
        self.link = SerialLink(
            SerialPort(str(self.cable.name), BAUD), monotonic=lambda: self.sitl.time_us * 1e-6
        )
        self.sitl.poll_every(20_000)
        self.sitl.vehicles[0].open(self.link, role="onboard", bytes_per_s=BAUD / 10, reach=Reach.CABLE)
        self._encoder = FrameEncoder(255, 190)
        self._parser = FrameParser()

    def run(self, seconds: float, *, listen: bool = True) -> list[Any]:
        """What is received at the other end in so many seconds of the vehicle's time."""
        received: list[Any] = []
        until_us = self.sitl.time_us + round(seconds * 1e6)
        while self.sitl.time_us < until_us:
            self.sitl.advance()
            if listen:
                try:
                    received += [decode(frame) for frame in self._parser.feed(os.read(self.cable.far, 65536))]
                except BlockingIOError:
                    continue
        return received

    def greet(self) -> list[Any]:
        """Ask who it is; the answers."""
        for command, number in ((512, 148.0), (511, 30.0)):
            message = mavlink.MAVLink_command_long_message(
                1, 1, command, 0, number, 1e5 if command == 511 else 0.0, 0, 0, 0, 0, 0
            )
            os.write(self.cable.far, self._encoder.encode(message))
        return self.run(2.0)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_the_vehicle_finds_its_line_again(flavour: str, tmp_path: Path) -> None:
    bench = Bench(flavour, tmp_path)
    try:
        bench.run(3.0)
        assert {"AUTOPILOT_VERSION", "COMMAND_ACK"} <= {m.get_type() for m in bench.greet()}
        bench.cable.unplug()
        bench.run(OUT_S, listen=False)
        assert not bench.link.connected and bench.link.counters.disconnects == 1
        bench.cable.plug()
        pulled_ms = (bench.sitl.time_us // 1000) - round(OUT_S * 1000)
        back = bench.run(3.0)
        assert bench.link.connected and bench.link.counters.connects == 2
        names = {m.get_type() for m in back}
        assert {"HEARTBEAT", "ATTITUDE"} <= names  # streams that were requested go on
        times_ms = [m.time_boot_ms for m in back if m.get_type() == "ATTITUDE"]
        assert min(times_ms) >= pulled_ms + OUT_S * 1000  # nothing stale
        assert {"AUTOPILOT_VERSION", "COMMAND_ACK"} <= {m.get_type() for m in bench.greet()}
    finally:
        bench.sitl.close()
        os.close(bench.cable.far)
