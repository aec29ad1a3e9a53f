"""Flow vanes: angle of attack and sideslip, as an air-data boom measures them."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.checks import NotNegative, Positive, Rate
from flightsim.foundation.kernels import kernel
from flightsim.foundation.options import Options
from flightsim.interface import VANE_ANGLE_OF_ATTACK_RAD, VANE_SIDESLIP_RAD, VANE_SIZE
from flightsim.sensors.sensor import SensorModel, quantise, saturate

Array = NDArray[np.float64]

_DEG: Final = math.pi / 180.0

_MISALIGNMENT: Final = 0  # angle of attack, sideslip
_NOISE: Final = 2
_LAG_GAIN: Final = 3
_LIMIT: Final = 4
_QUANTUM: Final = 5
_MIN_PRESSURE: Final = 6
_CONSTANTS: Final = 7


@dataclass(frozen=True, slots=True, kw_only=True)
class FlowVaneParameters(Options):
    """Two balsa-size vanes on magnetic 12-bit encoders, on a boom ahead of the flow that the aircraft bends.

    MAVLink has no failure unit for them, so they can't fail.

    Attributes:
        rate_hz: samples per second.
        latency_s: zero.
        noise_rad: white, per sample: 0.25 deg.
        misalignment_rad: one sigma for each vane, constant: 0.2 deg.
        lag_s: first-order lag: a vane swings into the flow.
        limit_rad: mechanical stops either way.
        quantum_rad: 2 pi / 4096.
        min_dynamic_pressure_pa: below it friction holds the vane where it is (10 Pa: 4 m/s at sea level).
    """

    rate_hz: Rate = 25
    latency_s: NotNegative = 0.0
    noise_rad: NotNegative = 0.25 * _DEG
    misalignment_rad: NotNegative = 0.2 * _DEG
    lag_s: NotNegative = 0.03
    limit_rad: Positive = 40.0 * _DEG
    quantum_rad: NotNegative = 2.0 * math.pi / 4096.0
    min_dynamic_pressure_pa: NotNegative = 10.0

    def build(self, interval_s: float, rng: np.random.Generator) -> SensorModel:
        """One specimen: draws its misalignments. Both vanes stand at zero before the first flow."""
        constants = np.zeros(_CONSTANTS)
        constants[_MISALIGNMENT : _MISALIGNMENT + VANE_SIZE] = self.misalignment_rad * rng.standard_normal(
            VANE_SIZE
        )
        constants[_NOISE] = self.noise_rad
        constants[_LAG_GAIN] = 1.0 if self.lag_s == 0.0 else 1.0 - math.exp(-interval_s / self.lag_s)
        constants[_LIMIT] = self.limit_rad
        constants[_QUANTUM] = self.quantum_rad
        constants[_MIN_PRESSURE] = self.min_dynamic_pressure_pa
        return SensorModel(
            kernel=_measure,
            constants=constants,
            state=np.zeros(VANE_SIZE),
            normals_per_sample=VANE_SIZE,
            size=VANE_SIZE,
            fault_targets=(),
        )


@kernel
def _swing(angle_rad: float, constants: Array, state: Array, channel: int, normal: float) -> float:
    state[channel] += constants[_LAG_GAIN] * (saturate(angle_rad, constants[_LIMIT]) - state[channel])
    value_rad = state[channel] + constants[_MISALIGNMENT + channel] + constants[_NOISE] * normal
    return quantise(value_rad, constants[_QUANTUM])


@kernel
def _measure(truth: Array, constants: Array, state: Array, normals: Array, row: int, out: Array) -> bool:
    alpha_rad, beta_rad = truth[t.ANGLE_OF_ATTACK_RAD], truth[t.SIDESLIP_RAD]
    if truth[t.DYNAMIC_PRESSURE_PA] < constants[_MIN_PRESSURE]:
        alpha_rad, beta_rad = state[VANE_ANGLE_OF_ATTACK_RAD], state[VANE_SIDESLIP_RAD]
    out[VANE_ANGLE_OF_ATTACK_RAD] = _swing(
        alpha_rad, constants, state, VANE_ANGLE_OF_ATTACK_RAD, normals[row, 0]
    )
    out[VANE_SIDESLIP_RAD] = _swing(beta_rad, constants, state, VANE_SIDESLIP_RAD, normals[row, 1])
    return True
