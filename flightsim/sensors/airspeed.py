"""Airspeed sensor: a pitot-static tube and a differential pressure transducer.

The tube takes up the impact pressure of the flow, which in subsonic flow is the isentropic

    q_c = p ((1 + (gamma - 1) / 2 M^2)^(gamma / (gamma - 1)) - 1),    M^2 = 2 q / (gamma p),

and 1/2 rho V^2 = q where M is small (Anderson, Fundamentals of Aerodynamics, section 8.7). Against flow from
the side a plain tube holds its total pressure up to some incidence (Gracey, Measurement of aircraft speed and
altitude, NASA RP-1046, chapter 3) and then loses it with the square of the cosine; from behind it reads none.
"""

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
from flightsim.interface import AIRSPEED_DIFFERENTIAL_PRESSURE_PA, AIRSPEED_SIZE, AIRSPEED_TEMPERATURE_C
from flightsim.sensors.fault_kinds import FaultTarget, SensorUnit
from flightsim.sensors.sensor import RecordArray, SensorModel, gauss_markov, quantise, saturate

Array = NDArray[np.float64]

_GAMMA: Final = 1.4

_NORMALS: Final = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class _Constants:
    noise_pa: float
    offset_pa: float
    gain: float
    decay: float  # of the drift
    drive_pa: float
    lag_gain: float
    quantum_pa: float
    limit_pa: float
    insensitive_rad: float
    rise_k: float
    temperature_quantum_k: float


@dataclass(slots=True, kw_only=True)
class _State:
    drift_pa: float
    lagged_pa: float  # NaN before the first sample


@dataclass(frozen=True, slots=True, kw_only=True)
class AirspeedParameters(Options):
    """A plain pitot-static tube with a TE Connectivity MS4525DO, 1 psi differential, zeroed before flight.

    Attributes:
        rate_hz: samples per second.
        latency_s: zero: the conversion time is part of the lag.
        noise_pa: white, per sample; about what both firmwares' simulators put on the pressure (1 to 2 Pa).
        zero_offset_pa: one sigma of the offset that zeroing on the ground leaves (wind into the tube): 1.5 Pa
            is 0.06 m/s at 20 m/s.
        scale_error: one sigma; position error of the static ports and of the transducer, left after
            calibration in flight. An airspeed errs by half of it.
        drift_pa, drift_time_constant_s: Gauss-Markov wandering of the zero with temperature.
        lag_s: first-order lag of the tubing.
        insensitive_angle_rad: incidence up to which the total pressure is held.
        range_pa: 1 psi either way.
        quantum_pa: 2 psi over 80 % of 14 bits (datasheet).
        self_heating_k, temperature_quantum_k: the transducer's own temperature reading, 11 bits over 200 K.
    """

    rate_hz: Rate = 25
    latency_s: NotNegative = 0.0
    noise_pa: NotNegative = 1.5
    zero_offset_pa: NotNegative = 1.5
    scale_error: NotNegative = 0.01
    drift_pa: NotNegative = 0.7
    drift_time_constant_s: Positive = 300.0
    lag_s: NotNegative = 0.05
    insensitive_angle_rad: NotNegative = math.radians(15.0)
    range_pa: Positive = 6894.757
    quantum_pa: NotNegative = 2.0 * 6894.757 / (0.8 * 16383)
    self_heating_k: NotNegative = 5.0
    temperature_quantum_k: NotNegative = 200.0 / 2047

    def check_together(self) -> None:
        if self.insensitive_angle_rad >= 0.5 * math.pi:
            raise ValueError(
                f"insensitive_angle_rad = {self.insensitive_angle_rad} is not accepted: less than pi/2 is"
            )

    def build(self, interval_s: float, rng: np.random.Generator) -> SensorModel:
        """One specimen: draws its offset, its scale error and where its drift starts."""
        decay, drive_pa = gauss_markov(self.drift_pa, self.drift_time_constant_s, interval_s)
        constants = _Constants(
            noise_pa=self.noise_pa,
            offset_pa=self.zero_offset_pa * rng.standard_normal(),
            gain=1.0 + self.scale_error * rng.standard_normal(),
            decay=decay,
            drive_pa=drive_pa,
            lag_gain=1.0 if self.lag_s == 0.0 else 1.0 - math.exp(-interval_s / self.lag_s),
            quantum_pa=self.quantum_pa,
            limit_pa=self.range_pa,
            insensitive_rad=self.insensitive_angle_rad,
            rise_k=self.self_heating_k,
            temperature_quantum_k=self.temperature_quantum_k,
        )
        state = _State(drift_pa=self.drift_pa * rng.standard_normal(), lagged_pa=math.nan)
        return SensorModel(
            kernel=_measure,
            constants=packed(constants),
            state=packed(state),
            normals_per_sample=_NORMALS,
            size=AIRSPEED_SIZE,
            fault_targets=(
                FaultTarget(
                    unit=SensorUnit.AIRSPEED,
                    channels=slice(0, AIRSPEED_SIZE),
                    wrong_bias=(-100.0, 0.0),
                    drift_per_s=(-1.0, 0.0),
                    low=(-self.range_pa, -40.0),
                    high=(self.range_pa, 85.0),
                    blocked=(0.0, math.nan),
                ),
            ),
        )


@kernel
def impact_pressure_pa(static_pa: float, dynamic_pa: float) -> float:
    """Impact pressure of an isentropic subsonic flow; the dynamic pressure 1/2 rho V^2 at low speed."""
    if static_pa <= 0.0:
        return dynamic_pa
    mach_sq = 2.0 * dynamic_pa / (_GAMMA * static_pa)
    # expm1 and log1p: at 10 m/s the plain form would lose five digits
    exponent = _GAMMA / (_GAMMA - 1.0)
    return static_pa * math.expm1(exponent * math.log1p(0.5 * (_GAMMA - 1.0) * mach_sq))


@kernel
def pressure_recovery(incidence_rad: float, insensitive_rad: float) -> float:
    """Share of the impact pressure that a tube takes up from a flow at an angle to its axis."""
    beyond = incidence_rad - insensitive_rad
    if beyond <= 0.0:
        return 1.0
    if incidence_rad >= 0.5 * math.pi:
        return 0.0
    # the cosine falls to zero at 90 degrees, wherever it begins
    cosine = math.cos(0.5 * math.pi * beyond / (0.5 * math.pi - insensitive_rad))
    return cosine * cosine


@kernel
def _measure(
    truth: Array, constants: RecordArray, states: RecordArray, normals: Array, row: int, out: Array
) -> bool:
    c: _Constants = constants[0]
    s: _State = states[0]
    # of the flow to the body's x axis: u / V
    cosine = math.cos(truth[t.ANGLE_OF_ATTACK_RAD]) * math.cos(truth[t.SIDESLIP_RAD])
    incidence_rad = math.acos(min(1.0, max(-1.0, cosine)))
    pressure_pa = pressure_recovery(incidence_rad, c.insensitive_rad) * impact_pressure_pa(
        truth[t.PRESSURE_PA], truth[t.DYNAMIC_PRESSURE_PA]
    )
    if math.isnan(s.lagged_pa):
        s.lagged_pa = pressure_pa
    s.lagged_pa += c.lag_gain * (pressure_pa - s.lagged_pa)
    value_pa = c.gain * s.lagged_pa + c.offset_pa + s.drift_pa + c.noise_pa * normals[row, 0]
    out[AIRSPEED_DIFFERENTIAL_PRESSURE_PA] = quantise(saturate(value_pa, c.limit_pa), c.quantum_pa)
    out[AIRSPEED_TEMPERATURE_C] = quantise(
        truth[t.TEMPERATURE_K] - ICE_POINT_K + c.rise_k, c.temperature_quantum_k
    )
    s.drift_pa = c.decay * s.drift_pa + c.drive_pa * normals[row, 1]
    return True
