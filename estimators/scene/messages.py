"""The scene that the messages of a run give: vehicles, truth, plans, fences, modes, texts. From a link or a
log.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.wire_units import (
    UNKNOWN_UINT16,
    degrees,
    e7,
    home,
    home_of,
    m_s,
    metres,
    mm,
    place,
    place_of,
)
from estimators import wire
from estimators.fleet import GROUND_SYSTEM
from estimators.logs.vehicles import mode_name
from estimators.messages import Message, on
from estimators.references import TARGET_SYSTEM
from estimators.scene.plans import ReceivedPlans
from estimators.scene.timeline import Timeline
from estimators.scene_items import Entry, Origin, Placed, PointSet, Pose, Role, Text, Value
from estimators.status_texts import StatusTextAssembler
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.vectors import Quaternion, Vector, between, conjugate, euler_of, from_euler, product

__all__ = ["ORIGIN", "MessageScene"]

ORIGIN: Final = "origin"
"""Path of the scene's origin."""

PERIOD_US: Final = 100_000
"""Of the samples of positions, attitudes and truth that are shown."""
_SLOW_PERIOD_US: Final = 500_000
_MOST_STEP_US: Final = 500_000  # of the truth that errors are taken from
_WITHOUT_HOME_US: Final = 10_000_000
_FIX_3D: Final = 3
_UNKNOWN_SATELLITES: Final = 255
_POSITION_IGNORED: Final = (
    dialect.POSITION_TARGET_TYPEMASK_X_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_Y_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_Z_IGNORE
)


class _True(NamedTuple):
    """A true state."""

    time_us: int
    pos_ned_m: Vector
    q_ned_from_frd: Quaternion


@dataclass(slots=True)
class _Vehicle:
    """The newest of one vehicle."""

    first_place_us: int | None = None
    q_ned_from_frd: Quaternion | None = None
    place_ned_m: Vector | None = None
    truth: _True | None = None
    truth_before: _True | None = None
    reported_place: tuple[int, Vector] | None = None
    reported_attitude: tuple[int, Quaternion] | None = None
    accuracy_m: float = math.nan
    mode: str = ""
    armed: bool | None = None
    has_fix: bool | None = None
    texts: StatusTextAssembler = field(default_factory=StatusTextAssembler)

    def truth_at(self, time_us: int) -> _True | None:
        """The true state at a time between the newest two; None: not known then."""
        before, newest = self.truth_before, self.truth
        if before is None or newest is None:
            return None
        step_us = newest.time_us - before.time_us
        if not 0 < step_us <= _MOST_STEP_US or not before.time_us <= time_us <= newest.time_us:
            return None
        share = (time_us - before.time_us) / step_us
        place = tuple(a + share * (b - a) for a, b in zip(before.pos_ned_m, newest.pos_ned_m, strict=True))
        q = between(before.q_ned_from_frd, newest.q_ned_from_frd, share)
        return _True(time_us, (place[0], place[1], place[2]), q)


class MessageScene:
    """Makes entries of messages, one after the other.

    Positions and series have at most 10 samples a second. Places are from the home that a vehicle reports
    first; before it, or 10 s of positions without one, nothing has a place.

    Attributes:
        NAMES: names of the messages that it uses.
        SAMPLED: those of which it uses the first in each period, with the period, us.
        timeline: converts vehicle times to the timeline of the run.
        origin: of the positions; None: not known yet.
    """

    SAMPLED: Final[Mapping[str, int]] = MappingProxyType(
        {
            **dict.fromkeys(("ATTITUDE", "GLOBAL_POSITION_INT"), PERIOD_US),
            **dict.fromkeys(("HIL_STATE_QUATERNION", "SIM_STATE", "SIMSTATE"), PERIOD_US),
            **dict.fromkeys(("ATTITUDE_QUATERNION", "VFR_HUD", "ESTIMATOR_STATUS"), _SLOW_PERIOD_US),
            **dict.fromkeys(("SYS_STATUS", "POSITION_TARGET_GLOBAL_INT"), _SLOW_PERIOD_US),
        }
    )
    NAMES: Final = SAMPLED.keys() | {
        *("HEARTBEAT", "STATUSTEXT", "SYSTEM_TIME", "HOME_POSITION", "GPS_RAW_INT"),
        *("MISSION_COUNT", "MISSION_ITEM_INT"),
    }

    def __init__(self) -> None:
        self.timeline = Timeline()
        self.origin: GeodeticPosition | None = None
        self._frame: LocalFrame | None = None
        self._vehicles: dict[int, _Vehicle] = {}
        self._plans = ReceivedPlans()
        self._slots: dict[tuple[str, int, int], int] = {}
        self._entries: list[Entry] = []
        self._handlers: dict[str, Callable[[int, Message], None]] = {
            **on(wire.HOME_POSITION, self._home),
            **on(wire.MISSION_COUNT, self._count),
            **on(wire.MISSION_ITEM_INT, self._item),
            **on(wire.HIL_STATE_QUATERNION, self._hil_state),
            **on(wire.SIM_STATE, self._sim_state),
            **on(wire.SIMSTATE, self._simstate),
        }
        self._own_handlers: dict[str, Callable[[int, Message], None]] = {
            **on(wire.HEARTBEAT, self._heartbeat),
            **on(wire.STATUSTEXT, self._status_text),
            **on(wire.ATTITUDE, self._attitude),
            **on(wire.ATTITUDE_QUATERNION, self._attitude_quaternion),
            **on(wire.GLOBAL_POSITION_INT, self._position),
            **on(wire.GPS_RAW_INT, self._gps),
            **on(wire.VFR_HUD, self._air_data),
            **on(wire.ESTIMATOR_STATUS, self._accuracy),
            **on(wire.SYS_STATUS, self._battery),
            **on(wire.POSITION_TARGET_GLOBAL_INT, self._setpoint),
        }

    def take(self, time_us: int, message: Message) -> list[Entry]:
        """The entries of one message, which may be none.

        Args:
            time_us: vehicle time of the message (`estimators.vehicle_time`).
            message: of any system and component; others than `NAMES` are ignored.
        """
        name = message.name
        if name in self.SAMPLED and not self._is_due(time_us, message):
            return []
        time_us = self.timeline.take(time_us, message)
        handler = self._handlers.get(name)
        if handler is None and message.src_component == AUTOPILOT_COMPONENT:
            handler = self._own_handlers.get(name) if message.src_system < GROUND_SYSTEM else None
        if handler is None:
            return []
        handler(time_us, message)
        made, self._entries = self._entries, []
        return made

    def place_of_vehicle(self, system_id: int) -> Vector | None:
        """Where a vehicle is: truly if the log has its truth, else by its report; None: not known."""
        vehicle = self._vehicles.get(system_id)
        if vehicle is None:
            return None
        return vehicle.truth.pos_ned_m if vehicle.truth is not None else vehicle.place_ned_m

    def true_columns(
        self, system_id: int, time_us: int, origin: GeodeticPosition | None
    ) -> Mapping[str, float]:
        """The true state of a vehicle by the names of estimates' columns, if it is known at that time.

        Args:
            time_us: on the timeline.
            origin: of `north_m` and `east_m`; None: that of the scene.
        """
        vehicle = self._vehicles.get(system_id)
        truth = None if vehicle is None else vehicle.truth_at(time_us)
        if truth is None:
            return {}
        north_m, east_m, _ = truth.pos_ned_m
        shift = (0.0, 0.0, 0.0) if origin is None else self._ned(origin)
        angles = dict(zip(("roll_rad", "pitch_rad", "yaw_rad"), euler_of(truth.q_ned_from_frd), strict=True))
        if shift is None:
            return angles
        return {**angles, "north_m": north_m - shift[0], "east_m": east_m - shift[1]}

    def shift_of(self, origin: GeodeticPosition) -> Vector | None:
        """Where another origin is in the scene; None: the scene has none yet."""
        return self._ned(origin)

    # what all handlers need

    def _vehicle(self, message: Message) -> _Vehicle:
        return self._vehicles.setdefault(message.src_system, _Vehicle())

    def _add(self, message: Message, name: str, time_us: int, item: Placed) -> None:
        self._entries.append(Entry(f"vehicles/{message.src_system}/{name}", time_us, item))

    def _is_due(self, time_us: int, message: Message) -> bool:
        """Whether a sample is shown: the first of this message and sender in each period."""
        name = message.name
        key, slot = (name, message.src_system, message.src_component), time_us // self.SAMPLED[name]
        if self._slots.get(key) == slot:
            return False
        self._slots[key] = slot
        return True

    def _ned(self, found: GeodeticPosition | None) -> Vector | None:
        if found is None or self._frame is None:
            return None
        return self._frame.ned_from_geodetic(found.lat_deg, found.lon_deg, found.alt_m)

    # places

    def _home(self, time_us: int, message: wire.HOME_POSITION) -> None:
        if message.src_component == AUTOPILOT_COMPONENT:
            self._begin(time_us, home_of(message))

    def _begin(self, time_us: int, origin: GeodeticPosition | None) -> None:
        if origin is None or self.origin is not None:
            return
        self.origin, self._frame = origin, LocalFrame(origin)
        found = Origin(lat_deg=origin.lat_deg, lon_deg=origin.lon_deg, alt_m=origin.alt_m)
        self._entries.append(Entry(ORIGIN, time_us, found))

    def _attitude(self, time_us: int, message: wire.ATTITUDE) -> None:
        if math.isfinite(message.roll + message.pitch + message.yaw):
            vehicle = self._vehicle(message)
            vehicle.q_ned_from_frd = from_euler(message.roll, message.pitch, message.yaw)
            vehicle.reported_attitude = time_us, vehicle.q_ned_from_frd

    def _attitude_quaternion(self, time_us: int, message: wire.ATTITUDE_QUATERNION) -> None:
        q = unit_quaternion((message.q1, message.q2, message.q3, message.q4))
        if q is not None:
            vehicle = self._vehicle(message)
            vehicle.q_ned_from_frd = q

    def _position(self, time_us: int, message: wire.GLOBAL_POSITION_INT) -> None:
        if message.lat == 0 and message.lon == 0:
            return
        found = place_of(message)
        if found is None:
            return
        vehicle = self._vehicle(message)
        if self.origin is None:
            if vehicle.first_place_us is None:
                vehicle.first_place_us = time_us
            if time_us - vehicle.first_place_us > _WITHOUT_HOME_US:
                self._begin(time_us, home(message.lat, message.lon, message.alt - message.relative_alt))
        place_ned_m = vehicle.place_ned_m = self._ned(found)
        if place_ned_m is None:
            return
        self._add(
            message, "estimate", time_us, Pose(pos_ned_m=place_ned_m, q_ned_from_frd=vehicle.q_ned_from_frd)
        )
        self._add(message, "height", time_us, Value(value=-place_ned_m[2], unit="m"))
        speed_m_s = math.hypot(m_s(message.vx), m_s(message.vy))
        self._add(message, "speed/ground", time_us, Value(value=speed_m_s, unit="m/s"))
        vehicle.reported_place = time_us, place_ned_m

    # truth

    def _hil_state(self, time_us: int, message: wire.HIL_STATE_QUATERNION) -> None:
        q = unit_quaternion(message.attitude_quaternion)
        if q is not None and message.time_usec:
            self._truth(time_us, message, place_of(message), q)

    def _sim_state(self, time_us: int, message: wire.SIM_STATE) -> None:
        whole = message.lat_int or message.lon_int
        lat_deg = degrees(message.lat_int) if whole else message.lat
        lon_deg = degrees(message.lon_int) if whole else message.lon
        if math.isfinite(message.roll + message.pitch + message.yaw + lat_deg + lon_deg + message.alt):
            found = place(e7(lat_deg), e7(lon_deg), mm(message.alt))
            self._truth(time_us, message, found, from_euler(message.roll, message.pitch, message.yaw))

    def _simstate(self, time_us: int, message: wire.SIMSTATE) -> None:
        """SIMSTATE has no height: the reported one is taken."""
        vehicle = self._vehicle(message)
        if vehicle.place_ned_m is None or self.origin is None:
            return
        if math.isfinite(message.roll + message.pitch + message.yaw):
            alt_mm = mm(self.origin.alt_m - vehicle.place_ned_m[2])
            q = from_euler(message.roll, message.pitch, message.yaw)
            self._truth(time_us, message, home(message.lat, message.lng, alt_mm), q)

    def _truth(self, time_us: int, message: Message, found: GeodeticPosition | None, q: Quaternion) -> None:
        place_ned_m = self._ned(found)
        if place_ned_m is None:
            return
        if message.src_system == TARGET_SYSTEM:
            number = message.src_component
            pose = Pose(pos_ned_m=place_ned_m, role=Role.TRUTH, label=f"target {number}, true")
            self._entries.append(Entry(f"targets/{number}/truth", time_us, pose))
        elif message.src_system < GROUND_SYSTEM:
            vehicle = self._vehicle(message)
            vehicle.truth_before, vehicle.truth = vehicle.truth, _True(time_us, place_ned_m, q)
            self._errors(message, vehicle)
            self._add(
                message, "truth", time_us, Pose(pos_ned_m=place_ned_m, q_ned_from_frd=q, role=Role.TRUTH)
            )

    def _errors(self, message: Message, vehicle: _Vehicle) -> None:
        """Errors of what was reported before the newest truth, at its own time."""
        if vehicle.reported_place is not None:
            at_us, place_ned_m = vehicle.reported_place
            truth = vehicle.truth_at(at_us)
            if truth is not None:
                vehicle.reported_place = None
                error_m = math.dist(place_ned_m[:2], truth.pos_ned_m[:2])
                found = Value(value=error_m, unit="m", sigma=vehicle.accuracy_m, error=True)
                self._add(message, "error/position", at_us, found)
        if vehicle.reported_attitude is not None:
            at_us, q = vehicle.reported_attitude
            truth = vehicle.truth_at(at_us)
            if truth is not None:
                vehicle.reported_attitude = None
                difference = product(conjugate(truth.q_ned_from_frd), q)
                angle_deg = math.degrees(2.0 * math.acos(min(1.0, abs(difference[0]))))
                self._add(message, "error/attitude", at_us, Value(value=angle_deg, unit="deg", error=True))

    # state

    def _heartbeat(self, time_us: int, message: wire.HEARTBEAT) -> None:
        vehicle = self._vehicle(message)
        mode = mode_name(message.autopilot, message.type, message.base_mode, message.custom_mode)
        if mode != vehicle.mode:
            vehicle.mode = mode
            self._add(message, "mode", time_us, Text(text=f"mode {mode}", state=mode))
        armed = bool(message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)
        if armed is not vehicle.armed:
            state = "armed" if armed else "disarmed"
            self._add(message, "armed", time_us, Text(text=state, state=state))
            vehicle.armed = armed

    def _status_text(self, time_us: int, message: wire.STATUSTEXT) -> None:
        text = self._vehicle(message).texts.add(message)
        if text is not None:
            warning = text.severity <= dialect.MAV_SEVERITY_WARNING
            self._add(message, "texts", time_us, Text(text=text.text, warning=warning))

    def _gps(self, time_us: int, message: wire.GPS_RAW_INT) -> None:
        vehicle = self._vehicle(message)
        has_fix = message.fix_type >= _FIX_3D
        if has_fix is not vehicle.has_fix:
            if vehicle.has_fix is not None or has_fix:
                state = "3D fix" if has_fix else "no fix"
                text = Text(text=f"GPS: {state}", state=state, warning=not has_fix)
                self._add(message, "gps/fix", time_us, text)
            vehicle.has_fix = has_fix
        if message.satellites_visible != _UNKNOWN_SATELLITES:
            satellites = Value(value=float(message.satellites_visible))
            self._add(message, "gps/satellites", time_us, satellites)

    def _accuracy(self, _time_us: int, message: wire.ESTIMATOR_STATUS) -> None:
        self._vehicle(message).accuracy_m = message.pos_horiz_accuracy

    def _air_data(self, time_us: int, message: wire.VFR_HUD) -> None:
        if message.airspeed > 0.0:
            self._add(message, "speed/air", time_us, Value(value=message.airspeed, unit="m/s"))

    def _battery(self, time_us: int, message: wire.SYS_STATUS) -> None:
        if message.voltage_battery not in (0, UNKNOWN_UINT16):
            self._add(message, "battery", time_us, Value(value=metres(message.voltage_battery), unit="V"))

    # commands

    def _setpoint(self, time_us: int, message: wire.POSITION_TARGET_GLOBAL_INT) -> None:
        if message.type_mask & _POSITION_IGNORED or not math.isfinite(message.alt):
            return
        place_ned_m = self._ned(home(message.lat_int, message.lon_int, mm(message.alt)))
        if place_ned_m is not None:
            points = PointSet(points_ned_m=np.array([place_ned_m]), role=Role.COMMANDED)
            self._add(message, "setpoint", time_us, points)

    def _count(self, _time_us: int, message: wire.MISSION_COUNT) -> None:
        self._plans.count(_of_vehicle(message), message)

    def _item(self, time_us: int, message: wire.MISSION_ITEM_INT) -> None:
        if self._frame is not None:
            self._entries += self._plans.take(_of_vehicle(message), time_us, message, self._frame)


def _of_vehicle(message: wire.MISSION_COUNT | wire.MISSION_ITEM_INT) -> int:
    """The vehicle whose plan a message is about: it goes to it, or comes from it."""
    return message.target_system if message.src_system >= GROUND_SYSTEM else message.src_system


def unit_quaternion(q: Iterable[float]) -> Quaternion | None:
    """A quaternion of length 1; None: it is none."""
    w, x, y, z = q
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    return (w / norm, x / norm, y / norm, z / norm) if math.isfinite(norm) and norm > 0.1 else None
