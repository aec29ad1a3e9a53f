"""A search without a flight: world, estimator and planner are those of `fly multi-target`, and the vehicle is
a point that is at each planned place when its sensor takes a scan, as in the paper's simulations.

What is left out is the flight: the time of a turn, the way between two places, and the errors of the
vehicle's own place and heading. With more than one vehicle in the options there is still one.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from estimators.multi_target.search_belief import SearchBelief
from estimators.tracking.range_bearing import Viewpoint
from flightsim import truth as t
from flightsim.foundation.geodetic_position import NorthEast
from flightsim.foundation.random_streams import RandomStreams
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.payload import GroundTargets, TerrainSpec
from flightsim.payload.target_sensor import TargetSensor
from flightsim.world_spec import WorldSpec
from missions.multi_target.figures import SearchScore, scored
from missions.multi_target.options import MultiTargetOptions
from missions.multi_target.planner import SearchPlanner
from missions.multi_target.search import planner_of
from missions.search.team import HEADING_RAD

__all__ = ["PointSearch", "search_with_point"]

_RATE_HZ: Final = 50  # steps of the sensor, of which its period is a multiple
_STEP_US: Final = 1_000_000 // _RATE_HZ


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PointSearch:
    """A finished search.

    Attributes:
        belief: the estimator's belief at the end.
        score: against the true targets, after each scan.
        places: of the scans.
    """

    belief: SearchBelief
    score: SearchScore
    places: tuple[NorthEast, ...]


def search_with_point(
    options: MultiTargetOptions, world: WorldSpec, planner: SearchPlanner | None = None
) -> PointSearch:
    """Search once.

    Args:
        options: the search, adapted to a vehicle.
        world: with targets and the first vehicle's sensor; `multi_target_world`.
        planner: None: that of the options.
    """
    parameters = world.vehicles[0].payload.target_sensor
    assert parameters is not None  # `multi_target_world` gives it one
    streams = RandomStreams(world.seed)
    truth = np.zeros(t.TRUTH_SIZE)
    quaternion_from_euler(0.0, 0.0, HEADING_RAD, truth[t.Q_NED_FROM_FRD])
    truth[t.ALT_M] = world.place.alt_m + options.altitude_m
    targets = GroundTargets(world.targets, seeds=lambda index: streams.child("target", index))
    terrain = world.terrain.made(world.seed) if isinstance(world.terrain, TerrainSpec) else world.terrain
    sensor = TargetSensor(
        parameters,
        truth=truth,
        home=world.place,
        targets=targets,
        physics_rate_hz=_RATE_HZ,
        seeds=lambda name: streams.child("vehicle", 0, "sensor", name),
        terrain=terrain,
    )
    belief, planner = SearchBelief(options.estimator), planner or planner_of(options)
    here, direction_rad = options.own_start_ne_m, None
    times_us, states, true_places, places = [], [], [], []
    time_us = 0
    for _ in range(options.steps):
        there = planner.next_place(belief, here, direction_rad, ())
        direction_rad, here = math.atan2(there[1] - here[1], there[0] - here[0]), there
        truth[t.LAT_RAD], truth[t.LON_RAD] = map(math.radians, world.place.offset(*here))
        while (scan := sensor.step(time_us)) is None:
            time_us += _STEP_US
        belief.observe(
            time_us,
            np.array(scan.detections).reshape(-1, 2),
            Viewpoint(north_m=here[0], east_m=here[1], heading_rad=HEADING_RAD),
        )
        time_us += _STEP_US
        times_us.append(scan.time_us)
        states.append(belief.targets)
        true_places.append(targets.positions_ned_m[:, :2].copy())
        places.append(here)
    score = scored(options.estimator, np.array(times_us) * 1e-6, states, np.array(true_places))
    return PointSearch(belief=belief, score=score, places=tuple(places))
