"""Scoring a flight from its frames: against made-up flights whose errors are known."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from autopilot_bridge.mavlink import FrameEncoder, dialect
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.cli.bodies.fly_report import report_left_out
from missions.flown.picture import draw_run
from missions.flown.records import FlightRecords
from missions.flown.run_folder import team_figures, vehicle_summary, versions, write_summary
from missions.flown.score import Track, path_errors_m, score
from missions.flown.track import waypoint_misses_m
from missions.vehicle.notes import PATTERN, CommandedPath, FlightNotes

HOME = GeodeticPosition(lat_deg=47.39774, lon_deg=8.54559, alt_m=489.4)


def straight_path(length=100.0):
    n = np.linspace(0.0, length, 401)
    return np.column_stack((n, np.zeros_like(n), np.full_like(n, -10.0)))


def tracked(points, time_s=None):
    """A track of points, 10 a second unless times are given."""
    time_s = 0.1 * np.arange(len(points)) if time_s is None else time_s
    return Track(time_s=time_s, pos_ned_m=points, yaw_rad=np.zeros(len(points)))


def test_distance_to_the_path_and_not_to_its_ends():
    track = np.array([(10.0, 0.3, -10.0), (20.0, -0.4, -10.0), (30.0, 0.3, -9.6)])
    assert path_errors_m(straight_path(), tracked(track)) == pytest.approx([0.3, 0.4, 0.5], abs=1e-9)


def test_another_branch_of_a_crossing_path_does_not_count():
    t = np.linspace(0.0, 2 * math.pi, 2000)
    eight = np.column_stack((50.0 * np.sin(2 * t), 50.0 * np.sin(t), np.full_like(t, -10.0)))
    lost = eight[900:1100].copy()  # through the crossing, then flown along the other branch's direction
    lost[:, 1] *= -1.0
    errors = path_errors_m(eight, tracked(np.vstack((eight[:900], lost))))
    assert errors[:900].max() < 1e-9
    assert errors[-1] > 5.0


def test_every_sample_of_a_flight_on_the_path_is_on_it():
    path = straight_path()
    assert path_errors_m(path, tracked(path[::7])).max() < 1e-9
    assert len(path_errors_m(path[:1], tracked(path))) == 0
    assert len(path_errors_m(path, tracked(path[:0]))) == 0


@pytest.mark.parametrize("missing_s", [5.0, 12.0, 31.0])
@pytest.mark.parametrize("from_s", [3.0, 20.0, 44.0])
def test_a_gap_counts_neither_as_an_error_nor_as_a_way(from_s, missing_s):
    """A figure of eight, 20 m from its nearest other branch where it does not cross itself."""
    t = np.linspace(0.0, 2 * math.pi, 4000)
    eight = np.column_stack((100.0 * np.sin(2 * t), 100.0 * np.sin(t), np.full_like(t, -10.0)))
    times = np.linspace(0.0, 80.0, 800)
    flown = eight[::5] + np.array((0.0, 0.0, 0.3))
    kept = (times < from_s) | (times > from_s + missing_s)
    track = tracked(flown[kept], times[kept])
    assert path_errors_m(eight, track) == pytest.approx(np.full(kept.sum(), 0.3), abs=0.05)
    steps = np.linalg.norm(np.diff(flown, axis=0), axis=1)
    assert track.length_m == pytest.approx(steps[kept[1:] & kept[:-1]].sum(), rel=0.01)
    drawn_s, drawn_m = track.drawn()
    assert np.isnan(drawn_s).sum() == np.isnan(drawn_m).all(axis=1).sum() == 1
    assert len(track.thinned(10).drawn()[0]) < 90
    assert np.isnan(track.thinned(10).drawn()[0]).sum() == 1


def test_a_waypoint_in_a_gap_is_neither_passed_nor_missed():
    n = np.arange(0.0, 60.0, 0.5)
    there = np.column_stack((n, np.zeros_like(n), np.full_like(n, -10.0)))
    commanded = CommandedPath(
        origin=HOME,
        points_ned_m=straight_path(),
        waypoints_ned_m=np.array([(12.0, 0.0, -10.0), (30.0, 8.0, -10.0), (50.0, 1.0, -10.0)]),
        acceptance_m=2.0,
    )
    kept = (n < 25.0) | (n > 36.0)
    misses = waypoint_misses_m(commanded, n[kept] / 4.0, there[kept])
    assert misses == pytest.approx((0.0, math.nan, 1.0), abs=1e-6, nan_ok=True)
    notes = FlightNotes(system_id=1, autopilot="px4", commanded=commanded)
    notes.begin(PATTERN, 0)
    notes.end(15_000_000)
    result = replace(score(*make_flight()), waypoint_misses_m=misses, gaps_s=((6.0, 9.25),))
    block = vehicle_summary(notes, result)
    assert block["waypoints"] | {"acceptance_m": 0} == {
        "count": 3, "acceptance_m": 0, "largest_miss_m": 1.0, "passed": 2, "not_received": 1
    }  # fmt: skip
    assert (block["not_received_s"], block["gaps"]) == (3.25, [{"start_s": 6.0, "end_s": 9.25}])


def position(k, *, lat=473977400, lon=85455900, alt=499400, time_ms=None):
    """The k-th of 10 positions a second."""
    time_ms = 100 * k if time_ms is None else time_ms
    message = dialect.MAVLink_global_position_int_message
    return FrameEncoder(1, 1).encode(message(time_ms, lat, lon, alt, 10_000, 0, 0, 0, 0xFFFF))


def test_positions_and_times_that_no_vehicle_can_have_are_left_out_and_counted(capsys):
    """Places outside the Earth, jumps of 100 km every few seconds, stamps near 2^32 ms."""
    frames = []
    for k in range(301):
        odd = {
            40: {"lat": 2_000_000_000}, 41: {"lon": -2_147_483_648}, 42: {"alt": 2_147_483_647},
            70: {"time_ms": 4_294_904_700}, 71: {"time_ms": 0}, 72: {"time_ms": 1_000_000},
            73: {"lat": 0, "lon": 0},
        }.get(k, {})  # fmt: skip
        if 100 <= k < 130 or 150 <= k < 180:
            odd = {"lat": 473977400 + 9_000_000}
        frames.append(position(k, **odd))
    notes = FlightNotes(system_id=1, autopilot="px4")
    notes.begin("flight", 0)
    notes.end(30_000_000)
    result = score(FlightRecords.of_frames(frames), notes)
    assert result.left_out == {"no_place_on_earth": 3, "position_jumped": 60, "time_jumped": 3}
    assert len(result.estimate.time_s) == 301 - 67
    assert result.distance_m == 0.0
    assert np.array(result.gaps_s) == pytest.approx(np.array([(9.9, 13.0), (14.9, 18.0)]))
    report_left_out({"vehicles": [vehicle_summary(notes, result)]})
    said = capsys.readouterr().err.splitlines()
    assert said == [
        "no position was received for 6.2 s of the flight, in 2 gaps: distances and errors leave them out",
        "messages left out: no place on earth 3, position jumped 60, time jumped 3",
    ]


def test_a_gap_lasts_to_the_end_of_the_flight_and_single_late_frames_are_no_jumps():
    frames = [position(k) for k in (*range(20), 18, 19, 17, *range(20, 51))]
    notes = FlightNotes(system_id=1, autopilot="px4")
    notes.begin("flight", 0)
    notes.end(9_000_000)
    result = score(FlightRecords.of_frames(frames), notes)
    assert (result.left_out, len(result.estimate.time_s)) == ({}, 51)
    assert np.array(result.gaps_s) == pytest.approx(np.array([(5.0, 9.0)]))


def test_waypoint_misses_between_samples_and_in_order():
    n = np.arange(0.0, 60.0, 5.0)
    there = np.column_stack((n, np.full_like(n, 0.7), np.full_like(n, -10.0)))
    back = there[::-1] + np.array((0.0, 1.0, 0.0))
    pos = np.vstack((there, back))
    commanded = CommandedPath(
        origin=HOME,
        points_ned_m=straight_path(),
        waypoints_ned_m=np.array([(12.0, 0.0, -10.0), (50.0, 0.0, -10.0), (12.0, 0.0, -10.0)]),
        acceptance_m=2.0,
    )
    assert waypoint_misses_m(commanded, 0.1 * np.arange(len(pos)), pos) == pytest.approx(
        (0.7, 0.7, 1.7), abs=1e-6
    )


def test_a_missed_waypoint_that_is_crossed_later_spoils_no_other():
    """As at the centre of a figure of eight, when the way in was flown wide."""
    t = np.linspace(0.0, 2 * math.pi, 400)
    eight = np.column_stack((100.0 * np.sin(2 * t), 100.0 * np.sin(t), np.full_like(t, -10.0)))
    track, times = eight.copy(), 0.1 * np.arange(len(eight))
    track[:5] += np.array((0.0, 30.0, 0.0))
    commanded = CommandedPath(
        origin=HOME, points_ned_m=eight, waypoints_ned_m=eight[:390:10], acceptance_m=5.0
    )
    misses = waypoint_misses_m(commanded, times, track)
    assert misses[0] > 5.0
    assert max(misses[1:]) < 0.1
    assert waypoint_misses_m(commanded, times, eight) == pytest.approx(np.zeros(39), abs=1e-6)
    assert waypoint_misses_m(commanded, times[:1], eight[:1]) == ()


def make_flight(
    offset_ned=(0.0, 0.0, 0.0), gps_ned=(0.0, 0.0, 0.0), roll_error=0.0, truth=True, before=(), more=()
):
    """A flight 10 m up along a straight path.

    It is off the commanded path by `offset_ned` while flying, and the autopilot's frame is off the true one
    by `gps_ned` all the time.
    """
    frames = []
    autopilot, simulator = FrameEncoder(1, 1), FrameEncoder(1, 240)
    frame = LocalFrame(HOME)
    for k in range(0, 2001):
        t_us = k * 20_000
        n = min(max(0.0, (t_us * 1e-6 - 5.0) * 4.0), 100.0)
        height = min(10.0, 10.0 * t_us * 1e-6 / 4.0)
        share = height / 10.0
        pos = np.array((n, 0.0, -height)) + share * np.array(offset_ned)
        if truth:
            lat, lon, alt = frame.geodetic_from_ned(*(pos - np.array(gps_ned)))
            frames.append(
                simulator.encode(
                    dialect.MAVLink_hil_state_quaternion_message(
                        t_us, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, round(lat * 1e7), round(lon * 1e7),
                        round(alt * 1e3), 0, 0, 0, 0, 0, 0, 0, 0,
                    )
                )
            )  # fmt: skip
        if k % 5 == 0:
            lat, lon, alt = frame.geodetic_from_ned(*pos)
            t_ms = t_us // 1000
            message = dialect.MAVLink_global_position_int_message
            frames.append(
                autopilot.encode(
                    message(t_ms, round(lat * 1e7), round(lon * 1e7), round(alt * 1e3), round(-pos[2] * 1e3),
                            0, 0, 0, 0xFFFF)
                )
            )  # fmt: skip
            frames.append(
                autopilot.encode(dialect.MAVLink_attitude_message(t_ms, roll_error, 0.0, 0.0, 0, 0, 0))
            )
    notes = FlightNotes(system_id=1, autopilot="px4")
    notes.begin("takeoff", 0)
    notes.begin(PATTERN, 5_000_000)
    notes.end(30_000_000)
    notes.commanded = CommandedPath(
        origin=HOME, points_ned_m=straight_path(), waypoints_ned_m=np.zeros((0, 3)), acceptance_m=2.0
    )
    return FlightRecords.of_frames([*before, *frames, *more]), notes


def test_a_perfect_flight_scores_zero():
    result = score(*make_flight())
    assert result.path_rms_error_m < 0.01  # type: ignore[operator]  # degE7 is a centimetre
    assert result.distance_m == pytest.approx(110.0, abs=0.5)
    assert result.max_attitude_error_deg == pytest.approx(0.0, abs=1e-6)
    assert result.reference == "truth"


def test_a_flight_without_a_position_in_its_phases_has_a_picture(tmp_path):
    """A vehicle's clock that began again at 0 leaves no positions in the time of the flight."""
    records, notes = make_flight(truth=False)
    notes.phases = [replace(phase, start_us=phase.start_us + 10**9, end_us=phase.end_us + 10**9)
                    for phase in notes.phases]  # fmt: skip
    draw_run(tmp_path / "track.png", "no position", [(notes, score(records, notes))])
    assert (tmp_path / "track.png").stat().st_size > 1000


def test_a_known_error_is_found():
    result = score(*make_flight(offset_ned=(0.0, 0.3, -0.4), roll_error=math.radians(2.0)))
    assert result.path_rms_error_m == pytest.approx(0.5, abs=0.01)
    assert result.path_max_error_m == pytest.approx(0.5, abs=0.02)
    assert result.path_rms_error_estimate_m == pytest.approx(0.5, abs=0.01)
    assert result.max_attitude_error_deg == pytest.approx(2.0, abs=1e-3)


def test_a_constant_receiver_error_moves_home_and_path_alike():
    result = score(*make_flight(gps_ned=(1.0, -2.0, 3.0)))
    assert result.path_rms_error_m < 0.01  # type: ignore[operator]
    assert result.path_rms_error_absolute_m == pytest.approx(2.0, abs=0.1)


def test_without_truth_the_estimate_is_scored():
    result = score(*make_flight(offset_ned=(0.0, 0.3, 0.0), truth=False))
    assert result.reference == "estimate"
    assert result.path_rms_error_m == pytest.approx(0.3, abs=0.01)
    assert result.max_attitude_error_deg is None


def test_a_truth_without_its_time_is_not_used():
    """PX4's own simulator sends it so; on a link that carries it the flight counted as one of no distance."""
    untimed = [
        FrameEncoder(1, 1).encode(
            dialect.MAVLink_hil_state_quaternion_message(
                0, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, 473_977_400, 85_455_900, 489_400,
                0, 0, 0, 0, 0, 0, 0, 0,
            )
        )
    ] * 50  # fmt: skip
    result = score(*make_flight(truth=False, more=untimed))
    assert result.reference == "estimate"
    assert result.distance_m == pytest.approx(110.0, abs=0.5)


def test_a_position_at_0_0_is_no_place():
    """ArduPilot reports it until it has a position; the picture of a flight had it thousands of km away."""
    early = FrameEncoder(1, 1).encode(
        dialect.MAVLink_global_position_int_message(0, 0, 0, 0, 0, 0, 0, 0, 0xFFFF)
    )
    result = score(*make_flight(truth=False, before=[early]))
    assert np.abs(result.estimate.pos_ned_m).max() < 200.0


def test_nothing_recorded_scores_nothing():
    result = score(FlightRecords.of_frames(()), FlightNotes(system_id=1))
    assert result.path_rms_error_m is None
    assert result.distance_m == 0.0


def test_records_count_and_decode_columns():
    records, _ = make_flight()
    counts = records.message_counts
    assert counts == {"ATTITUDE": 401, "GLOBAL_POSITION_INT": 401, "HIL_STATE_QUATERNION": 2001}
    table = records.table("HIL_STATE_QUATERNION", 1)
    assert table["time_usec"][-1] == 40_000_000
    assert table["attitude_quaternion"].shape == (2001, 4)
    assert len(records.table("HIL_STATE_QUATERNION", 2)) == 0
    assert len(records.table("ATTITUDE", 1, 240)) == 0


def test_messages_without_a_number_are_left_out_and_counted(tmp_path):
    frames = []
    autopilot, simulator = FrameEncoder(1, 1), FrameEncoder(1, 240)
    for k, bad in enumerate((math.nan, math.inf, -math.inf)):
        attitude = dialect.MAVLink_attitude_message(40_100 + k, bad, 0.0, 0.0, 0, 0, 0)
        frames.append(autopilot.encode(attitude))
    for k, q in enumerate(([math.nan, 0.0, 0.0, 0.0], [0.0] * 4)):
        target = dialect.MAVLink_attitude_target_message(20_000 + k, 0, q, 0.0, 0.0, 0.0, 0.5)
        frames.append(autopilot.encode(target))
        truth = dialect.MAVLink_hil_state_quaternion_message
        frames.append(
            simulator.encode(truth(40_000_001 + k, q, 0.0, 0.0, 0.0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0))
        )
    error_rad = math.radians(2.0)
    records, notes = make_flight(offset_ned=(0.0, 0.3, -0.4), roll_error=error_rad, more=frames)
    result = score(records, notes)
    assert result.left_out == {"attitude_not_finite": 5, "position_jumped": 2}  # states at 0, 0
    assert result.max_attitude_error_deg == pytest.approx(2.0, abs=1e-3)
    assert result.path_rms_error_m == pytest.approx(0.5, abs=0.01)
    block = vehicle_summary(notes, result)
    assert block["left_out"] == result.left_out
    write_summary(tmp_path, {"vehicles": [block]})


def test_a_summary_is_written_whole_or_not_at_all(tmp_path):
    path = write_summary(tmp_path, {"a": math.nan, "b": [math.inf, 1.5], "c": {"d": (2, -math.inf)}})
    assert json.loads(path.read_text()) == {"a": None, "b": [None, 1.5], "c": {"d": [2, None]}}
    other = tmp_path / "other"
    other.mkdir()
    with pytest.raises(TypeError):
        write_summary(other, {"a": 1, "b": object()})
    assert not list(other.iterdir())


def test_result_that_is_no_number_is_none():
    result = replace(score(*make_flight()), distance_m=math.nan, path_rms_error_m=math.inf)
    block = vehicle_summary(FlightNotes(system_id=1), result)
    assert block["distance_m"] is None
    assert block["path_rms_error_m"] is None
    assert team_figures([block, block | {"distance_m": 3.0}])["distance_m"] == 3.0


def test_a_checkout_knows_its_version():
    assert versions()["flightstack"][0].isdigit()
