"""The trial of the study `vision-search`: one search on SITL, and its log through four beliefs.

As in Tisdale et al. 2008, the aircraft fly by one belief, and the others are computed from the same flight
afterwards: a fine grid, a coarse one, and particles.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.library import make_estimator
from estimators.log_replay import replay
from estimators.logs import open_log
from estimators.vision_search.parameters import VisionSearchParameters
from flightsim.world_spec import WorldSpec
from missions.base.request import RunRequest
from missions.studies.flights import fly_trial
from missions.studies.study import run_of
from missions.vision_search.figures import ELLIPSE_95
from missions.vision_search.options import VisionSearchOptions
from missions.vision_search.world import vision_search_world

__all__ = ["BELIEFS", "MOMENTS_S", "TEAMS", "Localized", "VisionSearchCell", "VisionSearchTrial"]

Array = NDArray[np.float64]

TEAMS: Final[Mapping[str, int]] = MappingProxyType({"one": 1, "two": 2})

BELIEFS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "fine": ("cell_m=0.67", "single_precision=true"),
        "coarse": ("cell_m=12.5",),
        "particles": ("belief=particles", "particles=6400"),
    }
)
"""The paper's three representations, as settings of the estimator."""

MOMENTS_S: Final = (30, 60, 120, 180, 240, 300)
"""Times from the begin of the search at which the belief of a flight is recorded."""

_ESTIMATE_PERIOD: Final = "estimate_period_s=10"
_ERRORS: Final = VisionSearchParameters(
    forward_sigma_m=0.1,
    right_sigma_m=0.1,
    height_sigma_m=0.2,
    yaw_sigma_rad=0.005,
    pitch_sigma_rad=0.0016,
    roll_sigma_rad=0.0016,
    place_time_s=30.0,
    attitude_time_s=100.0,
)
"""Errors that the filter expects: of `pose_errors` in flights with other seeds than the study's. Of mounts,
headings, times and ground it knows no more than the defaults say.
"""
_PARAMETERS: Final = MappingProxyType(
    {"COM_LOW_BAT_ACT": 0.0}
)  # some searches outlast the battery's failsafe
_ANGLES_AND_PLACE: Final = (
    *("forward_m", "right_m", "height_m", "yaw_rad", "pitch_rad", "roll_rad"),
    *("place_time_s", "attitude_time_s"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class VisionSearchCell:
    """Parameters of a trial."""

    aircraft: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Localized:
    """The result of a search.

    Attributes:
        completed: the search was flown, and passed its checks.
        reason: why not; "" otherwise.
        localized: the belief of the flight has narrowed down.
        localized_s: time until then; NaN: it did not.
        search_s: duration of the search.
        sim_time_s: time from boot to the end.
        figures: of each belief ("fine", "coarse", "particles") its `error_m`, `sigma_m` and
            `distance_squared` (Mahalanobis), as "fine_error_m", and its width at `MOMENTS_S`, as
            "fine_sigma_at_120_m"; and the vehicles' pose errors, root mean squares over the team, as
            "pose_pitch_rad".
    """

    completed: bool
    reason: str
    localized: bool
    localized_s: float
    search_s: float
    sim_time_s: float
    figures: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class VisionSearchTrial:
    """One search.

    Attributes:
        model: of the vehicles.
        side_m: of the searched square (paper: 1 km).
        passes: over the target, of each vehicle.
    """

    model: str = "aerosonde"
    side_m: float = 1000.0
    passes: int = 4

    def __call__(self, cell: VisionSearchCell, seed: int) -> Localized:
        """Fly the search. The same seed has the same place of the target for both teams."""
        _, run = run_of(seed)
        half_m = 0.5 * self.side_m
        options = VisionSearchOptions(
            vehicles=TEAMS[cell.aircraft],
            passes=self.passes * TEAMS[cell.aircraft],
            estimator=replace(
                _ERRORS,
                south_m=-half_m,
                west_m=-half_m,
                north_m=half_m,
                east_m=half_m,
                target_size_m=3.0,
                seed=run,
            ),
        )
        world = WorldSpec.of_team(options.vehicles, model=self.model, seed=seed)
        world = vision_search_world(world, options)
        result = fly_trial(
            "vision-search", RunRequest(options=options, world=world, parameters=dict(_PARAMETERS))
        )
        summary = result.summary
        place = summary["target_north_m"], summary["target_east_m"]
        figures = _pose_figures(summary)
        for name, settings in BELIEFS.items():
            log = result.folder / "flight.tlog"
            figures |= _replayed(name, settings, options, log, place, summary["began_us"])
        localized_s = summary["localized_s"]
        return Localized(
            completed=result.outcome == "completed",
            reason=result.reason,
            localized=summary["localized"],
            localized_s=math.nan if localized_s is None else localized_s,
            search_s=summary["search_s"],
            sim_time_s=summary["sim_time_s"],
            figures=figures,
        )


def _pose_figures(summary: Mapping[str, Any]) -> dict[str, float]:
    known = [errors for errors in summary["pose_errors"].values() if errors is not None]
    return {
        f"pose_{name}": math.sqrt(sum(errors[name] ** 2 for errors in known) / len(known))
        for name in _ANGLES_AND_PLACE
        if known
    }


def _replayed(
    name: str,
    settings: tuple[str, ...],
    options: VisionSearchOptions,
    log: Path,
    place: tuple[float, float],
    began_us: int,
) -> dict[str, float]:
    """One belief over the log of a flight: at its end, and its width at the moments before."""
    parameters = options.estimator
    chosen = {setting.partition("=")[0] for setting in (*settings, _ESTIMATE_PERIOD)}
    own = [
        f"{field.name}={getattr(parameters, field.name)}"
        for field in fields(parameters)
        if field.name not in chosen
    ]
    centre = f"centre_vehicle={1 if options.vehicles > 1 else 0}"
    own = [setting for setting in own if not setting.startswith("centre_vehicle")]
    done = replay(
        open_log(log), partial(make_estimator, "vision-search", (*own, centre, *settings, _ESTIMATE_PERIOD))
    )
    (runner,) = done.fleet.runners.values()
    table = runner.tables.get("AreaEstimate")
    if table is None:
        return {}
    last = dict(zip(table.columns, table.values[-1].tolist(), strict=True))
    n, e = place[0] - last["north_m"], place[1] - last["east_m"]
    sn, se, rho = last["north_sigma_m"], last["east_sigma_m"], last["north_east_correlation"]
    a, b = n / sn, e / se
    distance = (a * a + b * b - 2.0 * rho * a * b) / (1.0 - rho * rho)
    times_s = (table.time_us - began_us) * 1e-6
    sigma_m = _sigma_m(table["north_sigma_m"], table["east_sigma_m"], table["north_east_correlation"])
    moments = {}
    for moment_s in MOMENTS_S:
        index = int(np.searchsorted(times_s, moment_s, side="right")) - 1
        if index >= 0:
            moments[f"{name}_sigma_at_{moment_s}_m"] = float(sigma_m[index])
    return moments | {
        f"{name}_error_m": math.hypot(n, e),
        f"{name}_sigma_m": float(sigma_m[-1]),
        f"{name}_distance_squared": distance,
        f"{name}_inside": float(distance <= ELLIPSE_95),
    }


def _sigma_m(north_m: Array, east_m: Array, correlation: Array) -> Array:
    """The fourth root of the covariance's determinant."""
    return np.asarray(np.sqrt(north_m * east_m) * (1.0 - correlation**2) ** 0.25)
