"""Made samples and messages for the tests of the attitude filter."""

import math

import numpy as np

from autopilot_bridge.mavlink import definition
from estimators.attitude import layout as at
from estimators.attitude.parameters import AttitudeParameters, coefficients
from estimators.attitude.step import start, step
from estimators.messages import message_class

G = 9.80665
MILLI_G = 1e-3 * G
STEP_S = 0.02


def made(name, system=1, component=1, **values):
    """A message with zeros where nothing is given."""
    found = definition(name)
    filled = {field.name: 0 for field in found.wire_fields}
    return message_class(found)(system, component, **(filled | values))  # type: ignore[call-arg]


def down_of(roll, pitch):
    """Down in the body."""
    return np.array([-math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll)])


def heartbeat(kind=1, armed=True, component=1, **values):
    return made("HEARTBEAT", 1, component, type=kind, base_mode=128 if armed else 0, **values)


def highres(time_us, rate=(0.0, 0.0, 0.0), force=(0.0, 0.0, -G), **values):
    x, y, z = rate
    a, b, c = force
    sample = {"xgyro": x, "ygyro": y, "zgyro": z, "xacc": a, "yacc": b, "zacc": c}
    return made("HIGHRES_IMU", **({"time_usec": time_us, "fields_updated": 63} | sample | values))


def scaled(name, time_us, rate=(0.0, 0.0, 0.0), force=(0.0, 0.0, -G), **values):
    """RAW_IMU or one of SCALED_IMU's: milli-g and milliradians per second."""
    stamp = {"time_usec": time_us} if name == "RAW_IMU" else {"time_boot_ms": time_us // 1000}
    sample = {f"{axis}gyro": round(1e3 * value) for axis, value in zip("xyz", rate, strict=True)}
    sample |= {f"{axis}acc": round(value / MILLI_G) for axis, value in zip("xyz", force, strict=True)}
    return made(name, **(stamp | sample | values))


class Filter:
    """The compiled filter with samples by hand.

    Args:
        form: of `layout`.
        settled: the mean of the start is over.
        parameters: of the filter, that differ from the defaults.
    """

    def __init__(self, form=at.WING, *, settled=True, roll=0.0, pitch=0.0, **parameters):
        self.p = coefficients(AttitudeParameters(**parameters))
        self.x = np.zeros(at.STATE_SIZE)
        start(self.x, self.p)
        self.form = form
        self.disarmed = False
        down = down_of(roll, pitch)
        self.feed((0.0, 0.0, 0.0), -G * down, 0.0)
        if settled:
            self.x[at.AGE] = 1000.0

    def air(self, airspeed_m_s, climb_m_s=0.0):
        self.x[at.AIRSPEED], self.x[at.AIRSPEED_FRESH], self.x[at.CLIMB] = airspeed_m_s, 1.0, climb_m_s

    def feed(self, rate, force, elapsed_s=STEP_S):
        self.x[: at.SAMPLE_RATE + 3] = self.form, float(self.disarmed), elapsed_s, *force, *rate
        return step(self.x, self.p)

    @property
    def down(self):
        return self.x[at.DOWN : at.DOWN + 3]

    @property
    def roll(self):
        return math.atan2(self.down[1], self.down[2])

    @property
    def pitch(self):
        return -math.asin(self.down[0])

    @property
    def bias(self):
        return self.x[at.GYRO_BIAS : at.GYRO_BIAS + 3]


class SteadyTurn:
    """Rates and specific force of a steady level turn, in closed form.

    Args:
        airspeed_m_s, roll, pitch, alpha, turn_rate: of the flight; no sideslip.
    """

    def __init__(self, airspeed_m_s, roll, pitch, alpha, turn_rate):
        down = down_of(roll, pitch)
        self.rate = turn_rate * down
        velocity = airspeed_m_s * np.array([math.cos(alpha), 0.0, math.sin(alpha)])
        self.force = np.cross(self.rate, velocity) - G * down
