"""Limits that keep an aircraft flyable with any parameter values, relative to the values of its envelope.

The gains of multicopters differ little, so fixed limits are enough. The gains of aircraft differ by orders of
magnitude, so they are limited to multiples of this aircraft's values.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any, Final

from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from autopilot_bridge.firmware.mapping import FieldMap, clamp
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters
from flightsim.flight_envelope import FlightEnvelope
from flightsim.foundation.atmosphere import GRAVITY_M_S2

_STALL_MARGIN: Final = 1.05  # least airspeed over the stall speed
_LEAST_ROOM: Final = 1.05  # highest over least airspeed

_SPREADS: Final[Mapping[str, tuple[float, float]]] = {
    "heading_p_1_s": (0.2, 2.5),
    "roll_slew_rad_s": (0.3, 10.0),
    "climb_max_m_s": (0.3, 2.0),
    "sink_min_m_s": (0.3, 2.0),
    "sink_max_m_s": (0.3, 3.0),
    "climb_rate_target_m_s": (0.1, 2.0),
    "sink_rate_target_m_s": (0.1, 3.0),
    "height_time_constant_s": (0.5, 5.0),
    "airspeed_time_constant_s": (0.5, 5.0),
    "pitch_damping": (0.0, 3.0),
    "pitch_integral_1_s": (0.0, 4.0),
    "throttle_damping": (0.0, 3.0),
    "throttle_integral_1_s": (0.0, 4.0),
    "turn_energy_rate_m2_s3": (0.0, 4.0),
    "roll_time_constant_s": (0.6, 4.0),
    "pitch_time_constant_s": (0.6, 4.0),
    "roll_rate_max_rad_s": (0.3, 3.0),
    "pitch_rate_max_up_rad_s": (0.3, 3.0),
    "pitch_rate_max_down_rad_s": (0.3, 3.0),
    "rate_roll_p": (0.1, 3.0),
    "rate_roll_i": (0.0, 4.0),
    "rate_roll_ff": (0.3, 2.5),
    "rate_pitch_p": (0.2, 3.0),
    "rate_pitch_i": (0.1, 4.0),
    "rate_pitch_ff": (0.0, 2.5),
    "rate_yaw_p": (0.0, 3.0),
    "rate_yaw_i": (0.0, 4.0),
    "sideslip_gain_rad_s_per_m_s2": (0.0, 3.0),
    "wheel_p": (0.2, 4.0),
    "wheel_i": (0.0, 4.0),
}
"""Least and greatest multiple of the value that fits the aircraft."""


def tuned_controller(envelope: FlightEnvelope | None) -> FixedWingParameters:
    """The control laws' parameters that fit an aircraft; without an envelope those of a small one."""
    return FixedWingParameters() if envelope is None else FixedWingParameters.for_envelope(envelope)


def tuned_flight(envelope: FlightEnvelope | None) -> FixedWingFlightParameters:
    """The flight tasks' parameters that fit an aircraft; without an envelope those of a small one."""
    if envelope is None:
        return FixedWingFlightParameters()
    return FixedWingFlightParameters.for_envelope(envelope)


def within_spread(values: dict[str, Any], tuned: FixedWingParameters) -> dict[str, Any]:
    """Fields of the control laws held within multiples of the tuned ones."""
    limited = dict(values)
    for name, (least, greatest) in _SPREADS.items():
        reference = getattr(tuned, name)
        if name in limited and reference > 0.0:
            limited[name] = clamp(limited[name], least * reference, greatest * reference)
    return limited


def airspeeds(
    least_m_s: float, trim_m_s: float, greatest_m_s: float, tuned: FixedWingParameters
) -> dict[str, float]:
    """`airspeed_min_m_s`, `airspeed_trim_m_s` and `airspeed_max_m_s`: in order, above the aircraft's stall
    and within what its power can keep up.
    """
    highest = 1.5 * tuned.airspeed_max_m_s
    floor = max(_STALL_MARGIN * tuned.airspeed_stall_m_s, 0.8 * tuned.airspeed_min_m_s)
    least = clamp(least_m_s, floor, max(floor, tuned.airspeed_max_m_s / _LEAST_ROOM))
    greatest = clamp(greatest_m_s, least * _LEAST_ROOM, max(highest, least * _LEAST_ROOM))
    trim = clamp(trim_m_s, least, min(greatest, max(least, tuned.airspeed_max_m_s)))
    return {"airspeed_min_m_s": least, "airspeed_trim_m_s": trim, "airspeed_max_m_s": greatest}


def controller_values(values: dict[str, Any], tuned: FixedWingParameters) -> dict[str, Any]:
    """Mapped fields of the control laws, made to fit each other and the aircraft."""
    v = {**_values_of(tuned), **within_spread(values, tuned)}
    v.update(airspeeds(v["airspeed_min_m_s"], v["airspeed_trim_m_s"], v["airspeed_max_m_s"], tuned))
    v["airspeed_stall_m_s"] = min(v["airspeed_stall_m_s"], v["airspeed_min_m_s"] / _STALL_MARGIN)
    v["scaling_airspeed_m_s"] = clamp(
        v["scaling_airspeed_m_s"], 0.5 * tuned.scaling_airspeed_m_s, 2.0 * tuned.scaling_airspeed_m_s
    )
    # throttle that flies level at least, and an idle below it
    v["throttle_max"] = max(v["throttle_max"], min(1.0, tuned.trim_throttle + 0.2))
    v["throttle_min"] = min(v["throttle_min"], 0.5 * tuned.trim_throttle)
    v["load_factor_max"] = max(tuned.load_factor_max, 1.0 / math.cos(v["roll_limit_rad"]))
    return v


def flight_values(
    values: dict[str, Any], tuned: FixedWingFlightParameters, controller: FixedWingParameters
) -> dict[str, Any]:
    """Mapped fields of the flight tasks, made to fit each other and the aircraft."""
    v = {**_values_of(tuned), **values}
    v.update(airspeeds(v["airspeed_min_m_s"], v["airspeed_trim_m_s"], v["airspeed_max_m_s"], controller))
    low, high = v["airspeed_min_m_s"], v["airspeed_max_m_s"]
    for name in ("takeoff_airspeed_m_s", "landing_airspeed_m_s"):
        v[name] = clamp(v[name], low, high)
    v["rotation_airspeed_m_s"] = clamp(
        v["rotation_airspeed_m_s"], 0.9 * controller.airspeed_stall_m_s, v["takeoff_airspeed_m_s"]
    )
    climb = max(tuned.climb_max_m_s, 0.3)
    v["climb_rate_m_s"] = min(v["climb_rate_m_s"], climb)
    v["sink_rate_m_s"] = min(v["sink_rate_m_s"], tuned.sink_max_m_s)
    v["landing_angle_max_rad"] = max(tuned.landing_angle_max_rad, v["landing_angle_rad"])
    v["flare_pitch_max_rad"] = max(v["flare_pitch_max_rad"], v["flare_pitch_min_rad"] + math.radians(1.0))
    for name in ("loiter_radius_m", "return_loiter_radius_m"):
        v[name] = flyable_radius(v[name], v)
    return v


def flyable_radius(radius_m: float, values: Mapping[str, Any]) -> float:
    """A circle's radius with its sign, no smaller than the bank limit allows at the trim airspeed."""
    least = values["airspeed_trim_m_s"] ** 2 / (GRAVITY_M_S2 * math.tan(values["bank_max_rad"]))
    return math.copysign(max(abs(radius_m), least), radius_m)


def _values_of(parameters: FixedWingParameters | FixedWingFlightParameters) -> dict[str, Any]:
    return {field.name: getattr(parameters, field.name) for field in fields(parameters)}


def only_in(table: Iterable[FieldMap], other: Iterable[FieldMap]) -> tuple[FieldMap, ...]:
    """The entries of `table` whose parameter `other` does not set too."""
    names = {entry.name for entry in other}
    return tuple(entry for entry in table if entry.name not in names)
