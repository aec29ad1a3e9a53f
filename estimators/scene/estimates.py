"""What estimates show by the names of their columns, without a line of the estimator's own.

`north_m` and `east_m` are a place, with `north_sigma_m`, `east_sigma_m` and `north_east_correlation` a
Gaussian; with `offset_` before them they are relative to the vehicle. Any other column is a series in the
reader's unit, with the band of its `..._sigma_...` or `..._variance_...` column.
"""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from estimators.references import quantity_of
from estimators.scene.shown import Estimates
from estimators.scene_items import Gaussian, Item, PointSet, Pose, Relative, Role, Value
from flightsim.foundation.vectors import Vector, wrap_pi

__all__ = ["items_of"]

_PLACES: Final = {"": "place", "offset_": "offset"}
_WEIGHTS: Final = ("weight", "probability", "mass")
_NUMBERS: Final = ("target", "vehicle", "lat_deg", "lon_deg")  # that say which, or where once more


def items_of(estimates: Estimates, truth: Mapping[str, float]) -> dict[str, Item]:
    """The items of estimates, by name.

    Args:
        estimates: of one time.
        truth: the true state at that time by column, as far as it is known: columns that are in it have an
            error.
    """
    return _of_set(estimates) if estimates.of_set else _of_one(estimates, truth)


def _of_one(estimate: Estimates, truth: Mapping[str, float]) -> dict[str, Item]:
    columns = dict(zip(estimate.columns, estimate.values[0].tolist(), strict=True))
    prefix = "".join(f"{name}_" for name in estimate.names)
    found: dict[str, Item] = {}
    shown = set(_NUMBERS)
    for before, name in _PLACES.items():
        north, east = f"{before}north_m", f"{before}east_m"
        if north not in columns or east not in columns:
            continue
        shown |= {f"{before}north_east_correlation"}
        place = _place(columns, before)
        if place is not None:
            found[prefix + name] = Relative(item=place, system_id=estimate.system_id) if before else place
    for column, value in columns.items():
        quantity, unit, factor = quantity_of(column)
        if column in shown or "_sigma" in column or "_variance" in column:
            continue
        sigma = factor * _sigma(columns, column)
        words = _WORDS.get(unit, unit)
        found[prefix + quantity] = Value(value=factor * value, unit=words, sigma=sigma)
        if column in truth:
            error = value - truth[column]
            error = float(wrap_pi(error)) if column.endswith("_rad") else error
            found[f"{prefix}error_{quantity}"] = Value(
                value=factor * error, unit=words, sigma=sigma, error=True
            )
    return found


_WORDS: Final = {"m_s": "m/s"}


def _place(columns: Mapping[str, float], before: str) -> Gaussian | Pose | None:
    place: Vector = (
        columns[f"{before}north_m"],
        columns[f"{before}east_m"],
        columns.get(f"{before}down_m", 0.0),
    )
    if before:
        place = place[0], place[1], columns.get("over_target_m", 0.0)
    if not all(map(math.isfinite, place)):
        return None
    north_m, east_m = (columns.get(f"{before}{axis}_sigma_m", math.nan) for axis in ("north", "east"))
    if not math.isfinite(north_m + east_m):
        return Pose(pos_ned_m=place)
    common_m2 = columns.get(f"{before}north_east_correlation", 0.0) * north_m * east_m
    if not math.isfinite(common_m2):
        common_m2 = 0.0
    covariance = np.array([[north_m**2, common_m2], [common_m2, east_m**2]])
    return Gaussian(mean_ned_m=place, covariance_m2=covariance, role=Role.ESTIMATE)


def _sigma(columns: Mapping[str, float], column: str) -> float:
    """Standard deviation of a column, in its unit; NaN: not known."""
    for suffix in ("_rad_s", "_rad", "_m_s", "_m"):
        if column.endswith(suffix):
            name = column.removesuffix(suffix)
            variance = columns.get(f"{name}_variance{suffix}2", math.nan)
            known = math.sqrt(variance) if variance >= 0.0 else math.nan
            return columns.get(f"{name}_sigma{suffix}", known)
    return math.nan


def _of_set(estimate: Estimates) -> dict[str, Item]:
    rows = estimate.values
    columns = dict(zip(estimate.columns, rows.T, strict=True))
    if "north_m" not in columns or "east_m" not in columns:
        return {}
    points = np.column_stack([columns["north_m"], columns["east_m"], np.zeros(len(rows))])
    kept = np.isfinite(points).all(axis=1)
    weights = next((columns[name] for name in _WEIGHTS if name in columns), np.zeros(0))
    labels = [str(number + 1) for number in range(len(rows))]
    return {
        "targets": PointSet(
            points_ned_m=points[kept],
            weights=weights[kept] if len(weights) else weights,
            labels=tuple(label for label, known in zip(labels, kept, strict=True) if known),
            role=Role.FOUND,
        )
    }
