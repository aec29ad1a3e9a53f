"""The readings of a flight from its records, and what they make."""

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT, SURVEY_MAGNETOMETER_COMPONENT
from autopilot_bridge.mavlink.wire_units import place_columns
from estimators import survey_magnetometer
from estimators.errors import EstimatorError
from estimators.survey.compensation import (
    Compensation,
    direction_cosines,
    figure_of_merit_nt,
    fit_compensation,
    mean_cycle,
    noise_figure_nt,
)
from estimators.survey.processing import aircraft_field_nt, white_noise_nt
from estimators.survey.readings import SurveyReadings, placed_readings
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.main_field import MainField
from missions.flown.records import FlightRecords
from missions.survey.manoeuvres import BOXES, manoeuvres
from missions.vehicle.notes import FlightNotes

__all__ = ["Calibration", "calibrated", "flight_readings"]

Array = NDArray[np.float64]

_ANGLES: Final = ("roll", "pitch", "yaw")

_MARGIN_S: Final = 5.0  # of the flight around the manoeuvres, for the filter's ends


def flight_readings(
    records: FlightRecords, system_id: int, frame: LocalFrame, *, attitude: bool
) -> SurveyReadings:
    """All readings of a vehicle's magnetometer in a flight, placed in a frame.

    Args:
        records: of the flight.
        system_id: the vehicle.
        frame: the frame.
        attitude: give them the vehicle's attitude, for a compensation; readings without one are left out.
    """
    sent = records.table("NAMED_VALUE_FLOAT", system_id, SURVEY_MAGNETOMETER_COMPONENT)
    sent = sent[sent["name"] == survey_magnetometer.TOTAL_FIELD_NAME.encode()]
    positions = records.positions(system_id)
    attitudes = records.table("ATTITUDE", system_id, AUTOPILOT_COMPONENT)
    finite = np.all([np.isfinite(attitudes[name]) for name in _ANGLES], axis=0)
    attitudes = attitudes[finite]
    return placed_readings(
        sent["time_boot_ms"] * 1e-3,
        sent["value"].astype(np.float64),
        positions=_columns(positions, *place_columns(positions)),
        attitudes=_columns(attitudes, *(attitudes[name] for name in _ANGLES)) if attitude else None,
        frame=frame,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Calibration:
    """A compensation and how good it is, from the second box, which it was not fitted to.

    Attributes:
        compensation: the coefficients.
        figure_of_merit_nt: of the compensated readings: sum of the peak-to-peak values of twelve manoeuvres.
        figure_of_merit_before_nt: of the readings as they were.
        figure_of_merit_noise_nt: what the white noise of the readings alone makes of it.
        improvement: improvement ratio: standard deviation of the readings during the manoeuvres before
            compensation over that after it, of the mean cycles.
        before_nt, after_nt: readings of the manoeuvres of the second box, less their level, by label.
    """

    compensation: Compensation
    figure_of_merit_nt: float
    figure_of_merit_before_nt: float
    figure_of_merit_noise_nt: float
    improvement: float
    before_nt: dict[str, Array] = field(default_factory=dict)
    after_nt: dict[str, Array] = field(default_factory=dict)


def calibrated(
    readings: SurveyReadings, notes: FlightNotes, direction_rad: float, main: MainField
) -> Calibration:
    """Fit the first box of a calibration flight, and judge the fit by the second.

    Args:
        readings: of the flight, in the frame of the main field's home.
        notes: with the phases of the manoeuvres.
        direction_rad: of the first leg.
        main: the main field, which is taken out of the readings. Geology is not: the flight is high above it.

    Raises:
        EstimatorError: manoeuvres are missing, or too small.
    """
    times: list[list[tuple[str, float, float]]] = [[] for _ in range(BOXES)]
    for manoeuvre in manoeuvres(direction_rad):
        phase = notes.phase(manoeuvre.label)
        if phase is None:
            raise EstimatorError(f"the calibration flight has no {manoeuvre.label}")
        times[manoeuvre.box].append((manoeuvre.label, phase.start_us * 1e-6, phase.end_us * 1e-6))
    residual = readings.total_nt - (
        main.total_at_nt(readings.north_m, readings.east_m) + main.gradient_up_nt_m * readings.height_m
    )
    fitted_from, fitted_to = times[0][0][1] - _MARGIN_S, times[0][-1][2] + _MARGIN_S
    part = (readings.time_s >= fitted_from) & (readings.time_s <= fitted_to)
    cosines, rates = direction_cosines(
        readings.roll_rad, readings.pitch_rad, readings.yaw_rad, readings.time_s, main.direction_ned
    )
    compensation = fit_compensation(
        readings.time_s[part], residual[part] + main.total_nt, cosines[part], rates[part]
    )
    left = residual - aircraft_field_nt(readings, compensation, main.direction_ned)
    rate_hz = 1.0 / float(np.median(np.diff(readings.time_s)))
    before, after = (
        {
            label: values[(readings.time_s >= start) & (readings.time_s <= end)]
            for label, start, end in times[1]
        }
        for values in (residual, left)
    )
    spreads = [
        np.concatenate([mean_cycle(values, rate_hz=rate_hz) for values in parts.values()]).std()
        for parts in (before, after)
    ]
    flown = list(after.values())
    numbers = np.repeat(np.arange(len(flown)), [len(values) for values in flown])
    noise_nt = white_noise_nt(np.concatenate(flown), numbers)
    return Calibration(
        compensation=compensation,
        figure_of_merit_nt=figure_of_merit_nt(flown, rate_hz=rate_hz),
        figure_of_merit_noise_nt=noise_figure_nt(flown, noise_nt, rate_hz=rate_hz),
        figure_of_merit_before_nt=figure_of_merit_nt(list(before.values()), rate_hz=rate_hz),
        improvement=float(spreads[0] / max(float(spreads[1]), 1e-12)),
        before_nt=before,
        after_nt=after,
    )


def _columns(table: NDArray[np.void], *values: Array) -> Array:
    columns = table["time_boot_ms"] * 1e-3, *values
    return np.column_stack([np.asarray(column, dtype=np.float64) for column in columns])
