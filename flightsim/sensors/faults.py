"""The fault panel: switch sensor failures on and off in flight."""

from collections.abc import Iterable, Mapping, Sequence

from flightsim.sensors.fault_kinds import FaultType, SensorUnit
from flightsim.sensors.fault_stage import FaultPoint


class UnsupportedFaultError(ValueError):
    """The vehicle has no such unit, or there is no such failure (MAVLink: MAV_RESULT_UNSUPPORTED)."""


class FaultPanel:
    """Failures of one vehicle's sensors, numbered as MAV_CMD_INJECT_FAILURE numbers them.

    Gyro and accelerometer fail apart although they share a reading. A unit that delivers nothing leaves its
    reading stale (`fresh` never True). If only one of gyro and accelerometer delivers nothing, its last
    values stay in the IMU reading, which stays fresh because of the other sensor, as in a driver that reads
    registers that are not updated. The IMU reading becomes stale only when both deliver nothing.

    A unit has one failure at a time: a new one replaces the old. Failures draw from separate streams, and the
    normal noise continues during a failure, so after `clear` a sensor gives the same readings as without the
    failure.
    """

    def __init__(self) -> None:
        self._points: dict[SensorUnit, FaultPoint] = {}

    def add(self, points: Iterable[FaultPoint]) -> None:
        """Take a sensor's units in (the suite does this)."""
        for point in points:
            if point.target.unit in self._points:
                raise ValueError(f"there is already a sensor with the unit {point.target.unit.name}")
            self._points[point.target.unit] = point

    @property
    def units(self) -> frozenset[SensorUnit]:
        """The units that can fail on this vehicle."""
        return frozenset(self._points)

    @property
    def active(self) -> Mapping[SensorUnit, FaultType]:
        """The failures in force."""
        return {unit: point.failure for unit, point in self._points.items() if point.fault is not None}

    def inject(
        self,
        unit: SensorUnit | int,
        failure: FaultType | int,
        *,
        instance: int = 0,
        bias: Sequence[float] | None = None,
        drift_per_s: Sequence[float] | None = None,
        slow_factor: int | None = None,
        delay_s: float | None = None,
        mean_up_s: float | None = None,
        mean_down_s: float | None = None,
        no_fix: bool = False,
        blocked: bool = False,
    ) -> None:
        """Put a failure in force from the next sample on; `FaultType.OK` clears.

        Args:
            unit: which unit (FAILURE_UNIT).
            failure: what happens to it (FAILURE_TYPE, or DRIFT).
            instance: 0 for all, 1 for the first; there is one of each.
            bias: WRONG: the constant bias, in the reading's units, one number per channel, missing ones zero.
                GPS: north, east, up in metres, then velocity NED in m/s.
            drift_per_s: DRIFT: growth of the bias per second, same form.
            slow_factor: SLOW: one sample in so many arrives.
            delay_s: DELAYED: extra delay, rounded to samples.
            mean_up_s, mean_down_s: INTERMITTENT: mean durations of delivering and silence.
            no_fix: WRONG on GPS: the receiver continues to report, but without a fix (OFF stops its
                messages).
            blocked: WRONG on AIRSPEED: the opening of the pitot tube is closed and its drain open, so that it
                reads no airspeed (STUCK: closed drain and all, the pressure stays in).

        Raises:
            UnsupportedFaultError: no such unit, failure or instance here.
            ValueError: an option that doesn't go with the failure, or is out of range.
        """
        point = self._point(unit, instance)
        try:
            kind = FaultType(failure)
        except ValueError:
            names = ", ".join(f"{member.name} {member.value}" for member in FaultType)
            raise UnsupportedFaultError(f"failure {failure!r} is not known; accepted: {names}") from None
        point.set(
            kind,
            bias=bias,
            drift_per_s=drift_per_s,
            slow_factor=slow_factor,
            delay_s=delay_s,
            mean_up_s=mean_up_s,
            mean_down_s=mean_down_s,
            no_fix=no_fix,
            blocked=blocked,
        )

    def clear(self, unit: SensorUnit | int | None = None, *, instance: int = 0) -> None:
        """End a unit's failure, or all of them."""
        if unit is None:
            for known in self._points:
                self.inject(known, FaultType.OK)
        else:
            self.inject(unit, FaultType.OK, instance=instance)

    def _point(self, unit: SensorUnit | int, instance: int) -> FaultPoint:
        known = ", ".join(f"{member.name} {member.value}" for member in sorted(self._points))
        point = next((point for member, point in self._points.items() if member == unit), None)
        if point is None:
            raise UnsupportedFaultError(f"this vehicle has no sensor unit {unit!r}; accepted: {known}")
        if instance not in (0, 1):
            raise UnsupportedFaultError(
                f"instance {instance!r} of {point.target.unit.name} does not exist; accepted: 0 (all), 1"
            )
        return point
