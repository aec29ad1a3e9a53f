"""The rotors' vibration in the IMU: its frequencies, its size, what averaging makes of it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.interface import IMU_ACCEL_FRD_M_S2, IMU_GYRO_FRD_RAD_S
from flightsim.sensors import ImuParameters, RotorVibrationParameters, SensorSuite, SensorSuiteParameters

Array = NDArray[np.float64]

RATE_HZ = 250
SAMPLES = 5000
QUIET = ImuParameters(
    gyro_noise_density_rad_s_sqrt_hz=0.0,
    gyro_bias_instability_rad_s=0.0,
    gyro_turn_on_bias_rad_s=0.0,
    gyro_scale_error=0.0,
    gyro_cross_axis_error=0.0,
    gyro_quantum_rad_s=0.0,
    accel_noise_density_m_s2_sqrt_hz=0.0,
    accel_bias_instability_m_s2=0.0,
    accel_turn_on_bias_m_s2=0.0,
    accel_scale_error=0.0,
    accel_cross_axis_error=0.0,
    accel_quantum_m_s2=0.0,
)
ONLY_IMU = {name: None for name in ("barometer", "magnetometer", "gps", "battery", "rangefinder")}


def readings(vibration: RotorVibrationParameters | None, *speeds_rad_s: float, seed: int = 1) -> Array:
    """(SAMPLES, 6) body rates and specific force of a vehicle that is else at rest."""
    truth = np.zeros(t.TRUTH_SIZE)
    truth[t.Q_NED_FROM_FRD.start] = 1.0
    truth[t.TEMPERATURE_K] = 288.15
    truth[t.ROTOR_RAD_S.start : t.ROTOR_RAD_S.start + len(speeds_rad_s)] = speeds_rad_s
    suite = SensorSuite(
        SensorSuiteParameters(imu=replace(QUIET, vibration=vibration), **ONLY_IMU),
        physics_rate_hz=RATE_HZ,
        truth=truth,
        seeds=lambda name: RandomStreams(seed).child("vehicle", 0, "sensor", name),
    )
    out = np.empty((SAMPLES, 6))
    for k in range(SAMPLES):
        suite.step((k + 1) * 4000)
        out[k, :3] = suite.readings.imu.values[IMU_GYRO_FRD_RAD_S]
        out[k, 3:] = suite.readings.imu.values[IMU_ACCEL_FRD_M_S2]
    return out


def tone(values: Array) -> tuple[float, float]:
    """Frequency (Hz) and amplitude of the strongest line."""
    spectrum = np.abs(np.fft.rfft(values * np.hanning(len(values)))) * 4.0 / len(values)
    peak = int(np.argmax(spectrum))
    return peak * RATE_HZ / len(values), float(spectrum[peak])


def folded_hz(frequency_hz: float) -> float:
    """Where sampling puts a frequency."""
    return abs(frequency_hz - RATE_HZ * round(frequency_hz / RATE_HZ))


@pytest.mark.parametrize("speed_rad_s", [300.0, 600.0, 900.0])
def test_once_and_twice_a_turn_and_folded(speed_rad_s: float) -> None:
    vibration = RotorVibrationParameters()
    out = readings(vibration, speed_rad_s)
    once_hz = speed_rad_s / math.tau
    for axis in (3, 4):  # across the rotor's axis
        assert tone(out[:, axis])[0] == pytest.approx(folded_hz(once_hz), abs=0.06)
    frequency_hz, amplitude = tone(out[:, 5])  # along it
    assert frequency_hz == pytest.approx(folded_hz(2.0 * once_hz), abs=0.06)
    fine_s = np.linspace(0.0, 1.0 / RATE_HZ, 1001)
    kept = abs(np.mean(np.exp(2j * speed_rad_s * fine_s)))  # by averaging over a sample's interval
    assert amplitude == pytest.approx(vibration.blade_passage_m * speed_rad_s**2 * kept, rel=0.15)


def test_the_turning_force_grows_with_the_square_of_the_speed_and_rocks_the_vehicle() -> None:
    vibration = RotorVibrationParameters(blade_passage_m=0.0)
    slow, fast = readings(vibration, 150.0), readings(vibration, 300.0)

    def size(values: Array) -> float:
        return float(np.hypot(*values.std(axis=0)))

    kept = math.sin(0.6) / 0.6 / (math.sin(0.3) / 0.3)
    assert size(fast[:, 3:5]) / size(slow[:, 3:5]) == pytest.approx(4.0 * kept, rel=0.02)
    assert size(slow[:, 0:2]) == pytest.approx(vibration.lever_1_m * size(slow[:, 3:5]) / 150.0, rel=0.02)
    assert np.allclose(fast[:, 5], 0.0) and np.allclose(fast[:, 2], 0.0)


def test_a_quadrotors_size_over_seeds() -> None:
    """Four rotors at 600 rad/s: tenths of m/s^2, as on a frame with new propellers."""
    rms = [readings(RotorVibrationParameters(), *([600.0] * 4), seed=seed)[:, 3].std() for seed in range(8)]
    assert 0.1 < np.sqrt(np.mean(np.square(rms))) < 1.0 and len(set(rms)) == len(rms)


def test_nothing_from_standing_rotors_or_without_it_and_an_aircraft_shakes_across_its_nose() -> None:
    assert not readings(RotorVibrationParameters(), 0.0).any()
    assert not readings(None, 600.0).any()
    out = readings(RotorVibrationParameters(axis=0, blade_passage_m=0.0), 500.0)
    assert np.allclose(out[:, 3], 0.0) and out[:, 4:].std() > 0.01
    imu = SensorSuiteParameters.fixed_wing().imu
    assert imu is not None and imu.vibration is not None and imu.vibration.axis == 0


def test_one_seed_is_one_vibration() -> None:
    runs = [readings(RotorVibrationParameters(), 600.0, 610.0, seed=seed) for seed in (5, 5, 6)]
    assert runs[0].tobytes() == runs[1].tobytes() != runs[2].tobytes()


@pytest.mark.parametrize(("field", "value"), [("imbalance_m", -1.0), ("lever_1_m", math.nan), ("axis", 3)])
def test_parameters_are_checked(field: str, value: float) -> None:
    with pytest.raises(ValueError, match=field):
        RotorVibrationParameters(**{field: value})  # type: ignore[arg-type]
