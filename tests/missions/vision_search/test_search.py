"""Planners and the state of a search, without flights: a camera that is moved from place to place."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from estimators.tracking.camera_sight import CameraSight
from estimators.vision_search import AreaEstimate, VisionSearchEstimator, VisionSearchParameters
from estimators.vision_search.models import new_belief, pose_errors_of
from flightsim.foundation.vectors import from_euler, product
from missions.search.area import edges
from missions.vehicle.limits import FixedWingLimits, MulticopterLimits
from missions.vision_search.figures import search_verdict
from missions.vision_search.for_vehicle import for_vehicle
from missions.vision_search.options import LocalizeKind, SearchPlannerKind, VisionSearchOptions
from missions.vision_search.planner import Localizer, planner_of
from missions.vision_search.search import VisionSearch
from tests.missions.held_options import with_fields

PARAMETERS = VisionSearchParameters(**edges((-100.0, -100.0, 100.0, 100.0)), cell_m=2.0)
OPTIONS = for_vehicle(VisionSearchOptions(estimator=PARAMETERS), MulticopterLimits())


def frame(place, heading_rad, options=OPTIONS):
    down = from_euler(0.0, -0.5 * math.pi, 0.0)
    place_m2, rotation_rad2 = pose_errors_of(options.estimator).covariances(
        from_euler(0.0, 0.0, heading_rad), down
    )
    return CameraSight(
        place_ned_m=(place[0], place[1], -60.0),
        q_ned_from_mount=product(from_euler(0.0, 0.0, heading_rad), down),
        place_m2=place_m2,
        rotation_rad2=rotation_rad2,
        width_px=1280,
        height_px=720,
        focal_px=914.0,
    )


def detection_probability_after(planner, steps, options=OPTIONS):
    """Of a search that sees nothing, with a frame in the middle and at the end of each step."""
    belief = new_belief(options.estimator)
    here, direction, camera = (0.0, 0.0), None, frame((0.0, 0.0), 0.0)
    for _ in range(steps):
        there = planner.next_place(belief, here, direction, camera)
        assert options.area.contains(*there) or options.planner is not SearchPlannerKind.HORIZON
        direction = math.atan2(there[1] - here[1], there[0] - here[0])
        for share in (0.5, 1.0):
            place = tuple(a + share * (b - a) for a, b in zip(here, there, strict=True))
            camera = frame(place, direction)
            belief.update(camera)
        here = there
    return belief.probability_of_detection


def test_the_planner_with_a_horizon_detects_sooner_than_the_greedy_one_and_the_curve():
    found = {}
    for name, changes in {
        "horizon": {"planner": SearchPlannerKind.HORIZON, "horizon": 2},
        "greedy": {"planner": SearchPlannerKind.HORIZON, "horizon": 1},
        "lissajous": {"planner": SearchPlannerKind.LISSAJOUS},
        "sweep": {"planner": SearchPlannerKind.SWEEP},
    }.items():
        options = with_fields(OPTIONS, **changes)
        found[name] = detection_probability_after(planner_of(options), 14, options)
    assert found["horizon"] > 0.6
    assert found["horizon"] >= found["greedy"] - 0.02
    assert found["greedy"] > found["lissajous"]
    assert found["sweep"] > 0.4


def test_vehicles_that_plan_by_the_same_belief_part():
    options = with_fields(OPTIONS, planner=SearchPlannerKind.HORIZON, horizon=2)
    belief, planner, camera = new_belief(PARAMETERS), planner_of(options), frame((0.0, 0.0), 0.0)
    first = planner.next_place(belief, (0.0, 0.0), None, camera)
    direction = math.atan2(first[1], first[0])
    second = planner.next_place(belief, (0.0, 0.0), None, camera, [(first, direction)])
    assert first == planner.next_place(belief, (0.0, 0.0), None, camera)
    assert abs(math.remainder(math.atan2(second[1], second[0]) - direction, math.tau)) > math.radians(40.0)


def test_a_sweep_sees_the_whole_area_and_each_vehicle_its_strip():
    assert detection_probability_after(planner_of(OPTIONS), 60) > 0.97
    for index, (low, high) in enumerate(((-100.0, 0.0), (0.0, 100.0))):
        own = with_fields(OPTIONS, vehicles=2, index=index)
        planner, here, places = planner_of(own), (0.0, 0.0), []
        for _ in range(30):
            here = planner.next_place(new_belief(PARAMETERS), here, None, None)
            places.append(here)
        north = np.array(places)[5:, 0]
        assert low <= north.min() and north.max() <= high


def test_the_planner_of_an_aircraft_turns_by_90_degrees_at_most():
    chosen = with_fields(
        VisionSearchOptions(planner=SearchPlannerKind.HORIZON),
        horizon=1,
        **edges((-600.0, -600.0, 600.0, 600.0)),
    )
    options = for_vehicle(chosen, FixedWingLimits())
    belief, planner = new_belief(options.estimator), planner_of(options)
    here, direction = (0.0, 0.0), 0.0
    for _ in range(10):
        there = planner.next_place(belief, here, direction, frame(here, direction, options))
        new = math.atan2(there[1] - here[1], there[0] - here[0])
        at_edge = max(map(abs, here)) > 600.0 - options.step_m  # type: ignore[operator]
        assert at_edge or abs(math.remainder(new - direction, math.tau)) < math.pi / 2 + 1e-6
        belief.update(frame(there, new, options))
        here, direction = there, new


def estimate(north_m=10.0, east_m=20.0, sigma_m=2.0, detections=3, time_us=1_000_000):
    return AreaEstimate(
        time_us=time_us,
        north_m=north_m,
        east_m=east_m,
        north_variance_m2=sigma_m**2,
        north_east_covariance_m2=0.0,
        east_variance_m2=sigma_m**2,
        mode_north_m=north_m,
        mode_east_m=east_m,
        entropy_nats=3.0,
        probability_of_detection=0.2,
        detections=detections,
        frames=100,
    )


def test_passes_cross_the_estimate_in_spread_directions():
    localizer, here, directions = Localizer(OPTIONS), (-80.0, 0.0), []
    for _ in range(6):
        entry = localizer.next_place(estimate(), here)
        exit_ = localizer.next_place(estimate(), entry)
        middle = 0.5 * (entry[0] + exit_[0]), 0.5 * (entry[1] + exit_[1])
        assert middle == pytest.approx((10.0, 20.0))
        directions.append(math.atan2(exit_[1] - entry[1], exit_[0] - entry[0]) % math.pi)
        here = exit_
    assert localizer.done == 5  # the sixth pass has begun
    gaps = np.diff(np.sort([*directions, min(directions) + math.pi]))
    assert gaps.max() < math.radians(60.0)


def test_an_orbit_keeps_its_distance():
    localizer = Localizer(with_fields(OPTIONS, localize=LocalizeKind.ORBIT))
    places = [localizer.next_place(estimate(), (40.0, 20.0)) for _ in range(7)]
    radii = [math.dist(place, (10.0, 20.0)) for place in places]
    assert radii == pytest.approx([radii[0]] * 7)
    assert 5.0 < radii[0] < 23.0  # the target stays in the picture
    assert places[6] == pytest.approx(places[0])
    assert localizer.done == 5  # the sixth turn has begun


def search_of(count=1, **changes):
    options = [with_fields(OPTIONS, vehicles=count, index=k, **changes) for k in range(count)]
    estimators = [VisionSearchEstimator(PARAMETERS) for _ in options]
    return VisionSearch(estimators, options, range(1, count + 1)), estimators


def nowhere():
    return (None,)


def test_a_search_localizes_when_the_belief_is_narrow_and_searches_on_when_it_is_wide_again():
    search, _ = search_of(passes=2)
    search.begin(0, 0)
    search.observed(0, estimate(sigma_m=80.0, detections=0), nowhere)
    assert search.localized_us == -1
    away = search.step(0, 0, (0.0, 0.0))
    search.observed(0, estimate(time_us=2_000_000), nowhere)
    assert search.localized_us == 2_000_000
    entry = search.step(0, 0, away)
    exit_ = search.step(0, 0, entry)
    assert math.dist(entry, (10.0, 20.0)) == pytest.approx(math.dist(exit_, (10.0, 20.0)))
    search.observed(0, estimate(sigma_m=50.0), nowhere)
    again = search.step(0, 0, exit_)
    assert math.dist(again, (10.0, 20.0)) != pytest.approx(math.dist(entry, (10.0, 20.0)))
    search.observed(0, estimate(), nowhere)
    places = [search.step(0, 0, again) for _ in range(2)]
    assert search.passes == 1 and not search.over
    assert 0.5 * np.add(*places) == pytest.approx((10.0, 20.0))  # the second pass is flown to its end
    assert search.step(0, 0, places[1]) == places[1]
    assert search.reason == "all passes are flown"
    assert search.progress == 1.0


def test_the_passes_of_a_team_count_together():
    search, _ = search_of(2, passes=2)
    for index in range(2):
        search.begin(index, 0)
        search.observed(index, estimate(), nowhere)
        search.step(index, 0, (0.0, 0.0))
        search.step(index, 0, (0.0, 0.0))
    for index in range(2):
        search.step(index, 0, (0.0, 0.0))
    assert search.over


def test_a_search_ends_with_its_time_or_its_steps():
    search, _ = search_of(search_time_s=10.0)
    search.begin(0, 1_000_000)
    search.observed(0, estimate(sigma_m=80.0, detections=0, time_us=11_500_000), nowhere)
    assert search.reason == "the search time is over"
    search, _ = search_of(steps=2)
    search.begin(0, 0)
    for _ in range(3):
        search.step(0, 0, (0.0, 0.0))
    assert search.reason == "all steps are taken"


def test_a_vehicle_waits_for_a_frame_before_each_decision():
    search, (estimator,) = search_of()
    search.begin(0, 0)
    assert not search.may_step(0)
    estimator.frames = 1
    assert search.may_step(0)
    search.step(0, 0, (0.0, 0.0))
    assert not search.may_step(0)


def test_moments_stay_few():
    search, _ = search_of()
    search.begin(0, 0)
    for k in range(250):
        search.observed(0, estimate(time_us=k * 1_000_000), nowhere)
    assert 40 < len(search.moments) < 100
    assert np.all(np.diff([moment.time_us for moment in search.moments]) > 0)


def test_why_no_frame_was_used_is_named():
    used = {"frames_without_pose": 0.0, "frames_too_low": 0.0}
    apart = {"frames_without_pose": 900.0, "frames_too_low": 40.0, "warning": "the clocks are 0.33 s apart"}
    teams = (([], "any frame"), ([used], "any frame"), ([used, apart], "900 without attitude or position"))
    for remarks, text in teams:
        team = SimpleNamespace(
            search=SimpleNamespace(states=[[] for _ in remarks]),
            searchers=remarks,
            watch=SimpleNamespace(remarks=lambda index, remarks=remarks: remarks[index]),
        )
        reason = search_verdict(team, None)
        assert text in reason and ("0.33 s apart" in reason) == (apart in remarks)
