"""Logs made for the tests: what each vehicle said, message by message."""

import math
from pathlib import Path

import pytest

from autopilot_bridge.mavlink import FrameEncoder, dialect
from autopilot_bridge.tlog import TlogWriter

EPOCH_US = 1_700_000_000_000_000
LEVEL = Path(__file__).parent / "level.py"


class LogMaker:
    """Writes a telemetry log; time of the records goes on by itself."""

    def __init__(self, path):
        self.path = path
        self._log = TlogWriter(path)
        self._encoders = {}
        self._time_us = EPOCH_US

    def say(self, message, system=1, component=1):
        key = system, component
        encoder = self._encoders.setdefault(key, FrameEncoder(*key))
        self._time_us += 1000
        self._log.write(self._time_us, encoder.encode(message))

    def attitude(self, time_s, roll=None, pitch=0.0, system=1, component=1):
        roll = 0.3 * math.sin(time_s) if roll is None else roll
        message = dialect.MAVLink_attitude_message(round(time_s * 1e3), roll, pitch, 0.1, 0.0, 0.0, 0.0)
        self.say(message, system, component)

    def truth(self, time_s, roll, system=1, component=25, lon=85455900):
        q = [math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0]
        self.say(
            dialect.MAVLink_hil_state_quaternion_message(
                round(time_s * 1e6), q, 0.0, 0.0, 0.0, 473977400, lon, 500000, 0, 0, 0, 0, 0, 0, 0, 0
            ),
            system,
            component,
        )

    def heartbeat(self, system=1, armed=True):
        self.say(dialect.MAVLink_heartbeat_message(2, 12, 128 if armed else 0, 0, 4, 3), system)

    def landed(self, state, system=1):
        self.say(dialect.MAVLink_extended_sys_state_message(0, state), system)

    def system_time(self, time_s, unix_s, system=1):
        self.say(dialect.MAVLink_system_time_message(round(unix_s * 1e6), round(time_s * 1e3)), system)

    def close(self):
        self._log.close()
        return self.path


@pytest.fixture
def make_log(tmp_path):
    """Factory of `LogMaker`s."""
    made = []

    def make(name="made.tlog"):
        made.append(LogMaker(tmp_path / name))
        return made[-1]

    yield make
    for log in made:
        log.close()


@pytest.fixture
def level():
    """Path of a user's estimator."""
    return str(LEVEL)
