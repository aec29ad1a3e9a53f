"""Programs that behave as a firmware's SITL does towards the world, written with pymavlink and plain sockets.

Each is run as a process: `python stand_ins.py px4|ardupilot ARGUMENT...`. The environment variable STAND_IN
says what it does beside answering: "end:N" ends after N steps, "deaf" never connects or sends, "plane" is a
fixed-wing aircraft.
"""

import json
import os
import re
import socket
import struct
import sys
import time
from pathlib import Path

GYRO_RATE_MAX_HZ = 400
THROTTLE = 0.62  # the quadrotor climbs slowly
PWM = 1000 + round(1000 * THROTTLE)


def behaviour() -> tuple[str, int]:
    name, _, number = os.environ.get("STAND_IN", "").partition(":")
    return name, int(number or 0)


def say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def px4(arguments: list[str]) -> None:
    os.environ["MAVLINK20"] = "1"
    from pymavlink.dialects.v20 import common as mavlink

    instance, etc = int(arguments[arguments.index("-i") + 1]), Path(arguments[-1])
    say("stand-in for PX4")
    what, number = behaviour()
    if what == "deaf":
        time.sleep(60)
    links = re.findall(r"-u (\d+) -r \d+ -o (\d+)", (etc / "init.d-posix/px4-rc.mavlink").read_text())
    own = int(
        re.search(r"MAV_SYS_ID (\d+)", (etc / "init.d-posix/px4-rc.mavlinksim").read_text()).group(1)  # type: ignore[union-attr]
    )
    sockets = []
    for port, other in links:
        each = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        each.bind(("127.0.0.1", int(port)))
        each.connect(("127.0.0.1", int(other)))
        each.setblocking(False)
        sockets.append(each)
    world = socket.create_connection(("127.0.0.1", 4560 + instance))
    reader, writer = mavlink.MAVLink(None), mavlink.MAVLink(None, srcSystem=own, srcComponent=1)
    steps = answered_us = 0
    while data := world.recv(4096):
        for message in reader.parse_buffer(data) or ():
            if message.get_type() != "HIL_SENSOR":
                continue
            if message.time_usec - answered_us < 1_000_000 / GYRO_RATE_MAX_HZ:
                continue  # as PX4's rate loop
            answered_us = message.time_usec
            steps += 1
            if what == "end" and steps > number:
                say("PX4 stand-in: end of its life")
                sys.exit(3)
            controls = [THROTTLE] * 4 + [0.0] * 12
            world.sendall(
                writer.hil_actuator_controls_encode(message.time_usec, controls, 128, 1).pack(writer)
            )
            if steps % 50 == 1:
                heartbeat = writer.heartbeat_encode(2, 12, 128 + 1, 0, 4).pack(writer)
                gimbal = mavlink.MAVLink(None, srcSystem=own, srcComponent=154)
                for each in sockets:
                    each.send(heartbeat)
                    each.send(gimbal.heartbeat_encode(26, 8, 0, 0, 4).pack(gimbal))
            for each in sockets:
                answer_pings(each, reader, writer)


def answer_pings(link: socket.socket, reader, writer) -> None:  # type: ignore[no-untyped-def]
    try:
        data = link.recv(4096)
    except (BlockingIOError, ConnectionError):
        return
    for message in reader.parse_buffer(data) or ():
        if message.get_type() == "PING":
            link.send(writer.ping_encode(7, message.seq, 255, 190).pack(writer))


def ardupilot(arguments: list[str]) -> None:
    os.environ["MAVLINK20"] = "1"
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    instance = int(arguments[arguments.index("--instance") + 1])
    what, number = behaviour()
    say("stand-in for ArduPilot")
    if what == "deaf":
        time.sleep(60)
    parameters = Path(arguments[arguments.index("--defaults") + 1]).read_text()
    own = int(re.search(r"SYSID_THISMAV (\d+)", parameters).group(1))  # type: ignore[union-attr]
    serial = arguments[arguments.index("--serial0") + 1].rpartition(":")[2]
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.connect(("127.0.0.1", int(serial)))
    writer = mavlink.MAVLink(None, srcSystem=own, srcComponent=1)
    world = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    world.connect(("127.0.0.1", 9002 + 10 * instance))
    frames = 0
    with Path("received.jsonl").open("w") as received:
        while True:
            world.send(struct.pack("<HHI16H", 18458, 400, frames, *[PWM] * 4, *[0] * 12))
            text = world.recv(4096).decode()
            # as its own reader: by the place of a name, and no space after it
            assert re.search(r'"gyro":\[[^ ]', text) and text.endswith("\n"), text
            json.loads(text)
            received.write(text.strip() + "\n")
            received.flush()
            frames += 1
            if frames % 50 == 1:
                link.send(writer.heartbeat_encode(1 if what == "plane" else 2, 3, 128, 0, 4).pack(writer))
            if what == "end" and frames > number:
                say("ArduPilot stand-in: end of its life")
                sys.exit(3)


if __name__ == "__main__":
    {"px4": px4, "ardupilot": ardupilot}[sys.argv[1]](sys.argv[2:])
