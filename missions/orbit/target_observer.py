"""Observation of the target: attitude and images for the estimator, and pointing of the gimbal."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from autopilot_bridge.mavlink import Frame
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT, CAMERA_COMPONENT, GIMBAL_COMPONENT
from estimators.messages import read_message
from estimators.orbit_target import OrbitTargetEstimator
from estimators.orbit_target.attitude import FilterAttitude
from estimators.orbit_target.tracker import TargetStatus
from estimators.vehicle_time import VehicleTime
from flightsim.foundation.geodesy import LocalFrame
from missions.errors import MissionError
from missions.orbit.options import WANDERING_M, OrbitOptions
from missions.vehicle import telemetry
from missions.vehicle.attitude_pilot import AttitudePilot
from missions.vehicle.vehicle import Vehicle

TICK_HZ: Final = 25.0
_GIMBAL_LEAD_S: Final = 0.15
_GIVEN_SIGMA_M: Final = 20.0  # standard deviation of a place from another source (paper: 20 m)
_OLD_US: Final = 1_000_000
_INERTIAL: Final = ("HIGHRES_IMU", "RAW_IMU")
_INERTIAL_HZ: Final = (25.0, 40.0)
_FILTER_START_S: Final = 5.0


class TargetObserver:
    """Observes the target from one vehicle, with the estimator `orbit-target` in the mission's own control
    loop.

    Attributes:
        tracker: estimates the target's position.
        filter: our own attitude filter; None when the autopilot's attitude is used.
        with_gps: whether the vehicle knows its position, and so the approximate direction of the target.
    """

    def __init__(self, vehicle: Vehicle, options: OrbitOptions) -> None:
        self._vehicle = vehicle
        self._options = options
        self._estimator = OrbitTargetEstimator(
            replace(
                options.estimator,
                target_north_m=options.target_ne_m[0],
                target_east_m=options.target_ne_m[1],
                target_sigma_m=WANDERING_M if options.target_wanders else options.estimator.target_sigma_m,
            )
        )
        source = self._estimator.attitude
        self.filter = source if isinstance(source, FilterAttitude) else None
        self.tracker = self._estimator.tracker
        self._time = VehicleTime()
        self.with_gps = True

    def listen_to_payload(self) -> list[Callable[[], None]]:
        """Pass detections and gimbal attitudes to the estimator; returns functions that end this."""
        return [
            self._listen("GIMBAL_DEVICE_ATTITUDE_STATUS", GIMBAL_COMPONENT),
            self._listen("LANDING_TARGET", CAMERA_COMPONENT),
        ]

    def listen_to_attitude(self) -> list[Callable[[], None]]:
        """Pass the messages of the attitude source to the estimator; returns functions that end this."""
        return [self._listen(name, AUTOPILOT_COMPONENT) for name in sorted(self._estimator.attitude.names)]

    def _listen(self, name: str, component_id: int) -> Callable[[], None]:
        def take(frame: Frame) -> None:
            if frame.system_id == self._vehicle.system_id and frame.component_id == component_id:
                message = read_message(frame)
                self._estimator.take(self._time.stamp(message), message)

        return self._vehicle.link.connection.listen(name, take)

    async def start_filter(self) -> None:
        """Start our filter, if it is used, while the aircraft is still on the ground, where it estimates its
        biases.
        """
        if self.filter is None:
            return
        vehicle = self._vehicle
        for name in _INERTIAL:
            # an autopilot that refuses the second as too fast has already accepted the first
            for rate_hz in _INERTIAL_HZ:
                await vehicle.commands.set_message_rate(name, rate_hz)
            await vehicle.clock.sleep(_FILTER_START_S)
            if self.filter.newest is not None:
                return
        raise MissionError(
            f"the attitude filter receives neither {' nor '.join(_INERTIAL)}; fly with `attitude=autopilot`; "
            f"{vehicle.link.last_received()}"
        )

    async def keep_looking(self, pilot: AttitudePilot) -> None:
        """Continuously step the tracker and keep the gimbal pointed at the target."""
        clock = self._vehicle.clock
        period_us = round(1e6 / TICK_HZ)
        due_us = clock.time_us
        while True:
            self._look(pilot)
            due_us = max(due_us + period_us, clock.time_us)
            await clock.sleep_until(due_us)

    def _look(self, pilot: AttitudePilot) -> None:
        vehicle, tracker = self._vehicle, self.tracker
        height_m, airspeed_m_s = pilot.height_m, pilot.airspeed_true_m_s
        if not (math.isfinite(height_m) and math.isfinite(airspeed_m_s)):
            return
        now_us = vehicle.clock.stamp_us
        tracker.height(height_m - self._options.estimator.target_ground_m)
        if self.with_gps and tracker.status is not TargetStatus.SEEN:
            self._use_given_place(now_us, airspeed_m_s)
        tracker.step(now_us, airspeed_m_s, pilot.climb_m_s)
        angles = tracker.pointing(now_us, _GIMBAL_LEAD_S)
        if angles is not None:
            vehicle.payload.point_gimbal(pitch_rad=angles[1], yaw_rad=angles[0])

    def _use_given_place(self, now_us: int, airspeed_m_s: float) -> None:
        """While there is GPS and the target was not seen: use its given place relative to the aircraft."""
        p = self._vehicle.latest(telemetry.Position)
        attitude = self._vehicle.latest(telemetry.Attitude)
        if p is None or attitude is None or not self.informed:
            return
        target_ne_m, target_ne_m_s = self.target_ne(self._vehicle.clock.time_us)
        frame = LocalFrame(self._vehicle.home)
        own_north_m, own_east_m, _ = frame.ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)
        self.tracker.expect(
            now_us,
            target_ne_m=target_ne_m,
            target_ne_m_s=target_ne_m_s,
            own_ne_m=(own_north_m, own_east_m),
            own_ne_m_s=p.vel_ned_m_s[:2],
            air_ne_m_s=(airspeed_m_s * math.cos(attitude.yaw_rad), airspeed_m_s * math.sin(attitude.yaw_rad)),
            sigma_m=self._estimator.parameters.target_sigma_m,
            drift_sigma_m_s=self._estimator.parameters.drift_sigma_m_s,
        )

    @property
    def informed(self) -> bool:
        """Whether the vehicle's position and attitude are recent; after a link loss they are old."""
        reports = (self._vehicle.latest(telemetry.Position), self._vehicle.latest(telemetry.Attitude))
        now_us = self._vehicle.clock.stamp_us
        return all(t is not None and now_us - t.time_us < _OLD_US for t in reports)

    def target_ne(self, time_us: int) -> tuple[tuple[float, float], tuple[float, float]]:
        """Estimated position and velocity of the target, from home."""
        o = self._options
        if o.target_wanders:  # its place is known only approximately
            return o.target_ne_m, (0.0, 0.0)
        speed_m_s, heading_rad = o.estimator.target_speed_m_s, o.estimator.target_heading_rad
        velocity = speed_m_s * math.cos(heading_rad), speed_m_s * math.sin(heading_rad)
        since_s = (time_us - self._vehicle.link.first_heartbeat_us) * 1e-6
        return (o.target_ne_m[0] + since_s * velocity[0], o.target_ne_m[1] + since_s * velocity[1]), velocity
