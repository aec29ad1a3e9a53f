"""Airspeed and its rate for the fixed-wing control laws: PX4 TECS's steady-state Kalman filter.

Model: a constant rate of change; measured are the equivalent airspeed and, along the flow (PX4: along the
body's x axis), the acceleration. Of a gust the accelerometer knows nothing, so the filter follows gusts at
its own pace.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing.layout import FixedWingState
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from autopilot_bridge.navigation.layout import NavigationState
from flightsim.foundation.kernels import kernel
from flightsim.foundation.rotations import body_axis

Array = NDArray[np.float64]

_DIRECTION_SPEED_M_S: Final = 5.0  # below it the direction of the flow isn't taken from the velocity
_RATIO_SPEED_M_S: Final = 3.0  # below it true over equivalent airspeed isn't taken from the two


@kernel
def acceleration_along_flow(nav: NavigationState) -> float:
    """Acceleration along the velocity through the air, m/s^2; without wind or velocity, along body x.

    The body's x axis is off the flow by the angle of attack, and in a turn or a pull-up it then sees a part
    of the acceleration across the flow.
    """
    north, east = nav.vel_ned_m_s[0] - nav.wind_ned_m_s[0], nav.vel_ned_m_s[1] - nav.wind_ned_m_s[1]
    down = nav.vel_ned_m_s[2]
    if math.isfinite(nav.wind_ned_m_s[2]):
        down -= nav.wind_ned_m_s[2]
    speed = math.sqrt(north * north + east * east + down * down)
    if not speed > _DIRECTION_SPEED_M_S:  # true for NaN
        north, east, down = body_axis(
            nav.q_ned_from_frd[0], nav.q_ned_from_frd[1], nav.q_ned_from_frd[2], nav.q_ned_from_frd[3], 0
        )
        speed = 1.0
    return (north * nav.acc_ned_m_s2[0] + east * nav.acc_ned_m_s2[1] + down * nav.acc_ned_m_s2[2]) / speed


@kernel
def update_air(nav: NavigationState, p: FixedWingParameters, s: FixedWingState, dt: float) -> None:
    """One step: writes EAS, EAS_RATE, EAS_TO_TAS and EAS_KNOWN."""
    measured = nav.airspeed_m_s
    known = math.isfinite(measured)
    if s.eas_to_tas <= 0.0:
        s.eas_to_tas = 1.0
    if known and measured > _RATIO_SPEED_M_S and math.isfinite(nav.airspeed_true_m_s):
        s.eas_to_tas = min(3.0, max(0.8, nav.airspeed_true_m_s / measured))
    if not known:
        s.eas = p.airspeed_trim_m_s
        s.eas_rate = 0.0
        s.eas_known = 0.0
        return
    measured = max(0.0, measured)
    if s.eas_known == 0.0:
        s.eas = measured
        s.eas_rate = 0.0
        s.eas_known = 1.0
        return
    forward = acceleration_along_flow(nav) / s.eas_to_tas
    if not math.isfinite(forward):
        forward = s.eas_rate
    # gains of the continuous filter, from its Riccati equation
    speed_information = 1.0 / p.airspeed_noise_m_s
    process = p.airspeed_rate_process_noise_m_s2
    rate_information = process / (p.airspeed_rate_noise_m_s2 * p.airspeed_rate_noise_m_s2)
    total = speed_information + rate_information
    root = math.sqrt(process * (2.0 * speed_information + rate_information))
    speed = s.eas + dt * s.eas_rate
    speed_error = measured - speed
    rate_error = forward - s.eas_rate
    s.eas = max(
        0.0, speed + dt * (speed_information * root * speed_error + rate_information * rate_error) / total
    )
    s.eas_rate += (
        dt
        * (
            speed_information * speed_information * process * speed_error
            + rate_information * root * rate_error
        )
        / total
    )
