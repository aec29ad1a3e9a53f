"""A small flight as a telemetry log, for what makes other files of logs."""

import math

from pymavlink.dialects.v20 import all as dialect

from tests.estimators.logs.reference import EPOCH_US, pack, record

SECONDS = 10
RATE_HZ = 20


def frames():
    """(time since the start in us, frame): IMU, GPS, attitude of vehicle 1, a vehicle 2, a ground station."""
    sequence = 0
    for tick in range(SECONDS * RATE_HZ):
        time_us = tick * 1_000_000 // RATE_HZ
        ms = time_us // 1000 + 5000
        said = [
            (dialect.MAVLink_raw_imu_message(ms * 1000, 0, 0, -1000, 10, -20, 30, 1, 2, 3), 1),
            (
                dialect.MAVLink_attitude_message(ms, 0.01 * tick, math.nan if tick == 3 else 0.1, 0, 0, 0, 0),
                1,
            ),
            (dialect.MAVLink_attitude_message(ms, -0.5, 0, 0, 0, 0, 0), 2),
        ]
        if tick % 4 == 0:
            place = (3, -353600000, 1491600000, 584000, 80, 80, 1500, 9000, 12)
            said.append((dialect.MAVLink_gps_raw_int_message(ms * 1000, *place), 1))
        if tick % RATE_HZ == 0:
            said.append((dialect.MAVLink_heartbeat_message(2, 3, 81, 4 if tick >= 100 else 0, 4, 3), 1))
            said.append((dialect.MAVLink_statustext_message(6, f"second {tick // RATE_HZ}".encode()), 1))
            said.append((dialect.MAVLink_servo_output_raw_message(ms * 1000 % 2**32, 0, *[1500] * 8), 1))
        for message, system in said:
            yield time_us, pack(message, system=system, sequence=sequence & 0xFF)
            sequence += 1


def write(path):
    path.write_bytes(b"".join(record(frame, EPOCH_US + time_us) for time_us, frame in frames()))
    return path
