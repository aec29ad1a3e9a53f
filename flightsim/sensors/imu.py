"""Inertial measurement unit: three gyros and three accelerometers at the centre of gravity, one reading.

Per axis: the rotors' vibration, cross-axis matrix, turn-on bias, wandering bias (first-order Gauss-Markov),
white noise, saturation, quantisation. Terms: Woodman, An introduction to inertial navigation (2007), section
3.2; IEEE Std 952.
"""

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.atmosphere import GRAVITY_M_S2, ICE_POINT_K
from flightsim.foundation.checks import NotNegative, Positive, Rate
from flightsim.foundation.kernels import kernel
from flightsim.foundation.options import Options
from flightsim.interface import IMU_ACCEL_FRD_M_S2, IMU_GYRO_FRD_RAD_S, IMU_SIZE, IMU_TEMPERATURE_C
from flightsim.sensors.fault_kinds import FaultTarget, SensorUnit
from flightsim.sensors.sensor import SensorModel, gauss_markov, quantise, saturate
from flightsim.sensors.vibration import CONSTANTS, ROTORS, RotorVibrationParameters, add_vibration

Array = NDArray[np.float64]

_DEG: Final = math.pi / 180.0

# Each triad has the same constants, accelerometer after gyro.
_MATRIX: Final = 0  # 9 numbers: what the axes read of a vector in FRD
_BIAS: Final = 9  # 3 numbers: turn-on bias
_WHITE: Final = 12
_DECAY: Final = 13
_DRIVE: Final = 14
_LIMIT: Final = 15
_QUANTUM: Final = 16
_TRIAD: Final = 17
_RISE_K: Final = 2 * _TRIAD
_WARMUP_DECAY: Final = _RISE_K + 1
_TEMPERATURE_QUANTUM: Final = _RISE_K + 2
_VIBRATION: Final = _RISE_K + 3
_CONSTANTS: Final = _VIBRATION + CONSTANTS

# state: wandering bias of gyro and accelerometer, share of the self-heating still to come, phases of the
# rotors, rates and specific force with their vibration
_WARMUP: Final = 6
_PHASES: Final = 7
_VIBRATING: Final = _PHASES + ROTORS
_STATE: Final = _VIBRATING + 6
_NORMALS: Final = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuParameters(Options):
    """A calibrated Bosch BMI088, the IMU of Pixhawk 5X and 6X boards, unless noted otherwise.

    Numbers are one-sigma where they describe a spread. Datasheet: BST-BMI088-DS001, section 1.2.

    Attributes:
        rate_hz: samples per second.
        latency_s: zero: PX4 and ArduPilot read the FIFO within a control step.
        gyro_noise_density_rad_s_sqrt_hz: 0.014 deg/s/sqrt(Hz). White noise per sample is
            density * sqrt(rate), the convention of angle random walk in rad/sqrt(s).
        gyro_bias_instability_rad_s: of the wandering bias; 0.015 deg/s/K (datasheet TCO) times 1 K.
        gyro_bias_time_constant_s: PX4's Gazebo IMU plugin.
        gyro_turn_on_bias_rad_s: left after the calibration at boot, about 0.06 deg/s.
        gyro_scale_error: datasheet tolerance 1 % taken as three sigma.
        gyro_cross_axis_error: likewise from 1 %, with the factory's alignment of the die in the package.
        gyro_range_rad_s, gyro_quantum_rad_s: 2000 deg/s in 16 bits.
        accel_noise_density_m_s2_sqrt_hz: 175 ug/sqrt(Hz) (160 for x and y, 190 for z).
        accel_bias_instability_m_s2: 0.2 mg/K (datasheet TCO) at about 1 K.
        accel_bias_time_constant_s: PX4's Gazebo IMU plugin.
        accel_turn_on_bias_m_s2: left after a six-side calibration of the datasheet's 20 mg offset.
        accel_scale_error, accel_cross_axis_error: left after calibration.
        accel_range_m_s2, accel_quantum_m_s2: 24 g in 16 bits.
        self_heating_k, warm_up_s: the board's temperature over the air's, reached exponentially from boot.
        temperature_quantum_k: 0.125 K.
        vibration: of the airframe by its rotors; None: none.
    """

    rate_hz: Rate = 250
    latency_s: NotNegative = 0.0
    gyro_noise_density_rad_s_sqrt_hz: NotNegative = 0.014 * _DEG
    gyro_bias_instability_rad_s: NotNegative = 0.015 * _DEG
    gyro_bias_time_constant_s: Positive = 1000.0
    gyro_turn_on_bias_rad_s: NotNegative = 1.0e-3
    gyro_scale_error: NotNegative = 0.0033
    gyro_cross_axis_error: NotNegative = 0.001
    gyro_range_rad_s: Positive = 2000.0 * _DEG
    gyro_quantum_rad_s: NotNegative = 2000.0 * _DEG / 32768.0
    accel_noise_density_m_s2_sqrt_hz: NotNegative = 175e-6 * GRAVITY_M_S2
    accel_bias_instability_m_s2: NotNegative = 0.2e-3 * GRAVITY_M_S2
    accel_bias_time_constant_s: Positive = 300.0
    accel_turn_on_bias_m_s2: NotNegative = 0.02
    accel_scale_error: NotNegative = 0.001
    accel_cross_axis_error: NotNegative = 0.001
    accel_range_m_s2: Positive = 24.0 * GRAVITY_M_S2
    accel_quantum_m_s2: NotNegative = 24.0 * GRAVITY_M_S2 / 32768.0
    self_heating_k: NotNegative = 15.0
    warm_up_s: Positive = 300.0
    temperature_quantum_k: NotNegative = 0.125
    vibration: RotorVibrationParameters | None = field(default_factory=RotorVibrationParameters)

    def build(self, interval_s: float, rng: np.random.Generator) -> SensorModel:
        """One specimen: draws its scale, cross-axis and turn-on errors and where its bias starts."""
        constants = np.zeros(_CONSTANTS)
        state = np.zeros(_STATE)
        triads = (
            (
                self.gyro_scale_error,
                self.gyro_cross_axis_error,
                self.gyro_turn_on_bias_rad_s,
                self.gyro_noise_density_rad_s_sqrt_hz,
                (self.gyro_bias_instability_rad_s, self.gyro_bias_time_constant_s),
                (self.gyro_range_rad_s, self.gyro_quantum_rad_s),
            ),
            (
                self.accel_scale_error,
                self.accel_cross_axis_error,
                self.accel_turn_on_bias_m_s2,
                self.accel_noise_density_m_s2_sqrt_hz,
                (self.accel_bias_instability_m_s2, self.accel_bias_time_constant_s),
                (self.accel_range_m_s2, self.accel_quantum_m_s2),
            ),
        )
        for index, (scale, cross_axis, turn_on, density, wander, converter) in enumerate(triads):
            c = constants[index * _TRIAD : (index + 1) * _TRIAD]
            spread = np.full((3, 3), cross_axis) + (scale - cross_axis) * np.eye(3)
            c[_MATRIX : _MATRIX + 9] = (np.eye(3) + spread * rng.standard_normal((3, 3))).ravel()
            c[_BIAS : _BIAS + 3] = turn_on * rng.standard_normal(3)
            c[_WHITE] = density / math.sqrt(interval_s)
            c[_DECAY], c[_DRIVE] = gauss_markov(*wander, interval_s)
            c[_LIMIT], c[_QUANTUM] = converter
            state[3 * index : 3 * index + 3] = wander[0] * rng.standard_normal(3)
        constants[_RISE_K] = self.self_heating_k
        constants[_WARMUP_DECAY] = math.exp(-interval_s / self.warm_up_s)
        constants[_TEMPERATURE_QUANTUM] = self.temperature_quantum_k
        state[_WARMUP] = 1.0
        if self.vibration is not None:
            vibration, phases = self.vibration.build(interval_s, rng)
            constants[_VIBRATION:] = vibration
            state[_PHASES : _PHASES + ROTORS] = phases
        return SensorModel(
            kernel=_measure,
            constants=constants,
            state=state,
            normals_per_sample=_NORMALS,
            size=IMU_SIZE,
            fault_targets=(
                FaultTarget(
                    unit=SensorUnit.GYRO,
                    channels=IMU_GYRO_FRD_RAD_S,
                    wrong_bias=(0.2, 0.0, 0.0),
                    drift_per_s=(0.005, 0.0, 0.0),
                    low=(-self.gyro_range_rad_s,) * 3,
                    high=(self.gyro_range_rad_s,) * 3,
                ),
                FaultTarget(
                    unit=SensorUnit.ACCEL,
                    channels=IMU_ACCEL_FRD_M_S2,
                    wrong_bias=(2.0, 0.0, 0.0),
                    drift_per_s=(0.05, 0.0, 0.0),
                    low=(-self.accel_range_m_s2,) * 3,
                    high=(self.accel_range_m_s2,) * 3,
                ),
            ),
        )


_RATES: Final = t.RATES_FRD_RAD_S.start
_FORCE: Final = t.SPECIFIC_FORCE_FRD_M_S2.start
_GYRO: Final = IMU_GYRO_FRD_RAD_S.start
_ACCEL: Final = IMU_ACCEL_FRD_M_S2.start


@kernel
def _measure(truth: Array, constants: Array, state: Array, normals: Array, row: int, out: Array) -> bool:
    sensed = state[_VIBRATING : _VIBRATING + 6]
    for axis in range(3):
        sensed[axis] = truth[_RATES + axis]
        sensed[3 + axis] = truth[_FORCE + axis]
    if constants[_VIBRATION] > 0.0:
        add_vibration(
            truth, constants[_VIBRATION:], state[_PHASES : _PHASES + ROTORS], sensed[:3], sensed[3:]
        )
    for triad in range(2):
        c = triad * _TRIAD
        target = _GYRO if triad == 0 else _ACCEL
        x, y, z = sensed[3 * triad], sensed[3 * triad + 1], sensed[3 * triad + 2]
        for axis in range(3):
            wander = 3 * triad + axis
            m = c + _MATRIX + 3 * axis
            value = (
                constants[m] * x
                + constants[m + 1] * y
                + constants[m + 2] * z
                + constants[c + _BIAS + axis]
                + state[wander]
                + constants[c + _WHITE] * normals[row, wander]
            )
            out[target + axis] = quantise(saturate(value, constants[c + _LIMIT]), constants[c + _QUANTUM])
            state[wander] = (
                constants[c + _DECAY] * state[wander] + constants[c + _DRIVE] * normals[row, 6 + wander]
            )
    air_c = truth[t.TEMPERATURE_K] - ICE_POINT_K
    out[IMU_TEMPERATURE_C] = quantise(
        air_c + constants[_RISE_K] * (1.0 - state[_WARMUP]), constants[_TEMPERATURE_QUANTUM]
    )
    state[_WARMUP] *= constants[_WARMUP_DECAY]
    return True
