"""Truth as MAVLink frames, for log and score only: HIL_STATE_QUATERNION, as PX4 sends its ground truth.

The frames carry the vehicle's system id and the component id of the simulator (`SIMULATOR_COMPONENT`), so
that no reader takes them for frames of the autopilot. Ground targets have a separate system id,
`TARGET_SYSTEM`; the first is component 1.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import FrameEncoder, dialect
from autopilot_bridge.mavlink.components import SIMULATOR_COMPONENT
from autopilot_bridge.mavlink.definitions import definition
from autopilot_bridge.mavlink.wire_units import e7, mm
from autopilot_bridge.telemetry.records import record_type, whole
from flightsim import truth as t
from flightsim.foundation.atmosphere import GRAVITY_M_S2, SEA_LEVEL_DENSITY_KG_M3
from flightsim.foundation.kernels import bound, kernel
from flightsim.home import Home
from flightsim.payload import GroundTargets, Static

TARGET_SYSTEM: Final = 251
MAX_TARGETS: Final = 250
_STATIC_EVERY: Final = 5
TRUTH_RATE_HZ: Final = 50
_MESSAGE_ID: Final = dialect.MAVLINK_MSG_ID_HIL_STATE_QUATERNION
_Q: Final[int] = t.Q_NED_FROM_FRD.start
_RATES: Final[int] = t.RATES_FRD_RAD_S.start
_VEL: Final[int] = t.VEL_NED_M_S.start
_FORCE: Final[int] = t.SPECIFIC_FORCE_FRD_M_S2.start


@kernel
def _fill(truth: NDArray[np.float64], out: NDArray[np.void], time_us: int) -> None:
    """Convert the layout of `flightsim.truth` to the wire's units."""
    r = out[0]
    r.time_usec = time_us
    for i in range(4):
        r.attitude_quaternion[i] = truth[_Q + i]
    r.rollspeed, r.pitchspeed, r.yawspeed = truth[_RATES], truth[_RATES + 1], truth[_RATES + 2]
    r.lat = whole(math.degrees(truth[t.LAT_RAD]) * 1e7, 1.8e9)
    r.lon = whole(math.degrees(truth[t.LON_RAD]) * 1e7, 1.8e9)
    r.alt = whole(truth[t.ALT_M] * 1e3, 2e9)
    r.vx = whole(truth[_VEL] * 100.0, 32767.0)
    r.vy = whole(truth[_VEL + 1] * 100.0, 32767.0)
    r.vz = whole(truth[_VEL + 2] * 100.0, 32767.0)
    airspeed = truth[t.AIRSPEED_TRUE_M_S]
    r.true_airspeed = whole(airspeed * 100.0, 32767.0)
    r.ind_airspeed = whole(
        truth[t.AIRSPEED_TRUE_M_S]
        * 100.0
        * math.sqrt(max(0.0, truth[t.DENSITY_KG_M3]) / SEA_LEVEL_DENSITY_KG_M3),
        32767.0,
    )
    r.xacc = whole(truth[_FORCE] * (1000.0 / GRAVITY_M_S2), 32767.0)
    r.yacc = whole(truth[_FORCE + 1] * (1000.0 / GRAVITY_M_S2), 32767.0)
    r.zacc = whole(truth[_FORCE + 2] * (1000.0 / GRAVITY_M_S2), 32767.0)


class TruthEncoder:
    """Packs the truth vector of one vehicle.

    Args:
        system_id: the vehicle's.
        truth: layout of `flightsim.truth`, written in place by the vehicle.
    """

    def __init__(self, system_id: int, truth: NDArray[np.float64]) -> None:
        if truth.shape != (t.TRUTH_SIZE,):
            raise ValueError(f"truth has shape {truth.shape}; accepted: ({t.TRUTH_SIZE},)")
        self._encoder = FrameEncoder(system_id, SIMULATOR_COMPONENT)
        self._record = np.zeros(1, record_type(definition(_MESSAGE_ID)))
        self._fill = bound(_fill, truth, self._record, then=(0,))

    def encode(self, time_us: int) -> bytes:
        """One HIL_STATE_QUATERNION frame of the present truth."""
        self._fill(time_us)
        return self._encoder.encode_payload(_MESSAGE_ID, self._record.tobytes())

    def encode_text(self, text: str) -> bytes:
        """A STATUSTEXT of the simulator, for users; severity critical."""
        return self._encoder.encode(
            dialect.MAVLink_statustext_message(dialect.MAV_SEVERITY_CRITICAL, text[:50].encode("ascii"))
        )


class TargetTruthEncoder:
    """Packs the positions of the ground targets: those that move every time, static ones every fifth time.

    Args:
        targets: the world's targets.
        home: origin of their frame.
    """

    def __init__(self, targets: GroundTargets, home: Home) -> None:
        if len(targets) > MAX_TARGETS:
            raise ValueError(f"{len(targets)} ground targets are too many; accepted are up to {MAX_TARGETS}")
        self._targets = targets
        self._home = home
        self._encoders = [FrameEncoder(TARGET_SYSTEM, number + 1) for number in range(len(targets))]
        self._moving = [not isinstance(target.parameters.motion, Static) for target in targets.targets]
        self._records = np.zeros(len(targets), record_type(definition(_MESSAGE_ID)))
        self._records["attitude_quaternion"][:, 0] = 1.0
        self._calls = 0

    def encode(self, time_us: int) -> list[bytes]:
        """HIL_STATE_QUATERNION frames of the targets, with their state at a vehicle time."""
        first, everyone = self._calls == 0, self._calls % _STATIC_EVERY == 0
        self._calls += 1
        if not (everyone or any(self._moving)):
            return []
        self._targets.step(time_us)
        records = self._records
        records["time_usec"] = time_us
        frames = []
        for index, (encoder, moving) in enumerate(zip(self._encoders, self._moving, strict=True)):
            if moving or first:
                self._write(index)
            if moving or everyone:
                frames.append(encoder.encode_payload(_MESSAGE_ID, records[index].tobytes()))
        return frames

    def _write(self, index: int) -> None:
        """Write where a target is, and its velocity."""
        record, targets = self._records[index], self._targets
        north_m, east_m, down_m = targets.positions_ned_m[index].tolist()
        lat_deg, lon_deg = self._home.offset(north_m, east_m)
        record["lat"], record["lon"] = e7(lat_deg), e7(lon_deg)
        record["alt"] = mm(self._home.alt_m - down_m)
        velocity_cm_s = (round(speed * 100.0) for speed in targets.velocities_ned_m_s[index].tolist())
        record["vx"], record["vy"], record["vz"] = velocity_cm_s
