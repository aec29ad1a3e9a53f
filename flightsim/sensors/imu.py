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
from flightsim.foundation.records import packed
from flightsim.interface import IMU_ACCEL_FRD_M_S2, IMU_GYRO_FRD_RAD_S, IMU_SIZE, IMU_TEMPERATURE_C
from flightsim.sensors.fault_kinds import FaultTarget, SensorUnit
from flightsim.sensors.sensor import RecordArray, SensorModel, gauss_markov, quantise, saturate
from flightsim.sensors.vibration import CONSTANTS, ROTORS, RotorVibrationParameters, add_vibration

Array = NDArray[np.float64]

_DEG: Final = math.pi / 180.0

_NORMALS: Final = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class _Constants:
    """Constants of the triads: gyro, accelerometer."""

    matrix: Array  # (2, 3, 3): what the axes read of a vector in FRD
    bias: Array  # (2, 3): turn-on bias
    white: Array  # (2,)
    decay: Array  # (2,), of the wandering bias
    drive: Array  # (2,)
    limit: Array  # (2,)
    quantum: Array  # (2,)
    rise_k: float
    warm_up_decay: float
    temperature_quantum_k: float
    vibrates: bool
    vibration: Array  # flightsim.sensors.vibration


@dataclass(slots=True, kw_only=True)
class _State:
    wander: Array  # (2, 3)
    warm_up: float  # share of the self-heating that is still to come
    phases: Array  # (ROTORS,)
    vibrating: Array  # (2, 3): rates and specific force with their vibration


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
        matrix, bias, wander = np.zeros((2, 3, 3)), np.zeros((2, 3)), np.zeros((2, 3))
        for index, (scale, cross_axis, turn_on, _, instability, _) in enumerate(triads):
            spread = np.full((3, 3), cross_axis) + (scale - cross_axis) * np.eye(3)
            matrix[index] = np.eye(3) + spread * rng.standard_normal((3, 3))
            bias[index] = turn_on * rng.standard_normal(3)
            wander[index] = instability[0] * rng.standard_normal(3)
        decay, drive = np.array([gauss_markov(*triad[4], interval_s) for triad in triads]).T
        vibration, phases = np.zeros(CONSTANTS), np.zeros(ROTORS)
        if self.vibration is not None:
            vibration, phases = self.vibration.build(interval_s, rng)
        constants = _Constants(
            matrix=matrix,
            bias=bias,
            white=np.array([triad[3] / math.sqrt(interval_s) for triad in triads]),
            decay=decay,
            drive=drive,
            limit=np.array([triad[5][0] for triad in triads]),
            quantum=np.array([triad[5][1] for triad in triads]),
            rise_k=self.self_heating_k,
            warm_up_decay=math.exp(-interval_s / self.warm_up_s),
            temperature_quantum_k=self.temperature_quantum_k,
            vibrates=self.vibration is not None,
            vibration=vibration,
        )
        state = _State(wander=wander, warm_up=1.0, phases=phases, vibrating=np.zeros((2, 3)))
        return SensorModel(
            kernel=_measure,
            constants=packed(constants),
            state=packed(state),
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
def _measure(
    truth: Array, constants: RecordArray, states: RecordArray, normals: Array, row: int, out: Array
) -> bool:
    c: _Constants = constants[0]
    s: _State = states[0]
    sensed = s.vibrating
    for axis in range(3):
        sensed[0, axis] = truth[_RATES + axis]
        sensed[1, axis] = truth[_FORCE + axis]
    if c.vibrates:
        add_vibration(truth, c.vibration, s.phases, sensed[0], sensed[1])
    for triad in range(2):
        target = _GYRO if triad == 0 else _ACCEL
        x, y, z = sensed[triad, 0], sensed[triad, 1], sensed[triad, 2]
        for axis in range(3):
            value = (
                c.matrix[triad, axis, 0] * x
                + c.matrix[triad, axis, 1] * y
                + c.matrix[triad, axis, 2] * z
                + c.bias[triad, axis]
                + s.wander[triad, axis]
                + c.white[triad] * normals[row, 3 * triad + axis]
            )
            out[target + axis] = quantise(saturate(value, c.limit[triad]), c.quantum[triad])
            s.wander[triad, axis] = (
                c.decay[triad] * s.wander[triad, axis] + c.drive[triad] * normals[row, 6 + 3 * triad + axis]
            )
    air_c = truth[t.TEMPERATURE_K] - ICE_POINT_K
    out[IMU_TEMPERATURE_C] = quantise(air_c + c.rise_k * (1.0 - s.warm_up), c.temperature_quantum_k)
    s.warm_up *= c.warm_up_decay
    return True
