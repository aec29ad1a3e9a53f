"""What may be requested of a log, and what it answers when the question or the file is wrong."""

import json
import math
from itertools import pairwise

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as dialect

from estimators.logs import LogError, open_log, report_of
from estimators.logs.condition import Condition
from missions.cli.bodies.log_text import report_lines
from tests.estimators.logs.reference import EPOCH_US, build, pack, record, tlog
from tests.recorded_logs import each_recorded_log

ARMED, CUSTOM = dialect.MAV_MODE_FLAG_SAFETY_ARMED, dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED


def attitude(ms, roll=0.0):
    return dialect.MAVLink_attitude_message(ms, roll, 0, 0, 0, 0, 0)


def heartbeat(mode=0, armed=False, kind=dialect.MAV_TYPE_QUADROTOR):
    base = CUSTOM | (ARMED if armed else 0)
    return dialect.MAVLink_heartbeat_message(kind, dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, base, mode, 4, 3)


def battery(number, ms=0):
    return dialect.MAVLink_battery_status_message(number, 0, 0, 0, [0] * 10, 100 * number, 0, 0, 50)


def two_boots():
    """Vehicle 1 flies, boots anew and flies again; vehicle 2 is there as well, and a ground station."""
    frames, sequence = [], 0

    def add(message, system=1, component=1):
        nonlocal sequence
        frames.append(pack(message, system=system, component=component, sequence=sequence & 0xFF))
        sequence += 1

    for boot, seconds in enumerate((20, 10)):
        for tick in range(seconds * 10):
            ms = 1000 + tick * 100
            if not (boot == 0 and 50 <= tick < 100):  # five seconds of silence
                add(attitude(ms, roll=0.01 * tick))
            add(attitude(ms + 7), system=2)
            if tick % 10 == 0:
                add(battery(tick // 10 % 2), component=1)
                add(heartbeat(mode=4 if tick >= 30 else 0, armed=20 <= tick < 80))
                add(
                    dialect.MAVLink_heartbeat_message(dialect.MAV_TYPE_GCS, 8, 0, 0, 4, 3),
                    system=255,
                    component=190,
                )
    return frames


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "two.tlog"
    path.write_bytes(tlog(two_boots(), step_us=40_000))
    return open_log(path)


def test_what_there_is(log):
    assert log.systems == (1, 2, 255)
    assert [(key.system_id, key.component_id, key.name) for key in log.keys] == [
        (1, 1, "ATTITUDE"),
        (1, 1, "BATTERY_STATUS"),
        (1, 1, "HEARTBEAT"),
        (2, 1, "ATTITUDE"),
        (255, 190, "HEARTBEAT"),
    ]
    assert sum(key.count for key in log.keys) == len(log)
    assert (log.format, log.size_bytes) == ("tlog", log.path.stat().st_size)
    assert log.start_unix_us == EPOCH_US
    assert log.duration_s == pytest.approx((len(log) - 1) * 0.04)


def test_columns_of_one_component(log):
    table = log.table("attitude", system_id=2)
    assert (table.name, table.system_id, table.component_id, len(table)) == ("ATTITUDE", 2, 1, 300)
    assert table.time_us.dtype == table.order.dtype == table.log_time_us.dtype == np.int64
    assert np.array_equal(table.time_us, table["time_boot_ms"].astype(np.int64) * 1000)
    assert np.array_equal(table.log_time_us, EPOCH_US + 40_000 * table.order)
    assert table["roll"].dtype == np.float32
    assert table.si("roll").dtype == np.float64
    assert table.fields[:2] == ("time_boot_ms", "roll")
    assert (table.units["roll"], table.units["time_boot_ms"]) == ("rad", "ms")
    assert table.si("time_boot_ms")[0] == pytest.approx(1.007)
    assert table.si_unit("time_boot_ms") == "s"
    assert table is log.table("ATTITUDE", system_id=2)


def test_boots(log):
    assert [(boot.system_id, boot.number) for boot in log.boots] == [(1, 0), (1, 1), (2, 0), (2, 1), (255, 0)]
    first, second = log.boots[:2]
    assert (first.start_us, first.end_us) == (1_000_000, 20_900_000)
    assert (second.start_us, second.end_us) == (1_000_000, 10_900_000)
    tables = [log.table("ATTITUDE", system_id=1, boot=boot) for boot in (0, 1)]
    assert [len(table) for table in tables] == [150, 100]
    assert all(np.all(np.diff(table.time_us) > 0) for table in tables)
    assert not log.has("ATTITUDE", system_id=1, boot=2)
    assert len(list(log.messages("ATTITUDE", system_id=1, boot=1))) == 100
    assert not list(log.messages("ATTITUDE", boot=7))


def test_instances(log):
    table = log.table("BATTERY_STATUS", instance=1)
    assert (len(table), table.instance) == (15, 1)
    assert set(table["current_battery"].tolist()) == {100}
    assert len(log.table("BATTERY_STATUS")) == 30


def test_rates_and_presence(log):
    assert log.rate_hz("ATTITUDE", system_id=1) == pytest.approx(10.0, rel=0.4)
    assert log.rate_hz("ATTITUDE", system_id=2, boot=0) == pytest.approx(10.0)
    assert log.rate_hz("VFR_HUD") == 0.0
    assert log.has("HEARTBEAT")
    assert log.has("HEARTBEAT", system_id=(2, 255))
    assert not log.has("HEARTBEAT", system_id=2)
    assert not log.has("VFR_HUD")


def test_messages_in_the_order_of_the_file(log):
    found = list(log.messages())
    assert len(found) == len(log)
    for position, name in ((0, "ATTITUDE"), (1, "ATTITUDE"), (2, "BATTERY_STATUS"), (3, "HEARTBEAT")):
        assert found[position][1].name == name
    only = list(log.messages(["HEARTBEAT", "BATTERY_STATUS"], system_id=1))
    wanted = ("HEARTBEAT", "BATTERY_STATUS")
    assert only == [(t, m) for t, m in found if m.name in wanted and m.src_system == 1]
    assert list(log.messages("VFR_HUD")) == []
    assert [m.src_system for _, m in log.messages(component_id={190})] == [255] * 30


def test_messages_that_fulfil_a_condition(log):
    by_function = list(log.messages("ATTITUDE", system_id=1, condition=lambda table: table["roll"] > 0.5))
    assert by_function
    assert all(message.roll > 0.5 for _, message in by_function)
    by_text = list(log.messages("ATTITUDE", system_id=1, condition=Condition("ATTITUDE.roll > 0.5")))
    assert by_text == by_function
    armed = list(log.messages(condition=Condition("HEARTBEAT.base_mode & 128 == 128"), system_id=1))
    assert 0 < len(armed) < len(log)


def test_report(log):
    report = report_of(log)
    json.dumps(report.to_dict())
    assert sum(report.bytes_by_kind.values()) == report.size_bytes
    (vehicle,) = report.vehicles
    assert (vehicle.system_id, vehicle.autopilot, vehicle.type, vehicle.boots) == (
        1,
        "ARDUPILOTMEGA",
        "QUADROTOR",
        2,
    )
    assert [(span.mode, span.boot) for span in vehicle.modes] == [
        ("STABILIZE", 0),
        ("GUIDED", 0),
        ("STABILIZE", 1),
        ("GUIDED", 1),
    ]
    assert vehicle.modes[0].end_us == vehicle.modes[1].start_us == 4_000_000
    assert [(flight.boot, flight.start_us) for flight in vehicle.flights] == [(0, 3_000_000), (1, 3_000_000)]
    # HEARTBEAT has no time of its own: in the silence of the first flight it has that of the ATTITUDE before.
    assert [flight.end_us for flight in vehicle.flights] == [5_900_000, 9_000_000]
    (gap,) = report.gaps
    assert (gap.system_id, gap.boot, gap.start_us, gap.end_us) == (1, 0, 5_900_000, 11_000_000)
    by_name = {(item.system_id, item.name): item for item in report.streams}
    assert by_name[1, "BATTERY_STATUS"].instances == (0, 1)
    assert by_name[1, "ATTITUDE"].longest_gap_s == pytest.approx(5.1)
    assert by_name[2, "ATTITUDE"].rate_hz == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("question", "words"),
    [
        ({"name": "ATTITUDE"}, r"ATTITUDE comes from 1/1, 2/1 .*give system_id and component_id"),
        ({"name": "ATTITUDE", "system_id": 9}, r"no ATTITUDE from 9/\*; it comes from 1/1, 2/1"),
        ({"name": "VFR_HUD"}, "has no VFR_HUD; it has ATTITUDE, BATTERY_STATUS, HEARTBEAT"),
        ({"name": "ALTITUD"}, "no message 'ALTITUD' in dialect 'all'"),
        ({"name": "BATTERY_STATUS", "instance": 7}, "no BATTERY_STATUS with id 7; there is 0, 1"),
        ({"name": "ATTITUDE", "system_id": 1, "instance": 0}, "ATTITUDE has no instances"),
    ],
)
def test_questions_without_an_answer(log, question, words):
    with pytest.raises(LogError, match=words):
        log.table(**question)


def test_fields_that_are_not_there(log):
    with pytest.raises(LogError, match="ATTITUDE has no field 'rol'; it has time_boot_ms, roll"):
        log.table("ATTITUDE", system_id=1)["rol"]
    with pytest.raises(LogError, match="no message 'NOSUCH'"):
        log.messages("NOSUCH")


def test_texts(tmp_path):
    path = tmp_path / "a.tlog"
    text = dialect.MAVLink_statustext_message(6, b"Takeoff")
    broken = build(253, b"\x06caf\xe9\0rest")
    named = dialect.MAVLink_named_value_float_message(1000, b"wind", 3.5)
    other = dialect.MAVLink_named_value_float_message(1000, b"gust", 9.5)
    path.write_bytes(tlog([pack(text), broken, pack(named), pack(other)]))
    log = open_log(path)
    assert log.table("STATUSTEXT")["text"].tolist()[0] == b"Takeoff"
    assert [message.text for _, message in log.messages("STATUSTEXT")] == ["Takeoff", "caf\ufffd"]  # type: ignore[attr-defined]
    assert log.table("NAMED_VALUE_FLOAT", instance="gust")["value"].tolist() == [9.5]
    with pytest.raises(LogError, match="is a text"):
        log.table("STATUSTEXT").si("text")


def test_capture_without_time_stamps_lasts_as_long_as_its_vehicle(tmp_path):
    path = tmp_path / "a.raw"
    path.write_bytes(b"".join(pack(attitude(1000 + 20 * index)) for index in range(101)))
    log = open_log(path)
    assert (log.format, log.start_unix_us, log.duration_s) == ("raw MAVLink", None, pytest.approx(2.0))
    assert log.rate_hz("ATTITUDE") == pytest.approx(50.0)


def test_rate_of_systems_without_a_clock_is_that_of_the_records(tmp_path):
    path = tmp_path / "a.tlog"
    beat = pack(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), system=255, component=190)
    path.write_bytes(tlog([beat] * 11, step_us=500_000))
    assert open_log(path).rate_hz("HEARTBEAT") == pytest.approx(2.0)


def test_rates_of_bursts_and_of_stamps_that_are_all_0(tmp_path):
    """A burst is counted over a second; messages without a clock by the time of their records."""
    path = tmp_path / "a.tlog"
    value = dialect.MAVLink_param_value_message(b"A", 1.0, 9, 900, 0)
    attitude = [
        (pack(dialect.MAVLink_attitude_message(ms, 0, 0, 0, 0, 0, 0)), ms) for ms in range(1000, 9000, 100)
    ]
    frames = [record(frame, EPOCH_US + ms * 1000) for frame, ms in attitude]
    frames[40:40] = [record(pack(value), EPOCH_US + 5_000_000 + 30 * k) for k in range(900)]
    path.write_bytes(b"".join(frames))
    assert open_log(path).rate_hz("PARAM_VALUE") == pytest.approx(899.0)
    zero = pack(dialect.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0))
    path.write_bytes(tlog([zero] * 101, step_us=20_000))
    assert open_log(path).rate_hz("ATTITUDE") == pytest.approx(50.0)


def test_the_rate_of_two_imus_is_that_of_one(tmp_path):
    path = tmp_path / "a.tlog"
    frames = [
        pack(dialect.MAVLink_highres_imu_message(1_000_000 + 40_000 * (k // 2), *[0.0] * 13, 63, k % 2))
        for k in range(200)
    ]
    path.write_bytes(tlog(frames, step_us=20_000))
    log = open_log(path)
    assert log.rate_hz("HIGHRES_IMU") == pytest.approx(25.0, rel=0.01)
    assert report_of(log).streams[0].rate_hz == pytest.approx(25.0, rel=0.01)


def test_times_are_reported_on_the_first_vehicles_clock_and_boot(tmp_path):
    """Vehicle 2 booted 100 s before vehicle 1, which boots anew."""
    path, frames = tmp_path / "a.tlog", []
    for boot in range(2):
        for second in range(1, 11):
            other = dialect.MAVLink_attitude_message((100 + 10 * boot + second) * 1000, 0, 0, 0, 0, 0, 0)
            own = dialect.MAVLink_attitude_message(second * 1000, 0, 0, 0, 0, 0, 0)
            mode = 4 if second > 5 else 0
            beats = [
                pack(dialect.MAVLink_heartbeat_message(2, 3, 129 + 80, mode, 4, 3), system=n) for n in (1, 2)
            ]
            frames += [pack(own), pack(other, system=2), *beats]
    path.write_bytes(tlog(frames, step_us=250_000))
    log = open_log(path)
    report = report_of(log)
    assert report.clock == "seconds since boot of vehicle 1"
    for vehicle in report.vehicles:
        assert [(span.mode, span.boot, span.start_us) for span in vehicle.modes] == [
            ("STABILIZE", 0, 1_000_000),
            ("GUIDED", 0, 6_000_000),
            ("STABILIZE", 1, 1_000_000),
            ("GUIDED", 1, 6_000_000),
        ]
    lines = "\n".join(report_lines(report))
    assert "armed boot 1, 1.00 to 10.00 s" in lines and "--from and --to count the same" in lines
    order = np.arange(len(log))
    assert log.inside(order, from_s=6.0, to_s=8.0, boot=1).sum() == 8  # both vehicles, two seconds
    assert log.boots_at(6.0, 8.0) == [0, 1]
    with pytest.raises(LogError, match="`boot` 2 is not in"):
        log.inside(order, boot=2)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "can't be read: No such file or directory"),
        (b"", "is empty"),
        (b"hello", "no valid MAVLink frame of dialect 'all' in 5 bytes"),
        (bytes(100_000), "no valid MAVLink frame"),
        (record(build(30, bytes(28), crc_extra=0)), "or the dialect that it was recorded with"),
    ],
)
def test_files_that_are_no_logs(tmp_path, content, words):
    path = tmp_path / "a.tlog"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(LogError, match=words):
        open_log(path)


def test_a_directory_is_no_log(tmp_path):
    with pytest.raises(LogError, match="is a directory"):
        open_log(tmp_path)


@pytest.mark.parametrize("magic", ["554c6f67011235", "a39580"])
def test_dialect_of_a_log_that_has_none(tmp_path, magic):
    path = tmp_path / "a.tlog"
    path.write_bytes(bytes.fromhex(magic) + bytes(100))
    with pytest.raises(LogError, match="common"):
        open_log(path, dialect="common")


@each_recorded_log
def test_recorded_logs_have_one_boot_and_one_flight(path):
    report = report_of(open_log(path))
    (vehicle,) = report.vehicles
    assert vehicle.boots == 1
    assert vehicle.autopilot == ("PX4" if path.stem.startswith("px4") else "ARDUPILOTMEGA")
    assert vehicle.type == ("FIXED_WING" if "plane" in path.stem else "QUADROTOR")
    (flight,) = vehicle.flights
    assert 100e6 < flight.end_us - flight.start_us < 360e6
    assert not any(span.mode.startswith("MODE") for span in vehicle.modes)
    assert all(one.mode != next_one.mode for one, next_one in pairwise(vehicle.modes))  # one boot
    assert report.gaps == ()
    rate = next(item.rate_hz for item in report.streams if item.name == "ATTITUDE")
    assert rate == pytest.approx(100.0 if vehicle.autopilot == "PX4" else 50.0, rel=0.02)
    assert math.isclose(report.duration_s, (flight.end_us - flight.start_us) * 1e-6, rel_tol=0.5)
