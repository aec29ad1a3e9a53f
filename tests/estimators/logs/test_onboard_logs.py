"""ArduPilot .bin and PX4 .ulg files give the messages that estimators ask for, in MAVLink's units."""

import contextlib
import math
import random
import struct

import numpy as np
import pytest
from pymavlink import DFReader
from pyulog.core import ULog

from estimators.logs import LogError, open_log, report_of
from estimators.logs.condition import Condition
from estimators.logs.dataflash_scan import _lookup
from tests.estimators.logs.onboard_logs import (
    SECONDS,
    DataflashWriter,
    UlogWriter,
    ardupilot_plane,
    px4_plane,
)


@pytest.fixture
def dataflash():
    return ardupilot_plane()


@pytest.fixture
def bin_log(dataflash, tmp_path):
    return open_log(dataflash.save(tmp_path / "00000001.BIN"))


def test_dataflash_columns_are_what_dfreader_gives(bin_log, dataflash, tmp_path):
    assert bin_log.format == "bin"
    reader = DFReader.DFReader_binary(str(tmp_path / "00000001.BIN"))
    seen = 0
    rows = {}
    while (message := reader.recv_msg()) is not None:
        name = message.get_type()
        if name in ("FMT", "FMTU", "UNIT", "MULT"):
            continue
        table = bin_log.table(name)
        row = rows.get(name, 0)
        rows[name] = row + 1
        for field in table.fields:
            value = table[field][row]
            expected = getattr(message, field)
            if isinstance(expected, str):
                assert value.decode() == expected
            else:
                assert value == expected, (name, field)
            seen += 1
    assert seen > 1000
    assert all(len(bin_log.table(name)) == count for name, count in rows.items())


def test_dataflash_gives_the_messages_of_estimators(bin_log):
    imu = bin_log.table("HIGHRES_IMU", instance=1)
    assert len(imu) == 50 * SECONDS
    assert imu["xgyro"][0] == np.float32(0.11) and imu["zacc"][0] == np.float32(-9.7)
    assert bin_log.rate_hz("HIGHRES_IMU") == pytest.approx(50.0, rel=0.02)  # of one of the two
    attitude = bin_log.table("ATTITUDE")
    assert attitude["roll"][-1] == pytest.approx(math.radians(30.0))
    assert attitude["pitch"][-1] == pytest.approx(math.radians(-5.5))
    assert attitude["yaw"][-1] == pytest.approx(math.radians(-10.0), abs=1e-6)
    assert attitude["pitchspeed"][-1] == pytest.approx(math.radians(-20.0))
    assert attitude["time_boot_ms"][0] == 1000
    hud = bin_log.table("VFR_HUD")
    assert (hud["airspeed"][0], hud["throttle"][-1], hud["climb"][-1]) == (21.5, 55, 0.5)
    assert hud["groundspeed"][0] == 15.0 and hud["heading"][-1] == 350
    assert bin_log.table("AIRSPEED")["raw_press"][0] == pytest.approx(2.7)
    assert bin_log.table("AIRSPEED")["temperature"][0] == 2500
    pressure = bin_log.table("SCALED_PRESSURE")
    assert pressure["press_abs"][0] == 945.0 and pressure["temperature"][0] == 3025
    assert bin_log.table("SIMSTATE").si("roll")[0] == pytest.approx(math.radians(30.5))
    position = bin_log.table("GLOBAL_POSITION_INT")
    assert (position["lat"][0], position["relative_alt"][0], position["vy"][-1]) == (
        -353600000,
        100_000,
        2000,
    )
    assert bin_log.table("LOCAL_POSITION_NED")["z"][0] == -100.0
    home = bin_log.table("HOME_POSITION")
    assert len(home) == 1 and math.isnan(home["x"][0])
    assert (home["latitude"][0], home["longitude"][0], home["altitude"][0]) == (
        -353600000,
        1491600000,
        584_200,
    )
    gps = bin_log.table("GPS_RAW_INT")
    assert (gps["fix_type"][0], gps["vel"][0], gps["cog"][0], gps["eph"][0]) == (3, 1500, 9000, 80)


def test_dataflash_vehicle_modes_flights_and_date(bin_log):
    report = report_of(bin_log)
    (vehicle,) = report.vehicles
    assert (vehicle.autopilot, vehicle.type) == ("ARDUPILOTMEGA", "FIXED_WING")
    assert [span.mode for span in vehicle.modes] == ["MANUAL", "AUTO"]
    (flight,) = vehicle.flights
    assert (flight.start_us, flight.end_us) == (2_000_000, 4_000_000)
    week = 2300 * 7 * 86400 + 100_000 - 18 + 315_964_800
    assert report.start_unix_us == round((week - 0.7 + 0.5) * 1e6)
    assert sum(report.bytes_by_kind.values()) == report.size_bytes


def test_messages_and_conditions_work_on_it(bin_log):
    messages = list(bin_log.messages(["HIGHRES_IMU", "VFR_HUD"]))
    assert [time for time, _ in messages] == sorted(time for time, _ in messages)
    assert messages[0][1].name == "HIGHRES_IMU" and messages[0][1].src_component == 1
    kept = list(bin_log.messages("ATTITUDE", condition=Condition("HEARTBEAT.custom_mode == 10")))
    assert 0 < len(kept) < 50 * SECONDS and all(time >= 3_000_000 for time, _ in kept)


def test_damaged_dataflash(dataflash, tmp_path):
    whole = bytes(dataflash.data)
    torn = tmp_path / "torn.bin"
    torn.write_bytes(whole[: len(whole) - 40])
    log = open_log(torn)
    assert len(log.table("HIGHRES_IMU")) > 0
    assert sum(report_of(log).bytes_by_kind.values()) == log.size_bytes
    holed = tmp_path / "holed.bin"
    holed.write_bytes(whole[:3000] + bytes(700) + whole[3100:])
    assert len(open_log(holed).table("ATTITUDE")) > 50


@pytest.mark.parametrize("size", [3, 20, 89, 500])
def test_what_is_no_dataflash_is_refused(dataflash, tmp_path, size):
    path = tmp_path / "short.bin"
    path.write_bytes(bytes(dataflash.data[:size]))
    with pytest.raises(LogError, match=r"short\.bin"):
        open_log(path)


def test_a_dialect_has_no_effect_on_it(dataflash, tmp_path):
    path = dataflash.save(tmp_path / "a.bin")
    with pytest.raises(LogError, match="dialect"):
        open_log(path, dialect="common")


@pytest.fixture
def ulog():
    return px4_plane()


@pytest.fixture
def ulg_log(ulog, tmp_path):
    return open_log(ulog.save(tmp_path / "flight.ulg"))


def test_ulog_topics_are_what_pyulog_gives(ulg_log, tmp_path):
    assert ulg_log.format == "ulg"
    for data in ULog(str(tmp_path / "flight.ulg")).data_list:
        table = ulg_log.table(data.name if not data.multi_id else f"{data.name}_{data.multi_id}")
        assert table.time_us.tolist() == sorted(data.data["timestamp"].tolist())
        for name, column in data.data.items():
            field, _, index = name.partition("[")
            ours = table[field] if not index else table[field][:, int(index[:-1])]
            assert np.array_equal(ours, column), name


def test_ulog_gives_the_messages_of_estimators(ulg_log):
    assert ulg_log.table("HIGHRES_IMU", instance=0)["ygyro"][0] == np.float32(-0.2)
    second = ulg_log.table("HIGHRES_IMU", instance=1)
    assert second["xgyro"][0] == np.float32(0.2) and second["zacc"][0] == np.float32(-9.7)
    attitude = ulg_log.table("ATTITUDE")
    assert attitude["roll"][0] == pytest.approx(math.radians(30.0)) and attitude["yawspeed"][0] == np.float32(
        0.3
    )
    assert ulg_log.table("VFR_HUD")["airspeed"][0] == 21.5
    assert ulg_log.table("VFR_HUD")["groundspeed"][0] == 5.0
    assert ulg_log.table("SCALED_PRESSURE")["press_abs"][0] == 945.0
    assert ulg_log.table("GLOBAL_POSITION_INT")["lat"][0] == 473900000
    assert ulg_log.table("LOCAL_POSITION_NED")["vx"][0] == 3.0
    home = ulg_log.table("HOME_POSITION")
    assert (home["latitude"].tolist(), home["altitude"].tolist()) == ([473900000], [488_000])
    assert (home["x"][0], home["z"][0]) == (1.0, -0.5)
    assert ulg_log.table("GLOBAL_POSITION_INT")["relative_alt"][-1] == 100_000
    gps = ulg_log.table("GPS_RAW_INT")
    assert (gps["lat"][0], gps["vel"][0], gps["fix_type"][0], gps["satellites_visible"][0]) == (
        473900000,
        1500,
        3,
        12,
    )
    assert ulg_log.table("HIL_STATE_QUATERNION")["attitude_quaternion"][0].tolist() == [1.0, 0.0, 0.0, 0.0]
    assert ulg_log.table("STATUSTEXT")["text"][0] == b"Ready for takeoff!"
    assert ulg_log.table("STATUSTEXT")["severity"][0] == 6
    landed = ulg_log.table("EXTENDED_SYS_STATE")
    assert landed["landed_state"][0] == 1 and landed["landed_state"][-1] == 2


def test_ulog_vehicle_modes_flights_and_date(ulg_log):
    (vehicle,) = report_of(ulg_log).vehicles
    assert (vehicle.autopilot, vehicle.type) == ("PX4", "FIXED_WING")
    assert [span.mode for span in vehicle.modes] == ["MANUAL", "TAKEOFF", "MISSION"]
    assert vehicle.flights[0].start_us == 2_000_000
    assert ulg_log.start_unix_us == 1_700_000_000_000_000 - 200_000


def test_single_imus_are_turned_as_the_board_is(ulog, tmp_path):
    """The voted IMU comes corrected from the firmware; the others are turned, by 90 deg and 2 deg of roll."""
    ulog.parameter("SENS_BOARD_ROT", 2)
    ulog.parameter("SENS_BOARD_X_OFF", 2.0)
    log = open_log(ulog.save(tmp_path / "flight.ulg"))
    assert log.table("HIGHRES_IMU", instance=0)["ygyro"][0] == np.float32(-0.2)
    second = log.table("HIGHRES_IMU", instance=1)  # 0.2 about x of the board
    assert (second["xgyro"][0], second["ygyro"][0]) == pytest.approx((0.0, 0.2 * math.cos(math.radians(2.0))))
    assert second["zgyro"][0] == pytest.approx(0.2 * math.sin(math.radians(2.0)))
    assert "SENS_BOARD_*_OFF 2 0 0 deg" in report_of(log).remarks["board"]  # type: ignore[operator]
    assert b"SENS_BOARD_ROT" in log.table("PARAM_VALUE")["param_id"].tolist()


def test_times_of_the_calendar_count_from_the_beginning(tmp_path):
    """A simulated vehicle without lockstep stamps its messages with Unix time."""
    start_us = 1_600_000_000_000_000
    writer = UlogWriter(vehicle_attitude="uint64_t timestamp;float[4] q;")
    writer.data[8:16] = struct.pack("<Q", start_us)
    writer.subscribe("vehicle_attitude")
    for tick in range(100):
        writer.add("vehicle_attitude", "Q4f", start_us - 500 + 10_000 * tick, 1.0, 0.0, 0.0, 0.0)
    log = open_log(writer.save(tmp_path / "flight.ulg"))
    attitude = log.table("ATTITUDE")
    assert (len(attitude), attitude.time_us[0], attitude.time_us[-1]) == (100, 0, 990_000)
    assert log.start_unix_us == start_us - 500


def test_a_board_on_its_side_leaves_single_imus_out(ulog, tmp_path):
    ulog.parameter("SENS_BOARD_ROT", 16)
    log = open_log(ulog.save(tmp_path / "flight.ulg"))
    assert set(log.table("HIGHRES_IMU")["id"].tolist()) == {0}
    assert "left out" in report_of(log).remarks["board"]  # type: ignore[operator]


def test_damaged_ulog(ulog, tmp_path):
    whole = bytes(ulog.data)
    torn = tmp_path / "torn.ulg"
    torn.write_bytes(whole[:-5])
    assert len(open_log(torn).table("ATTITUDE")) > 300
    for size in (7, 16, 60):
        torn.write_bytes(whole[:size])
        with pytest.raises(LogError, match=r"torn\.ulg"):
            open_log(torn)


def test_values_that_do_not_fit_are_clipped():
    from estimators.logs.mapped import mavlink_part

    part = mavlink_part(
        "VFR_HUD", np.array([1, 2, 3]), throttle=np.array([-5.0, 1e9, math.nan]), heading=359.6
    )
    assert part.columns["throttle"].tolist() == [0, 65535, 0]
    assert part.columns["heading"].tolist() == [360] * 3
    with pytest.raises(ValueError, match="no field wings"):
        mavlink_part("VFR_HUD", np.array([1]), wings=2)


@pytest.mark.parametrize(("number", "name"), [(1, "QUADROTOR"), (2, "FIXED_WING"), (0, "GENERIC")])
def test_ulog_without_a_system_type_has_one_of_its_class(tmp_path, number, name):
    writer = UlogWriter(
        vehicle_status="uint64_t timestamp;uint8_t arming_state;uint8_t nav_state;uint8_t vehicle_type;"
    )
    writer.subscribe("vehicle_status")
    for second in range(3):
        writer.add("vehicle_status", "QBBB", (second + 1) * 1_000_000, 1, 3, number)
    (vehicle,) = report_of(open_log(writer.save(tmp_path / "flight.ulg"))).vehicles
    assert vehicle.type == name


def test_what_pyulog_prints_is_not_said(ulog, tmp_path, capfd):
    path = ulog.save(tmp_path / "flight.ulg")
    data = bytearray(path.read_bytes())
    data[7] = 77  # the version of the format
    path.write_bytes(data)
    assert len(open_log(path)) > 0
    assert capfd.readouterr() == ("", "")


def test_ulog_of_junk_ends(tmp_path):
    """pyulog alone runs for ever on some of these."""
    choose = random.Random(1)
    for _ in range(30):
        path = tmp_path / "flight.ulg"
        path.write_bytes(b"ULog\x01\x12\x35\x01" + bytes(8) + choose.randbytes(choose.randrange(3000)))
        with contextlib.suppress(LogError):
            report_of(open_log(path))


def test_a_damaged_description_costs_its_own_messages_only(dataflash, tmp_path):
    """A byte of the name of one format: DFReader then reads nothing of the log."""
    data = bytearray(dataflash.data)
    at = data.index(b"ATT\0")
    data[at + 1] = 0xFF
    path = tmp_path / "a.bin"
    path.write_bytes(data)
    log = open_log(path)
    assert len(log.table("HIGHRES_IMU")) == 100 * SECONDS and not log.has("ATTITUDE")
    assert report_of(log).drops["damaged_formats"] == 1
    data[at + 1] = ord("T")
    data[at + 4] = ord("?")  # the type of its first field
    path.write_bytes(data)
    log = open_log(path)
    assert len(log.table("HIGHRES_IMU")) == 100 * SECONDS and not log.has("ATTITUDE")


@pytest.mark.parametrize("name", ["IMU", "MODE", "MSG", "ARM"])
def test_a_damaged_time_makes_no_rows_for_months(tmp_path, name):
    writer = ardupilot_plane(1)
    at = bytes(writer.data).rindex(bytes((0xA3, 0x95, writer.formats[name][0]))) + 3
    writer.data[at : at + 8] = (9 * 10**12).to_bytes(8, "little")
    log = open_log(writer.save(tmp_path / "a.bin"))
    assert len(log.table("HEARTBEAT")) < 100 and log.duration_s < 4.0
    assert report_of(log).drops["implausible_times"] == 1


def test_a_date_that_a_damaged_message_has_is_not_that_of_the_log(tmp_path):
    writer = DataflashWriter(GPS=("QBIH", "TimeUS,Status,GMS,GWk"))
    for second in range(20):
        writer.add("GPS", 1_000_000 * second, 3, 100_000_000 + 1000 * second, 65535 if not second else 2300)
    log = open_log(writer.save(tmp_path / "a.bin"))
    assert log.start_unix_us == (2300 * 7 * 86400 + 100_000 - 18 + 315_964_800) * 1_000_000


def _topics(path, formats, subscribed="a"):
    writer = UlogWriter(good="uint64_t timestamp;float x;", **formats)
    writer.subscribe("good")
    for name in subscribed:
        writer.subscribe(name)
    for second in range(10):
        writer.add("good", "Qf", second * 1_000_000, 1.0)
    return writer, path


def test_messages_that_are_too_short_do_not_end_the_log(tmp_path):
    writer, path = _topics(tmp_path / "a.ulg", {}, subscribed=())
    for kind in "DILCOPQ":
        writer._message(kind, b"")
    writer.add("good", "Qf", 10_000_000, 1.0)
    assert len(open_log(writer.save(path)).table("good")) == 11


@pytest.mark.parametrize(
    "formats",
    [
        {"a": "a inner;"},
        {"a": "b[65535] inner;", "b": "c[65535] inner;", "c": "float[65535] x;"},
        {"a": "b[60000] inner;", "b": "c[60000] inner;", "c": ""},
        {"a": "float[65535] x;float[65535] y;"},
    ],
)
def test_formats_that_no_message_can_have_are_left_out(tmp_path, formats):
    writer, path = _topics(tmp_path / "a.ulg", formats)
    log = open_log(writer.save(path))
    assert len(log.table("good")) == 10
    assert log.source.remarks["corrupt"] == 1


def test_topics_without_a_time_and_texts_in_place_of_numbers(tmp_path):
    writer, path = _topics(tmp_path / "a.ulg", {"a": "float x;", "vehicle_attitude": "float timestamp;"})
    writer.subscribe("vehicle_attitude")
    writer.add("a", "f", 1.0)
    writer.add("vehicle_attitude", "f", 1.0)
    for kind, key, value in (("I", "char[3] ver_sw_release", b"abc"), ("P", "char[3] A_GAIN", b"abc")):
        body = bytes([len(key)]) + key.encode() + value
        place = writer._header_end
        writer.data[place:place] = struct.pack("<HB", len(body), ord(kind)) + body
    for second in range(10, 20):
        writer.add("good", "Qf", second * 1_000_000, 1.0)
    log = open_log(writer.save(path))
    assert len(log.table("good")) == 20 and not log.has("PARAM_VALUE")
    assert report_of(log).drops["topics_without_time"] == 2


def test_topics_of_another_shape_make_no_messages(tmp_path):
    writer = UlogWriter(
        vehicle_attitude="uint64_t timestamp;float q;",
        sensor_combined="uint64_t timestamp;float[2] gyro_rad;float[3] accelerometer_m_s2;",
        vehicle_status="uint64_t timestamp;uint8_t[2] nav_state;uint8_t arming_state;",
    )
    for name in ("vehicle_attitude", "sensor_combined", "vehicle_status"):
        writer.subscribe(name)
    writer.add("vehicle_attitude", "Qf", 1_000_000, 1.0)
    writer.add("sensor_combined", "Q5f", 1_000_000, *[1.0] * 5)
    writer.add("vehicle_status", "Q3B", 1_000_000, 1, 2, 3)
    log = open_log(writer.save(tmp_path / "a.ulg"))
    assert {key.name for key in log.keys} == {"vehicle_attitude", "sensor_combined", "vehicle_status"}


def test_a_damaged_time_of_a_topic_is_left_out(tmp_path):
    writer = px4_plane(1)
    writer.add("vehicle_status", "QBBB", 9 * 10**12, 2, 3, 1)
    log = open_log(writer.save(tmp_path / "a.ulg"))
    assert log.duration_s < 4.0 and len(log.table("HEARTBEAT")) < 20
    assert report_of(log).drops["implausible_times"] == 1


def test_units_of_a_log_have_signed_bytes_as_ids():
    """As ArduPilot's own logs have them (format b)."""
    table = {"Id": np.array([109, -1], dtype=np.int8), "Label": np.array([b"m", b"?"])}
    assert _lookup(table, "Label") == {109: b"m", 255: b"?"}
