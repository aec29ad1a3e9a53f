"""Barometer: static pressure with lag, drift, noise and quantisation."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.atmosphere import ICE_POINT_K
from flightsim.foundation.checks import NotNegative, Positive, Rate
from flightsim.foundation.kernels import kernel
from flightsim.foundation.options import Options
from flightsim.interface import BARO_PRESSURE_PA, BARO_SIZE, BARO_TEMPERATURE_C
from flightsim.sensors.fault_kinds import FaultTarget, SensorUnit
from flightsim.sensors.sensor import SensorModel, gauss_markov, quantise

Array = NDArray[np.float64]


_NOISE: Final = 0
_BIAS: Final = 1
_DECAY: Final = 2
_DRIVE: Final = 3
_LAG_GAIN: Final = 4
_QUANTUM: Final = 5
_RISE_K: Final = 6
_TEMPERATURE_QUANTUM: Final = 7
_CONSTANTS: Final = 8

_DRIFT: Final = 0
_LAGGED: Final = 1  # NaN before the first sample
_NORMALS: Final = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class BarometerParameters(Options):
    """A TE Connectivity MS5611-01BA03 at oversampling 4096 (datasheet figures) in a Pixhawk's case.

    Attributes:
        rate_hz: samples per second.
        latency_s: zero: the conversion time is part of the lag.
        noise_pa: 0.012 mbar, the datasheet's resolution (RMS).
        turn_on_bias_pa: one sigma of an offset that shifts all heights of a flight alike; the datasheet's
            accuracy of 1.5 mbar is the outer limit.
        drift_pa, drift_time_constant_s: slow Gauss-Markov wandering (temperature, weather, air in the case);
            1.5 Pa is 0.13 m at sea level, what a shielded sensor wanders in the minutes of a flight.
        lag_s: first-order lag: foam and case volume, and 9 ms of conversion.
        quantum_pa: 0.01 mbar, the datasheet's integer output.
        self_heating_k, temperature_quantum_k: the sensor's own temperature reading.
    """

    rate_hz: Rate = 25
    latency_s: NotNegative = 0.0
    noise_pa: NotNegative = 1.2
    turn_on_bias_pa: NotNegative = 20.0
    drift_pa: NotNegative = 1.5
    drift_time_constant_s: Positive = 300.0
    lag_s: NotNegative = 0.03
    quantum_pa: NotNegative = 1.0
    self_heating_k: NotNegative = 10.0
    temperature_quantum_k: NotNegative = 0.01

    def build(self, interval_s: float, rng: np.random.Generator) -> SensorModel:
        """One specimen: draws its offset and where its drift starts."""
        constants = np.zeros(_CONSTANTS)
        constants[_NOISE] = self.noise_pa
        constants[_BIAS] = self.turn_on_bias_pa * rng.standard_normal()
        constants[_DECAY], constants[_DRIVE] = gauss_markov(
            self.drift_pa, self.drift_time_constant_s, interval_s
        )
        constants[_LAG_GAIN] = 1.0 if self.lag_s == 0.0 else 1.0 - math.exp(-interval_s / self.lag_s)
        constants[_QUANTUM] = self.quantum_pa
        constants[_RISE_K] = self.self_heating_k
        constants[_TEMPERATURE_QUANTUM] = self.temperature_quantum_k
        state = np.array([self.drift_pa * rng.standard_normal(), np.nan])
        return SensorModel(
            kernel=_measure,
            constants=constants,
            state=state,
            normals_per_sample=_NORMALS,
            size=BARO_SIZE,
            fault_targets=(
                FaultTarget(
                    unit=SensorUnit.BARO,
                    channels=slice(0, BARO_SIZE),
                    wrong_bias=(500.0, 0.0),
                    drift_per_s=(5.0, 0.0),
                    low=(1000.0, -40.0),
                    high=(120000.0, 85.0),
                ),
            ),
        )


@kernel
def _measure(truth: Array, constants: Array, state: Array, normals: Array, row: int, out: Array) -> bool:
    pressure_pa = truth[t.PRESSURE_PA]
    if math.isnan(state[_LAGGED]):
        state[_LAGGED] = pressure_pa
    state[_LAGGED] += constants[_LAG_GAIN] * (pressure_pa - state[_LAGGED])
    out[BARO_PRESSURE_PA] = quantise(
        state[_LAGGED] + constants[_BIAS] + state[_DRIFT] + constants[_NOISE] * normals[row, 0],
        constants[_QUANTUM],
    )
    out[BARO_TEMPERATURE_C] = quantise(
        truth[t.TEMPERATURE_K] - ICE_POINT_K + constants[_RISE_K], constants[_TEMPERATURE_QUANTUM]
    )
    state[_DRIFT] = constants[_DECAY] * state[_DRIFT] + constants[_DRIVE] * normals[row, 1]
    return True
