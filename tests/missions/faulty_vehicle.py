"""Faults of a vehicle, for flights of the scripted autopilot that goes wrong on the ground or in the air.

`inject(autopilot, name)` changes what a `FakeAutopilot` sends, answers and does. Faults in the air begin two
seconds after it has climbed above 8 m.
"""

import math
import random
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType

from autopilot_bridge.mavlink import FrameEncoder, dialect

WRAP_MS = 1 << 32
_HIGH_M = 8.0
_LATER_US = 2_000_000
_MANUAL = MappingProxyType({"px4": 1 << 16, "ardupilot": 0})


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A fault and the end of a flight with it.

    Attributes:
        reason: pattern of the reason of the failed flight; "": it is harmless, the flight completes.
        within_s: vehicle time in which the flight ends, from the boot of the vehicle.
        via: the only way of flying that it concerns; "": both.
        left: what the vehicle does at the end: "landed", "returning", "flying", or "" where it depends.
    """

    reason: str = ""
    within_s: float = 300.0
    via: str = ""
    left: str = "landed"


_TWO = "are not those of one vehicle"
FAULTS = {
    # time stamps: the flight is flown, and can't be judged by them
    "time stands still from the start": Fault(reason="time stamps stood still for .* is judged by them"),
    "time is always 0": Fault(reason="time stamps stood still for .* is judged by them"),
    "time stands still": Fault(reason="time stamps stood still for .* is judged by them"),
    "time is the last there is": Fault(reason="time stamps stood still for .* is judged by them"),
    "time steps back": Fault(reason="time stamps stepped back 1 times .* is judged by them", via="waypoints"),
    "time steps ahead": Fault(),
    "time wraps": Fault(reason="time stamps began again at 0 .* is judged by them"),
    "time steps to and fro": Fault(reason=f"{_TWO}: the time stamps stepped to and fro", left="returning"),
    # what it reports of itself
    "one heartbeat disarmed": Fault(),
    "heartbeats flip": Fault(reason=f"{_TWO}|has the vehicle|left the guided mode|disarmed before", left=""),
    "heartbeats stop": Fault(reason="no heartbeat for .* other messages of it are still received", left=""),
    "silence": Fault(reason="link lost: no heartbeat", left=""),
    "positions stop": Fault(reason="position", via="setpoints"),
    "positions are not numbers": Fault(reason="position", left=""),
    "becomes another autopilot": Fault(reason=_TWO, left="returning"),
    "two vehicles": Fault(reason=_TWO, within_s=60.0),
    "many vehicles": Fault(),
    "disarms in the air": Fault(reason="the vehicle disarmed before", left=""),
    "manual mode": Fault(reason="left the|has the vehicle|was not entered", left=""),
    "moves no more": Fault(reason="was not reached within", via="waypoints", left="flying"),
    # what it answers
    "no answers in the air": Fault(reason="no answer|was not entered", via="setpoints", left="flying"),
    "arming in progress for ever": Fault(reason="COMPONENT_ARM_DISARM was still in progress .*after 6"),
    "arms in words only": Fault(reason="no armed heartbeat"),
    "wrong answers": Fault(reason="refused|no answer|was not entered"),
    "many answers": Fault(),
    "answers without number": Fault(reason="result 77"),
    "never disarms": Fault(reason="no disarmed heartbeat", within_s=900.0),
    # missions and parameters
    "requests item 0 for ever": Fault(
        reason="requests nothing new of the mission: 41 replies", via="waypoints"
    ),
    "requests items that do not exist": Fault(via="waypoints"),
    "requests no item": Fault(reason="stopped requesting items", via="waypoints"),
    "answers the mission again and again": Fault(via="waypoints"),
    "item numbers jump": Fault(reason="waypoints were not passed", via="waypoints"),
    "parameters are not numbers": Fault(reason="MPC_XY_VEL_MAX = nan"),
    "many parameters": Fault(),
    # noise
    "many texts": Fault(),
    "garbage": Fault(),
}


def inject(autopilot, name):
    """Give a scripted autopilot a fault."""
    _Injected(autopilot, name)


class _Injected:
    """A scripted autopilot with a fault: its sending, receiving and stepping pass through here."""

    def __init__(self, autopilot, name):
        self.autopilot, self.name = autopilot, name
        self.chance = random.Random(6)
        self.high_us = None
        self.frozen_ms = None
        self.sent_us = 0
        self.done = False
        self._send, self._step, self._command = autopilot.send, autopilot.step, autopilot._command
        self._receive, self._fly = autopilot.receive, autopilot._fly
        autopilot._fly = self.fly
        autopilot.send, autopilot.step, autopilot._command = self.send, self.step, self.command
        autopilot.link.on_receive = self.receive
        for name, take in (
            ("on_mission_item_int", self.mission_item_int),
            ("on_mission_count", self.mission_count),
            ("on_param_request_read", self.param_request_read),
        ):
            setattr(autopilot, name, partial(take, handle=getattr(autopilot, name)))

    @property
    def on(self):
        """Whether a fault in the air has begun."""
        return self.high_us is not None and self.autopilot.time_us >= self.high_us + _LATER_US

    # sending

    def send(self, message):
        kind = message.get_type()
        if hasattr(message, "time_boot_ms"):
            message.time_boot_ms = self.stamp_ms(message.time_boot_ms) % WRAP_MS
        if self.on and not self.passes(message, kind):
            return
        if self.on and kind == "GLOBAL_POSITION_INT" and self.name == "positions are not numbers":
            message.lat = message.lon = message.alt = message.relative_alt = (1 << 31) - 1
        if self.on and kind == "LOCAL_POSITION_NED" and self.name == "positions are not numbers":
            message.x = message.y = message.z = math.nan
        if self.on and kind == "HEARTBEAT":
            self.falsify(message)
        self._send(message)

    def stamp_ms(self, now_ms):
        if self.name == "time is always 0":
            return 0
        if self.name == "time stands still from the start":
            return 5000
        if self.name == "time wraps":
            return WRAP_MS - 16_000 + now_ms
        if not self.on:
            return now_ms
        self.frozen_ms = now_ms if self.frozen_ms is None else self.frozen_ms
        return {
            "time stands still": self.frozen_ms,
            "time steps back": max(0, now_ms - 10_000),
            "time steps ahead": now_ms + 10_000_000,
            "time is the last there is": WRAP_MS - 1,
            "time steps to and fro": now_ms + self.chance.choice((0, 0, 1_000_000, WRAP_MS // 2)),
        }.get(self.name, now_ms)

    def passes(self, message, kind):
        stops = {
            "heartbeats stop": kind == "HEARTBEAT",
            "silence": True,
            "positions stop": kind in ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"),
            "no answers in the air": kind == "COMMAND_ACK",
        }
        return not stops.get(self.name, False)

    def falsify(self, message):
        armed = dialect.MAV_MODE_FLAG_SAFETY_ARMED
        if self.name == "one heartbeat disarmed" and not self.done:
            self.done = True
            message.base_mode &= ~armed
        elif self.name == "heartbeats flip":
            message.base_mode ^= self.chance.choice((0, armed))
            message.custom_mode = self.chance.choice((message.custom_mode, 0, WRAP_MS - 1))
        elif self.name == "becomes another autopilot":
            message.autopilot = 15 - message.autopilot  # 3 and 12
        elif self.name == "manual mode":
            message.custom_mode = _MANUAL[self.autopilot.flavour]

    # answering

    def receive(self, data):
        if self.on and self.name == "no answers in the air":
            return
        self._receive(data)

    def command(self, command, params):
        autopilot = self.autopilot
        arming = command == dialect.MAV_CMD_COMPONENT_ARM_DISARM and params[0] > 0.5
        if self.name == "arming in progress for ever" and arming:
            self.done = True
        elif self.name == "arms in words only" and arming:
            autopilot.ack(command, 0)
        elif self.name == "answers without number" and arming:
            autopilot.ack(command, 77)
        elif self.name == "wrong answers" and command != dialect.MAV_CMD_SET_MESSAGE_INTERVAL:
            autopilot.ack(
                self.chance.choice((command, 0, 65535)), self.chance.choice((1, 2, 3, 4, 6, 77, 255))
            )
        else:
            self._command(command, params)
            if self.name == "many answers":
                for _ in range(50):
                    autopilot.ack(command, self.chance.randrange(10))

    def mission_count(self, message, handle):
        if self.name != "requests no item":
            handle(message)
        if self.name == "requests items that do not exist":
            self.autopilot.send(dialect.MAVLink_mission_request_int_message(255, 190, 65535, 0))

    def mission_item_int(self, message, handle):
        if self.name == "requests item 0 for ever":
            self.autopilot.send(dialect.MAVLink_mission_request_int_message(255, 190, 0, 0))
            return
        handle(message)
        if self.name == "answers the mission again and again" and message.seq + 1 == len(
            self.autopilot.items
        ):
            for _ in range(50):
                self.autopilot.send(dialect.MAVLink_mission_ack_message(255, 190, 13, 0))

    def param_request_read(self, message, handle):
        if self.name == "parameters are not numbers":
            self.autopilot.send(
                dialect.MAVLink_param_value_message(message.param_id.encode(), math.nan, 9, 1, 0)
            )
            return
        if self.name == "many parameters":
            for k in range(300):
                self.autopilot.send(dialect.MAVLink_param_value_message(b"P%d" % k, 1.0, 9, 65535, k))
        handle(message)

    # stepping

    def fly(self, dt):
        self._fly(dt)
        if self.name == "never disarms":
            self.autopilot.armed = True

    def step(self, time_us):
        autopilot = self.autopilot
        position = list(autopilot.pos)
        self._step(time_us)
        if self.high_us is None and autopilot.pos[2] < -_HIGH_M:
            self.high_us = time_us
        if self.on and self.name == "moves no more":
            autopilot.pos = position
        if self.on and self.name == "disarms in the air" and not self.done:
            self.done, autopilot.armed = True, False
            autopilot.text("Crash: Disarming", 2)
        if time_us - self.sent_us >= 50_000:
            self.sent_us = time_us
            self.noise()

    def noise(self):
        autopilot, chance = self.autopilot, self.chance
        if self.name == "two vehicles":
            other = dialect.MAVLink_heartbeat_message(
                2, chance.choice((3, 12)), chance.choice((0, 128)), chance.getrandbits(32), 4, 3
            )
            self._send(other)
            self._send(
                dialect.MAVLink_global_position_int_message(
                    chance.getrandbits(31), 484_000_000, 85_000_000, 0, 0, 0, 0, 0, 0
                )
            )
        elif self.name == "many vehicles":
            for k in range(2, 255, 9):
                encoder = FrameEncoder(k, 1)
                autopilot.link.send(encoder.encode(dialect.MAVLink_heartbeat_message(2, 12, 128, 0, 4, 3)))
        elif self.name == "many texts":
            text = bytes(chance.choices(b"\x1b[2J\x07%s{}\n\xff\x80AB", k=50))
            self._send(dialect.MAVLink_statustext_message(chance.randrange(8), text))
        elif self.name == "garbage":
            autopilot.link.send(chance.randbytes(chance.randrange(1, 1400)))
        elif self.name == "item numbers jump" and self.on and autopilot.kind == "mission":
            self._send(dialect.MAVLink_mission_current_message(chance.choice((0, 65535, 40000))))
        elif self.name == "arming in progress for ever" and self.done:
            ack = dialect.MAVLink_command_ack_message(
                dialect.MAV_CMD_COMPONENT_ARM_DISARM, 5, chance.randrange(100), 0, 255, 190
            )
            self._send(ack)
