"""From the readings of a survey flight to levelled lines, anomalies and a map.

The steps are those of survey practice (Reeves 2005, "Aeromagnetic Surveys"): compensation of the aircraft,
differences from the reference (the published map, or the main field), levelling by tie lines, gridding. The
differential measurement, reading - map, is that of Lum, Rysdyk and Pongpunwattana 2005, section II.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from estimators.errors import EstimatorError
from estimators.occupancy.survey_map import SurveyMap, map_error_of
from estimators.survey.anomalies import LinePeak, Search, SurveyAnomaly, line_peaks, survey_anomalies
from estimators.survey.compensation import Compensation, direction_cosines
from estimators.survey.gridding import SurveyGrid, block_means, grid_axes, grid_lines, interpolated
from estimators.survey.levelling import Levelling, crossings, levelled
from estimators.survey.lines import LineKind, LinePlan
from estimators.survey.parameters import BLOCKS, ProcessingParameters
from estimators.survey.readings import SurveyReadings
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.foundation.main_field import MainField

__all__ = ["SurveyResult", "check_grid", "process_survey", "white_noise_nt"]

Array = NDArray[np.float64]

_FOURTH: Final = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
_AWAY_M: Final = 3.0  # widths of an anomaly within which readings are not "where nothing is"
_LEAST_REACH_M: Final = 150.0
_NORMAL: Final = 1.4826  # standard deviation over median absolute deviation
_CONFIDENCE: Final = 0.9  # that the error of the grid is not larger than stated


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurveyResult:
    """A processed survey; arrays of readings are (n,).

    Attributes:
        plan: the lines.
        readings: the readings of the flight.
        line_of: number of each reading's line; -1: none.
        compensated_nt: readings less the aircraft's field.
        reference_nt: map, or main field, at each reading; NaN off the map.
        levelled_nt: compensated readings less the level of their line; NaN off the lines.
        differential_nt: levelled readings less the reference, with median 0 over all lines; NaN off the
        lines. levelling: levels of the lines.
        noise_nt: white noise of a reading, from fourth differences along the lines.
        differential_noise_nt: standard deviation (robust) of the differential measurement along the lines,
            away from anomalies.
        against_map: the reference is a published map.
        anomalies: what differs from the map, the strongest first; none without a map.
        grid: levelled total field on a grid; None: there is none.
        no_grid: why there is no grid; "" if there is one.
        grid_height_m: mean height of the readings on the lines, at which the grid is valid. Readings at other
            heights, over terrain, are not continued to it.
        grid_error_nt: error of the grid: root mean square of the tie lines' readings about a grid of the
            survey lines alone, as the upper limit of a confidence of 90 % for as many independent places as
            there are crossings; NaN without tie lines.
        home: origin of the frame.
        line_spacing_m: distance of the survey lines.
    """

    plan: LinePlan
    readings: SurveyReadings
    line_of: NDArray[np.int64]
    compensated_nt: Array
    reference_nt: Array
    levelled_nt: Array
    differential_nt: Array
    levelling: Levelling
    noise_nt: float
    differential_noise_nt: float
    against_map: bool
    anomalies: tuple[SurveyAnomaly, ...]
    grid: SurveyGrid | None
    no_grid: str
    grid_height_m: float
    grid_error_nt: float
    home: GeodeticPosition
    line_spacing_m: float

    @property
    def on_lines(self) -> NDArray[np.bool_]:
        """Whether each reading belongs to a line and has a value."""
        found: NDArray[np.bool_] = np.isfinite(self.levelled_nt)
        return found

    @property
    def heights_m(self) -> tuple[float, float]:
        """Lowest and highest reading on the lines, above home; NaN without readings."""
        heights = self.readings.height_m[self.on_lines]
        return (float(heights.min()), float(heights.max())) if len(heights) else (math.nan, math.nan)


def process_survey(
    readings: SurveyReadings,
    plan: LinePlan,
    *,
    home: GeodeticPosition,
    survey_map: SurveyMap | None = None,
    compensation: Compensation | None = None,
    parameters: ProcessingParameters | None = None,
) -> SurveyResult:
    """Process the readings of a flight.

    Args:
        readings: with places in the frame of `home`.
        plan: the lines, in the same frame.
        home: origin of the frame; with a map, the map's home.
        survey_map: the published map to compare with.
        compensation: coefficients of the aircraft.
        parameters: how.
    """
    p = parameters or ProcessingParameters()
    main = MainField(home, p.decimal_year)
    main_nt = main.total_at_nt(readings.north_m, readings.east_m) + main.gradient_up_nt_m * readings.height_m
    line_of = plan.line_of(readings.north_m, readings.east_m)
    compensated = readings.total_nt.copy()
    if compensation is not None and len(readings):
        compensated -= aircraft_field_nt(readings, compensation, main.direction_ned)
    reference = (
        main_nt
        if survey_map is None
        else survey_map.totals_nt(readings.north_m, readings.east_m, readings.height_m)
    )
    residual = compensated - reference
    line_of = np.where(np.isfinite(residual), line_of, -1)
    found = crossings(plan.lines, line_of, readings.north_m, readings.east_m, residual) if p.level else []
    levelling = levelled(len(plan.lines), found)
    on = line_of >= 0
    level = (
        np.where(on, levelling.level_nt[line_of], math.nan) if len(plan.lines) else np.full(len(on), math.nan)
    )
    datum_nt = float(np.median((residual - level)[on])) if on.any() and survey_map is not None else 0.0
    levelled_nt = compensated - level - datum_nt
    differential = levelled_nt - reference
    noise_nt = white_noise_nt(differential, line_of)
    anomalies = _anomalies(readings, plan, line_of, differential, noise_nt, main, survey_map, p)
    grid, no_grid, misfit_nt = _grid(readings, plan, line_of, levelled_nt - main_nt, main, p)
    count = max(1, levelling.crossings or len(plan.lines))
    error_nt = misfit_nt * math.sqrt(count / float(chi2.ppf(1.0 - _CONFIDENCE, count)))
    return SurveyResult(
        plan=plan,
        readings=readings,
        line_of=line_of,
        compensated_nt=compensated,
        reference_nt=reference,
        levelled_nt=levelled_nt,
        differential_nt=differential,
        levelling=levelling,
        noise_nt=noise_nt,
        differential_noise_nt=_spread_nt(readings, line_of, differential, anomalies),
        against_map=survey_map is not None,
        anomalies=tuple(anomalies),
        grid=grid,
        no_grid=no_grid,
        grid_height_m=float(readings.height_m[on].mean()) if on.any() else math.nan,
        grid_error_nt=error_nt,
        home=home,
        line_spacing_m=p.spacing_m(plan),
    )


def check_grid(plan: LinePlan, parameters: ProcessingParameters) -> None:
    """Refuse a grid that is too fine for the area of the lines, before they are flown or processed.

    Raises:
        EstimatorError: there are too many grid points.
    """
    ends = np.array([end for line in plan.lines for end in (line.start_ne_m, line.end_ne_m)])
    grid_axes(np.concatenate((ends - plan.corridor_m, ends + plan.corridor_m)), parameters.cell_m(plan))


def aircraft_field_nt(readings: SurveyReadings, compensation: Compensation, direction_ned: Array) -> Array:
    """The aircraft's field (n,) at readings, from their attitudes."""
    cosines, rates = direction_cosines(
        readings.roll_rad, readings.pitch_rad, readings.yaw_rad, readings.time_s, direction_ned
    )
    return compensation.field_nt(cosines, rates)


def white_noise_nt(values_nt: Array, line_of: NDArray[np.int64]) -> float:
    """Standard deviation of white noise, from fourth differences of successive readings on the same line.

    The field hardly has fourth differences at ten readings a second; noise has them with a variance of 70
    times its own (Reeves 2005, section 3.5). The median makes single spikes harmless.
    """
    parts = []
    for number in range(int(line_of.max(initial=-1)) + 1):
        own = values_nt[line_of == number]
        if len(own) >= len(_FOURTH):
            parts.append(np.convolve(own, _FOURTH, "valid"))
    if not parts:
        return math.nan
    return _NORMAL * float(np.median(np.abs(np.concatenate(parts)))) / math.sqrt(70.0)


def _anomalies(
    readings: SurveyReadings,
    plan: LinePlan,
    line_of: NDArray[np.int64],
    differential_nt: Array,
    noise_nt: float,
    main: MainField,
    survey_map: SurveyMap | None,
    p: ProcessingParameters,
) -> list[SurveyAnomaly]:
    """What differs from the map; nothing without one."""
    if survey_map is None or not math.isfinite(noise_nt):
        return []
    error = map_error_of(survey_map, p.map_error_nt)

    def find(line: int, values_nt: Array) -> list[LinePeak]:
        own = line_of == line
        return line_peaks(
            line,
            readings.time_s[own],
            readings.north_m[own],
            readings.east_m[own],
            values_nt[own],
            noise_nt=noise_nt,
            map_error_nt=error.sigma_nt,
            correlation_m=error.correlation_m,
        )

    search = Search(
        lines=range(len(plan.lines)),
        line_of=line_of,
        north_m=readings.north_m,
        east_m=readings.east_m,
        height_m=readings.height_m,
        differential_nt=differential_nt,
        direction_ned=main.direction_ned,
    )
    return survey_anomalies(search, find)


def _spread_nt(
    readings: SurveyReadings,
    line_of: NDArray[np.int64],
    differential_nt: Array,
    anomalies: list[SurveyAnomaly],
) -> float:
    """Robust standard deviation about the median of each line, away from anomalies."""
    kept = line_of >= 0
    for anomaly in anomalies:
        away_m = np.hypot(readings.north_m - anomaly.north_m, readings.east_m - anomaly.east_m)
        kept &= away_m > _AWAY_M * max(anomaly.width_m, _LEAST_REACH_M)
    parts = []
    for number in np.unique(line_of[kept]).tolist():
        own = differential_nt[kept & (line_of == number)]
        parts.append(own - np.median(own))
    return _NORMAL * float(np.median(np.abs(np.concatenate(parts)))) if parts else math.nan


def _grid(
    readings: SurveyReadings,
    plan: LinePlan,
    line_of: NDArray[np.int64],
    anomaly_nt: Array,
    main: MainField,
    p: ProcessingParameters,
) -> tuple[SurveyGrid | None, str, float]:
    """The grid of total field from all lines or why there is none, and how well the survey lines predict the
    tie lines.
    """
    block_m = p.spacing_m(plan) / BLOCKS
    blocks: dict[LineKind, list[tuple[Array, Array]]] = {kind: [] for kind in LineKind}
    for number, line in enumerate(plan.lines):
        own = line_of == number
        places = np.column_stack((readings.north_m[own], readings.east_m[own]))
        blocks[line.kind].append(block_means(places, anomaly_nt[own], block_m))
    lines, ties = (_joined(blocks[kind]) for kind in (LineKind.LINE, LineKind.TIE))
    places, values = (np.concatenate(parts) for parts in zip(lines, ties, strict=True))
    if len(places):
        # a tie line's block beside a line's has the same place and another value: the spline would bend
        places, values = _apart(places, values, 0.5 * block_m)
    error_nt = _tie_misfit_nt(*lines, *ties)
    try:
        grid = grid_lines(places, values, line_spacing_m=p.spacing_m(plan), cell_m=p.cell_m(plan))
    except EstimatorError as error:
        return None, str(error).replace("`", ""), error_nt
    total = (
        grid.values_nt
        + main.total_at_nt(grid.north_m[:, None], grid.east_m[None, :])
        + (main.gradient_up_nt_m * float(readings.height_m[line_of >= 0].mean()))
    )
    return SurveyGrid(north_m=grid.north_m, east_m=grid.east_m, values_nt=total), "", error_nt


def _tie_misfit_nt(places_m: Array, values_nt: Array, tie_places_m: Array, tie_values_nt: Array) -> float:
    """Root mean square of the tie lines' values about a grid of the survey lines; NaN: there are no tie
    lines, or no two survey lines.
    """
    if not len(tie_places_m):
        return math.nan
    try:
        left = interpolated(places_m, values_nt, tie_places_m) - tie_values_nt
    except (ValueError, np.linalg.LinAlgError):
        return math.nan
    return float(np.sqrt(np.mean(left**2)))


def _joined(parts: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    if not parts:
        return np.zeros((0, 2)), np.zeros(0)
    places, values = zip(*parts, strict=True)
    return np.concatenate(places), np.concatenate(values)


def _apart(places_m: Array, values_nt: Array, least_m: float) -> tuple[Array, Array]:
    """Means of places that are nearer to each other than a distance, in squares of that side."""
    _, square = np.unique(np.floor(places_m / least_m), axis=0, return_inverse=True)
    square = square.ravel()
    count = np.bincount(square)
    means = [np.bincount(square, weights=column) / count for column in (*places_m.T, values_nt)]
    return np.column_stack(means[:2]), means[2]
