"""The times at which a vehicle was in the air, from its log."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT

if TYPE_CHECKING:
    from estimators.logs import Log

Spans = list[tuple[int, int]]
"""Spans of vehicle time in microseconds, (from, to), `to` exclusive, ascending."""

ALWAYS: Final[tuple[int, int]] = (-(1 << 62), 1 << 62)

_ARMED: Final = 128  # MAV_MODE_FLAG_SAFETY_ARMED
_IN_AIR: Final = (2, 3, 4)  # MAV_LANDED_STATE_IN_AIR, _TAKEOFF, _LANDING
_LEAST_HEIGHT_MM: Final = 2000
_LEAST_AIRSPEED_M_S: Final = 8.0
_LEAST_THROTTLE_PERCENT: Final = 20
_CLEAR_HEIGHT_MM: Final = 10_000
_CLEAR_SPEED_M_S: Final = 5.0
_GROUND_TYPES: Final = (5, 10, 11, 12)
"""MAV_TYPE_ANTENNA_TRACKER, _GROUND_ROVER, _SURFACE_BOAT, _SUBMARINE."""
_HOLD_US: Final = 2_500_000
"""Longest time for which a reported state holds without another report; one lost message of a 1 Hz stream
does not end it.
"""

Samples = tuple[NDArray[np.int64], NDArray[Any]]
"""Times and values."""
_Judge = Callable[[NDArray[Any]], NDArray[np.bool_]]


def airborne_spans(log: "Log", system_id: int, boot: int | None = None) -> tuple[Spans, str]:
    """The times at which a vehicle was in the air, by the first of these that shows any time in the air:

    * EXTENDED_SYS_STATE. Some autopilots report a take-off run as flight. Therefore the time before the
      vehicle is 2 m above its first height and the time after it was last 2 m above its last height are left
      out.
    * Armed and more than 2 m above home.
    * Armed and faster than 8 m/s through the air.
    * Armed with the throttle above 20 % (a hover below 2 m, or indoors, where no height is known).
    * Above 10 m and faster than 5 m/s, though no message says that it was armed.

    A vehicle that can't fly (rover, boat, submarine, antenna tracker) counts while it is armed.

    Returns:
        Spans, and the name of their source. When there is evidence but none of it shows the vehicle in the
        air: no spans, and the reason. When the log has no such evidence: all time, and "all of the log".
    """

    def column(name: str, field: str) -> Samples | None:
        # Requested by name only if the log has it: the log's dialect may not define this message.
        if not any(key.name == name and key.system_id == system_id for key in log.keys):
            return None
        tables = log.tables(name, system_id=system_id, component_id=AUTOPILOT_COMPONENT, boot=boot)
        return (tables[0].time_us, tables[0][field]) if tables else None

    def spans_of(samples: Samples | None, judge: _Judge) -> Spans:
        return [] if samples is None else _spans(samples[0], judge(samples[1]))

    heights = column("GLOBAL_POSITION_INT", "relative_alt")
    landed = column("EXTENDED_SYS_STATE", "landed_state")
    reported = spans_of(landed, lambda state: np.isin(state, _IN_AIR))
    types, modes = column("HEARTBEAT", "type"), column("HEARTBEAT", "base_mode")
    armed = spans_of(modes, lambda mode: (mode & _ARMED) != 0)
    if types is not None and np.isin(types[1], _GROUND_TYPES).any():
        if armed:
            return armed, "armed"
        return [ALWAYS], "all of the log (a vehicle that does not fly, never armed)"
    if reported:
        if heights is not None:
            reported = [_off_the_ground(span, *heights) for span in reported]
        return reported, "EXTENDED_SYS_STATE"
    if landed is None and modes is None:
        return [ALWAYS], "all of the log"
    hud = {field: column("VFR_HUD", field) for field in ("airspeed", "groundspeed", "throttle")}
    high = spans_of(heights, lambda height: height > _LEAST_HEIGHT_MM)
    if heights is not None and np.ptp(heights[1].astype(np.int64)) < _LEAST_HEIGHT_MM // 2:
        high, heights = [], None  # a height that never changes is not used
    fast = spans_of(hud["airspeed"], lambda speed: speed > _LEAST_AIRSPEED_M_S)
    driven = spans_of(hud["throttle"], lambda percent: percent > _LEAST_THROTTLE_PERCENT)
    for spans, source in (
        (_both(armed, high), "armed, above 2 m"),
        (_both(armed, fast), "armed, faster than 8 m/s"),
        (_both(armed, driven), "armed, throttle above 20 %"),
    ):
        if spans:
            return spans, source
    if not armed:
        clearly_high = spans_of(heights, lambda height: height > _CLEAR_HEIGHT_MM)
        moving = spans_of(hud["groundspeed"], lambda speed: speed > _CLEAR_SPEED_M_S)
        if both := _both(clearly_high, moving):
            return both, "above 10 m, faster than 5 m/s; never armed by its messages"
        return [], "never armed"
    if landed is None and heights is None and all(samples is None for samples in hud.values()):
        return armed, "armed"
    return [], "armed, but never above 2 m, faster than 8 m/s, or with the throttle above 20 %"


def within(spans: Spans, time_us: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Mask of the times that are in one of the spans."""
    inside = np.zeros(len(time_us), dtype=np.bool_)
    for start_us, end_us in spans:
        inside |= (time_us >= start_us) & (time_us < end_us)
    return inside


def duration_s(spans: Spans, time_us: NDArray[np.int64]) -> float:
    """Time in the spans, between the first and the last of the given times."""
    if not len(time_us):
        return 0.0
    first_us, last_us = int(time_us.min()), int(time_us.max())
    return 1e-6 * sum(max(0, min(end, last_us) - max(start, first_us)) for start, end in spans)


def _spans(time_us: NDArray[np.int64], state: NDArray[np.bool_]) -> Spans:
    """Spans in which a state holds: from each message that reports it to the next message."""
    order = np.argsort(time_us, kind="stable")
    times, holds = time_us[order], state[order]
    ends = np.minimum(np.append(times[1:], times[-1:] + _HOLD_US), times + _HOLD_US)
    spans: Spans = []
    for start_us, end_us in zip(times[holds].tolist(), ends[holds].tolist(), strict=True):
        if spans and start_us <= spans[-1][1]:
            spans[-1] = (spans[-1][0], end_us)
        else:
            spans.append((start_us, end_us))
    return spans


def _off_the_ground(
    span: tuple[int, int], time_us: NDArray[np.int64], height_mm: NDArray[np.int32]
) -> tuple[int, int]:
    """A span without its time on the ground before and after the flight; the whole span if it never gets
    high.
    """
    inside = (time_us >= span[0]) & (time_us < span[1])
    times, heights = time_us[inside], height_mm[inside].astype(np.int64)
    if not len(times):
        return span
    risen = np.flatnonzero(heights > heights[0] + _LEAST_HEIGHT_MM)
    above = np.flatnonzero(heights > heights[-1] + _LEAST_HEIGHT_MM)
    start_us = int(times[risen[0]]) if len(risen) else span[0]
    # The log may end in the air: then the last height is not a height of the ground.
    landed = len(above) > 0 and heights[-1] <= heights[0] + 2 * _LEAST_HEIGHT_MM
    end_us = int(times[above[-1]]) + 1 if landed else span[1]
    return (start_us, end_us) if start_us < end_us else span


def _both(first: Spans, second: Spans) -> Spans:
    common = [(max(a, c), min(b, d)) for a, b in first for c, d in second]
    return [(start_us, end_us) for start_us, end_us in common if start_us < end_us]
