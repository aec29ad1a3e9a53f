"""Magnetometer: the Earth's field in the body frame, residual hard and soft iron, noise, quantum."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.checks import NotNegative, Positive, Rate
from flightsim.foundation.kernels import kernel
from flightsim.foundation.options import Options
from flightsim.foundation.records import packed
from flightsim.foundation.rotations import rotate_inverse
from flightsim.interface import MAG_SIZE
from flightsim.sensors.fault_kinds import FaultTarget, SensorUnit
from flightsim.sensors.sensor import RecordArray, SensorModel, quantise, saturate

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Constants:
    scale: Array
    hard_iron_gauss: Array
    noise_gauss: float
    limit_gauss: float
    quantum_gauss: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MagnetometerParameters(Options):
    """A calibrated iSentek IST8310, the compass of Holybro's GPS modules.

    Attributes:
        rate_hz: samples per second.
        latency_s: zero.
        noise_gauss: per sample; 0.0004 gauss/sqrt(Hz) of PX4's Gazebo magnetometer plugin at 50 Hz.
        hard_iron_gauss: one sigma per axis, left after calibration; 0.5 deg of heading at mid latitudes.
        scale_error: one sigma, left after calibration (soft iron).
        range_gauss, quantum_gauss: 1600 uT and 0.3 uT per bit (datasheet).
    """

    rate_hz: Rate = 25
    latency_s: NotNegative = 0.0
    noise_gauss: NotNegative = 0.0028
    hard_iron_gauss: NotNegative = 0.002
    scale_error: NotNegative = 0.005
    range_gauss: Positive = 16.0
    quantum_gauss: NotNegative = 0.003

    def build(self, interval_s: float, rng: np.random.Generator) -> SensorModel:
        """One specimen: draws its hard iron and scale errors."""
        constants = _Constants(
            scale=1.0 + self.scale_error * rng.standard_normal(MAG_SIZE),
            hard_iron_gauss=self.hard_iron_gauss * rng.standard_normal(MAG_SIZE),
            noise_gauss=self.noise_gauss,
            limit_gauss=self.range_gauss,
            quantum_gauss=self.quantum_gauss,
        )
        return SensorModel(
            kernel=_measure,
            constants=packed(constants),
            state=np.zeros(1),
            normals_per_sample=MAG_SIZE,
            size=MAG_SIZE,
            fault_targets=(
                FaultTarget(
                    unit=SensorUnit.MAG,
                    channels=slice(0, MAG_SIZE),
                    wrong_bias=(0.2, 0.2, 0.0),
                    drift_per_s=(0.005, 0.005, 0.0),
                    low=(-self.range_gauss,) * MAG_SIZE,
                    high=(self.range_gauss,) * MAG_SIZE,
                ),
            ),
        )


@kernel
def _measure(
    truth: Array, constants: RecordArray, _states: Array, normals: Array, row: int, out: Array
) -> bool:
    c: _Constants = constants[0]
    rotate_inverse(truth[t.Q_NED_FROM_FRD], truth[t.MAG_NED_GAUSS], out)
    for axis in range(3):
        value = c.scale[axis] * out[axis] + c.hard_iron_gauss[axis] + c.noise_gauss * normals[row, axis]
        out[axis] = quantise(saturate(value, c.limit_gauss), c.quantum_gauss)
    return True
