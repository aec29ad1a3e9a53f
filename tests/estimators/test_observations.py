"""Sets of targets, and observations beside messages: recorded, replayed, written, compared."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from autopilot_bridge.mavlink import FrameEncoder, Packet, dialect
from autopilot_bridge.tlog import TlogWriter
from estimators.comparison import comparisons
from estimators.errors import EstimatorFailure
from estimators.fleet import Fleet
from estimators.interface import Outcome
from estimators.library import estimator_class
from estimators.log_replay import replay
from estimators.logs import open_log
from estimators.observations import Image, ObservationWriter, observations_beside, read_observations
from estimators.runner import Runner
from missions.estimation.over_logs import ReplayRequest, replay_logs
from missions.estimation.report import write_estimates
from missions.estimation.tap import EstimatorTap

FINDER = str(Path(__file__).parent / "finder.py")
LAT, LON = 47.0, 8.0
PER_LAT = 111_176.0  # metres a degree of latitude, at 47 degrees


def image(time_us, *bright, system=1):
    pixels = np.zeros((40, 60), dtype=np.uint8)
    for row, column in bright:
        pixels[row, column] = 200
    return Image(
        time_us=time_us,
        src_system=system,
        pixels=pixels,
        focal_px=(50.0, 50.0),
        centre_px=(30.0, 20.0),
        q_ned_from_camera=(1.0, 0.0, 0.0, 0.0),
        pos_ned_m=(0.0, 0.0, -math.inf),
    )


class Log:
    """Records as a flight does: frames to a log, observations beside it."""

    def __init__(self, path):
        self._log = TlogWriter(path)
        self._encoders = {}
        self._us = 0

    def record(self, packet, time_us):
        self._us += 1000
        for frame in packet:
            self._log.write(1_700_000_000_000_000 + self._us, frame.raw)

    def frame(self, message, system=1, component=1):
        encoder = self._encoders.setdefault((system, component), FrameEncoder(system, component))
        return Packet.of_one(encoder.encode(message))

    def close(self):
        self._log.close()


@pytest.fixture
def make():
    found = estimator_class(FINDER)
    return lambda: found()


@pytest.fixture
def flight(tmp_path, make):
    """A flight with images between its messages, some older than the messages before them: (tap, log)."""
    path = tmp_path / "flight.tlog"
    log = Log(path)
    tap = EstimatorTap(log, Fleet(make), log=path)

    def hil(row, column, component, time_us):
        lat, lon = LAT + row / PER_LAT, LON + column / (PER_LAT * math.cos(math.radians(LAT)))
        tap.record(
            log.frame(
                dialect.MAVLink_hil_state_quaternion_message(
                    *(time_us, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, round(lat * 1e7), round(lon * 1e7)),
                    *(0, 0, 0, 0, 0, 0, 0, 0, 0),
                ),
                251,
                component,
            ),
            time_us,
        )

    home = (round(LAT * 1e7), round(LON * 1e7), 0, 0.0, 0.0, 0.0, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0)
    tap.record(log.frame(dialect.MAVLink_home_position_message(*home)), 0)
    seen = [(), ((10, 5),), ((10, 5), (30, 40)), ((10, 5), (30, 40), (35, 3))]
    for k in range(20):
        time_us = 1_000_000 + 50_000 * k
        hil(10, 5, 1, time_us)
        hil(30, 40, 2, time_us)
        attitude = dialect.MAVLink_attitude_message(time_us // 1000, 0.1 * k, 0.0, 0.0, 0.0, 0.0, 0.0)
        tap.record(log.frame(attitude), time_us)
        if k % 2:
            tap.observe(image(time_us - 30_000, *seen[k // 2 % 4]), time_us)
        if k == 8:
            tap.observe(image(time_us, system=7), time_us)  # of a vehicle without a runner
    tap.close()
    log.close()
    assert tap.failure == ""
    return tap, path


def columns(fleet):
    (table,) = fleet.runners[1].tables.values()
    return table.time_us.tolist(), table.target_index.tolist(), table.values.tobytes()


def test_a_replay_gives_the_estimates_of_the_flight_bit_for_bit(flight, make):
    tap, path = flight
    done = replay(open_log(path), make)
    assert columns(done.fleet) == columns(tap.fleet)
    assert done.fleet.runners[1].outcomes == {Outcome.USED: 20, Outcome.UPDATED: 10}
    part = replay(open_log(path), make, from_s=1.5)
    assert 0 < len(part.fleet.runners[1].tables["Found"]) < len(done.fleet.runners[1].tables["Found"])


def test_sets_are_rows_with_a_target_index(flight, tmp_path):
    tap, _ = flight
    table = tap.fleet.runners[1].tables["Found"]
    assert table.of_sets
    assert table.target_index.tolist() == [-1, 0, 0, 1, 0, 1, 2] * 2 + [-1, 0]
    assert np.isnan(table.values[0]).all()
    assert table["level"][1:7].tolist() == [200.0] * 6
    written = write_estimates(tmp_path, tap.fleet)
    arrays = np.load(written[0])
    assert arrays["target_index"].tolist() == table.target_index.tolist()
    assert len(arrays["time_us"]) == len(table) == 16
    rows = list(csv.DictReader(written[1].open()))
    assert [row["target_index"] for row in rows[:3]] == ["-1", "0", "0"]
    assert rows[0]["north_m"] == "nan"


def test_sets_are_compared_with_the_true_targets(flight):
    """OSPA of order 1, cut at 20 m: each target without estimate or estimate without target costs 20 m."""
    tap, path = flight
    (found,) = comparisons([open_log(path)], tap.fleet.runners[1], "truth")
    assert found.label == "targets"
    assert found.estimates["targets"].tolist() == [0, 1, 2, 3, 0, 1, 2, 3, 0, 1]
    assert found.references["truth"]["targets"].tolist() == [2.0] * 10
    roll = [0.1, 0.3, 0.5, 0.7]
    expected = [20.0, (20.0 + roll[1]) / 2, roll[2], (20.0 + 2 * roll[3]) / 3]
    assert found.estimates["ospa_m"][:4] == pytest.approx(expected, abs=0.05)
    summary = {key: value for item in found.figures["truth"] for key, value in item.as_summary().items()}
    assert summary["targets_mean"] == pytest.approx(-0.7)
    assert summary["ospa_max_m"] == pytest.approx(20.0)


def test_the_command_replays_a_log_with_its_observations(flight, tmp_path):
    _, path = flight
    out = tmp_path / "run"
    ((_, result),) = replay_logs(ReplayRequest(logs=[path], estimator=FINDER, out=out))
    assert result.outcome == "completed", result.reason
    assert result.summary["reference"] == "truth"
    assert {"ospa_rms_m", "targets_mean"} <= result.summary.keys()
    assert sorted(item.name for item in out.iterdir()) == [
        *("errors.png", "estimates.csv", "estimates.npz", "summary.json")
    ]


def test_an_image_is_read_as_it_was_written(tmp_path):
    path = tmp_path / "flight.observations"
    writer, rng = ObservationWriter(path), np.random.default_rng(1)
    sent = image(5)
    noise = Image(
        **{name: getattr(sent, name) for name in Image.__slots__ if name not in ("pixels", "distortion")},
        pixels=rng.integers(0, 256, (7, 9, 3)).astype(np.uint8),
        distortion=(0.1, -0.2),
    )
    writer.write(sent, 3)
    writer.write(noise, 4)
    writer.close()
    assert observations_beside(tmp_path / "flight.tlog") == path
    (first, one), (second, two) = read_observations(path, (Image,))
    assert (first, second) == (3, 4)
    assert np.array_equal(one.pixels, sent.pixels)  # type: ignore[attr-defined]
    assert np.array_equal(two.pixels, noise.pixels)  # type: ignore[attr-defined]
    assert two.pixels.dtype == np.uint8  # type: ignore[attr-defined]
    others = [name for name in Image.__slots__ if name != "pixels"]
    assert [getattr(two, name) for name in others] == [getattr(noise, name) for name in others]
    assert list(read_observations(path, ())) == []


@pytest.mark.parametrize("damage", ["cut", "changed", "garbage"])
def test_a_damaged_record_ends_the_file(tmp_path, damage):
    path = tmp_path / "flight.observations"
    writer = ObservationWriter(path)
    for k in range(3):
        writer.write(image(k), k)
    writer.close()
    raw = bytearray(path.read_bytes())
    if damage == "cut":
        raw = raw[:-5]
    elif damage == "changed":
        raw[-5] ^= 1
    else:
        raw += b"FSO1" + b"\xff" * 12
    path.write_bytes(raw)
    assert [frames for frames, _ in read_observations(path, (Image,))] == [0, 1, 2][
        : 3 if damage == "garbage" else 2
    ]


def test_no_observation_no_file(tmp_path):
    writer = ObservationWriter(tmp_path / "flight.observations")
    writer.close()
    assert observations_beside(tmp_path / "flight.tlog") is None


def test_an_estimator_that_fails_at_an_image_is_reported(make):
    estimator = make()
    runner = Runner(estimator, system_id=1)
    assert runner.observe(image(1, system=2)) is None
    assert runner.left_out == {"of another vehicle": 1}
    with pytest.raises(EstimatorFailure, match=r"finder failed at Image of 0\.000 s: AttributeError"):
        runner.observe(image(1, (1, 1)))  # no roll was received
    wrong = type(
        "Wrong", (), {"COLUMNS": ("north_m",), "time_us": 1, "subject": 0, "rows": lambda self: [(1, 2)]}
    )
    estimator.observe = lambda time_us, observation: Outcome.UPDATED
    estimator.newest = wrong()
    with pytest.raises(EstimatorFailure, match="gives a row of 2 values, and COLUMNS names 1"):
        runner.observe(image(1))
