"""Parts of logs, and logs with faults: every record that is not meant stays as it is."""

import math
import struct
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot_bridge.mavlink import FrameEncoder, dialect
from autopilot_bridge.tlog import TlogReader
from estimators.logs import LogError, open_log, report_of
from estimators.logs.faults import UNITS, FaultKind, parse_fault
from estimators.logs.mutate import mutated_records
from estimators.logs.raw_records import positions, read_records, window, write_records
from flightsim.sensors.fault_kinds import FaultType, SensorUnit
from tests.estimators.logs.flight_log import RATE_HZ, SECONDS, frames, write
from tests.estimators.logs.reference import EPOCH_US, build, pack, record

COUNT = SECONDS * RATE_HZ


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return open_log(write(tmp_path_factory.mktemp("mutate") / "flight.tlog"))


@pytest.fixture
def mutate(log, tmp_path):
    def work(*faults, seed=0, **selection):
        out = tmp_path / f"out{len(list(tmp_path.iterdir()))}.tlog"
        records = mutated_records(
            log, log.select(**selection), [parse_fault(text) for text in faults], seed=seed
        )
        write_records(out, records)
        return open_log(out)

    return work


def raw(log):
    return list(read_records(log, np.arange(len(log))))


def test_records_are_copied_as_they_are(log, tmp_path):
    write_records(tmp_path / "copy.tlog", read_records(log, positions(log.select())))
    assert (tmp_path / "copy.tlog").read_bytes() == log.path.read_bytes()


def test_a_window_of_some_messages(log, tmp_path):
    chosen = window(log, log.select("ATTITUDE", system_id=1), 7.0, 9.5)  # since boot; the log begins at 5 s
    write_records(tmp_path / "cut.tlog", read_records(log, positions(chosen)))
    cut = open_log(tmp_path / "cut.tlog")
    assert len(cut) == 50 and {key.name for key in cut.keys} == {"ATTITUDE"}
    assert cut.start_unix_us == EPOCH_US + 2_000_000
    assert len([*TlogReader(cut.path)]) == 50


@pytest.mark.parametrize(("low", "high"), [(-1.0, None), (None, math.nan), (3.0, 3.0), (5.0, 1.0)])
def test_windows_that_can_not_be(log, low, high):
    with pytest.raises(LogError, match=r"`(from|to)_s`"):
        window(log, log.select(), low, high)


def test_an_empty_selection_writes_nothing(log, tmp_path):
    with pytest.raises(LogError, match="no message is selected"):
        write_records(tmp_path / "none.tlog", read_records(log, positions([])))
    assert list(tmp_path.iterdir()) == []


def test_off_takes_messages_away(mutate):
    log = mutate("gps:off@7-11")
    times = (log.table("GPS_RAW_INT").log_time_us - EPOCH_US) * 1e-6
    assert not np.any((times >= 2.0) & (times < 6.0)) and len(times) == COUNT // 4 - 20
    assert len(log.table("RAW_IMU")) == COUNT


def test_off_of_one_unit_of_several_leaves_its_last_values(mutate):
    imu = mutate("gyro:off@8-").table("RAW_IMU")
    assert len(imu) == COUNT and set(imu["xgyro"].tolist()) == {10}


@pytest.mark.parametrize(
    ("fault", "message", "field", "expected"),
    [
        ("RAW_IMU.xgyro:wrong=0.5@10-", "RAW_IMU", "xgyro", 510),
        ("accel:wrong=9.80665@10-", "RAW_IMU", "xacc", 1000),
        ("ATTITUDE.roll:wrong=1", "ATTITUDE", "roll", 0.01 * (COUNT - 1) + 1),
        ("ATTITUDE.roll:stuck@10-", "ATTITUDE", "roll", 1.0),
        ("gyro:drift=0.1@10-", "RAW_IMU", "ygyro", round(-20 + 100 * 4.95)),
        ("RAW_IMU.xgyro:wrong=1e9", "RAW_IMU", "xgyro", 32767),
        ("GPS_RAW_INT.lat:wrong=111.19493", "GPS_RAW_INT", "lat", -353600000 + 10_000),
        ("ATTITUDE:wrong=2", "ATTITUDE", "yaw", 2.0),
    ],
)
def test_values_are_changed_in_si_units(mutate, log, fault, message, field, expected):
    table = mutate(fault).table(message, system_id=1)
    assert table[field][-1] == pytest.approx(expected, abs=1.0 if abs(expected) > 1000 else 1e-5)
    if "@10-" in fault and "stuck" not in fault:
        before = table.log_time_us < EPOCH_US + 5_000_000
        assert np.array_equal(table[field][before], log.table(message, system_id=1)[field][before])


def test_noise_spikes_and_garbage(mutate):
    noisy = mutate("ATTITUDE.pitch:noise=0.2").table("ATTITUDE", system_id=2)["pitch"]
    assert noisy.std() == pytest.approx(0.2, rel=0.2) and abs(noisy.mean()) < 0.05
    spikes = mutate("ATTITUDE.pitch:spike=5", seed=3).table("ATTITUDE", system_id=2)["pitch"]
    assert 0 < np.count_nonzero(spikes == 5.0) < 10 and set(spikes.tolist()) == {0.0, 5.0}
    garbage = mutate("gyro:garbage=3").table("RAW_IMU")["xgyro"]
    assert garbage.min() < -2000 and garbage.max() > 2000 and np.abs(garbage).max() <= 3000


def test_losses(mutate):
    assert len(mutate("RAW_IMU:slow=4").table("RAW_IMU")) == COUNT // 4
    assert len(mutate("RAW_IMU:drop=0.3").table("RAW_IMU")) == pytest.approx(0.7 * COUNT, abs=25)
    received = mutate("RAW_IMU:intermittent=0.5").table("RAW_IMU").time_us
    assert 0.2 * COUNT < len(received) < 0.8 * COUNT
    assert max(b - a for a, b in pairwise(received.tolist())) > 200_000
    assert received[0] > 5_000_000  # it is silent first


@pytest.mark.parametrize("fault", ["ATTITUDE:intermittent=0.5", "ATTITUDE:delayed=2", "ATTITUDE:drop=0.5"])
def test_stamps_that_go_back_or_far_away(tmp_path, fault):
    """A damaged stamp is no reason for millions of years of spells, nor for a time that doesn't fit."""
    message = dialect.MAVLink_attitude_message(1000, 0.1, 0, 0, 0, 0, 0)
    times = [EPOCH_US + k * 100_000 for k in range(50)]
    times[10:20], times[25], times[30] = times[10:20][::-1], 2**63 - 1, EPOCH_US // 2
    path = tmp_path / "flight.tlog"
    encoder = FrameEncoder(1, 1)
    path.write_bytes(b"".join(struct.pack(">Q", t) + encoder.encode(message) for t in times))
    log, out = open_log(path), tmp_path / "out.tlog"
    count = write_records(out, mutated_records(log, log.select(), [parse_fault(fault)]))
    assert count == (50 if "delayed" in fault else len(open_log(out))) and 5 < count <= 50


def test_delayed_messages_come_later_with_their_own_stamps(mutate):
    log = mutate("RAW_IMU:delayed=0.12@7-13")
    stamps = [time for time, _ in raw(log)]
    assert stamps == sorted(stamps)
    imu = log.table("RAW_IMU")
    late = imu.log_time_us - EPOCH_US - (imu["time_usec"].astype(np.int64) - 5_000_000)
    assert set(late.tolist()) == {0, 120_000} and np.count_nonzero(late) == 120


def test_delays_add_up(mutate):
    imu = mutate("RAW_IMU:delayed=0.12", "RAW_IMU:delayed=0.3").table("RAW_IMU")
    late = imu.log_time_us - EPOCH_US - (imu["time_usec"].astype(np.int64) - 5_000_000)
    assert set(late.tolist()) == {420_000}


def test_faults_add_up_and_a_seed_makes_one_log(mutate):
    both = mutate("ATTITUDE.roll:wrong=1", "ATTITUDE.roll:wrong=2", "ATTITUDE.pitch:wrong=0.5")
    assert both.table("ATTITUDE", system_id=2)["roll"][0] == pytest.approx(2.5)
    assert both.table("ATTITUDE", system_id=2)["pitch"][0] == pytest.approx(0.5)
    assert raw(mutate("RAW_IMU:drop=0.3", seed=5)) == raw(mutate("RAW_IMU:drop=0.3", seed=5))
    assert raw(mutate("RAW_IMU:drop=0.3", seed=5)) != raw(mutate("RAW_IMU:drop=0.3", seed=6))


def test_old_and_signed_frames_stay_readable(tmp_path):
    from pymavlink.dialects.v20 import all as dialect

    message = dialect.MAVLink_attitude_message(5000, 0.25, 0.5, 0, 0, 0, 0)
    old = pack(message, version=1)
    payload = pack(message)[10:-2]
    signed = build(dialect.MAVLINK_MSG_ID_ATTITUDE, payload, signed=True)
    path = tmp_path / "in.tlog"
    path.write_bytes(record(old) + record(signed))
    log = open_log(path)
    assert len(log) == 2
    write_records(
        tmp_path / "out.tlog", mutated_records(log, log.select(), [parse_fault("ATTITUDE.roll:wrong=1")])
    )
    out = open_log(tmp_path / "out.tlog")
    assert out.table("ATTITUDE")["roll"].tolist() == [1.25, 1.25]
    assert out.table("ATTITUDE")["pitch"].tolist() == [0.5, 0.5]
    remarks = report_of(out).remarks
    assert (remarks["frames_v1"], remarks["frames_signed"]) == (1, 0)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "can't be read"),
        ("gps", "can't be read"),
        ("gps:broken", "no kind 'broken'"),
        ("gps:off=3", "has no value"),
        ("gyro:noise", "needs a value"),
        ("gyro:noise=much", "no number"),
        ("gyro:noise=nan", "no number"),
        ("gyro:noise=-1", "not in 0"),
        ("gyro:drop=2", "not in 0..1"),
        ("gyro:slow=1", "not in 2"),
        ("gyro:delayed=0", "not in"),
        ("gps:off@60-20", "ends before it begins"),
        ("gps:off@1.2.3-4", "no time"),
        ("wings:off", "neither one of gyro"),
    ],
)
def test_faults_that_can_not_be_read(text, says):
    with pytest.raises(LogError, match=says):
        parse_fault(text)


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        ("ATTITUDE.bank:wrong=1", "no field 'bank'"),
        ("STATUSTEXT.text:wrong=1", "is a text"),
        ("HIGHRES_IMU:off", "it needs HIGHRES_IMU"),
        ("gps:off@100-", "it needs GPS_RAW_INT"),
    ],
)
def test_faults_that_do_not_fit_the_log(mutate, fault, says):
    with pytest.raises(LogError, match=says):
        mutate(fault)


@given(st.text(alphabet="gpsRAW_IMU.xyro:=@-0123456789offstuckdrift", max_size=40))
def test_any_text_is_a_fault_or_refused(text):
    try:
        fault = parse_fault(text)
    except LogError:
        return
    assert fault.kind in FaultKind and fault.from_s < fault.to_s


def test_kinds_and_units_are_those_of_the_simulated_sensors():
    ours = {kind.value.upper() for kind in FaultKind}
    assert {kind.name for kind in FaultType} - {"OK"} <= ours
    assert ours - {kind.name for kind in FaultType} == {"NOISE", "SPIKE", "DROP"}
    known = {unit.name.lower() for unit in SensorUnit}
    assert set(UNITS) <= known and known - set(UNITS) == {"optical_flow", "vio", "avoidance"}


def test_the_flight_has_every_message_once():
    assert len(list(frames())) == COUNT * 3 + COUNT // 4 + 3 * SECONDS
