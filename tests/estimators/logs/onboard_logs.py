"""Writers of small ArduPilot .bin and PX4 .ulg files, after the formats' descriptions; a flight in each."""

import math
import struct

SECONDS = 4
_DATAFLASH_FMT = 128
_DATAFLASH_CODES = {"Q": "Q", "I": "I", "i": "i", "B": "B", "h": "h", "H": "H", "f": "f", "d": "d"}
_DATAFLASH_CODES |= {
    "L": "i",
    "c": "h",
    "C": "H",
    "e": "i",
    "E": "I",
    "M": "B",
    "n": "4s",
    "N": "16s",
    "Z": "64s",
}
_SCALED = {"c": 100.0, "C": 100.0, "e": 100.0, "E": 100.0, "L": 1e7}


class DataflashWriter:
    """Formats come first; `add` writes values as the log would give them back."""

    def __init__(self, **formats):
        """formats: name=(codes, "Column,Column")."""
        self.data = bytearray()
        self.formats = {}
        self._format(_DATAFLASH_FMT, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
        for number, (name, (codes, columns)) in enumerate(formats.items(), start=1):
            self.formats[name] = (number, codes)
            self._format(number, name, codes, columns)

    def _format(self, number, name, codes, columns):
        size = 3 + struct.calcsize("<" + "".join(_DATAFLASH_CODES[code] for code in codes))
        values = (number, size, name.encode(), codes.encode(), columns.encode())
        self.data += bytes((0xA3, 0x95, _DATAFLASH_FMT)) + struct.pack("<BB4s16s64s", *values)

    def add(self, name, *values):
        number, codes = self.formats[name]
        raw = [
            round(value * _SCALED[code])
            if code in _SCALED
            else value.encode()
            if isinstance(value, str)
            else value
            for code, value in zip(codes, values, strict=True)
        ]
        layout = "<" + "".join(_DATAFLASH_CODES[code] for code in codes)
        self.data += bytes((0xA3, 0x95, number)) + struct.pack(layout, *raw)

    def save(self, path):
        path.write_bytes(self.data)
        return path


class UlogWriter:
    """Definitions come first, then `subscribe` and `add`."""

    def __init__(self, **formats):
        """formats: topic="uint64_t timestamp;float[3] gyro_rad;"."""
        self.data = bytearray(bytes.fromhex("554c6f67011235") + b"\x01" + struct.pack("<Q", 1000))
        self._message("B", bytes(40))
        self._header_end = len(self.data)
        self.topics = {}
        for name, fields in formats.items():
            self._message("F", f"{name}:{fields}".encode())

    def _message(self, kind, body):
        self.data += struct.pack("<HB", len(body), ord(kind)) + body

    def subscribe(self, name, instance=0):
        number = len(self.topics)
        self.topics[name, instance] = number
        self._message("A", struct.pack("<BH", instance, number) + name.encode())

    def add(self, name, layout, *values, instance=0):
        number = self.topics[name, instance]
        self._message("D", struct.pack("<H", number) + struct.pack(f"<{layout}", *values))

    def parameter(self, name, value):
        kind, layout = ("int32_t", "<i") if isinstance(value, int) else ("float", "<f")
        key = f"{kind} {name}".encode()
        body = bytes([len(key)]) + key + struct.pack(layout, value)
        # Parameters stand among the definitions, before the first subscription.
        self.data[self._header_end : self._header_end] = struct.pack("<HB", len(body), ord("P")) + body

    def text(self, level, time_us, message):
        self._message("L", struct.pack("<BQ", level + ord("0"), time_us) + message.encode())

    def save(self, path):
        path.write_bytes(self.data)
        return path


def ardupilot_plane(seconds=SECONDS):
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
    for tick in range(50 * seconds):
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


def px4_plane(seconds=SECONDS):
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
    for tick in range(100 * seconds):
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
