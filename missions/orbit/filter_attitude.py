"""Attitude from our own filter: roll and pitch from inertial messages and airspeed, yaw from the autopilot.

The filter is the self-pose estimation of Tolman et al. 2021 (docs/attitude.md); it does not estimate yaw.
"""

import math
from collections import deque
from typing import Final

from autopilot_bridge.mavlink import Frame, decode
from estimators.attitude import AttitudeEstimate, AttitudeEstimator, AttitudeParameters, VehicleKind
from estimators.interface import Outcome
from estimators.messages import read_message
from estimators.needs import message_names
from estimators.runner import ESTIMATOR_COMPONENTS, TRUTH_COMPONENT
from estimators.vehicle_time import VehicleTime
from flightsim.foundation.vectors import Quaternion, from_euler, yaw_of
from missions.orbit.attitude import AutopilotAttitude
from missions.vehicle import telemetry

__all__ = ["FilterAttitude"]

_KEPT: Final = 512
_STALE_US: Final = 500_000
_ATTITUDE: Final = "ATTITUDE"


class FilterAttitude:
    """Attitude of one aircraft as a function of time (an `AttitudeSource`).

    Args:
        system_id: system id of the aircraft.
        parameters: parameters of the filter; None: its defaults, for a fixed wing.

    Attributes:
        names: names of the messages that must be passed to it.
    """

    def __init__(self, system_id: int, parameters: AttitudeParameters | None = None) -> None:
        self._system_id = system_id
        self._filter = AttitudeEstimator(parameters or AttitudeParameters(vehicle=VehicleKind.FIXED_WING))
        self._time = VehicleTime()
        self._yaw = AutopilotAttitude()
        self._kept: deque[AttitudeEstimate] = deque(maxlen=_KEPT)
        self.names = message_names(self._filter.needs) | {_ATTITUDE}

    @property
    def newest(self) -> AttitudeEstimate | None:
        """The filter's newest estimate; None before the first."""
        return self._kept[-1] if self._kept else None

    def roll_rad(self, time_us: int) -> float | None:
        """The newest roll; None when it is too old at a vehicle time."""
        newest = self.newest
        return None if newest is None or time_us - newest.time_us > _STALE_US else newest.roll_rad

    def hear(self, frame: Frame) -> None:
        """Process a frame. Frames of other vehicles, of simulators and of estimators are ignored."""
        left_out = frame.component_id == TRUTH_COMPONENT or frame.component_id in ESTIMATOR_COMPONENTS
        if frame.system_id != self._system_id or left_out:
            return
        message = read_message(frame)
        time_us = self._time.stamp(message)
        if message.name == _ATTITUDE:
            attitude = telemetry.attitude(decode(frame)) if frame.component_id == 1 else None
            if attitude is not None:
                self._yaw.add(attitude)
            return
        outcome = self._filter.handle(time_us, message)
        if outcome is Outcome.TIME_JUMP:
            self._kept.clear()
        elif outcome is Outcome.UPDATED:
            self._kept.extend(self._filter.estimates)

    def at(self, time_us: int) -> Quaternion | None:
        """`q_ned_from_frd` at a vehicle time; None when filter or autopilot have no attitude for it."""
        heading = self._yaw.at(time_us)
        if heading is None:
            return None
        later: AttitudeEstimate | None = None
        for estimate in reversed(self._kept):
            if estimate.time_us <= time_us:
                until_us = time_us if later is None else later.time_us
                if until_us - estimate.time_us > _STALE_US:
                    return None
                return _between(estimate, later or estimate, time_us, yaw_of(heading))
            later = estimate
        return None


def _between(a: AttitudeEstimate, b: AttitudeEstimate, time_us: int, yaw_rad: float) -> Quaternion:
    share = 0.0 if b.time_us == a.time_us else (time_us - a.time_us) / (b.time_us - a.time_us)
    roll = a.roll_rad + share * math.remainder(b.roll_rad - a.roll_rad, math.tau)
    pitch = a.pitch_rad + share * (b.pitch_rad - a.pitch_rad)
    return from_euler(roll, pitch, yaw_rad)
