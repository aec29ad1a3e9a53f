"""Does `flightstack sitl` keep real time, and every default stream its rate?

Starts the SITL as a process of its own for each flavour, listens as clients do (PX4: its onboard and its
ground-station link; ArduPilot: TCP, after REQUEST_DATA_STREAM at 4 Hz) and compares with the rates of
docs/firmware/px4.md (section 6) and docs/firmware/ardupilot.md (section 2): pace within 1 %, every stream
within 5 % (or one message) of its rate, by wall time and by vehicle time.

    python benchmarks/realtime_streams.py [--seconds 60] [--flavour px4|ardupilot]
"""

import argparse
import contextlib
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from autopilot_bridge.errors import LinkError
from autopilot_bridge.links import Link, open_link, parse_address
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, MAVLinkMessage, decode_as, dialect
from autopilot_bridge.mavlink.definitions import DEFINITIONS
from tests.clients.sitl_process import free_port
from tests.telemetry.test_default_streams import (
    ARDUPILOT_AT_4_HZ,
    NOT_ON_OUR_VEHICLE,
    PX4_GCS_HZ,
    PX4_ONBOARD_HZ,
)

PACE_TOLERANCE = 0.01
RATE_TOLERANCE = 0.05
SETTLE_S = {"px4": 6.0, "ardupilot": 45.0}  # vehicle seconds until every stream has something to say
ARDUPILOT_HZ = {**dict.fromkeys(sorted(ARDUPILOT_AT_4_HZ - NOT_ON_OUR_VEHICLE), 4.0), "HEARTBEAT": 1.0}


@dataclass
class Listener:
    """Counts what comes over one link.

    Attributes:
        counts: messages by name.
        boot_us, wall_s: vehicle and wall time of the newest message that carries a time since boot.
    """

    name: str
    link: Link
    wanted_hz: dict[str, float]
    counts: Counter[str] = field(default_factory=Counter)
    boot_us: int = 0
    wall_s: float = 0.0
    parser: FrameParser = field(default_factory=FrameParser)

    def poll(self) -> None:
        """Take what has arrived."""
        for _, data in self.link.receive():
            for frame in self.parser.feed(data):
                if frame.system_id != 1:  # the other listener's heartbeat, forwarded
                    continue
                known = DEFINITIONS.get(frame.message_id)
                self.counts[known.name if known else str(frame.message_id)] += 1
                if frame.message_id == dialect.MAVLINK_MSG_ID_ATTITUDE:
                    self.boot_us, self.wall_s = (
                        decode_as(frame, dialect.MAVLink_attitude_message).time_boot_ms * 1000,
                        time.monotonic(),
                    )

    def send(self, message: MAVLinkMessage) -> None:
        """Send as a ground station."""
        self.link.send(FrameEncoder(255, 190).encode(message))


def listen(listeners: list[Listener], seconds: float) -> None:
    """Poll for so many wall seconds, with a heartbeat a second."""
    end_s = time.monotonic() + seconds
    beat_s = 0.0
    while (now_s := time.monotonic()) < end_s:
        if now_s >= beat_s:
            beat_s = now_s + 1.0
            for listener in listeners:
                listener.send(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
        for listener in listeners:
            listener.poll()
        time.sleep(0.002)


@contextlib.contextmanager
def sitl(flavour: str) -> Iterator[list[Listener]]:
    """A SITL process and listeners on its links."""
    command = [sys.executable, "-m", "missions", "sitl", "--autopilot", flavour]
    if flavour == "px4":
        onboard, gcs = free_port(), free_port()
        command += ["--link", f"udpout:127.0.0.1:{onboard}", "--gcs-link", f"udpout:127.0.0.1:{gcs}"]
        names = {f"udpin:127.0.0.1:{onboard}": PX4_ONBOARD_HZ, f"udpin:127.0.0.1:{gcs}": PX4_GCS_HZ}
    else:
        port = free_port(socket.SOCK_STREAM)
        command += ["--gcs-link", f"tcpin:127.0.0.1:{port}"]
        names = {f"tcp:127.0.0.1:{port}": ARDUPILOT_HZ}
    roles = ("onboard", "gcs") if flavour == "px4" else ("4 Hz",)
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        while not (line := process.stdout.readline()).startswith("ready"):
            if not line:
                raise SystemExit("the SITL did not start")
        links = [_open(address) for address in names]
        yield [
            Listener(f"{flavour} {role}", link, dict(wanted))
            for role, link, wanted in zip(roles, links, names.values(), strict=True)
        ]
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(10.0)


def _open(address: str) -> Link:
    try:
        return open_link(parse_address(address))
    except LinkError as error:
        raise SystemExit(str(error)) from error


def measure(flavour: str, seconds: float) -> bool:
    """Print the table of one flavour; True when everything is within its tolerance."""
    with sitl(flavour) as listeners:
        listen(listeners, 1.0)
        if flavour == "ardupilot":
            for listener in listeners:
                listener.send(dialect.MAVLink_request_data_stream_message(1, 1, 0, 4, 1))
        listen(listeners, SETTLE_S[flavour])
        for listener in listeners:
            listener.counts.clear()
        starts = [(listener.boot_us, listener.wall_s) for listener in listeners]
        listen(listeners, seconds)
        good = True
        for listener, (boot_us, wall_s) in zip(listeners, starts, strict=True):
            vehicle_s, passed_s = (listener.boot_us - boot_us) * 1e-6, listener.wall_s - wall_s
            good &= _print(listener, vehicle_s, passed_s)
    return good


def _print(listener: Listener, vehicle_s: float, wall_s: float) -> bool:
    pace = vehicle_s / wall_s if wall_s > 0.0 else 0.0
    good = abs(pace - 1.0) <= PACE_TOLERANCE
    _line(f"\n{listener.name}: pace {pace:.4f} over {wall_s:.1f} s  {_verdict(good)}")
    _line(f"{'message':<28}{'wanted':>8}{'wall Hz':>10}{'vehicle Hz':>12}")
    for name, rate_hz in sorted(listener.wanted_hz.items(), key=lambda item: (-item[1], item[0])):
        count = listener.counts.pop(name, 0)
        within = all(
            abs(count - rate_hz * span_s) <= max(1.0, RATE_TOLERANCE * rate_hz * span_s)
            for span_s in (vehicle_s, wall_s)
        )
        good &= within
        by_wall_hz, by_vehicle_hz = count / wall_s, count / vehicle_s
        _line(f"{name:<28}{rate_hz:>8g}{by_wall_hz:>10.3f}{by_vehicle_hz:>12.3f}  {_verdict(within)}")
    if listener.counts:
        _line(f"not in the table: {dict(sorted(listener.counts.items()))}")
    return good


def _verdict(good: bool) -> str:
    return "pass" if good else "FAIL"


def _line(text: str) -> None:
    sys.stdout.write(text + "\n")


def main() -> int:
    """Measure the flavours requested."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0, help="wall seconds measured per flavour")
    parser.add_argument("--flavour", choices=("px4", "ardupilot"), action="append")
    options = parser.parse_args()
    results = [measure(flavour, options.seconds) for flavour in options.flavour or ("px4", "ardupilot")]
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
