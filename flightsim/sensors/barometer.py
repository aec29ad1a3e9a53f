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
from flightsim.foundation.records import packed
from flightsim.interface import BARO_PRESSURE_PA, BARO_SIZE, BARO_TEMPERATURE_C
from flightsim.sensors.fault_kinds import FaultTarget, SensorUnit
from flightsim.sensors.sensor import RecordArray, SensorModel, gauss_markov, quantise

Array = NDArray[np.float64]

_NORMALS: Final = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class _Constants:
    noise_pa: float
    bias_pa: float
    decay: float  # of the drift
    drive_pa: float
    lag_gain: float
    quantum_pa: float
    rise_k: float
    temperature_quantum_k: float


@dataclass(slots=True, kw_only=True)
class _State:
    drift_pa: float
    lagged_pa: float  # NaN before the first sample


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
        decay, drive_pa = gauss_markov(self.drift_pa, self.drift_time_constant_s, interval_s)
        constants = _Constants(
            noise_pa=self.noise_pa,
            bias_pa=self.turn_on_bias_pa * rng.standard_normal(),
            decay=decay,
            drive_pa=drive_pa,
            lag_gain=1.0 if self.lag_s == 0.0 else 1.0 - math.exp(-interval_s / self.lag_s),
            quantum_pa=self.quantum_pa,
            rise_k=self.self_heating_k,
            temperature_quantum_k=self.temperature_quantum_k,
        )
        state = _State(drift_pa=self.drift_pa * rng.standard_normal(), lagged_pa=math.nan)
        return SensorModel(
            kernel=_measure,
            constants=packed(constants),
            state=packed(state),
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
def _measure(
    truth: Array, constants: RecordArray, states: RecordArray, normals: Array, row: int, out: Array
) -> bool:
    c: _Constants = constants[0]
    s: _State = states[0]
    pressure_pa = truth[t.PRESSURE_PA]
    if math.isnan(s.lagged_pa):
        s.lagged_pa = pressure_pa
    s.lagged_pa += c.lag_gain * (pressure_pa - s.lagged_pa)
    out[BARO_PRESSURE_PA] = quantise(
        s.lagged_pa + c.bias_pa + s.drift_pa + c.noise_pa * normals[row, 0], c.quantum_pa
    )
    out[BARO_TEMPERATURE_C] = quantise(
        truth[t.TEMPERATURE_K] - ICE_POINT_K + c.rise_k, c.temperature_quantum_k
    )
    s.drift_pa = c.decay * s.drift_pa + c.drive_pa * normals[row, 1]
    return True
