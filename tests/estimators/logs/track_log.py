"""A vehicle on straight legs as a telemetry log, with a gap in its messages."""

import math
from itertools import pairwise

import numpy as np
from pymavlink.dialects.v20 import all as dialect

from tests.estimators.logs.reference import EPOCH_US, pack, record

HOME = (-27.0, 153.0, 40.0)  # degrees, metres
CORNERS_NE_M = ((0.0, 0.0), (200.0, 0.0), (200.0, 40.0), (0.0, 40.0))
SPEED_M_S, HEIGHT_M = 10.0, 30.0
GAP_S = (25.0, 30.0)
PER_LAT_M, PER_LON_M = 110790.0, 99254.0  # near enough to WGS84's at this latitude


def places():
    """(time s, north m, east m, yaw rad), 5 a second."""
    time_s = 1.0
    for (n0, e0), (n1, e1) in pairwise(CORNERS_NE_M):
        length_m = math.dist((n0, e0), (n1, e1))
        for share in np.arange(0.0, 1.0, SPEED_M_S / 5.0 / length_m):
            yield time_s, n0 + share * (n1 - n0), e0 + share * (e1 - e0), math.atan2(e1 - e0, n1 - n0)
            time_s += 0.2


def messages(time_s, north_m, east_m, yaw_rad):
    ms = round(1000 * time_s)
    lat, lon = HOME[0] + north_m / PER_LAT_M, HOME[1] + east_m / PER_LON_M
    alt_mm = round(1000 * (HOME[2] + HEIGHT_M))
    yield dialect.MAVLink_attitude_message(ms, 0, 0, yaw_rad, 0, 0, 0)
    yield dialect.MAVLink_global_position_int_message(
        ms, round(lat * 1e7), round(lon * 1e7), alt_mm, round(1000 * HEIGHT_M), 0, 0, 0, 65535
    )
    if ms % 1000 == 0:
        yield dialect.MAVLink_heartbeat_message(2, 3, 81, 4, 4, 3)
        yield dialect.MAVLink_home_position_message(
            round(HOME[0] * 1e7), round(HOME[1] * 1e7), round(HOME[2] * 1000), 0, 0, 0, [1, 0, 0, 0], 0, 0, 0
        )


def write(path):
    frames, sequence = [], 0
    for time_s, *place in places():
        if GAP_S[0] < time_s < GAP_S[1]:
            continue
        for message in messages(time_s, *place):
            frames.append(record(pack(message, sequence=sequence & 0xFF), EPOCH_US + round(1e6 * time_s)))
            sequence += 1
    path.write_bytes(b"".join(frames))
    return path
