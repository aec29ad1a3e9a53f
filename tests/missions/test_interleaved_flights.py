"""A mission remembers no flight: flights of one mission at the same time report what each reports alone."""

import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from flightsim.environment import Environment
from flightsim.world_spec import WorldSpec
from missions.base.options import FlightOptions, MissionOptions
from missions.base.request import RunRequest
from missions.handoff.options import HandoffOptions
from missions.handoff.world import handoff_world
from missions.library import MISSIONS, find_mission
from missions.multi_target.options import MultiTargetOptions
from missions.multi_target.world import TargetField, multi_target_world  # type: ignore[attr-defined]
from missions.occupancy.options import OccupancyOptions
from missions.occupancy.world import occupancy_world
from missions.orbit.options import OrbitOptions
from missions.orbit.world import orbit_world
from missions.runs.session import Flight, RunResult, fly
from missions.search.area import edges
from missions.survey.options import SurveyOptions
from missions.survey.world import survey_world
from missions.vision_search.options import VisionSearchOptions
from missions.vision_search.world import vision_search_world
from tests.missions.held_options import with_fields

AIR = Environment.from_wind(speed_m_s=3.0, from_deg=270.0, turbulence="light")
PATTERN = FlightOptions(width_m=20.0, height_m=20.0, spacing_m=10.0)


def team(count: int, seed: int, model: str = "iris") -> WorldSpec:
    return WorldSpec.of_team(count, model=model, seed=seed, air=AIR)


def pattern(seed: int) -> tuple[MissionOptions, WorldSpec]:
    return PATTERN, team(1, seed)


def orbit(seed: int) -> tuple[MissionOptions, WorldSpec]:
    options = OrbitOptions(duration_s=20.0, entry_distance_m=250.0)
    return options, orbit_world(team(1, seed, "aerosonde"), options)


def occupancy(seed: int) -> tuple[MissionOptions, WorldSpec]:
    options = OccupancyOptions(
        vehicles=2, altitude_m=15.0, separation_m=6.0, width_m=400.0, height_m=400.0, search_time_s=20.0
    )
    return options, occupancy_world(team(2, seed), options)


def multi_target(seed: int) -> tuple[MissionOptions, WorldSpec]:
    options = with_fields(
        MultiTargetOptions(),
        altitude_m=8.0,
        start_ne_m=(0.0, 0.0),
        steps=3,
        expected_targets=4.0,
        **edges((-20.0, -20.0, 60.0, 60.0)),
    )
    return options, multi_target_world(team(1, seed), options, TargetField(count=4, clusters=1))


def handoff(seed: int) -> tuple[MissionOptions, WorldSpec]:
    options = HandoffOptions(vehicles=2, takeover_s=20.0, timeout_s=20.0)
    return options, handoff_world(team(2, seed, "aerosonde"), options)


def survey(seed: int) -> tuple[MissionOptions, WorldSpec]:
    options = with_fields(SurveyOptions(width_m=300.0, height_m=300.0, spacing_m=300.0), map_error_nt=0.0)
    return options, survey_world(team(1, seed, "aerosonde"), options)


def vision_search(seed: int) -> tuple[MissionOptions, WorldSpec]:
    area = edges((-15.0, -15.0, 15.0, 15.0))
    options = with_fields(
        VisionSearchOptions(), altitude_m=15.0, search_time_s=10.0, target_size_m=0.8, **area
    )
    return options, vision_search_world(team(1, seed), options)


SMALL = {
    "handoff": handoff,
    "multi-target": multi_target,
    "occupancy": occupancy,
    "orbit": orbit,
    "survey": survey,
    "vision-search": vision_search,
}


def request(name: str, seed: int, out: Path) -> RunRequest:
    options, world = SMALL.get(name, pattern)(seed)
    return RunRequest(options=options, world=world, out=out, picture=False)


def reported(result: RunResult) -> Any:
    """What a result says of its flight."""
    changing = ("wall_time_s", "speedup", "options")  # options have the path of a map in the run folder
    summary = {key: value for key, value in result.summary.items() if key not in changing}
    return result.outcome, result.reason, summary, result.report.lines


@pytest.mark.parametrize("name", MISSIONS)
@pytest.mark.slow
def test_a_flight_within_a_flight_changes_neither(name: str, tmp_path: Path) -> None:
    """The second flight begins and ends while the first one is under way."""
    alone = [reported(fly(name, request(name, seed, tmp_path / f"alone{seed}"))) for seed in (1, 2)]
    mission = find_mission(name)
    within: list[RunResult] = []

    def second() -> None:
        within.append(fly(mission, request(name, 2, tmp_path / "second")))

    def meanwhile(flight: Flight) -> None:
        if not within and flight.mission is not None and flight.elapsed_s > 15.0:
            thread = threading.Thread(target=second)
            thread.start()
            thread.join()

    first = fly(mission, request(name, 1, tmp_path / "first"), meanwhile)
    assert len(within) == 1
    assert [reported(first), reported(within[0])] == alone
    assert alone[0][2]["mission"] == name and alone[0] != alone[1]


def test_flights_in_threads_are_those_of_one_after_another(tmp_path: Path) -> None:
    requests = [replace(request("sector", seed, tmp_path / f"in_turn{seed}")) for seed in (1, 2)]
    in_turn = [reported(fly("sector", each)) for each in requests]
    with ThreadPoolExecutor(2) as pool:
        at_once = pool.map(
            lambda seed: reported(fly("sector", request("sector", seed, tmp_path / f"at_once{seed}"))), (1, 2)
        )
    assert list(at_once) == in_turn
