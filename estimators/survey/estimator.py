"""The estimator `survey`: the differential measurement during a flight, and the processed survey at its end.

Source: Lum, Rysdyk and Pongpunwattana 2005, section II; docs/magnetic_survey.md. Its inputs are the readings
of a survey magnetometer with positions and attitudes of the vehicle, and, if they exist, the published map,
the lines that were commanded, and the coefficients of the aircraft.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT, SURVEY_MAGNETOMETER_COMPONENT
from autopilot_bridge.mavlink.wire_units import degrees, metres
from estimators import wire
from estimators.input_guard import InputGuard
from estimators.interface import Estimator, Need, Outcome
from estimators.messages import Message, is_a
from estimators.occupancy.placed_readings import ReadingCheck
from estimators.occupancy.survey_map import SurveyMap, load_survey_map
from estimators.survey.compensation import Compensation, load_compensation
from estimators.survey.estimate import SurveyEstimate
from estimators.survey.export import MAP, survey_files
from estimators.survey.gridding import block_means
from estimators.survey.lines import LinePlan, detected_lines, load_lines
from estimators.survey.parameters import ProcessingParameters
from estimators.survey.processing import SurveyResult, aircraft_field_nt, check_grid, process_survey
from estimators.survey.readings import SurveyReadings, joined, placed_readings
from estimators.survey_magnetometer import TOTAL_FIELD_NAME
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.main_field import MainField
from flightsim.foundation.options import option

__all__ = ["SurveyEstimator", "SurveyEstimatorParameters"]

Array = NDArray[np.float64]

_BLOCK_US: Final = 1_000_000
_KEPT: Final = 500  # positions and attitudes that are kept for readings that arrive late
_TRACK_M: Final = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SurveyEstimatorParameters(ProcessingParameters):
    """Parameters of `SurveyEstimator`."""

    map_file: Path | None = option(
        None, varies="the main field", help="Published magnetic map (.npz) to compare with."
    )
    lines_file: Path | None = option(
        None, varies="straight flight", help="Lines that were commanded (lines.csv of a survey)."
    )
    compensation_file: Path | None = option(
        None, varies="readings are compensated", help="Coefficients of the aircraft."
    )
    least_line_m: float = option(
        500.0, above=0.0, help="Shortest straight flight that is a line, without lines_file."
    )

    @property
    def processing(self) -> ProcessingParameters:
        """The part of them that processing needs."""
        names = [field.name for field in fields(ProcessingParameters)]
        return ProcessingParameters(**{name: getattr(self, name) for name in names})


class SurveyEstimator(Estimator[SurveyEstimatorParameters]):
    """Places the readings of one vehicle, compares them with the map, and processes them at the end."""

    NAME: ClassVar[str] = "survey"
    PARAMETERS = SurveyEstimatorParameters

    def __init__(self, parameters: SurveyEstimatorParameters | None = None) -> None:
        super().__init__(parameters)
        p = self.parameters
        self._map: SurveyMap | None = None if p.map_file is None else load_survey_map(p.map_file)
        self._lines: LinePlan | None = None if p.lines_file is None else load_lines(p.lines_file)
        self._compensation: Compensation | None = (
            None if p.compensation_file is None else load_compensation(p.compensation_file)
        )
        if self._lines is not None:
            check_grid(self._lines, p)
        self._guard = InputGuard()
        self.reset()

    @property
    def needs(self) -> tuple[Need, ...]:
        return (
            Need(messages=("NAMED_VALUE_FLOAT",), rate_hz=0.0, purpose="total magnetic field (MAG_NT)"),
            Need(
                messages=("GLOBAL_POSITION_INT",),
                rate_hz=2.0,
                wanted_rate_hz=10.0,
                purpose="places of the readings",
            ),
            Need(
                messages=("ATTITUDE",),
                rate_hz=2.0,
                wanted_rate_hz=25.0,
                purpose="attitude for compensation",
                optional=self._compensation is None,
            ),
        )

    def reset(self) -> None:
        """Discard everything except the parameters and the files."""
        self._guard.reset()
        self._check = ReadingCheck()
        self._readings: list[tuple[float, float]] = []
        self._positions: list[tuple[float, float, float, float]] = []
        self._attitudes: list[tuple[float, float, float, float]] = []
        self._placed: list[SurveyReadings] = []
        self._estimates: tuple[SurveyEstimate, ...] = ()
        self._block_from_us = -1
        self._home: GeodeticPosition | None = None if self._map is None else self._map.home
        self._main: MainField | None = None if self._home is None else self._main_field(self._home)
        self._result: SurveyResult | None = None

    def _main_field(self, home: GeodeticPosition) -> MainField:
        return MainField(home, self.parameters.decimal_year)

    def handle(self, time_us: int, message: Message) -> Outcome:
        name = message.name
        if is_a(message, wire.NAMED_VALUE_FLOAT):
            if message.src_component != SURVEY_MAGNETOMETER_COMPONENT or message.name_ != TOTAL_FIELD_NAME:
                return Outcome.IGNORED
            return self._on_reading(time_us, message.value)
        if message.src_component != AUTOPILOT_COMPONENT:
            return Outcome.IGNORED
        if is_a(message, wire.ATTITUDE):
            if self._compensation is None:
                return Outcome.IGNORED
            values: tuple[float, ...] = (message.roll, message.pitch, message.yaw)
        elif not is_a(message, wire.GLOBAL_POSITION_INT):
            return Outcome.IGNORED
        else:
            values = (degrees(message.lat), degrees(message.lon), metres(message.alt))
        refused = self._guard.check(time_us, name, values, leads=False)
        if refused is Outcome.TIME_JUMP:
            self.reset()
        elif refused is not None:
            return refused
        row = (time_us * 1e-6, *values)
        if name == "ATTITUDE":
            self._attitudes.append(row)  # type: ignore[arg-type]  # three values
            return refused or Outcome.USED
        self._positions.append(row)  # type: ignore[arg-type]
        if self._home is None:
            lat_deg, lon_deg, alt_m = values
            if not (abs(lat_deg) <= 89.0 and abs(lon_deg) <= 180.0):
                self._positions.pop()
                return Outcome.IMPLAUSIBLE
            self._home = GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m)
            self._main = self._main_field(self._home)
        if self._block_from_us < 0:
            self._block_from_us = time_us
        if time_us - self._block_from_us < _BLOCK_US:
            return refused or Outcome.USED
        self._block_from_us = time_us
        self._estimates = self._next_block(message.src_system)
        return refused or (Outcome.UPDATED if self._estimates else Outcome.USED)

    def _on_reading(self, time_us: int, total_nt: float) -> Outcome:
        refused = self._guard.check(time_us, "reading", (total_nt,), leads=False)
        if refused is Outcome.TIME_JUMP:
            self.reset()
        elif refused is not None:
            return refused
        if not self._check.accepts(total_nt):
            return Outcome.IMPLAUSIBLE
        self._readings.append((time_us * 1e-6, total_nt))
        return refused or Outcome.USED

    def _next_block(self, system: int) -> tuple[SurveyEstimate, ...]:
        """Place the readings up to the newest position, and with a compensation up to the newest attitude."""
        block = self._place(last=False)
        home, main = self._home, self._main
        if block is None or home is None or main is None or not len(block):
            return ()
        compensated = block.total_nt
        if self._compensation is not None and len(block) > 1:
            compensated = compensated - aircraft_field_nt(block, self._compensation, main.direction_ned)
        reference = self._reference(block, main)
        north, east, height, total, own, other, difference = (
            float(np.mean(values))
            for values in (
                *(block.north_m, block.east_m, block.height_m),
                *(block.total_nt, compensated, reference, compensated - reference),
            )
        )
        return (
            SurveyEstimate(
                time_us=round(float(block.time_s.mean()) * 1e6),
                subject=system,
                north_m=north,
                east_m=east,
                height_m=height,
                total_nt=total,
                compensated_nt=own,
                reference_nt=other,
                differential_nt=difference,
            ),
        )

    def _reference(self, block: SurveyReadings, main: MainField) -> Array:
        if self._map is not None:
            return self._map.totals_nt(block.north_m, block.east_m, block.height_m)
        along: Array = main.total_at_nt(block.north_m, block.east_m)
        return along + main.gradient_up_nt_m * block.height_m

    def _place(self, *, last: bool) -> SurveyReadings | None:
        """Place waiting readings; those after the newest position or attitude wait on, unless it is the last
        time.
        """
        tables = [self._positions] if self._compensation is None else [self._positions, self._attitudes]
        if not (self._readings and all(tables) and self._home is not None):
            return None
        until_s = math.inf if last else min(table[-1][0] for table in tables)
        ready = [row for row in self._readings if row[0] <= until_s]
        self._readings = [row for row in self._readings if row[0] > until_s]
        times, values = np.array(ready).reshape(-1, 2).T
        block = placed_readings(
            times,
            values,
            positions=np.array(self._positions),
            attitudes=None if self._compensation is None else np.array(self._attitudes),
            frame=LocalFrame(self._home),
        )
        del self._positions[:-_KEPT], self._attitudes[:-_KEPT]
        self._placed.append(block)
        self._result = None
        return block

    @property
    def estimates(self) -> Sequence[SurveyEstimate]:
        return self._estimates

    @property
    def origin(self) -> GeodeticPosition | None:
        """The map's home, or the vehicle's first position."""
        return self._home

    def result(self) -> SurveyResult | None:
        """The processed survey of all readings so far; None: there are none with a place."""
        self._place(last=True)
        if self._home is None or not self._placed:
            return None
        if self._result is None:
            readings = joined(self._placed)
            if len(readings) < 2:
                return None
            self._result = process_survey(
                readings,
                self._lines or _lines_in(readings, self.parameters.least_line_m),
                home=self._home,
                survey_map=self._map,
                compensation=self._compensation,
                parameters=self.parameters.processing,
            )
        return self._result

    def remarks(self) -> Mapping[str, float | str]:
        result = self.result()
        if result is None:
            return {"warning": "no reading of the magnetic field has a position: nothing was processed"}
        found: dict[str, float | str] = {
            "lines": float(len(result.plan.lines)),
            "readings_on_lines": float(result.on_lines.sum()),
            "readings_unplaced": float(result.readings.unplaced),
            "readings_implausible": float(self._check.implausible + result.readings.implausible),
            "anomalies": float(len(result.anomalies)),
            "crossings": float(result.levelling.crossings),
        }
        figures = {
            "noise_nt": result.noise_nt,
            "differential_noise_nt": result.differential_noise_nt,
            "misclosure_before_nt": result.levelling.before_nt,
            "misclosure_after_nt": result.levelling.after_nt,
            "grid_error_nt": result.grid_error_nt,
        }
        found |= {name: round(value, 4) for name, value in figures.items() if math.isfinite(value)}
        if result.no_grid:
            found["warning"] = f"there is no {MAP}: {result.no_grid}"
        if not result.plan.lines:
            found["warning"] = "no straight flight was found that is long enough for a line (least_line_m)"
        elif not result.on_lines.any():
            found["warning"] = "no reading belongs to a line with data on the map; is the map of this place?"
        return found

    def files(self) -> Mapping[str, bytes]:
        result = self.result()
        return {} if result is None or not result.on_lines.any() else survey_files(result)


def _lines_in(readings: SurveyReadings, least_length_m: float) -> LinePlan:
    """The lines of a track, from its places at some distance from each other."""
    places, _ = block_means(np.column_stack((readings.north_m, readings.east_m)), readings.total_nt, _TRACK_M)
    return detected_lines(places[:, 0], places[:, 1], least_length_m=least_length_m)
