"""Truth as MAVLink frames, for the log and the score only: HIL_STATE_QUATERNION, as PX4 sends its ground truth.

The frames carry the vehicle's system id and the component id of the simulator (`SIMULATOR_COMPONENT`), so that no
reader takes them for the autopilot's word.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mavlink import FrameEncoder
from autopilot_bridge.mavlink.definitions import definition
from autopilot_bridge.telemetry.packing import values_packer
from flightsim import truth as t

SIMULATOR_COMPONENT: Final = mavlink.MAV_COMP_ID_USER1
TRUTH_RATE_HZ: Final = 50
_MILLI_G: Final = 1000.0 / 9.80665
_MESSAGE_ID: Final = mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION


class TruthEncoder:
    """Packs the truth vector of one vehicle."""

    __slots__ = ("_encoder", "_pack")

    def __init__(self, system_id: int) -> None:
        self._encoder = FrameEncoder(system_id, SIMULATOR_COMPONENT)
        self._pack = values_packer(definition(_MESSAGE_ID))

    def encode(self, time_us: int, truth: NDArray[np.float64]) -> bytes:
        """One HIL_STATE_QUATERNION frame."""
        values = truth.tolist()
        north, east, down = values[t.VEL_NED_M_S]
        airspeed_cm_s = round(values[t.AIRSPEED_TRUE_M_S] * 100.0)
        indicated_cm_s = round(airspeed_cm_s * math.sqrt(max(0.0, values[t.DENSITY_KG_M3]) / 1.225))
        payload = self._pack(
            (
                time_us,
                values[t.Q_NED_FROM_FRD],
                *values[t.RATES_FRD_RAD_S],
                round(math.degrees(values[t.LAT_RAD]) * 1e7),
                round(math.degrees(values[t.LON_RAD]) * 1e7),
                round(values[t.ALT_M] * 1000.0),
                round(north * 100.0),
                round(east * 100.0),
                round(down * 100.0),
                indicated_cm_s,
                airspeed_cm_s,
                *(round(force * _MILLI_G) for force in values[t.SPECIFIC_FORCE_FRD_M_S2]),
            )
        )
        return self._encoder.encode_payload(_MESSAGE_ID, payload)
