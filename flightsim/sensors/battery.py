"""Battery monitor: voltage and current through an analogue power module, charge by counting."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim import interface as i
from flightsim import truth as t
from flightsim.foundation.checks import NotNegative, Rate
from flightsim.foundation.kernels import kernel
from flightsim.foundation.options import Options
from flightsim.sensors.fault_kinds import FaultTarget, SensorUnit
from flightsim.sensors.sensor import SensorModel, quantise

Array = NDArray[np.float64]

_VOLTAGE_NOISE: Final = 0
_VOLTAGE_GAIN: Final = 1
_VOLTAGE_QUANTUM: Final = 2
_CURRENT_NOISE: Final = 3
_CURRENT_GAIN: Final = 4
_CURRENT_QUANTUM: Final = 5
_INTERVAL_H: Final = 6
_CONSTANTS: Final = 7

_USED_AH: Final = 0  # NaN before the first sample
_STATE: Final = 1
_NORMALS: Final = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class BatteryMonitorParameters(Options):
    """The classic analogue power module on a 12-bit, 3.3 V converter, with PX4's 18.1 V/V and 36.4 A/V.

    Attributes:
        rate_hz: samples per second.
        latency_s: zero.
        voltage_noise_v: per sample.
        voltage_scale_error: one sigma: resistor tolerance left after calibration with a meter.
        voltage_quantum_v: 3.3 V / 4096 * 18.1.
        current_noise_a: per sample; ripple of the speed controllers that the filter leaves.
        current_scale_error: one sigma, left after calibration; the charge counted errs by the same share.
        current_quantum_a: 3.3 V / 4096 * 36.4.
    """

    rate_hz: Rate = 10
    latency_s: NotNegative = 0.0
    voltage_noise_v: NotNegative = 0.01
    voltage_scale_error: NotNegative = 0.002
    voltage_quantum_v: NotNegative = 3.3 / 4096 * 18.1
    current_noise_a: NotNegative = 0.1
    current_scale_error: NotNegative = 0.02
    current_quantum_a: NotNegative = 3.3 / 4096 * 36.4

    def build(self, interval_s: float, rng: np.random.Generator) -> SensorModel:
        """One specimen: draws its scale errors. The charge used before the first sample is taken as known."""
        constants = np.zeros(_CONSTANTS)
        constants[_VOLTAGE_NOISE] = self.voltage_noise_v
        constants[_VOLTAGE_GAIN] = 1.0 + self.voltage_scale_error * rng.standard_normal()
        constants[_VOLTAGE_QUANTUM] = self.voltage_quantum_v
        constants[_CURRENT_NOISE] = self.current_noise_a
        constants[_CURRENT_GAIN] = 1.0 + self.current_scale_error * rng.standard_normal()
        constants[_CURRENT_QUANTUM] = self.current_quantum_a
        constants[_INTERVAL_H] = interval_s / 3600.0
        return SensorModel(
            kernel=_measure,
            constants=constants,
            state=np.full(_STATE, np.nan),
            normals_per_sample=_NORMALS,
            size=i.BATTERY_SIZE,
            fault_targets=(
                FaultTarget(
                    unit=SensorUnit.BATTERY,
                    channels=slice(0, i.BATTERY_SIZE),
                    wrong_bias=(-2.0, 0.0, 0.0, 0.0),
                    drift_per_s=(-0.02, 0.0, 0.0, 0.0),
                    low=(0.0, 0.0, 0.0, 0.0),
                    high=(60.0, 120.0, 10.0, 1.0),
                ),
            ),
        )


@kernel
def _measure(truth: Array, constants: Array, state: Array, normals: Array, row: int, out: Array) -> bool:
    voltage_v = (
        constants[_VOLTAGE_GAIN] * truth[t.BATTERY_VOLTAGE_V] + constants[_VOLTAGE_NOISE] * normals[row, 0]
    )
    current_a = (
        constants[_CURRENT_GAIN] * truth[t.BATTERY_CURRENT_A] + constants[_CURRENT_NOISE] * normals[row, 1]
    )
    out[i.BATTERY_VOLTAGE_V] = max(0.0, quantise(voltage_v, constants[_VOLTAGE_QUANTUM]))
    out[i.BATTERY_CURRENT_A] = max(0.0, quantise(current_a, constants[_CURRENT_QUANTUM]))
    if math.isnan(state[_USED_AH]):
        state[_USED_AH] = truth[t.BATTERY_USED_AH]
    else:
        state[_USED_AH] += constants[_INTERVAL_H] * out[i.BATTERY_CURRENT_A]
    out[i.BATTERY_USED_AH] = state[_USED_AH]
    capacity_ah = truth[t.BATTERY_CAPACITY_AH]
    if capacity_ah > 0.0:
        out[i.BATTERY_REMAINING] = min(1.0, max(0.0, 1.0 - state[_USED_AH] / capacity_ah))
    else:
        out[i.BATTERY_REMAINING] = math.nan
    return True
