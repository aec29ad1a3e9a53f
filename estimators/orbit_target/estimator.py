"""The estimator `orbit-target`: a target relative to an aircraft that does not know its own position.

Source: Tolman et al. 2021, sections IV and V; docs/papers.md. Its inputs are attitude, airspeed, pressure,
    gimbal
and camera. The position of GPS is used only to expect the target at a place that is given, until it is
acquired.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean
from typing import ClassVar, Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.wire_units import degrees, home_of, metres, velocity_of
from estimators import wire
from estimators.input_guard import InputGuard
from estimators.interface import Estimator, Need, Outcome
from estimators.messages import Message, is_a, on
from estimators.orbit_target.attitude import ATTITUDE, AttitudeSource, AutopilotAttitude, FilterAttitude
from estimators.orbit_target.parameters import PRESSURES_PA, OrbitTargetParameters
from estimators.orbit_target.tracker import TargetStatus, TargetTracker
from estimators.pressure_height import PressureHeight
from estimators.tracking.line_of_sight import detection, gimbal_attitude
from estimators.vehicle_time import UNIX_TIME_US
from flightsim.foundation.atmosphere import air_density_ratio
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

_GROUND_SAMPLES: Final = 20
_AIR_M_S: Final = 8.0
"""Standard deviation per axis of the velocity of an unknown target against the air: wind and its own
motion.
"""
_STATUSES: Final = tuple(TargetStatus)


@dataclass(frozen=True, slots=True, kw_only=True)
class OrbitTargetEstimate:
    """The target relative to the aircraft, horizontal, NED axes.

    Attributes:
        time_us: vehicle time.
        subject: system id of the aircraft.
        offset_ne_m: offset from the aircraft to the target.
        offset_rate_ne_m_s: rate of the offset.
        drift_ne_m_s: velocity of the target relative to the air.
        covariance_m2: north variance, covariance, east variance of the offset.
        height_m: height of the aircraft over the target's ground.
        status: state of the knowledge about the target; in `row`: 0 expected, 1 seen, 2 lost.
    """

    COLUMNS: ClassVar[tuple[str, ...]] = (
        *("offset_north_m", "offset_east_m", "offset_rate_north_m_s", "offset_rate_east_m_s"),
        *("drift_north_m_s", "drift_east_m_s"),
        *("offset_north_sigma_m", "offset_east_sigma_m", "offset_north_east_correlation"),
        *("over_target_m", "status"),
    )

    time_us: int
    subject: int
    offset_ne_m: tuple[float, float]
    offset_rate_ne_m_s: tuple[float, float]
    drift_ne_m_s: tuple[float, float]
    covariance_m2: tuple[float, float, float]
    height_m: float
    status: TargetStatus

    def row(self) -> tuple[float, ...]:
        """The values in the order of `COLUMNS`."""
        nn, ne, ee = self.covariance_m2
        return (
            *(*self.offset_ne_m, *self.offset_rate_ne_m_s, *self.drift_ne_m_s),
            *(math.sqrt(nn), math.sqrt(ee), ne / math.sqrt(nn * ee)),
            *(self.height_m, float(_STATUSES.index(self.status))),
        )


class OrbitTargetEstimator(Estimator[OrbitTargetParameters]):
    """Follows one target by line of sight.

    `handle` makes an estimate with every attitude of the autopilot. A mission with its own control loop and
    its own air data calls `take` for messages and `tracker.step` in its loop instead.

    Attributes:
        attitude: attitude of the aircraft.
        tracker: the target.
    """

    NAME: ClassVar[str] = "orbit-target"
    PARAMETERS = OrbitTargetParameters

    def __init__(self, parameters: OrbitTargetParameters | None = None) -> None:
        super().__init__(parameters)
        self.attitude: AttitudeSource = (
            FilterAttitude() if self.parameters.attitude == "filter" else AutopilotAttitude()
        )
        self._handlers: dict[str, Callable[[int, Message], Outcome]] = {
            **on(wire.GIMBAL_DEVICE_ATTITUDE_STATUS, self._gimbal),
            **on(wire.LANDING_TARGET, self._detection),
        }
        self._own_handlers: dict[str, Callable[[int, Message], Outcome]] = {
            **on(wire.HEARTBEAT, self._heartbeat),
            **on(wire.VFR_HUD, self._air_data),
            **on(wire.SCALED_PRESSURE, self._pressure),
            **on(wire.HOME_POSITION, self._on_home),
            **on(wire.GLOBAL_POSITION_INT, self._position),
        }
        self._guard = InputGuard()
        self.reset()

    @property
    def needs(self) -> tuple[Need, ...]:
        unplaced = self.parameters.target_north_m is None
        found = [
            _need(ATTITUDE, 5.0, 40.0, "attitude of the aircraft"),
            _need("VFR_HUD", 1.0, 20.0, "airspeed and rate of climb"),
            _need("SCALED_PRESSURE", 1.0, 20.0, "height and air density"),
            _need("GIMBAL_DEVICE_ATTITUDE_STATUS", 5.0, 25.0, "attitude of the camera"),
            _need("LANDING_TARGET", 0.0, 0.0, "detections of the target"),
            _need("HEARTBEAT", 0.0, 0.0, "whether it is armed", self.parameters.ground_pa is not None),
            _need("HOME_POSITION", 0.0, 0.0, "home, the origin of the target's place", unplaced),
            _need("GLOBAL_POSITION_INT", 0.0, 5.0, "position until the target is seen", unplaced),
        ]
        if isinstance(self.attitude, FilterAttitude):
            named = {need.messages for need in found}
            found += [need for need in self.attitude.filter.needs if need.messages not in named]
        return tuple(found)

    def reset(self) -> None:
        """Discard everything except the parameters."""
        p = self.parameters
        self.attitude.reset()
        self._guard.reset()
        unplaced = p.target_north_m is None
        self.tracker = TargetTracker(self.attitude, p, (p.target_sigma_m, _AIR_M_S) if unplaced else None)
        self._height = None if p.ground_pa is None else PressureHeight(p.ground_pa)
        self._ground_pa: list[float] = []
        self._armed: bool | None = None
        self._airspeed_m_s = self._climb_m_s = self._static_pa = math.nan
        self._home: GeodeticPosition | None = None
        self._first_us: int | None = None
        self._place: tuple[float, ...] | None = None  # north, east, their rates
        self._subject = 0
        self._time_us: int | None = None

    def handle(self, time_us: int, message: Message) -> Outcome:
        if not is_a(message, wire.ATTITUDE) or message.src_component != AUTOPILOT_COMPONENT:
            return self.take(time_us, message)
        refused = self._guard.check(time_us, ATTITUDE, (message.roll, message.pitch, message.yaw))
        if refused is Outcome.TIME_JUMP:
            self.reset()
        elif refused is not None:
            return refused
        self._subject = message.src_system
        self.attitude.take(time_us, message)
        if self._height is None or not math.isfinite(self._height.height_m + self._airspeed_m_s):
            return refused or Outcome.WAITING
        self.tracker.height(self._height.height_m - self.parameters.target_ground_m)
        airspeed_m_s = self._airspeed_m_s / math.sqrt(air_density_ratio(self._static_pa))
        self._expect(time_us, airspeed_m_s, message.yaw)
        self.tracker.step(time_us, airspeed_m_s, self._climb_m_s)
        if not self.tracker.target.known:
            return refused or Outcome.WAITING
        self._time_us = time_us
        return refused or Outcome.UPDATED

    def take(self, time_us: int, message: Message) -> Outcome:
        """Process a message without making an estimate."""
        name = message.name
        outcome = self.attitude.take(time_us, message) if name in self.attitude.names else Outcome.IGNORED
        handler = self._handlers.get(name)
        if handler is None and message.src_component == AUTOPILOT_COMPONENT:
            handler = self._own_handlers.get(name)
        return outcome if handler is None else handler(time_us, message)

    def _gimbal(self, _time_us: int, message: wire.GIMBAL_DEVICE_ATTITUDE_STATUS) -> Outcome:
        found = gimbal_attitude(message)
        if found is None:
            return Outcome.IMPLAUSIBLE
        return Outcome.USED if self.tracker.gimbal(found) else Outcome.LATE

    def _detection(self, time_us: int, message: wire.LANDING_TARGET) -> Outcome:
        found = detection(message)
        if found is None:
            return Outcome.IMPLAUSIBLE
        if not 0 < found.time_us < UNIX_TIME_US:  # not a time of the vehicle's clock
            found = replace(found, time_us=time_us)
        self.tracker.detect(found)
        return Outcome.USED

    def _heartbeat(self, _time_us: int, message: wire.HEARTBEAT) -> Outcome:
        self._armed = bool(message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)
        if self._armed and self._height is None and self._ground_pa:
            self._height = PressureHeight(fmean(self._ground_pa))
        return Outcome.USED

    def _air_data(self, _time_us: int, message: wire.VFR_HUD) -> Outcome:
        if not math.isfinite(message.airspeed + message.climb):
            return Outcome.NOT_FINITE
        self._airspeed_m_s, self._climb_m_s = message.airspeed, message.climb
        return Outcome.USED

    def _pressure(self, time_us: int, message: wire.SCALED_PRESSURE) -> Outcome:
        static_pa = 100.0 * message.press_abs
        if not PRESSURES_PA[0] < static_pa < PRESSURES_PA[1]:
            return Outcome.IMPLAUSIBLE
        self._static_pa = static_pa
        if self._height is None:
            if self._armed is not False:
                return Outcome.WAITING
            self._ground_pa = [*self._ground_pa[1 - _GROUND_SAMPLES :], static_pa]
        elif math.isfinite(self._climb_m_s):
            self._height.add(time_us, static_pa, self._climb_m_s)
        return Outcome.USED

    def _on_home(self, _time_us: int, message: wire.HOME_POSITION) -> Outcome:
        home = home_of(message)
        if home is None:
            return Outcome.IMPLAUSIBLE
        self._home = home
        return Outcome.USED

    def _position(self, time_us: int, message: wire.GLOBAL_POSITION_INT) -> Outcome:
        if self._first_us is None:
            self._first_us = time_us
        if self._home is None:
            return Outcome.WAITING
        north_m, east_m, _ = LocalFrame(self._home).ned_from_geodetic(
            degrees(message.lat), degrees(message.lon), metres(message.alt)
        )
        self._place = (north_m, east_m, *velocity_of(message)[:2])
        return Outcome.USED

    def _expect(self, time_us: int, airspeed_m_s: float, yaw_rad: float) -> None:
        """Until the target is acquired: use the place where it is expected."""
        p, place = self.parameters, self._place
        if p.target_north_m is None or p.target_east_m is None or place is None or self._first_us is None:
            return
        if self.tracker.status is not TargetStatus.EXPECTED:
            return
        since_s = (time_us - self._first_us) * 1e-6
        heading = p.target_heading_rad
        way = (p.target_speed_m_s * math.cos(heading), p.target_speed_m_s * math.sin(heading))
        self.tracker.expect(
            time_us,
            target_ne_m=(p.target_north_m + since_s * way[0], p.target_east_m + since_s * way[1]),
            target_ne_m_s=way,
            own_ne_m=(place[0], place[1]),
            own_ne_m_s=(place[2], place[3]),
            air_ne_m_s=(airspeed_m_s * math.cos(yaw_rad), airspeed_m_s * math.sin(yaw_rad)),
            sigma_m=p.target_sigma_m,
            drift_sigma_m_s=p.drift_sigma_m_s,
        )

    @property
    def estimates(self) -> Sequence[OrbitTargetEstimate]:
        time_us, tracker = self._time_us, self.tracker
        if time_us is None or not tracker.target.known:
            return ()
        state = tracker.state(time_us)
        (nn, ne), (_, ee) = tracker.target.offset_covariance_m2.tolist()
        return (
            OrbitTargetEstimate(
                time_us=time_us,
                subject=self._subject,
                offset_ne_m=state.offset_ne_m,
                offset_rate_ne_m_s=state.offset_rate_ne_m_s,
                drift_ne_m_s=tracker.target.drift_ne_m_s,
                covariance_m2=(nn, ne, ee),
                height_m=tracker.height_m,
                status=tracker.status,
            ),
        )

    def publish(self) -> Sequence[MAVLinkMessage]:
        """DEBUG_VECT "TGT_NED": the offset from the aircraft to the target, NED, metres. MAVLink has no
        message for a target whose position on the Earth is not known.
        """
        return [
            dialect.MAVLink_debug_vect_message(b"TGT_NED", e.time_us, *e.offset_ne_m, e.height_m)
            for e in self.estimates
        ]

    def remarks(self) -> Mapping[str, float | str]:
        """Numbers of detections and losses, and the pressure on the ground."""
        tracker = self.tracker
        remarks: dict[str, float | str] = {
            "status": tracker.status.value,
            "detections_used": float(tracker.target.accepted),
            "detections_rejected": float(tracker.target.rejected),
            "losses": float(tracker.losses),
            "ground_pa": math.nan if self._height is None else self._height.ground_pa,
        }
        if self._height is None and self._armed:
            remarks["warning"] = (
                "no pressure was received before the vehicle was armed, so its height is not known; "
                "set ground_pa, the pressure at the start in pascals"
            )
        return remarks


def _need(name: str, rate_hz: float, wanted_hz: float, purpose: str, optional: bool = False) -> Need:
    return Need(
        messages=(name,), rate_hz=rate_hz, wanted_rate_hz=wanted_hz, purpose=purpose, optional=optional
    )
