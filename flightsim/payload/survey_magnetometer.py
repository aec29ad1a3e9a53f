"""Survey magnetometer: total field, as an optically pumped sensor on an aircraft reads it."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.checks import NotNegative, Positive, Rate
from flightsim.foundation.main_field import NANOTESLA_PER_GAUSS
from flightsim.foundation.rotations import rotate_inverse
from flightsim.payload.device import Carrier, Device, DeviceParameters
from flightsim.payload.home_frame import HomeFrame
from flightsim.payload.magnetic_field import MagneticField
from flightsim.payload.vehicle_field import VehicleField, VehicleFieldParameters
from flightsim.sensors.sensor import gauss_markov
from flightsim.sensors.suite import steps_per_sample

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class SurveyMagnetometerParameters(DeviceParameters):
    """A caesium or potassium magnetometer on a small aircraft, compensated.

    Attributes:
        rate_hz: readings per second.
        latency_s: from measurement to delivery; rounded to physics steps.
        noise_nt: white, per reading: engine, servos and payload currents; the sensor itself has 0.01.
        heading_error_nt: one sigma of each of the three permanent terms of Tolles and Lawson that
            compensation leaves: proportional to the direction cosines of the field in the body frame, so it
            changes with heading and attitude (Leliak 1961, IRE Transactions on Aerospace 8).
        drift_nt, drift_time_constant_s: Gauss-Markov; what base-station correction leaves of the field's
            daily variation, and the sensor's own wandering.
        quantum_nt: of the digital output.
        vehicle_field: of the whole aircraft, not compensated; None: compensated, so that only
            `heading_error_nt` is left.
    """

    rate_hz: Rate = 10
    latency_s: NotNegative = 0.0
    noise_nt: NotNegative = 0.2
    heading_error_nt: NotNegative = 0.3
    drift_nt: NotNegative = 0.2
    drift_time_constant_s: Positive = 600.0
    quantum_nt: NotNegative = 0.001
    vehicle_field: VehicleFieldParameters | None = None

    def build(self, carrier: Carrier) -> "SurveyMagnetometer":
        if carrier.magnetic_field is None:
            raise ValueError("a survey magnetometer needs a magnetic map; give the world one")
        return SurveyMagnetometer(
            self,
            truth=carrier.truth,
            field=carrier.magnetic_field,
            physics_rate_hz=carrier.physics_rate_hz,
            seed=carrier.seeds("survey_magnetometer"),
        )


@dataclass(frozen=True, slots=True)
class MagneticReading:
    """One reading.

    Attributes:
        time_us: when it was taken, microseconds since boot.
        total_field_nt: magnitude of the field.
    """

    time_us: int
    total_field_nt: float


class SurveyMagnetometer(Device[MagneticReading]):
    """One magnetometer on one vehicle.

    Attributes:
        parameters: as given.
        reading: newest delivered reading; None before the first.
        next_us: time of the next measurement or delivery; steps before it may be left out.
    """

    def __init__(
        self,
        parameters: SurveyMagnetometerParameters | None = None,
        *,
        truth: Array,
        field: MagneticField,
        physics_rate_hz: int,
        seed: np.random.SeedSequence,
    ) -> None:
        """Mount a magnetometer; its constant errors are drawn from its stream.

        Args:
            parameters: the magnetometer.
            truth: the vehicle's truth vector, read when a reading is due.
            field: what there is to measure.
            physics_rate_hz: calls of `step` per second.
            seed: its random stream.

        Raises:
            ValueError: the rate doesn't divide the physics rate.
        """
        p = self.parameters = parameters or SurveyMagnetometerParameters()
        self._interval_us = steps_per_sample(p.rate_hz, physics_rate_hz) * (1_000_000 // physics_rate_hz)
        self._latency_us = round(p.latency_s * physics_rate_hz) * 1_000_000 // physics_rate_hz
        self.next_us = self._due_us = 0
        self._truth = truth
        self._field = field
        self._home_frame = HomeFrame(field.home)
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._permanent_nt: Array = p.heading_error_nt * self._rng.standard_normal(3)
        self._drift_nt = p.drift_nt * float(self._rng.standard_normal())
        self._decay, self._drive_nt = gauss_markov(p.drift_nt, p.drift_time_constant_s, 1.0 / p.rate_hz)
        # drawn last, so that the other errors are the same with and without it
        self._vehicle_field = None if p.vehicle_field is None else VehicleField(p.vehicle_field, self._rng)
        self._body_field: Array = np.zeros(3)
        self._waiting: deque[MagneticReading] = deque()
        self.reading: MagneticReading | None = None

    def step(self, time_us: int) -> MagneticReading | None:
        """One physics step; the reading that is delivered on it, if there is one."""
        if time_us < self.next_us:
            return None
        if time_us >= self._due_us:
            self._due_us = time_us + self._interval_us
            self._waiting.append(MagneticReading(time_us, self._measure(time_us * 1e-6)))
        delivered: MagneticReading | None = None
        if self._waiting[0].time_us + self._latency_us <= time_us:
            delivered = self.reading = self._waiting.popleft()
        self.next_us = self._due_us
        if self._waiting:
            self.next_us = min(self._due_us, self._waiting[0].time_us + self._latency_us)
        return delivered

    def _measure(self, time_s: float) -> float:
        p, truth = self.parameters, self._truth
        north_m, east_m, down_m = self._home_frame.position_ned_m(truth)
        white, drive = self._rng.standard_normal(2).tolist()
        rotate_inverse(truth[t.Q_NED_FROM_FRD], truth[t.MAG_NED_GAUSS], self._body_field)
        strength = math.sqrt(float(self._body_field @ self._body_field))
        heading_error_nt = float(self._permanent_nt @ self._body_field) / strength if strength else 0.0
        value_nt = (
            self._field.total_nt(north_m, east_m, -down_m, time_s)
            + heading_error_nt
            + self._drift_nt
            + p.noise_nt * white
        )
        if self._vehicle_field is not None and strength:
            value_nt += self._vehicle_field.total_nt(
                self._body_field / strength, truth[t.RATES_FRD_RAD_S], NANOTESLA_PER_GAUSS * strength
            )
        self._drift_nt = self._decay * self._drift_nt + self._drive_nt * drive
        if p.quantum_nt > 0.0:
            value_nt = math.floor(value_nt / p.quantum_nt + 0.5) * p.quantum_nt
        return value_nt
