"""What is read from JSBSim for the truth vector, and its conversion."""

import math
from collections.abc import Callable
from enum import IntEnum
from operator import call
from struct import Struct
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.airframe import Airframe, AirframeKind
from flightsim.crash import BREAKS_AT_M_S2, DEEPEST_M, FASTEST_M_S, FASTEST_RAD_S, MOVING_M_S, NEAR_M, Touches
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.imperial import KG_M3_PER_SLUG_FT3, M_PER_FT, PA_PER_PSF
from flightsim.foundation.kernels import bound, kernel
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.jsbsim_model import find_property
from flightsim.jsbsim_package import jsbsim

Array = NDArray[np.float64]

_VEL: Final[int] = t.VEL_NED_M_S.start
_RATES: Final[int] = t.RATES_FRD_RAD_S.start
_FORCE: Final[int] = t.SPECIFIC_FORCE_FRD_M_S2.start
_WIND: Final[int] = t.WIND_NED_M_S.start

MOTION: Final = (
    "position/lat-geod-rad",
    "position/long-gc-rad",
    "position/geod-alt-ft",
    "velocities/v-north-fps",
    "velocities/v-east-fps",
    "velocities/v-down-fps",
    "attitude/phi-rad",
    "attitude/theta-rad",
    "attitude/psi-rad",
)
# What is read from JSBSim every step, in this order; `write_truth` converts it.
STATE: Final = (
    *MOTION,
    "velocities/pi-rad_sec",
    "velocities/qi-rad_sec",
    "velocities/ri-rad_sec",
    "accelerations/a-pilot-x-ft_sec2",
    "accelerations/a-pilot-y-ft_sec2",
    "accelerations/a-pilot-z-ft_sec2",
    "atmosphere/P-psf",
    "atmosphere/T-R",
    "atmosphere/rho-slugs_ft3",
    "atmosphere/total-wind-north-fps",
    "atmosphere/total-wind-east-fps",
    "atmosphere/total-wind-down-fps",
    "position/h-agl-ft",
    "velocities/vt-fps",
    "forces/fbx-gear-lbs",
    "forces/fby-gear-lbs",
    "forces/fbz-gear-lbs",
    "aero/alpha-rad",
    "aero/beta-rad",
    "aero/qbar-psf",
)
STATE_SIZE: Final = len(STATE)
GEAR_FORCE_Z: Final = STATE.index("forces/fbz-gear-lbs")
# a-pilot is at the eye point, which our multicopter has at its centre of gravity; other models have not.
LOAD_FACTORS: Final = {
    f"accelerations/a-pilot-{axis}-ft_sec2": f"accelerations/N{axis}" for axis in ("x", "y", "z")
}
ACCEL_SCALE: Final = np.array([M_PER_FT, M_PER_FT, M_PER_FT])
LOAD_FACTOR_SCALE: Final = np.array([1.0, 1.0, -1.0]) * GRAVITY_M_S2
# Motion is read every step; the rest and the model's own properties may be slower.
MOTION_SIZE: Final = STATE.index("atmosphere/P-psf")
_MOTION_BYTES: Final = 8 * MOTION_SIZE
_TOUCHED_S: Final = 10  # after touching the ground: what goes wrong then began there


class Motion(IntEnum):
    """The result of `write_truth` for JSBSim's values."""

    SOUND = 0
    IMPOSSIBLE = 1  # not finite, or no motion of any vehicle
    BROKEN = 2  # on the ground, by a force beyond what the airframe stands, or deep in it


_SOUND, _IMPOSSIBLE, _BROKEN = (int(motion) for motion in Motion)


@kernel
def write_truth(
    raw: Array,
    accel_scale: Array,
    extra: NDArray[np.int64],
    scale: Array,
    breaks_at_m_s2: float,
    ground_alt_m: float,
    truth: Array,
) -> int:
    """Convert JSBSim's values (order of `STATE`, then the model's own) to truth, if they are sound.

    Args:
        raw: the values.
        accel_scale: (3,) to specific force.
        extra, scale: where the model's own values go, and their factors.
        breaks_at_m_s2: largest specific force that a blow on the ground may make.
        ground_alt_m: above mean sea level.
        truth: left as it was by values that aren't sound.

    Returns:
        A `Motion`.
    """
    total = 0.0
    for i in range(raw.shape[0]):
        total += raw[i]
    speed = math.sqrt(raw[3] ** 2 + raw[4] ** 2 + raw[5] ** 2) * M_PER_FT
    turn = math.sqrt(raw[9] ** 2 + raw[10] ** 2 + raw[11] ** 2)
    if not (math.isfinite(total) and speed <= FASTEST_M_S and turn <= FASTEST_RAD_S):
        return _IMPOSSIBLE
    force = 0.0
    for i in range(3):
        force += (raw[12 + i] * accel_scale[i]) ** 2
    height_m = raw[2] * M_PER_FT - ground_alt_m
    blow = height_m < NEAR_M and speed > MOVING_M_S and math.sqrt(force) > breaks_at_m_s2
    if blow or height_m < -DEEPEST_M:
        return _BROKEN
    truth[t.LAT_RAD] = raw[0]
    truth[t.LON_RAD] = raw[1]
    truth[t.ALT_M] = raw[2] * M_PER_FT
    quaternion_from_euler(raw[6], raw[7], raw[8], truth[t.Q_NED_FROM_FRD])
    for i in range(3):
        truth[_VEL + i] = raw[3 + i] * M_PER_FT
        truth[_RATES + i] = raw[9 + i]
        truth[_FORCE + i] = raw[12 + i] * accel_scale[i]
        truth[_WIND + i] = raw[18 + i] * M_PER_FT
    truth[t.PRESSURE_PA] = raw[15] * PA_PER_PSF
    truth[t.TEMPERATURE_K] = raw[16] / 1.8
    truth[t.DENSITY_KG_M3] = raw[17] * KG_M3_PER_SLUG_FT3
    truth[t.HEIGHT_ABOVE_GROUND_M] = raw[21] * M_PER_FT
    truth[t.AIRSPEED_TRUE_M_S] = raw[22] * M_PER_FT
    truth[t.ANGLE_OF_ATTACK_RAD] = raw[26]
    truth[t.SIDESLIP_RAD] = raw[27]
    truth[t.DYNAMIC_PRESSURE_PA] = raw[28] * PA_PER_PSF
    truth[t.ON_GROUND] = 0.0 if raw[23] == 0.0 and raw[24] == 0.0 and raw[25] == 0.0 else 1.0
    for i in range(extra.shape[0]):
        truth[extra[i]] = raw[STATE_SIZE + i] * scale[i]
    return _SOUND


class TruthReader:
    """Reads one JSBSim model and writes a vehicle's truth.

    Args:
        fdm: the model, loaded.
        airframe: its description.
        truth: (TRUTH_SIZE,), written.
        ground_alt_m: of the level ground, above mean sea level.
        physics_rate_hz: calls of `read` per second.
        slow_steps: interval in steps at which values other than motion (air, power, ground contact) are read,
            from the first step on.

    Attributes:
        touches: how it met the ground.

    Raises:
        AirframeError: the model lacks a property.
    """

    def __init__(
        self,
        fdm: jsbsim.FGFDMExec,
        airframe: Airframe,
        truth: Array,
        *,
        ground_alt_m: float,
        physics_rate_hz: int,
        slow_steps: int,
    ) -> None:
        fixed_wing = airframe.kind is AirframeKind.FIXED_WING
        state = [LOAD_FACTORS.get(prop, prop) for prop in STATE] if fixed_wing else STATE
        getters = tuple(
            find_property(fdm, prop, needed_by="the truth vector").get_double_value
            for prop in (*state, *(prop for _, prop in airframe.truth))
        )
        self._get_motion, self._get_slow = getters[:MOTION_SIZE], getters[MOTION_SIZE:]
        self._raw = np.zeros(len(getters))
        self._raw_view = self._raw.data
        self._pack_motion = Struct(f"{MOTION_SIZE}d").pack_into  # faster than setting elements of an array
        self._pack_slow = Struct(f"{len(self._get_slow)}d").pack_into
        self._slow_steps = slow_steps
        self._slow_phase = 1 % slow_steps  # the first step, then at the slow rate, as sensors measure
        self._sink_max_m_s = airframe.limits.touchdown_sink_max_m_s if fixed_wing else math.inf
        self._truth = truth
        self._write: Callable[[], int] = bound(
            write_truth,
            self._raw,
            LOAD_FACTOR_SCALE if fixed_wing else ACCEL_SCALE,
            np.array([index for index, _ in airframe.truth], dtype=np.int64),
            np.array(airframe.truth_scale or np.ones(len(airframe.truth)), dtype=float),
            BREAKS_AT_M_S2 if fixed_wing else math.inf,
            ground_alt_m,
            truth,
        )
        self.touches = Touches(physics_rate_hz * _TOUCHED_S)

    def read(self, step: int) -> int:
        """Write the truth after a step, if there is any.

        Args:
            step: number of physics steps since the start.

        Returns:
            A `Motion`.
        """
        self._pack_motion(self._raw_view, 0, *map(call, self._get_motion))
        if step % self._slow_steps == self._slow_phase or step == 0:
            self._pack_slow(self._raw_view, _MOTION_BYTES, *map(call, self._get_slow))
            sink_m_s = self.touches.observe(step, bool(self._raw[GEAR_FORCE_Z] != 0.0), self._truth)
            motion = self._write()
            return _BROKEN if sink_m_s > self._sink_max_m_s and motion == _SOUND else motion
        return self._write()
