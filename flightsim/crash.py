"""Detection of a crash, and the position of the crashed vehicle.

Contact points of a model carry wheels and tips at the loads of landings. They are not valid for impacts
beyond the strength of the airframe: JSBSim then throws the vehicle kilometres high, moves it into the ground,
or computes values that are not finite. Here the vehicle crashes, and stays at its position.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.atmosphere import GAS_CONSTANT_J_KG_K, GRAVITY_M_S2
from flightsim.foundation.rotations import rotate_inverse

Array = NDArray[np.float64]

BREAKS_AT_M_S2: Final = 1000.0
"""Specific force, some 100 g, at which an aircraft breaks. A small multicopter bounces with more."""
FASTEST_M_S: Final = 1500.0
FASTEST_RAD_S: Final = 500.0
"""No vehicle moves or turns faster; contact forces that ring without end do."""
DEEPEST_M: Final = 5.0
"""Below the ground, of the centre of gravity."""
NEAR_M: Final = 30.0
"""Above the ground; what happens higher up is no blow on it."""
MOVING_M_S: Final = 2.0
"""What stands doesn't crash: contact springs that ring at a slow physics rate are no blow either."""

_WRECK_HEIGHT_M: Final = 1.0  # highest place of the centre of gravity of what lies on the ground


def hits_ground(truth: Array, ground_alt_m: float, *, touched: bool) -> bool:
    """Whether a motion that can't go on ended at the ground: otherwise the model is at fault.

    Args:
        truth: the last that was sound.
        ground_alt_m: above mean sea level.
        touched: the ground was touched a moment ago; it may have been thrown up since.
    """
    near = touched or truth[t.ALT_M] - ground_alt_m < NEAR_M
    return bool(near and speed_m_s(truth) > MOVING_M_S)


def speed_m_s(truth: Array) -> float:
    """Over ground, and of climb and fall."""
    return float(np.linalg.norm(truth[t.VEL_NED_M_S]))


class Touches:
    """How a vehicle met the ground when it came from the air.

    After the impact the velocity is that of a bounce, or of a wreck that JSBSim moves unpredictably. The load
    on the gear and the report of a crash therefore use the velocity just before the impact. Of several
    bounces, the hardest one counts.

    Args:
        within_steps: touches no farther apart are bounces of one landing.
    """

    def __init__(self, within_steps: int) -> None:
        self._within_steps = within_steps
        self._aloft_ned_m_s = np.zeros(3)
        self._touch_ned_m_s = np.zeros(3)
        self._on_ground = True
        self._step = -within_steps

    def observe(self, step: int, touching: bool, truth: Array) -> float:
        """Check a vehicle; returns the sink rate (m/s) of a new touch, else 0.

        Args:
            step: of the physics; it rises from call to call.
            touching: the ground carries something of it.
            truth: of the step before.
        """
        new = touching and not self._on_ground
        self._on_ground = touching
        if not touching:
            self._aloft_ned_m_s[:] = truth[t.VEL_NED_M_S]
            return 0.0
        if new and (not self.recent(step) or self._aloft_ned_m_s[2] > self._touch_ned_m_s[2]):
            self._touch_ned_m_s[:] = self._aloft_ned_m_s
        self._step = step
        return float(self._aloft_ned_m_s[2]) if new else 0.0

    def recent(self, step: int) -> bool:
        """Whether the ground was touched a moment before."""
        return step - self._step < self._within_steps

    def words(self, step: int, truth: Array) -> str:
        """The text that describes a crash at this step."""
        velocity = self._touch_ned_m_s if self.recent(step) else truth[t.VEL_NED_M_S]
        speed, sink = float(np.linalg.norm(velocity)), max(0.0, float(velocity[2]))
        return f"hit the ground at {speed:.0f} m/s, sinking at {sink:.1f} m/s"


def lay_down(truth: Array, ground_alt_m: float) -> None:
    """Make of a vehicle in motion a wreck at rest, in place; its heading and attitude stay.

    Args:
        truth: the last that was sound.
        ground_alt_m: above mean sea level.
    """
    height_m = min(max(truth[t.ALT_M] - ground_alt_m, 0.0), _WRECK_HEIGHT_M)
    fallen_m = truth[t.ALT_M] - (ground_alt_m + height_m)
    scale_height_m = GAS_CONSTANT_J_KG_K * truth[t.TEMPERATURE_K] / GRAVITY_M_S2
    truth[t.PRESSURE_PA] *= math.exp(fallen_m / scale_height_m)
    truth[t.ALT_M] = ground_alt_m + height_m
    truth[t.HEIGHT_ABOVE_GROUND_M] = height_m
    truth[t.VEL_NED_M_S] = 0.0
    truth[t.RATES_FRD_RAD_S] = 0.0
    force_frd = np.empty(3)
    rotate_inverse(
        np.ascontiguousarray(truth[t.Q_NED_FROM_FRD]), np.array([0.0, 0.0, -GRAVITY_M_S2]), force_frd
    )
    truth[t.SPECIFIC_FORCE_FRD_M_S2] = force_frd
    for still in (
        t.AIRSPEED_TRUE_M_S,
        t.BATTERY_CURRENT_A,
        t.ROTOR_RAD_S,
        t.ANGLE_OF_ATTACK_RAD,
        t.SIDESLIP_RAD,
        t.DYNAMIC_PRESSURE_PA,
    ):
        truth[still] = 0.0
    truth[t.ON_GROUND] = 1.0
