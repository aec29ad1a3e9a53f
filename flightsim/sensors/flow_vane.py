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
from flightsim.foundation.records import packed
from flightsim.interface import VANE_ANGLE_OF_ATTACK_RAD, VANE_SIDESLIP_RAD, VANE_SIZE
from flightsim.sensors.sensor import RecordArray, SensorModel, quantise, saturate

Array = NDArray[np.float64]

_DEG: Final = math.pi / 180.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Constants:
    misalignment_rad: Array  # angle of attack, sideslip
    noise_rad: float
    lag_gain: float
    limit_rad: float
    quantum_rad: float
    min_pressure_pa: float


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
        constants = _Constants(
            misalignment_rad=self.misalignment_rad * rng.standard_normal(VANE_SIZE),
            noise_rad=self.noise_rad,
            lag_gain=1.0 if self.lag_s == 0.0 else 1.0 - math.exp(-interval_s / self.lag_s),
            limit_rad=self.limit_rad,
            quantum_rad=self.quantum_rad,
            min_pressure_pa=self.min_dynamic_pressure_pa,
        )
        return SensorModel(
            kernel=_measure,
            constants=packed(constants),
            state=np.zeros(VANE_SIZE),
            normals_per_sample=VANE_SIZE,
            size=VANE_SIZE,
            fault_targets=(),
        )


@kernel
def _swing(angle_rad: float, c: _Constants, state: Array, channel: int, normal: float) -> float:
    state[channel] += c.lag_gain * (saturate(angle_rad, c.limit_rad) - state[channel])
    value_rad = state[channel] + c.misalignment_rad[channel] + c.noise_rad * normal
    return quantise(value_rad, c.quantum_rad)


@kernel
def _measure(
    truth: Array, constants: RecordArray, state: Array, normals: Array, row: int, out: Array
) -> bool:
    c: _Constants = constants[0]
    alpha_rad, beta_rad = truth[t.ANGLE_OF_ATTACK_RAD], truth[t.SIDESLIP_RAD]
    if truth[t.DYNAMIC_PRESSURE_PA] < c.min_pressure_pa:
        alpha_rad, beta_rad = state[VANE_ANGLE_OF_ATTACK_RAD], state[VANE_SIDESLIP_RAD]
    out[VANE_ANGLE_OF_ATTACK_RAD] = _swing(alpha_rad, c, state, VANE_ANGLE_OF_ATTACK_RAD, normals[row, 0])
    out[VANE_SIDESLIP_RAD] = _swing(beta_rad, c, state, VANE_SIDESLIP_RAD, normals[row, 1])
    return True
