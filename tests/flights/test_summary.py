"""What `summary.json` says of a flight, computed again from its `flight.tlog` with pymavlink."""

import json
import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink import mavutil

from flightsim.environment import Environment
from flightsim.world_spec import WorldSpec
from missions.base.options import FlightOptions, Via
from missions.library import find_mission
from missions.runs.session import RunRequest, fly
from tests.rotations import rotation_matrix
from tests.slow import slow
from tests.system.logs import known_name

RADIUS_M = 20.0
HEIGHT_M = 8.0


class Recorded:
    """A run folder, read with nothing of ours."""

    def __init__(self, folder: Path) -> None:
        self.summary: dict[str, Any] = json.loads((folder / "summary.json").read_text())
        self.counts: Counter[str] = Counter()
        self.messages: dict[str, list[Any]] = {}
        log = mavutil.mavlink_connection(str(folder / "flight.tlog"), dialect="all")
        while (message := log.recv_msg()) is not None:
            name = known_name(message.get_type())
            self.counts[name] += 1
            self.messages.setdefault(name, []).append(message)

    def phase(self, name: str) -> tuple[float, float]:
        return next(
            (p["start_s"], p["end_s"]) for p in self.summary["vehicles"][0]["phases"] if p["name"] == name
        )

    def truth(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(time s, metres north, east, up of where it stood before takeoff, q_ned_from_frd)."""
        rows = self.messages["HIL_STATE_QUATERNION"]
        time_s = np.array([m.time_usec * 1e-6 for m in rows])
        first = rows[int(np.searchsorted(time_s, self.summary["vehicles"][0]["phases"][0]["start_s"]))]
        lat = np.radians(first.lat * 1e-7)
        # radii of curvature of the WGS84 ellipsoid
        w = 1.0 - 6.69437999014e-3 * math.sin(lat) ** 2
        north_radius = 6378137.0 * (1.0 - 6.69437999014e-3) / w**1.5 + first.alt * 1e-3
        east_radius = (6378137.0 / math.sqrt(w) + first.alt * 1e-3) * math.cos(lat)
        place = [
            (
                math.radians((m.lat - first.lat) * 1e-7) * north_radius,
                math.radians((m.lon - first.lon) * 1e-7) * east_radius,
                (m.alt - first.alt) * 1e-3,
            )
            for m in rows
        ]
        return time_s, np.array(place), np.array([m.attitude_quaternion for m in rows])


@pytest.fixture(scope="module", params=["px4", slow("ardupilot")])
def recorded(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """A circle, flown with setpoints in a breeze."""
    folder = tmp_path_factory.mktemp("summary") / request.param
    options = FlightOptions(
        pattern="L1", width_m=2.0 * RADIUS_M, height_m=2.0 * RADIUS_M, altitude_m=HEIGHT_M, via=Via.SETPOINTS
    )
    result = fly(
        find_mission("lissajous"),
        RunRequest(
            options=options,
            world=WorldSpec.of_team(
                autopilot=request.param, seed=11, air=Environment.from_wind(speed_m_s=3.0, from_deg=0.0)
            ),
            out=folder,
            picture=False,
        ),
    )
    assert result.outcome == "completed", result.reason
    return Recorded(folder)


def test_what_it_says_about_the_run(recorded: Recorded) -> None:
    summary = recorded.summary
    assert summary["mission"] == "lissajous" and summary["vehicle"] == "iris"
    heartbeat = next(m for m in recorded.messages["HEARTBEAT"] if m.get_srcComponent() == 1)
    assert summary["autopilot"] == {12: "px4", 3: "ardupilot"}[heartbeat.autopilot]
    assert summary["seed"] == 11 and summary["outcome"] == "completed"
    for package in ("python", "flightstack", "jsbsim", "numpy", "numba", "pymavlink"):
        assert summary["versions"][package]


def test_times(recorded: Recorded) -> None:
    summary = recorded.summary
    last_s = recorded.messages["HIL_STATE_QUATERNION"][-1].time_usec * 1e-6
    assert summary["sim_time_s"] == pytest.approx(last_s, abs=0.05)
    assert summary["speedup"] == pytest.approx(summary["sim_time_s"] / summary["wall_time_s"], rel=1e-2)


def test_message_counts(recorded: Recorded) -> None:
    assert recorded.summary["message_counts"] == dict(recorded.counts)


def test_distance(recorded: Recorded) -> None:
    time_s, place, _ = recorded.truth()
    phases = recorded.summary["vehicles"][0]["phases"]
    flown = place[(time_s >= phases[0]["start_s"]) & (time_s <= phases[-1]["end_s"])][::5]
    length_m = np.linalg.norm(np.diff(flown, axis=0), axis=1).sum()
    assert recorded.summary["distance_m"] == pytest.approx(length_m, rel=2e-3)


def test_path_errors(recorded: Recorded) -> None:
    """The commanded curve is a circle: the distance to it has a closed form."""
    time_s, place, _ = recorded.truth()
    start_s, end_s = recorded.phase("pattern")
    north, east, up = place[(time_s >= start_s) & (time_s <= end_s)].T
    error = np.hypot(np.hypot(north, east) - RADIUS_M, up - HEIGHT_M)
    assert recorded.summary["path_rms_error_m"] == pytest.approx(np.sqrt((error**2).mean()), abs=0.01)
    assert recorded.summary["path_max_error_m"] == pytest.approx(error.max(), abs=0.02)
    assert recorded.summary["path_max_error_m"] < 1.0


def test_attitude_error(recorded: Recorded) -> None:
    """The largest angle between the attitude the autopilot reports and the true one, in flight."""
    time_s, place, q = recorded.truth()
    worst_deg = 0.0
    for m in recorded.messages["ATTITUDE"]:
        k = int(np.searchsorted(time_s, m.time_boot_ms * 1e-3))
        if not 0 < k < len(time_s) or place[k, 2] < 1.0:
            continue
        share = (m.time_boot_ms * 1e-3 - time_s[k - 1]) / (time_s[k] - time_s[k - 1])
        after = q[k] if q[k] @ q[k - 1] > 0.0 else -q[k]
        true = (1.0 - share) * q[k - 1] + share * after
        r_true = rotation_matrix(true / np.linalg.norm(true))
        (cr, cp, cy), (sr, sp, sy) = (
            [function(a) for a in (m.roll, m.pitch, m.yaw)] for function in (math.cos, math.sin)
        )
        r_reported = np.array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ]
        )
        cosine = 0.5 * (np.trace(r_reported.T @ r_true) - 1.0)
        worst_deg = max(worst_deg, math.degrees(math.acos(min(1.0, cosine))))
    assert recorded.summary["max_attitude_error_deg"] == pytest.approx(worst_deg, rel=0.1)
    assert worst_deg < 4.0
