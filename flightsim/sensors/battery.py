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
from flightsim.foundation.records import packed
from flightsim.sensors.fault_kinds import FaultTarget, SensorUnit
from flightsim.sensors.sensor import RecordArray, SensorModel, quantise

Array = NDArray[np.float64]

_NORMALS: Final = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class _Constants:
    voltage_noise_v: float
    voltage_gain: float
    voltage_quantum_v: float
    current_noise_a: float
    current_gain: float
    current_quantum_a: float
    interval_h: float


@dataclass(slots=True, kw_only=True)
class _State:
    used_ah: float  # NaN before the first sample


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
        constants = _Constants(
            voltage_noise_v=self.voltage_noise_v,
            voltage_gain=1.0 + self.voltage_scale_error * rng.standard_normal(),
            voltage_quantum_v=self.voltage_quantum_v,
            current_noise_a=self.current_noise_a,
            current_gain=1.0 + self.current_scale_error * rng.standard_normal(),
            current_quantum_a=self.current_quantum_a,
            interval_h=interval_s / 3600.0,
        )
        return SensorModel(
            kernel=_measure,
            constants=packed(constants),
            state=packed(_State(used_ah=math.nan)),
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
def _measure(
    truth: Array, constants: RecordArray, states: RecordArray, normals: Array, row: int, out: Array
) -> bool:
    c: _Constants = constants[0]
    s: _State = states[0]
    voltage_v = c.voltage_gain * truth[t.BATTERY_VOLTAGE_V] + c.voltage_noise_v * normals[row, 0]
    current_a = c.current_gain * truth[t.BATTERY_CURRENT_A] + c.current_noise_a * normals[row, 1]
    out[i.BATTERY_VOLTAGE_V] = max(0.0, quantise(voltage_v, c.voltage_quantum_v))
    out[i.BATTERY_CURRENT_A] = max(0.0, quantise(current_a, c.current_quantum_a))
    if math.isnan(s.used_ah):
        s.used_ah = truth[t.BATTERY_USED_AH]
    else:
        s.used_ah += c.interval_h * out[i.BATTERY_CURRENT_A]
    out[i.BATTERY_USED_AH] = s.used_ah
    capacity_ah = truth[t.BATTERY_CAPACITY_AH]
    if capacity_ah > 0.0:
        out[i.BATTERY_REMAINING] = min(1.0, max(0.0, 1.0 - s.used_ah / capacity_ah))
    else:
        out[i.BATTERY_REMAINING] = math.nan
    return True
