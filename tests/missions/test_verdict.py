"""Whether what was commanded was flown, by the vehicle's own positions."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from flightsim.world_spec import WorldSpec
from missions.base.options import FlightOptions, Via
from missions.flown.score import Track
from missions.flown.verdict import path_verdict
from missions.kind import VehicleKind
from missions.runs import session
from missions.runs.session import RunRequest
from missions.vehicle.notes import PATTERN, CommandedPath, CutShort, FlightNotes
from tests.missions.conftest import HOME

PATH = np.column_stack((np.arange(0.0, 201.0), np.zeros(201), np.full(201, -10.0)))
TIME_S = np.arange(0.0, 40.01, 0.1)


def notes_of(*, waypoints=(), kind=VehicleKind.MULTICOPTER, cut_short=None, flown=True) -> FlightNotes:
    notes = FlightNotes(kind=str(kind), system_id=1, cut_short=cut_short)
    notes.commanded = CommandedPath(
        origin=HOME,
        points_ned_m=PATH,
        waypoints_ned_m=np.array([(n, 0.0, -10.0) for n in waypoints]).reshape(-1, 3),
        acceptance_m=2.0,
    )
    if flown:
        notes.begin(PATTERN, 0)
        notes.end(40_000_000)
    return notes


def along(speed_m_s: float = 5.0, east_m: float = 0.0, kept=lambda time_s: True):
    """A score with the track of a straight flight; only samples that are kept."""
    times = np.array([t for t in TIME_S if kept(t)])
    north = np.minimum(speed_m_s * times, 200.0)
    track = np.column_stack((north, np.full_like(times, east_m), np.full_like(times, -10.0)))
    return SimpleNamespace(estimate=Track(time_s=times, pos_ned_m=track, yaw_rad=np.zeros_like(times)))


@pytest.mark.parametrize("waypoints", [(), (0.0, 100.0, 200.0)])
def test_what_was_flown_is_accepted(waypoints) -> None:
    assert path_verdict(notes_of(waypoints=waypoints), along(east_m=2.0)) == ""


def test_a_vehicle_that_stays_where_the_path_begins_has_not_flown_it() -> None:
    assert "94 % of the commanded path were not flown" in path_verdict(notes_of(), along(0.0))
    missed = path_verdict(notes_of(waypoints=(0.0, 100.0, 200.0)), along(0.0))
    assert "2 of 3 waypoints were not passed within 5 m by the vehicle's own position: number 2" in missed


def test_a_track_beside_the_path_is_outside_the_bound_of_its_kind() -> None:
    text = path_verdict(notes_of(), along(east_m=12.0))
    assert "up to 12.0 m off the commanded path by its own position; accepted: 10 m (`max_error_m`)" in text
    assert path_verdict(notes_of(kind=VehicleKind.FIXED_WING), along(east_m=12.0)) == ""
    assert path_verdict(notes_of(), along(east_m=12.0), max_error_m=15.0) == ""


@pytest.mark.parametrize("seed", range(5))
def test_a_closed_path_is_flown_with_a_rest_before_and_after_it(seed) -> None:
    """Places near each other are passed in their order also where the vehicle wanders about them."""
    angle = np.concatenate((np.zeros(30), np.linspace(0.0, 2.0 * np.pi, 300), np.full(60, 2.0 * np.pi)))
    circle = np.column_stack((30.0 * np.cos(angle), 30.0 * np.sin(angle), np.full_like(angle, -10.0)))
    wander = np.random.default_rng(seed).normal(0.0, 0.3, circle.shape)
    times = 0.1 * np.arange(len(angle))
    notes = notes_of()
    notes.commanded = replace(notes.commanded, points_ned_m=circle[30:330])  # type: ignore[type-var]
    track = Track(time_s=times, pos_ned_m=circle + wander, yaw_rad=np.zeros_like(times))
    assert path_verdict(notes, SimpleNamespace(estimate=track)) == ""
    still = Track(time_s=times, pos_ned_m=circle[:1] + wander, yaw_rad=np.zeros_like(times))
    assert "of the commanded path were not flown" in path_verdict(notes, SimpleNamespace(estimate=still))


def test_a_path_that_was_not_begun_or_not_seen_is_no_flight() -> None:
    assert path_verdict(notes_of(flown=False), along()) == "the commanded path was not begun"
    found_before = notes_of(flown=False)
    found_before.cut_short = CutShort.FOUND  # a search that has ended on the way to its pattern
    assert path_verdict(found_before, along()) == ""
    blind = SimpleNamespace(estimate=None)
    assert "no position (GLOBAL_POSITION_INT) was received" in path_verdict(notes_of(), blind)
    assert path_verdict(FlightNotes(kind="multicopter"), blind) == ""  # nothing was commanded


def test_what_passed_while_the_link_was_lost_is_no_evidence_against_the_flight() -> None:
    away = along(kept=lambda time_s: not 15.0 < time_s < 28.0)
    away.estimate.pos_ned_m[away.estimate.time_s >= 28.0, 1] = 4.0  # straight between, past the waypoint
    assert path_verdict(notes_of(waypoints=(0.0, 100.0, 200.0)), away) == ""


def test_with_a_time_limit_the_rest_need_not_be_flown() -> None:
    half = along(2.5)
    waypoints = (0.0, 100.0, 200.0)
    assert "1 of 3 waypoints" in path_verdict(notes_of(waypoints=waypoints), half)
    assert path_verdict(notes_of(waypoints=waypoints, cut_short=CutShort.TIME), half) == ""


@pytest.mark.parametrize("waypoints", [(), (100.0, 150.0, 200.0)])
def test_a_time_limit_does_not_excuse_a_flight_that_passed_nothing(waypoints) -> None:
    beside = along(0.0, east_m=9.0 if waypoints else 12.0)
    notes = notes_of(waypoints=waypoints, cut_short=CutShort.TIME)
    text = path_verdict(notes, beside, max_error_m=5.0)
    assert ("3 of 3 waypoints were not passed" if waypoints else "100 % of the commanded path") in text
    notes.cut_short = CutShort.FOUND  # a search may end on the way
    assert path_verdict(notes, beside, max_error_m=5.0) == ""
    not_begun = notes_of(waypoints=waypoints, cut_short=CutShort.TIME, flown=False)
    assert path_verdict(not_begun, beside) == "the commanded path was not begun"


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.parametrize("via", Via)
@pytest.mark.sampled(1)
def test_a_mission_that_is_reported_and_not_flown_has_failed(
    scripted, make_sitl, tmp_path: Path, flavour, via
):
    """The vehicle reports every item and takes every setpoint, and stands still at its altitude."""

    class Idle(make_sitl):
        def __init__(self):
            super().__init__(flavour)
            autopilot = self.autopilots[0]
            step = autopilot._fly

            def stay(dt):
                step(dt)
                if autopilot.kind in ("mission", "guided") and -autopilot.pos[2] > 9.0:
                    autopilot.pos[:2] = [0.0, 0.0]
                    last = len(autopilot.items) - 1
                    if (
                        autopilot.kind == "mission"
                        and autopilot.current < last
                        and not autopilot.time_us % 10**6
                    ):
                        autopilot.current += 1

            autopilot._fly = stay

    scripted.make = lambda *_: Idle()
    options = FlightOptions(pattern="sector", width_m=60.0, height_m=60.0, via=via)
    request = RunRequest(
        options=options, world=WorldSpec.of_team(autopilot=flavour), picture=False, out=tmp_path / "run"
    )
    result = session.fly("sector", request)
    assert result.outcome == "failed"
    assert "own position" in result.reason
