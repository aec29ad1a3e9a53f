"""Vibration of the airframe caused by its rotors, as an IMU measures it.

A rotor whose centre of mass lies off its axis pulls once in a turn, with a force that turns in the rotor's
plane and grows with the square of its speed. Its blades pass the arms or the wing twice in a turn and pull
along the axis. Off the centre of gravity the turning force rocks the vehicle, too. Structure and mount are
rigid.

The IMU's converter runs at kilohertz and the driver averages its samples over the interval of a reading, as
the firmwares' drivers do. The mean of cos(p) over an interval in which the phase grows by d is
sin(d / 2) / (d / 2) times its value in the middle, so frequencies above half the rate come out weaker and
folded, as they do there.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.checks import NotNegative
from flightsim.foundation.kernels import kernel
from flightsim.foundation.options import Options

Array = NDArray[np.float64]

ROTORS: Final = t.ROTOR_RAD_S.stop - t.ROTOR_RAD_S.start
_FIRST_ROTOR: Final = t.ROTOR_RAD_S.start

# constants
_INTERVAL_S: Final = 0
_AXIS: Final = 1
_LEVER: Final = 2
_BLADES: Final = 3
_IMBALANCE: Final = 4  # one for each rotor
CONSTANTS: Final = _IMBALANCE + ROTORS
_LEAST_RAD_S: Final = 1.0
"""A rotor slower than this stands."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RotorVibrationParameters(Options):
    """Small propellers, balanced when they were made and not since.

    Attributes:
        imbalance_m: 1-sigma, each way across the axis, of the offset of a rotor's centre of mass times the
            rotor's part of the vehicle's mass: 25 um (balance grade G 16 of ISO 21940-11 at 640 rad/s) times
            2.5 % for propeller and bell. Acceleration = this times the square of the speed: 0.2 m/s^2 for
            each rotor of a quadrotor that hovers at 600 rad/s.
        blade_passage_m: likewise of the force along the axis at twice the speed: about one per cent of the
            thrust.
        lever_1_m: angular acceleration over acceleration: mass times the rotor's distance from the centre of
            gravity along its axis over the moment of inertia.
        axis: body axis the rotors turn about: 2 (down) of a multicopter, 0 (forward) of a propeller aircraft.
    """

    imbalance_m: NotNegative = 6e-7
    blade_passage_m: NotNegative = 1e-7
    lever_1_m: NotNegative = 2.0
    axis: int = 2

    def check_together(self) -> None:
        if self.axis not in (0, 1, 2):
            raise ValueError(f"axis = {self.axis!r} is not accepted: 0 (forward), 1 (right) or 2 (down) is")

    def build(self, interval_s: float, rng: np.random.Generator) -> tuple[Array, Array]:
        """One specimen's constants (CONSTANTS,) and phases in rad (ROTORS,); draws both."""
        constants = np.zeros(CONSTANTS)
        constants[_INTERVAL_S] = interval_s
        constants[_AXIS] = self.axis
        constants[_LEVER] = self.lever_1_m
        constants[_BLADES] = self.blade_passage_m
        constants[_IMBALANCE:] = self.imbalance_m * np.hypot(*rng.standard_normal((2, ROTORS)))
        return constants, rng.uniform(0.0, math.tau, ROTORS)


@kernel
def add_vibration(truth: Array, constants: Array, phases: Array, rates: Array, force: Array) -> None:
    """Add the mean of the vibration over an interval to body rates (rad/s) and specific force (m/s^2), both
    (3,), and turn the rotors on."""
    dt, axis = constants[_INTERVAL_S], int(constants[_AXIS])
    p, q = (axis + 1) % 3, (axis + 2) % 3
    for rotor in range(ROTORS):
        speed = abs(truth[_FIRST_ROTOR + rotor])
        if speed < _LEAST_RAD_S:
            continue
        half = 0.5 * speed * dt
        middle = phases[rotor] + half
        phases[rotor] = (phases[rotor] + 2.0 * half) % math.tau
        cosine, sine = math.cos(middle), math.sin(middle)
        once = math.sin(half) / half  # of the mean over the interval
        twice = once * math.cos(half)
        pull = constants[_IMBALANCE + rotor] * speed * speed * once
        force[p] += pull * cosine
        force[q] += pull * sine
        force[axis] += constants[_BLADES] * speed * speed * twice * (2.0 * cosine * cosine - 1.0)
        rock = constants[_LEVER] * pull / speed
        rates[p] -= rock * cosine
        rates[q] -= rock * sine
