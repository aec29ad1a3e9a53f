"""ArduPilot's onboard logs of every year: times, text logs, vehicles, modes, armed states."""

import numpy as np
import pytest
from pymavlink import DFReader

from estimators.airborne import airborne_spans
from estimators.attitude import AttitudeEstimator
from estimators.log_replay import replay
from estimators.logs import LogError, open_log, report_of
from estimators.logs.ardupilot_firmware import firmware_of, mode_names, mode_number
from tests.estimators.logs.onboard_logs import DataflashWriter

WEEK, WEEK_MS = 1777, 56_674_000
UNIX_S = 315_964_800 + WEEK * 7 * 86_400 + WEEK_MS // 1000 - 18


def counts(reader):
    found = {}
    while (message := reader.recv_msg()) is not None:
        found[message.get_type()] = found.get(message.get_type(), 0) + 1
    return {name: count for name, count in found.items() if name != "FMT"}


def copter_of_2014(path, *, events=True, banner="ArduCopter V3.2.1 (36b405fb)"):
    """Twenty seconds, times in milliseconds; MODE, MSG and EV have none, GPS has two."""
    writer = DataflashWriter(
        PARM=("Nf", "Name,Value"),
        MSG=("Z", "Message"),
        MODE=("Mh", "Mode,ThrCrs"),
        EV=("B", "Id"),
        IMU=("Iffffff", "TimeMS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"),
        IMU2=("Iffffff", "TimeMS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"),
        ATT=("IccccCC", "TimeMS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw"),
        CTUN=("Ihhhffecchh", "TimeMS,ThrIn,AngBst,ThrOut,DAlt,Alt,BarAlt,DSAlt,SAlt,DCRt,CRt"),
        GPS=("BIHBcLLeeEefI", "Status,TimeMS,Week,NSats,HDop,Lat,Lng,RelAlt,Alt,Spd,GCrs,VZ,T"),
    )
    writer.add("PARM", "AHRS_TRIM_X", 0.05)
    if banner:
        writer.add("MSG", banner)
    for tick in range(1000):
        ms = 60_000 + 20 * tick
        writer.add("IMU", ms, 0.1, 0.0, 0.0, 0.0, 0.0, -9.8)
        writer.add("IMU2", ms, 0.2, 0.0, 0.0, 0.0, 0.0, -9.7)
        if tick == 0:
            writer.add("MODE", 0, 400)
        if tick == 500:
            writer.add("MODE", 5, 400)
        if events and tick == 900:
            writer.add("EV", 11)
        if tick % 5 == 0:
            flying = 250 <= tick < 800
            height = 0.02 * (tick - 250) if flying else 0.0
            writer.add("ATT", ms, 0.0, 10.0, 0.0, -5.0, 0.0, 90.0)
            throttle = 400 if flying else 0
            writer.add("CTUN", ms, 0, 0, throttle, 0.0, height, height, 0.0, 0.0, 0, 50 if flying else 0)
        if tick % 10 == 0:
            writer.add(
                "GPS", 3, WEEK_MS + 20 * tick, WEEK, 9, 1.2, 14.11, 100.62, 0.0, 20.0, 1.0, 90.0, 0.0, ms
            )
    return writer.save(path)


def test_milliseconds_and_messages_without_a_time(tmp_path):
    log = open_log(copter_of_2014(tmp_path / "1.bin"))
    assert log.source.remarks["times"] == "milliseconds since boot"
    assert log.table("ATTITUDE").time_us[:2].tolist() == [60_000_000, 60_100_000]
    assert log.table("MODE").time_us.tolist() == [60_000_000, 70_000_000]  # of the message before
    assert log.table("GPS_RAW_INT").time_us[1] == 60_200_000  # T, and not the time of the week
    assert log.start_unix_us == UNIX_S * 1_000_000
    assert [log.table("HIGHRES_IMU", instance=n)["xgyro"][0] for n in (0, 1)] == pytest.approx([0.1, 0.2])
    assert log.rate_hz("HIGHRES_IMU") == pytest.approx(50.0, rel=0.01)
    assert log.table("GLOBAL_POSITION_INT")["lat"][0] == 141_100_000
    hud = log.table("VFR_HUD")
    assert (hud["throttle"].max(), hud["climb"].max()) == (40, 0.5)
    assert log.table("PARAM_VALUE")["param_id"][0] == b"AHRS_TRIM_X"
    theirs = counts(DFReader.DFReader_binary(str(tmp_path / "1.bin")))
    assert {name: len(log.table(name)) for name in theirs} == theirs


def test_a_part_of_a_log_has_the_parameters_from_before_it(tmp_path):
    log = open_log(copter_of_2014(tmp_path / "1.bin"))
    done = replay(log, AttitudeEstimator, from_s=70.0, to_s=75.0)
    runner = done.fleet.runners[1]
    assert "board trim corrected: roll +2.86 deg" in runner.remarks["note"]  # type: ignore[operator]
    times = runner.tables["AttitudeEstimate"].time_us
    assert times[0] >= 70_000_000 and times[-1] < 75_000_000


def test_vehicle_modes_and_the_flight_of_2014(tmp_path):
    """The log begins with arming: it holds the disarming only."""
    log = open_log(copter_of_2014(tmp_path / "1.bin"))
    (vehicle,) = report_of(log).vehicles
    assert (vehicle.type, vehicle.firmware) == ("QUADROTOR", "ArduCopter V3.2.1 (36b405fb)")
    assert [span.mode for span in vehicle.modes] == ["STABILIZE", "LOITER"]
    (flight,) = vehicle.flights
    assert (flight.start_us, flight.end_us) == (60_000_000, 78_000_000)
    spans, source = airborne_spans(log, 1)
    assert source == "armed, throttle above 20 %"  # GPS says no height
    assert spans[0][0] == 65_000_000 and spans[-1][1] == pytest.approx(76_000_000, abs=100_000)


def test_armed_where_no_event_was_logged(tmp_path):
    log = open_log(copter_of_2014(tmp_path / "1.bin", events=False, banner=""))
    (vehicle,) = report_of(log).vehicles
    (flight,) = vehicle.flights
    assert (flight.start_us, flight.end_us) == (65_000_000, pytest.approx(75_900_001, abs=1000))


def test_a_log_that_begins_with_arming_holds_only_arm_state_0(tmp_path):
    writer = DataflashWriter(
        MSG=("QZ", "TimeUS,Message"),
        MODE=("QMBB", "TimeUS,Mode,ModeNum,Rsn"),
        ARM=("QB", "TimeUS,ArmState"),
        POS=("QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt"),
    )
    writer.add("MSG", 1_000_000, "ArduCopter V4.6.3 (3fc7011a)")
    writer.add("MODE", 1_000_000, 5, 5, 1)
    for second in range(1, 30):
        writer.add("POS", second * 1_000_000, -35.0, 149.0, 600.0, 20.0 if 5 <= second < 25 else 0.0, 0.0)
    writer.add("ARM", 29_000_000, 0)
    log = open_log(writer.save(tmp_path / "1.bin"))
    (flight,) = report_of(log).vehicles[0].flights
    assert (flight.start_us, flight.end_us) == (1_000_000, 29_000_000)
    assert airborne_spans(log, 1) == ([(5_000_000, 25_000_000)], "armed, above 2 m")


def text_of(path):
    """The text form of a log, as ground stations write it."""
    reader = DFReader.DFReader_binary(str(path))
    lines = ["ArduCopter V3.0.1", "Free RAM: 1273"]
    for layout in reader.formats.values():
        columns = ",".join(layout.columns)
        lines.append(f"FMT, {layout.type}, {layout.len}, {layout.name}, {layout.format}, {columns}")
    while (message := reader.recv_msg()) is not None:
        name = message.get_type()
        values = [str(getattr(message, field)) for field in message.get_fieldnames()]
        if name == "MODE":
            values[0] = {"0": "Stabilize", "5": "LOITER"}[values[0]]
        if name != "FMT":
            lines.append(", ".join([name, *values]))
    return "\r\n".join(lines) + "\r\n"


def test_text_logs_give_what_binary_ones_give(tmp_path):
    binary = open_log(copter_of_2014(tmp_path / "1.bin", banner=""))
    path = tmp_path / "1.log"
    path.write_text(text_of(tmp_path / "1.bin"), newline="")
    text = open_log(path)
    for name in ("ATTITUDE", "HIGHRES_IMU", "GPS_RAW_INT", "VFR_HUD", "GLOBAL_POSITION_INT"):
        ours, theirs = text.table(name), binary.table(name)
        assert np.array_equal(ours.time_us, theirs.time_us), name
        for field in ours.fields:
            assert ours[field] == pytest.approx(theirs[field], rel=1e-6), (name, field)
    (vehicle,) = report_of(text).vehicles
    assert vehicle.firmware == "ArduCopter V3.0.1"
    assert [span.mode for span in vehicle.modes] == ["STABILIZE", "LOITER"]
    theirs = counts(DFReader.DFReader_text(str(path)))
    assert {name: len(text.table(name)) for name in theirs} == theirs
    assert sum(report_of(text).bytes_by_kind.values()) == text.size_bytes


def test_a_text_log_of_2013_has_the_times_of_its_gps(tmp_path):
    path = tmp_path / "1.log"
    lines = [
        "ArduCopter V3.0.1",
        "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format",
        "FMT, 130, 35, GPS, BIBcLLeeEe, Status,Time,NSats,HDop,Lat,Lng,RelAlt,Alt,Spd,GCrs",
        "FMT, 131, 27, IMU, ffffff, GyrX,GyrY,GyrZ,AccX,AccY,AccZ",
        "FMT, 3, 6, MODE, Mh, Mode,ThrCrs",
        "FMT, 10, 3, STRT, , ",
        "MODE, Toy_A, 494",
    ]
    for tenth in range(100):
        lines.append(f"GPS, 3, {308_900_000 + 200 * tenth}, 10, 1.49, 24.24, 54.58, 0.1, 9.4, 0.0, 0.0")
        lines += ["IMU, 0.0, 0.0, 0.0, 0.0, 0.0, -9.8"] * 10
    path.write_text("\n".join(lines))
    log = open_log(path)
    assert log.source.remarks["times"] == "interpolated between GPS times"
    assert log.start_unix_us is None  # the week is not known
    assert log.duration_s == pytest.approx(20.0, abs=0.3)
    assert log.rate_hz("HIGHRES_IMU") == pytest.approx(50.0, rel=0.02)


def test_a_log_without_any_time_counts_at_50_hz(tmp_path):
    writer = DataflashWriter(IMU=("ffffff", "GyrX,GyrY,GyrZ,AccX,AccY,AccZ"), ATT=("cc", "Roll,Pitch"))
    for tick in range(500):
        writer.add("IMU", *[0.0] * 6)
        if tick % 5 == 0:
            writer.add("ATT", 0.0, 0.0)
    log = open_log(writer.save(tmp_path / "1.bin"))
    assert log.source.remarks["times"] == "none; 50 Hz is assumed"
    assert log.table("HIGHRES_IMU").time_us[-1] == 499 * 20_000


def test_junk_before_the_first_message(tmp_path):
    path = copter_of_2014(tmp_path / "1.bin")
    path.write_bytes(bytes(100) + path.read_bytes())
    assert len(open_log(path).table("IMU")) == 1000


def test_a_damaged_stamp_is_replaced_and_counted(tmp_path):
    path = copter_of_2014(tmp_path / "1.bin")
    data = bytearray(path.read_bytes())
    name = DFReader.DFReader_binary(str(path))
    at = name.offsets[name.name_to_id["ATT"]][100]
    data[at + 3 : at + 7] = (3_000_000_000).to_bytes(4, "little")
    path.write_bytes(data)
    log = open_log(path)
    assert log.duration_s < 21.0 and len(log.table("ATT")) == 200
    assert report_of(log).drops["implausible_times"] == 1


def test_what_holds_formats_but_no_message_says_so(tmp_path):
    path = DataflashWriter(IMU=("Qf", "TimeUS,GyrX")).save(tmp_path / "1.bin")
    with pytest.raises(LogError, match="no message: nothing was logged"):
        open_log(path)


def test_px4_logs_of_before_2016(tmp_path):
    """TIME messages give the time; angles are in radians."""
    writer = DataflashWriter(
        TIME=("Q", "StartTime"),
        STAT=("BBBBB", "MainState,NavState,ArmS,Failsafe,IsRotWing"),
        IMU=("ffffff", "AccX,AccY,AccZ,GyroX,GyroY,GyroZ"),
        ATT=("ffffff", "Roll,Pitch,Yaw,RollRate,PitchRate,YawRate"),
        LAND=("B", "Landed"),
    )
    writer.add("TIME", 5_000_000)
    writer.add("STAT", 2, 0, 2, 0, 1)
    writer.add("LAND", 0)
    for tick in range(100):
        writer.add("TIME", 5_000_000 + 10_000 * tick)
        writer.add("IMU", 0.0, 0.0, -9.8, 0.001 * tick, 0.0, 0.0)
        writer.add("ATT", 0.5, -0.1, 1.0, 0.0, 0.0, 0.0)
    log = open_log(writer.save(tmp_path / "1.px4log"))
    attitude = log.table("ATTITUDE")
    assert (attitude["roll"][0], attitude.time_us[-1]) == (0.5, 5_990_000)
    assert log.table("HIGHRES_IMU")["xgyro"][-1] == pytest.approx(0.099)
    (vehicle,) = report_of(log).vehicles
    assert (vehicle.autopilot, vehicle.type) == ("PX4", "QUADROTOR")
    assert [span.mode for span in vehicle.modes] == ["POSCTL"] and len(vehicle.flights) == 1


@pytest.mark.parametrize(
    ("texts", "vehicle", "mav_type"),
    [
        (["ArduCopter V3.1.3 (92cdd2a3)"], "copter", 2),
        (["APM:Copter V3.4-rc2 (f46a31d0)", "Frame: HEXA"], "copter", 13),
        (["Frame: HELI", "ArduCopter V4.0.2"], "copter", 4),
        (["APM:Plane V3.5.0"], "plane", 1),
        (["ArduPlane V4.5.0-dev (fa0f089f)"], "plane", 1),
        (["ArduRover v2.46beta2 (588ab08d)"], "rover", 10),
        (["APMrover2 V2.50"], "rover", 10),
        (["APM:Rover V3.0.1"], "rover", 10),
        (["ArduSub V3.7.0-dev (51e18734)"], "sub", 12),
        (["AntennaTracker V1.1.0"], "tracker", 5),
        (["Blimp V4.5.0"], "blimp", 7),
        (["PX4: 60133536 NuttX: 1e53bc3d"], "", 0),
    ],
)
def test_banners_of_the_years(texts, vehicle, mav_type):
    made_by = firmware_of(texts)
    assert (made_by.vehicle, made_by.mav_type) == (vehicle, mav_type)


def test_without_a_banner_the_build_or_the_parameters_tell():
    assert firmware_of([], (), [7]).vehicle == "sub"
    assert firmware_of([], ["RLL2SRV_P", "Q_A_RAT_RLL_P"]).vehicle == "plane"
    assert firmware_of([], ["ATC_RAT_RLL_P", "JS_GAIN_DEFAULT"]).vehicle == "sub"
    assert firmware_of([], ["STB_RLL_P", "H_COL_MIN"]).mav_type == 4


def test_modes_whose_number_was_used_again():
    assert mode_names(2, (3, 0))[11] == "TOY_A"
    assert mode_names(2, (3, 1))[11] == mode_names(2)[11] == "DRIFT"
    assert (mode_names(12)[19], mode_names(5)[2], mode_names(10)[4]) == ("MANUAL", "SCAN", "HOLD")
    assert mode_number(2, "AltHold") == 2 and mode_number(1, "Fly by wire") is None
    assert not mode_names(0)
