"""What a survey flight has made: figures, files, and whether the lines were flown."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from estimators.errors import EstimatorError
from estimators.received import GAP_S
from estimators.survey.compensation import compensation_bytes
from estimators.survey.export import MAP, survey_files
from estimators.survey.lines import LineKind, LinePlan
from estimators.survey.processing import SurveyResult, process_survey
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.main_field import MainField
from missions.base.report import Debriefing
from missions.survey.inputs import compensation_of, survey_map_of
from missions.survey.options import SurveyOptions
from missions.survey.records import Calibration, calibrated, flight_readings

__all__ = ["COMPENSATION", "SurveyFindings", "outcome_of", "report_lines"]

COMPENSATION: Final = "compensation.json"
LEAST_COVERAGE: Final = 0.97
"""Share of each line that readings must cover."""

_ONE_HEIGHT_M: Final = 20.0  # readings over level ground are closer together, in gusts too
_FOUND_WITHIN: Final = 0.5  # of a line spacing, and the least distance below: a target on the list
_FOUND_LEAST_M: Final = 100.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurveyFindings:
    """The outcome of a flight.

    Attributes:
        survey: processed lines; None: a calibration, or there were no readings.
        calibration: None: a survey, or it failed.
        failure: why there is neither; "" if there is.
        figures: for the summary.
        files: contents by name.
        coverage: share of each line's length that readings cover, in the order of flight.
    """

    survey: SurveyResult | None = None
    calibration: Calibration | None = None
    failure: str = ""
    figures: Mapping[str, Any] = field(default_factory=dict)
    files: Mapping[str, bytes] = field(default_factory=dict)
    coverage: tuple[float, ...] = ()

    @property
    def drawable(self) -> bool:
        """Whether there is something of the mission's own to be drawn."""
        return self.survey is not None or self.calibration is not None

    def verdict(self) -> str:
        """Why the survey was not flown as commanded; "" if it was. By the vehicle's own messages alone."""
        if self.failure:
            return self.failure
        if self.survey is None:
            return ""
        missed = [
            f"{line.name} ({math.floor(1e3 * share) / 10.0:g} %)"
            for line, share in zip(self.survey.plan.lines, self.coverage, strict=True)
            if share < LEAST_COVERAGE
        ]
        if not missed:
            return ""
        shown = ", ".join(missed[:5]) + ("" if len(missed) <= 5 else f" and {len(missed) - 5} more")
        return (
            f"{len(missed)} of {len(self.coverage)} lines were not measured: readings within "
            f"{self.survey.plan.corridor_m:g} m cover less than {100.0 * LEAST_COVERAGE:g} % of {shown}"
        )


def outcome_of(
    debriefing: Debriefing, options: SurveyOptions, plan: LinePlan | None, home: GeodeticPosition
) -> SurveyFindings:
    """Process the readings of a flight.

    Args:
        debriefing: of the flight.
        options: of the vehicle.
        plan: lines that were commanded; None: a calibration.
        home: the vehicle's home, for a flight without a commanded path.
    """
    notes = debriefing.flights[0][0]
    if notes.commanded is not None:
        home = notes.commanded.origin  # a vehicle that has landed reports that of its next flight
    survey_map = survey_map_of(options)
    origin = home if survey_map is None else survey_map.home
    compensation = compensation_of(options)
    readings = flight_readings(
        debriefing.records,
        notes.system_id,
        LocalFrame(origin),
        attitude=options.calibrate or compensation is not None,
    )
    if len(readings) < 2:
        return SurveyFindings(
            failure=f"vehicle {notes.system_id} sent no readings of the magnetic field with a place"
        )
    if plan is None:
        main = MainField(origin)
        try:
            made = calibrated(readings, notes, options.direction_rad, main)
        except EstimatorError as error:
            return SurveyFindings(failure=str(error))
        return SurveyFindings(
            calibration=made,
            figures=_calibration_figures(made),
            files={COMPENSATION: compensation_bytes(made.compensation)},
        )
    result = process_survey(
        readings,
        plan,
        home=origin,
        survey_map=survey_map,
        compensation=compensation,
        parameters=options.processing_parameters,
    )
    coverage = covered(result)
    return SurveyFindings(
        survey=result,
        figures=_survey_figures(result, coverage, debriefing.targets_ne_m),
        files=survey_files(result),
        coverage=coverage,
    )


def covered(result: SurveyResult) -> tuple[float, ...]:
    """Share of each line's length that its readings cover: the way between two readings counts unless there
    are more than `GAP_S` between them.
    """
    found = []
    for number, line in enumerate(result.plan.lines):
        own = result.line_of == number
        along, _ = line.along_across_m(result.readings.north_m[own], result.readings.east_m[own])
        near = np.diff(result.readings.time_s[own]) <= GAP_S
        found.append(abs(float(np.diff(along)[near].sum())) / line.length_m)
    return tuple(found)


def _survey_figures(
    result: SurveyResult, coverage: Sequence[float], targets_ne_m: Sequence[tuple[float, float]] | None
) -> dict[str, Any]:
    lines = result.plan.lines
    found: dict[str, Any] = {
        "lines": sum(line.kind is LineKind.LINE for line in lines),
        "tie_lines": sum(line.kind is LineKind.TIE for line in lines),
        "line_km": round(sum(line.length_m for line in lines) * 1e-3, 3),
        "least_coverage": round(min(coverage), 4),
        "readings_on_lines": int(result.on_lines.sum()),
        "readings_unplaced": result.readings.unplaced,
        "readings_implausible": result.readings.implausible,
        "noise_nt": _rounded(result.noise_nt),
        "differential_noise_nt": _rounded(result.differential_noise_nt),
        "crossings": result.levelling.crossings,
        "misclosure_before_nt": _rounded(result.levelling.before_nt),
        "misclosure_after_nt": _rounded(result.levelling.after_nt),
        "grid_error_nt": _rounded(result.grid_error_nt),
        "no_map": result.no_grid or None,
        "map_height_m": _rounded(result.grid_height_m, 1),
        "lowest_height_m": _rounded(result.heights_m[0], 1),
        "highest_height_m": _rounded(result.heights_m[1], 1),
        "compared_with_map": result.against_map,
        "anomalies": [
            {
                "north": round(anomaly.north_m, 1),
                "east": round(anomaly.east_m, 1),
                "peak_nt": round(anomaly.peak_nt, 2),
                "signal_to_noise": round(anomaly.ratio, 1),
                "lines": [lines[k].name for k in anomaly.lines],
            }
            for anomaly in result.anomalies
        ],
    }
    if targets_ne_m is not None:
        within_m = max(_FOUND_LEAST_M, _FOUND_WITHIN * result.line_spacing_m)
        errors = [
            min((math.dist(place, (a.north_m, a.east_m)) for a in result.anomalies), default=math.inf)
            for place in targets_ne_m
        ]
        found["targets"] = [{"north": round(n, 1), "east": round(e, 1)} for n, e in targets_ne_m]
        found["target_errors_m"] = [_rounded(error, 1) for error in errors]
        found["targets_found"] = sum(error <= within_m for error in errors)
        found["false_anomalies"] = sum(
            all(math.dist(place, (a.north_m, a.east_m)) > 2.0 * within_m for place in targets_ne_m)
            for a in result.anomalies
        )
    return found


def _calibration_figures(made: Calibration) -> dict[str, Any]:
    return {
        "figure_of_merit_nt": _rounded(made.figure_of_merit_nt),
        "figure_of_merit_before_nt": _rounded(made.figure_of_merit_before_nt),
        "figure_of_merit_noise_nt": _rounded(made.figure_of_merit_noise_nt),
        "improvement": _rounded(made.improvement, 2),
    }


def report_lines(figures: Mapping[str, Any]) -> Sequence[str]:
    """Lines for the terminal."""
    if "figure_of_merit_nt" in figures:
        return (
            f"figure of merit {figures['figure_of_merit_before_nt']:.1f} nT before compensation, "
            f"{figures['figure_of_merit_nt']:.2f} nT after ({figures['figure_of_merit_noise_nt']:.2f} nT by "
            f"noise alone), improvement ratio {figures['improvement']:.1f}: "
            f"{COMPENSATION}",
        )
    if "lines" not in figures:
        return ()
    lines = [
        f"{figures['lines']} lines and {figures['tie_lines']} tie "
        f"{'line' if figures['tie_lines'] == 1 else 'lines'}, {figures['line_km']:.1f} km, "
        f"{figures['readings_on_lines']} readings with {_nt(figures['noise_nt'])} of noise"
    ]
    if figures["crossings"]:
        after_nt = figures["misclosure_after_nt"]
        after = "unknown (the levels explain all crossings)" if after_nt is None else _nt(after_nt)
        lines.append(
            f"{figures['crossings']} crossings: misclosure {_nt(figures['misclosure_before_nt'])} before "
            f"levelling, after it {after}; map by the lines within {_nt(figures['grid_error_nt'])} of the "
            "tie lines"
        )
    if figures["no_map"] is not None:
        lines.append(f"warning: there is no {MAP}: {figures['no_map']}")
    elif figures["highest_height_m"] - figures["lowest_height_m"] > _ONE_HEIGHT_M:
        lines.append(
            f"the map is stated for {figures['map_height_m']:.0f} m above home, the mean height of readings "
            f"at {figures['lowest_height_m']:.0f} to {figures['highest_height_m']:.0f} m"
        )
    if figures["compared_with_map"]:
        count = len(figures["anomalies"])
        of_targets = (
            f"; {figures['targets_found']} of {len(figures['targets'])} targets are among them"
            if figures.get("targets")
            else ""
        )
        lines.append(
            f"{count} {'anomaly' if count == 1 else 'anomalies'} against the published map, "
            f"{_nt(figures['differential_noise_nt'])} elsewhere{of_targets}"
        )
    else:
        lines.append("there is no published map to compare with: no anomalies are listed")
    return tuple(lines)


def _nt(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.2f} nT"


def _rounded(value: float, digits: int = 4) -> float | None:
    return round(value, digits) if math.isfinite(value) else None
