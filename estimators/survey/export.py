"""The files of a processed survey: line data, lines, anomalies, and the map."""

import io
import math
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.survey.processing import SurveyResult
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.magnetic_map_file import MapContents, map_file_bytes

__all__ = ["ANOMALIES", "LINES", "LINE_DATA", "LINE_DATA_XYZ", "MAP", "survey_files"]

Array = NDArray[np.float64]

LINE_DATA: Final = "line_data.csv"
LINE_DATA_XYZ: Final = "line_data.xyz"
LINES: Final = "lines.csv"
ANOMALIES: Final = "anomalies.csv"
MAP: Final = "survey_map.npz"

_COLUMNS: Final = (
    *("longitude_deg", "latitude_deg", "north_m", "east_m", "height_m", "time_s"),
    *("total_nt", "compensated_nt", "levelled_nt", "reference_nt", "differential_nt"),
)
_FORMATS: Final = ("%.7f", "%.7f", *["%.2f"] * 3, "%.3f", *["%.3f"] * 5)


def survey_files(result: SurveyResult) -> Mapping[str, bytes]:
    """Contents of the files, by name; the map is missing if there is no grid.

    The map has the format of `flightsim.foundation.magnetic_map_file`. Its one height is the mean height of
    the readings on the lines; over terrain they are at other heights.
    """
    files = {
        LINES: result.plan.to_csv().encode(),
        LINE_DATA: _line_data_csv(result),
        LINE_DATA_XYZ: _line_data_xyz(result),
        ANOMALIES: _anomalies(result),
    }
    grid = result.grid
    if grid is not None:
        error_nt = result.grid_error_nt
        files[MAP] = map_file_bytes(
            MapContents(
                north_m=grid.north_m,
                east_m=grid.east_m,
                total_field_nt=grid.values_nt,
                height_m=result.grid_height_m,
                home=result.home,
                error_nt=error_nt if math.isfinite(error_nt) and error_nt > 0.0 else None,
                line_spacing_m=result.line_spacing_m,
            )
        )
    return files


def _table(result: SurveyResult) -> Array:
    readings = result.readings
    lat_deg, lon_deg, _ = LocalFrame(result.home).geodetic_from_ned(
        readings.north_m, readings.east_m, -readings.height_m
    )
    return np.column_stack(
        (
            lon_deg,
            lat_deg,
            *(readings.north_m, readings.east_m, readings.height_m, readings.time_s, readings.total_nt),
            *(result.compensated_nt, result.levelled_nt, result.reference_nt, result.differential_nt),
        )
    )


def _line_data_csv(result: SurveyResult) -> bytes:
    """All readings on lines as a table, in the order of flight."""
    on = np.nonzero(result.on_lines)[0]
    file = io.StringIO()
    file.write(",".join(("line", "kind", *_COLUMNS)) + "\n")
    table, lines = _table(result)[on], result.plan.lines
    names = [f"{lines[k].name},{lines[k].kind}," for k in result.line_of[on].tolist()]
    row_format = ",".join(_FORMATS)
    for name, row in zip(names, table.tolist(), strict=True):
        file.write(name + row_format % tuple(row) + "\n")
    return file.getvalue().encode()


def _line_data_xyz(result: SurveyResult) -> bytes:
    """The same as Geosoft's XYZ: a header for each line, columns with blanks between, `*` for no value."""
    file = io.StringIO()
    file.write("/ " + " ".join(_COLUMNS) + "\n")
    table = _table(result)
    row_format = " ".join(_FORMATS)
    for number, line in enumerate(result.plan.lines):
        own = (result.line_of == number) & result.on_lines
        if own.any():
            file.write(f"{'Tie' if line.name.startswith('T') else 'Line'} {line.name.lstrip('LT')}\n")
            for row in table[own].tolist():
                file.write((row_format % tuple(row)).replace("nan", "*") + "\n")
    return file.getvalue().encode()


def _anomalies(result: SurveyResult) -> bytes:
    frame = LocalFrame(result.home)
    rows = [
        "number,latitude_deg,longitude_deg,north_m,east_m,peak_nt,signal_to_noise,width_m,time_s,source_height_m,moment_a_m2,lines"
    ]
    for number, found in enumerate(result.anomalies, 1):
        lat_deg, lon_deg, _ = frame.geodetic_from_ned(found.north_m, found.east_m, 0.0)
        dipole = found.source
        source = "," if dipole is None else f"{dipole.height_m:.1f},{dipole.moment_a_m2:.0f}"
        names = " ".join(result.plan.lines[k].name for k in found.lines)
        rows.append(
            f"{number},{lat_deg:.7f},{lon_deg:.7f},{found.north_m:.1f},{found.east_m:.1f},{found.peak_nt:.2f},"
            f"{found.ratio:.1f},{found.width_m:g},{found.time_s:.1f},{source},{names}"
        )
    return ("\n".join(rows) + "\n").encode()
