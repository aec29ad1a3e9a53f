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
from tests.estimators.logs.onboard_logs import DataflashWriter, UlogWriter

SECONDS = 4


@pytest.fixture
def dataflash(tmp_path):
    """Four seconds of an ArduPlane with two IMUs; armed from 1 s to 3 s."""
    writer = DataflashWriter(
        IMU=("QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"),
        ATT=("QccccCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw"),
        RATE=("Qfff", "TimeUS,R,P,Y"),
        ARSP=("QBffc", "TimeUS,I,Airspeed,DiffPress,Temp"),
        BARO=("QBfffc", "TimeUS,I,Alt,Press,Junk,Temp"),
        GPS=("QBBIHBcLLeffff", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw"),
        POS=("QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt"),
        ORGN=("QBLLe", "TimeUS,Type,Lat,Lng,Alt"),
        XKF1=("QBffffff", "TimeUS,C,VN,VE,VD,PN,PE,PD"),
        CTUN=("Qf", "TimeUS,ThO"),
        MODE=("QMBB", "TimeUS,Mode,ModeNum,Rsn"),
        ARM=("QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method"),
        MSG=("QZ", "TimeUS,Message"),
        SIM=("QccCfLL", "TimeUS,Roll,Pitch,Yaw,Alt,Lat,Lng"),
    )
    writer.add("MSG", 500_000, "ArduPlane V4.6.3 (3fc7011a)")
    writer.add("MODE", 600_000, 0, 0, 1)
    writer.add("ORGN", 800_000, 0, -35.0, 149.0, 500.0)  # of the EKF
    writer.add("ORGN", 900_000, 1, -35.36, 149.16, 584.2)
    writer.add("GPS", 700_000, 0, 3, 100_000_000, 2300, 11, 0.8, -35.36, 149.16, 584.2, 15.0, 90.0, -0.5, 0.0)
    for tick in range(50 * SECONDS):
        time_us = 1_000_000 + tick * 20_000
        writer.add("IMU", time_us, 0, 0.1, -0.2, 0.3, 0.5, 0.0, -9.8)
        writer.add("IMU", time_us, 1, 0.11, -0.2, 0.3, 0.5, 0.0, -9.7)
        writer.add("ATT", time_us, 0.0, 30.0, 0.0, -5.5, 0.0, 350.0)
        if tick % 5 == 0:
            writer.add("RATE", time_us, 10.0, -20.0, 5.0)
            writer.add("ARSP", time_us, 0, 21.5, 270.0, 25.0)
            writer.add("BARO", time_us, 0, 100.0, 94_500.0, 0.0, 30.25)
            writer.add("POS", time_us, -35.36, 149.16, 684.2, 100.0, 100.0)
            writer.add("XKF1", time_us, 0, 1.0, 20.0, -0.5, 10.0, 200.0, -100.0)
            writer.add("CTUN", time_us, 55.0)
            writer.add("SIM", time_us, 30.5, -5.25, 350.0, 684.0, -35.36, 149.16)
    writer.add("ARM", 2_000_000, 1, 0, 0, 0)
    writer.add("MODE", 3_000_000, 10, 10, 1)
    writer.add("ARM", 4_000_000, 0, 0, 0, 0)
    return writer


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
def ulog(tmp_path):
    """Four seconds of a PX4 aircraft, in AUTO.MISSION from 3 s on."""
    writer = UlogWriter(
        sensor_combined="uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;",
        sensor_gyro="uint64_t timestamp;float x;float y;float z;",
        sensor_accel="uint64_t timestamp;float x;float y;float z;",
        vehicle_attitude="uint64_t timestamp;float[4] q;",
        vehicle_attitude_groundtruth="uint64_t timestamp;float[4] q;",
        vehicle_angular_velocity="uint64_t timestamp;float[3] xyz;",
        vehicle_local_position=(
            "uint64_t timestamp;float x;float y;float z;float vx;float vy;float vz;float heading;"
        ),
        vehicle_global_position="uint64_t timestamp;double lat;double lon;float alt;",
        home_position=(
            "uint64_t timestamp;double lat;double lon;float alt;float x;float y;float z;bool valid_hpos;"
        ),
        airspeed_validated="uint64_t timestamp;float calibrated_airspeed_m_s;",
        vehicle_air_data="uint64_t timestamp;float baro_pressure_pa;float baro_temp_celcius;",
        vehicle_gps_position=(
            "uint64_t timestamp;uint64_t time_utc_usec;double latitude_deg;double longitude_deg;"
            "double altitude_msl_m;float vel_m_s;float cog_rad;float hdop;uint8_t fix_type;"
            "uint8_t satellites_used;"
        ),
        vehicle_status="uint64_t timestamp;uint8_t arming_state;uint8_t nav_state;uint8_t system_type;",
        vehicle_land_detected="uint64_t timestamp;bool landed;",
    )
    for name in (
        "sensor_combined",
        "vehicle_attitude",
        "vehicle_attitude_groundtruth",
        "vehicle_angular_velocity",
        "vehicle_local_position",
        "vehicle_global_position",
        "home_position",
        "airspeed_validated",
        "vehicle_air_data",
        "vehicle_gps_position",
        "vehicle_status",
        "vehicle_land_detected",
    ):
        writer.subscribe(name)
    for name in ("sensor_gyro", "sensor_accel"):
        writer.subscribe(name, 1)
    half = math.radians(30.0) / 2
    writer.add("vehicle_status", "QBBB", 1_000_000, 1, 0, 1)
    writer.add("vehicle_land_detected", "Q?", 1_000_000, True)
    writer.text(6, 1_100_000, "Ready for takeoff!")
    writer.add("home_position", "Qdd4f?", 1_100_000, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False)
    writer.add("home_position", "Qdd4f?", 1_150_000, 47.39, 8.54, 488.0, 1.0, 2.0, -0.5, True)
    gps = (1_700_000_000_000_000, 47.39, 8.54, 488.0, 15.0, 1.5, 0.8, 3, 12)
    writer.add("vehicle_gps_position", "QQdddfffBB", 1_200_000, *gps)
    for tick in range(100 * SECONDS):
        time_us = 1_000_000 + tick * 10_000
        writer.add("sensor_combined", "Q6f", time_us, 0.1, -0.2, 0.3, 0.5, 0.0, -9.8)
        writer.add("sensor_accel", "Q3f", time_us, 0.4, 0.0, -9.7, instance=1)
        writer.add("sensor_gyro", "Q3f", time_us + 100, 0.2, 0.0, 0.0, instance=1)
        writer.add("vehicle_attitude", "Q4f", time_us, math.cos(half), math.sin(half), 0.0, 0.0)
        writer.add("vehicle_attitude_groundtruth", "Q4f", time_us, 1.0, 0.0, 0.0, 0.0)
        writer.add("vehicle_angular_velocity", "Q3f", time_us, 0.1, -0.2, 0.3)
        if tick % 10 == 0:
            writer.add("vehicle_local_position", "Q7f", time_us, 10.0, 20.0, -100.0, 3.0, 4.0, -0.5, 1.0)
            writer.add("vehicle_global_position", "Qddf", time_us, 47.39, 8.54, 588.0)
            writer.add("airspeed_validated", "Qf", time_us, 21.5)
            writer.add("vehicle_air_data", "Q2f", time_us, 94_500.0, 30.25)
    writer.add("vehicle_status", "QBBB", 2_000_000, 2, 17, 1)
    writer.add("vehicle_land_detected", "Q?", 2_500_000, False)
    writer.add("vehicle_status", "QBBB", 3_000_000, 2, 3, 1)
    return writer


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
    assert "SENS_BOARD_*_OFF 2 0 0 deg" in report_of(log).remarks["board"]
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
    assert "left out" in report_of(log).remarks["board"]


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
