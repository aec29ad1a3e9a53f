"""Airspeed from a pitot tube: conversion, smoothing, and checks."""

import math
from typing import Final

from autopilot_bridge.navigation.parameters import NavigationParameters
from flightsim import interface as interface
from flightsim.foundation.atmosphere import (
    ICE_POINT_K,
    SEA_LEVEL_PRESSURE_PA,
    SEA_LEVEL_TEMPERATURE_K,
    air_density_kg_m3,
    standard_temperature_k,
)

_SEA_LEVEL_KG_M3: Final = air_density_kg_m3(SEA_LEVEL_PRESSURE_PA, SEA_LEVEL_TEMPERATURE_K)
_TEMPERATURE_C: Final = (-60.0, 80.0)  # plausible of the transducer
_PRESSURE_PA: Final = (1.0e4, 1.2e5)
_MAX_DIFFERENTIAL_PA: Final = 1.0e4
_STALE_US: Final = 1_000_000
_STUCK_US: Final = 2_000_000  # PX4: no change for two seconds


class Pitot:
    """The sensor's newest airspeed.

    Attributes:
        equivalent_m_s: equivalent airspeed of the newest sample; NaN before the first.
        true_per_equivalent: true over equivalent airspeed at the present density.
        sample_us: when the newest usable sample was measured; -1 before the first.
    """

    def __init__(self, parameters: NavigationParameters, *, readings: interface.SensorReadings) -> None:
        self._parameters = parameters
        self._readings = readings
        self.restart()

    def set_parameters(self, parameters: NavigationParameters) -> None:
        """New calibration for the samples to come."""
        self._parameters = parameters

    def restart(self) -> None:
        """As before the first sample."""
        self.equivalent_m_s = math.nan
        self.true_per_equivalent = 1.0
        self.sample_us = -1
        self._newest_us = -1
        self._changed_us = -1
        self._pressure_pa = math.nan

    @property
    def true_m_s(self) -> float:
        """True airspeed of the newest sample."""
        return self.equivalent_m_s * self.true_per_equivalent

    def look(self, time_us: int) -> None:
        """Take the reading's sample at `time_us` if it is new and makes sense."""
        reading = self._readings.airspeed
        pressure_pa = float(reading.values[interface.AIRSPEED_DIFFERENTIAL_PRESSURE_PA])
        if reading.time_us == self.sample_us or not abs(pressure_pa) <= _MAX_DIFFERENTIAL_PA:
            return
        self._newest_us = time_us
        self.sample_us = reading.time_us
        if pressure_pa != self._pressure_pa:
            self._pressure_pa = pressure_pa
            self._changed_us = time_us
        scale = self._parameters.airspeed_scale
        self.equivalent_m_s = scale * math.sqrt(2.0 * max(pressure_pa, 0.0) / _SEA_LEVEL_KG_M3)

    def alive(self, time_us: int) -> bool:
        """Samples come, and they vary."""
        return (
            self._newest_us >= 0
            and time_us - self._newest_us <= _STALE_US
            and time_us - self._changed_us <= _STUCK_US
        )

    def update_density(self, *, trusted: bool) -> None:
        """Air density from the barometer, and from the sensor's own temperature if that is valid."""
        static_pa = float(self._readings.barometer.values[interface.BARO_PRESSURE_PA])
        if not _PRESSURE_PA[0] <= static_pa <= _PRESSURE_PA[1]:
            return
        sensed_c = float(self._readings.airspeed.values[interface.AIRSPEED_TEMPERATURE_C])
        if trusted and _TEMPERATURE_C[0] <= sensed_c <= _TEMPERATURE_C[1]:
            temperature_k = sensed_c + ICE_POINT_K - self._parameters.airspeed_sensor_heating_k
        else:
            temperature_k = standard_temperature_k(static_pa)
        density = air_density_kg_m3(static_pa, temperature_k)
        self.true_per_equivalent = math.sqrt(_SEA_LEVEL_KG_M3 / density)


class AirspeedCheck:
    """Decides over time whether the sensor is used: PX4's airspeed selector (AirspeedValidator).

    The part of the innovation beyond a limit is added up; beyond an integral, or when the sensor is dead,
    the check fails. Failing for `airspeed_stop_delay_s` takes the sensor out, passing for
    `airspeed_start_delay_s` brings it back.

    Attributes:
        passed: the sensor is used.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Use the sensor until its checks fail."""
        self.passed = True
        self._integral_m = 0.0
        self._bad_since_us = -1
        self._good_since_us = -1
        self._updated_us = -1

    def update(
        self,
        parameters: NavigationParameters,
        time_us: int,
        *,
        alive: bool,
        innovation_m_s: float,
        sigma_m_s: float,
    ) -> None:
        """Judge at `time_us`; `sigma_m_s` is what the innovation (NaN: none) may owe to the estimate."""
        elapsed_s = (time_us - self._updated_us) * 1e-6 if self._updated_us >= 0 else 0.0
        self._updated_us = time_us
        excess = 0.0
        if parameters.airspeed_checks and not math.isnan(innovation_m_s):
            allowed = parameters.airspeed_check_innovation_m_s + 2.0 * sigma_m_s
            excess = max(0.0, abs(innovation_m_s) - allowed)
        self._integral_m = self._integral_m + excess * elapsed_s if excess > 0.0 else 0.0
        if not alive or self._integral_m > parameters.airspeed_check_integral_m:
            self._good_since_us = -1
            if self._bad_since_us < 0:
                self._bad_since_us = time_us
            if time_us - self._bad_since_us >= parameters.airspeed_stop_delay_s * 1e6:
                self.passed = False
            return
        self._bad_since_us = -1
        if self._good_since_us < 0 or excess > 0.0:  # to come back it must agree, not just begin to disagree
            self._good_since_us = time_us
        if time_us - self._good_since_us >= parameters.airspeed_start_delay_s * 1e6:
            self.passed = True


class GustVariance:
    """Variance of the turbulence in one kind of innovation, averaged over a minute, light until it has shown.

    Attributes:
        variance: (m/s)^2.
    """

    _LIGHT: Final = 1.0  # (m/s)^2, light turbulence of MIL-F-8785C at 100 m
    _LIGHT_FOR_S: Final = 15.0  # weight of that first guess
    _LONGEST_S: Final = 60.0
    _MOST: Final = 100.0  # (m/s)^2, limit for one innovation
    _SETTLED: Final = 1.0  # (m/s)^2 of the estimate, below which the innovation is turbulence

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Light turbulence."""
        self.variance = self._LIGHT
        self._memory_s = self._LIGHT_FOR_S

    def add(
        self, innovation_m_s: float, noise_variance: float, state_variance: float, interval_s: float
    ) -> None:
        """Take an accepted innovation. What the state contributes isn't subtracted once it is small: the
        wind's error is then mostly turbulence of the last minute, with the same sign."""
        if state_variance > self._SETTLED:
            return
        excess = max(0.0, min(innovation_m_s * innovation_m_s, self._MOST) - noise_variance)
        self._memory_s = min(self._memory_s + interval_s, self._LONGEST_S)
        self.variance += (excess - self.variance) * min(1.0, interval_s / self._memory_s)
