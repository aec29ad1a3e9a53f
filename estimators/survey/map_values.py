"""The values of an imported map: total field, or an anomaly and the main field it is added to."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from estimators.survey.map_import_options import Values
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.foundation.magnetic_map_file import EARTH_NT
from flightsim.foundation.magnetics import FieldModel
from flightsim.foundation.main_field import MainField

__all__ = ["LATITUDES", "LONGITUDES", "checked_values", "chosen", "with_main_field"]

Array = NDArray[np.float64]

LONGITUDES: Final = ("longitude", "lon", "long", "longitude_deg", "lon_deg", "x", "easting")
LATITUDES: Final = ("latitude", "lat", "latitude_deg", "lat_deg", "y", "northing")
"""Usual names of coordinates, in lower case, the first ones preferred."""

_VALUES: Final = (
    *("levelled_nt", "total_field_nt", "total_nt", "tmi", "total_field_anomaly_nt", "anomaly_nt"),
    *("anomaly", "mag", "z", "value"),
)
"""Usual names of the field, likewise."""

_NAMES_SHOWN: Final = 20
_LONGEST_NAME: Final = 40
_ANOMALY_NT: Final = 10_000.0
_SINGLE: Final = 1e-6  # of a value that was stored in single precision


def chosen(path: Path, found: Mapping[str, Any], column: str | None) -> Any:
    """The variable, column or band of the field; upper and lower case are the same.

    Args:
        path: the file, for errors.
        found: what there is, by name.
        column: name; None: the one of the first usual name, else the only one.

    Raises:
        EstimatorError: there is no such name, or several could be it.
    """
    if column is not None:
        for name in (column, *(name for name in found if name.casefold() == column.casefold())):
            if name in found:
                return found[name]
        raise EstimatorError(f"{path} has no `column` {column!r}; there are {_names(found)}")
    names = {name.casefold(): name for name in found}
    for usual in _VALUES:
        if usual in names:
            return found[names[usual]]
    if len(found) != 1:
        raise EstimatorError(
            f"{path} has {len(found)} candidates for the field ({_names(found)}); name one with `column`"
        )
    return next(iter(found.values()))


def _names(found: Mapping[str, Any]) -> str:
    """The first of some names, as text."""
    shown = [name[:_LONGEST_NAME] for name in list(found)[:_NAMES_SHOWN]]
    more = len(found) - len(shown)
    return f"{', '.join(shown) or 'none'}{f' and {more} more' if more else ''}"


def checked_values(path: Path, values_nt: Array, kind: Values, no_data: float | None) -> Array:
    """The values of a file, before anything is computed of them; NaN where there is no data.

    A value that stands for no data would otherwise be averaged with its neighbours, and be plausible again.

    Args:
        path: the file, for errors.
        values_nt: (...) of the file.
        kind: what they are.
        no_data: value that stands for no data; None: none but NaN and infinity.

    Raises:
        EstimatorError: values are impossible; the message names one, and how many there are.
    """
    values = np.where(np.isfinite(values_nt), values_nt, np.nan)
    if no_data is not None:
        values[np.isclose(values, no_data, rtol=_SINGLE, atol=0.0)] = np.nan
    low, high = EARTH_NT if kind is Values.TOTAL else (-_ANOMALY_NT, _ANOMALY_NT)
    with np.errstate(invalid="ignore"):
        wrong = values[(values < low) | (values > high)]
    if not len(wrong):
        return values
    kinds, counts = np.unique(wrong, return_counts=True)
    worst, times = float(kinds[np.argmax(counts)]), int(counts.max())
    known = int(np.count_nonzero(np.isfinite(values)))
    count = f"{len(wrong)} of {known} values" + (f", {times} times {worst:g} nT" if len(wrong) > 1 else "")
    if kind is Values.TOTAL:
        why = f"no total field of the Earth ({low:g} to {high:g} nT)"
        other = "anomalies get a main field with `values=anomaly-wmm`"
    else:
        why = f"no anomaly (up to {high:g} nT)"
        other = "total field is read with `values=total`"
    raise EstimatorError(
        f"{path} has values such as {worst:g} nT, {why}: {count}. If that value stands for no data, give it "
        f"with `no_data` {worst:.10g}; {other}"
    )


def with_main_field(
    path: Path,
    values_nt: Array,
    kind: Values,
    home: GeodeticPosition,
    north_m: Array,
    east_m: Array,
    height_m: float,
    decimal_year: float,
) -> Array:
    """Total field (rows, columns) of a map.

    Args:
        path: the file, for errors.
        values_nt: (rows, columns) of the file; NaN: no data.
        kind: what they are.
        home: origin of the map's frame.
        north_m, east_m: grid lines.
        height_m: height of the map above home.
        decimal_year: date of the main field.

    Raises:
        EstimatorError: there is no data, or the model has no field at the date.
    """
    if not np.isfinite(values_nt).any():
        raise EstimatorError(f"{path} has no data in the map's area; is `home` of another place?")
    if kind is Values.TOTAL:
        return values_nt
    model = FieldModel.IGRF if kind is Values.ANOMALY_IGRF else FieldModel.WMM
    try:
        main = MainField(home, decimal_year, model=model)
    except ValueError as error:
        raise EstimatorError(str(error)) from None
    total: Array = values_nt + main.total_at_nt(north_m[:, None], east_m[None, :], height_m)
    return total
