"""The sensors of one vehicle, composed and stepped together.

When each sensor is due: a table over one common period, so that a physics step needs no search.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsim.interface import Reading, SensorReadings
from flightsim.sensors.airspeed import AirspeedParameters
from flightsim.sensors.barometer import BarometerParameters
from flightsim.sensors.battery import BatteryMonitorParameters
from flightsim.sensors.fault_kinds import FaultTarget
from flightsim.sensors.fault_stage import FaultPoint
from flightsim.sensors.faults import FaultPanel
from flightsim.sensors.flow_vane import FlowVaneParameters
from flightsim.sensors.gps import GpsParameters
from flightsim.sensors.imu import ImuParameters
from flightsim.sensors.magnetometer import MagnetometerParameters
from flightsim.sensors.rangefinder import RangefinderParameters
from flightsim.sensors.sensor import Sensor, SensorParameters
from flightsim.sensors.vibration import RotorVibrationParameters
from flightsim.truth import TRUTH_SIZE


def steps_per_sample(rate_hz: int, physics_rate_hz: int) -> int:
    """Physics steps between two samples.

    Raises:
        ValueError: the rate does not divide the physics rate.
    """
    if physics_rate_hz % rate_hz:
        accepted = ", ".join(str(n) for n in range(1, physics_rate_hz + 1) if physics_rate_hz % n == 0)
        raise ValueError(
            f"a sensor rate of {rate_hz} Hz does not divide the physics rate of {physics_rate_hz} Hz; "
            f"accepted: {accepted}"
        )
    return physics_rate_hz // rate_hz


class Schedule:
    """What to do on each physics step of one period (the least common multiple of the sampling intervals).

    Attributes:
        period: steps after which the table repeats.
        expire: per step, the readings delivered on the step before and not due on this one.
        act: per step, the sensors' actions, called with the time in microseconds.
    """

    def __init__(self, sensors: Iterable[Sensor]) -> None:
        sensors = tuple(sensors)
        self.period = math.lcm(1, *(sensor.interval_steps for sensor in sensors))
        act: list[tuple[Callable[[int], None], ...]] = []
        delivered: list[list[Reading]] = []
        for step in range(self.period):
            actions: list[Callable[[int], None]] = []
            delivered.append([])
            for sensor in sensors:
                measures = step % sensor.interval_steps == 0
                delivers = step % sensor.interval_steps == sensor.latency_steps % sensor.interval_steps
                if sensor.latency_steps == 0:
                    if measures:
                        actions.append(sensor.sample)
                else:
                    if measures:
                        actions.append(sensor.measure)
                    if delivers:
                        actions.append(sensor.deliver)
                if delivers:
                    delivered[-1].append(sensor.reading)
            act.append(tuple(actions))
        self.act = tuple(act)
        self.expire = tuple(
            tuple(reading for reading in delivered[step - 1] if reading not in delivered[step])
            for step in range(self.period)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSuiteParameters:
    """One parameter set per sensor; None leaves the sensor out, and its reading never comes."""

    imu: ImuParameters | None = field(default_factory=ImuParameters)
    barometer: BarometerParameters | None = field(default_factory=BarometerParameters)
    magnetometer: MagnetometerParameters | None = field(default_factory=MagnetometerParameters)
    gps: GpsParameters | None = field(default_factory=GpsParameters)
    battery: BatteryMonitorParameters | None = field(default_factory=BatteryMonitorParameters)
    rangefinder: RangefinderParameters | None = field(default_factory=RangefinderParameters)
    airspeed: AirspeedParameters | None = None
    flow_vane: FlowVaneParameters | None = None

    @classmethod
    def fixed_wing(cls, **overrides: Any) -> "SensorSuiteParameters":
        """What a small aircraft carries: a multicopter's sensors, a pitot tube, a lidar for the flare."""
        fitted: dict[str, Any] = {
            "imu": ImuParameters(vibration=RotorVibrationParameters(axis=0)),
            "rangefinder": RangefinderParameters.long_range(),
            "airspeed": AirspeedParameters(),
        }
        return cls(**(fitted | overrides))


class SensorSuite:
    """Sensors between a vehicle's truth and the autopilot's readings.

    Call `step` once per physics step, after the vehicle has written `truth`. Every sensor measures on the
    first step and then at its rate.

    Attributes:
        readings: what the autopilot sees, written in place.
        faults: switches for failures in flight.
    """

    def __init__(
        self,
        parameters: SensorSuiteParameters,
        *,
        physics_rate_hz: int,
        truth: NDArray[np.float64],
        seeds: Callable[[str], np.random.SeedSequence],
    ) -> None:
        """Compose the sensors.

        Args:
            parameters: the sensors.
            physics_rate_hz: calls of `step` per second of vehicle time.
            truth: the vehicle's truth vector (`flightsim.truth`), read on each step.
            seeds: a separate seed sequence for each name: sensors draw from "imu", "gps", ..., their failures
                from "fault_gyro", "fault_gps", ....

        Raises:
            ValueError: a rate that doesn't divide the physics rate, or a truth vector of another shape.
        """
        if truth.shape != (TRUTH_SIZE,) or truth.dtype != np.float64 or not truth.flags.c_contiguous:
            raise ValueError(
                f"truth is {truth.dtype} of shape {truth.shape}; "
                f"accepted: contiguous float64 of ({TRUTH_SIZE},)"
            )
        if physics_rate_hz <= 0:
            raise ValueError(f"physics_rate_hz = {physics_rate_hz!r} is not accepted: a positive number is")
        self.readings = SensorReadings()
        self.faults = FaultPanel()
        self._physics_rate_hz = physics_rate_hz
        self._truth = truth
        self._seeds = seeds
        self._sensors: dict[str, Sensor] = {}
        self._schedule = Schedule(())
        self._step = -1
        readings = self.readings
        fitted: tuple[tuple[str, Reading, SensorParameters | None], ...] = (
            ("imu", readings.imu, parameters.imu),
            ("barometer", readings.barometer, parameters.barometer),
            ("magnetometer", readings.magnetometer, parameters.magnetometer),
            ("gps", readings.gps, parameters.gps),
            ("battery", readings.battery, parameters.battery),
            ("rangefinder", readings.rangefinder, parameters.rangefinder),
            ("airspeed", readings.airspeed, parameters.airspeed),
            ("flow_vane", readings.flow_vane, parameters.flow_vane),
        )
        for name, reading, sensor_parameters in fitted:
            if sensor_parameters is not None:
                self.add(name, reading, sensor_parameters)

    def add(self, name: str, reading: Reading, parameters: SensorParameters) -> None:
        """Fit one more sensor, before the first step. It changes no other sensor's stream.

        Args:
            name: unique; names its random stream.
            reading: where its samples go; of the model's size.
            parameters: its parameter set.

        Raises:
            ValueError: name or unit taken, or a rate that doesn't divide the physics rate.
            RuntimeError: the suite has been stepped.
        """
        if self._step >= 0:
            raise RuntimeError(f"sensor {name!r} comes too late: fit sensors before the first step")
        if name in self._sensors:
            raise ValueError(f"there is already a sensor named {name!r}")
        try:
            interval_steps = steps_per_sample(parameters.rate_hz, self._physics_rate_hz)
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None
        interval_s = interval_steps / self._physics_rate_hz
        rng = np.random.Generator(np.random.PCG64(self._seeds(name)))
        model = parameters.build(interval_s, rng)
        points = tuple(
            FaultPoint(target, reading, interval_s, self._fault_generator(target.unit.name))
            for target in model.fault_targets
        )
        self.faults.add(points)
        self._sensors[name] = Sensor(
            reading,
            model,
            interval_steps=interval_steps,
            latency_steps=round(parameters.latency_s * self._physics_rate_hz),
            truth=self._truth,
            rng=rng,
            fault_points=points,
        )
        self._schedule = Schedule(self._sensors.values())

    def add_elsewhere(self, target: FaultTarget, *, size: int, rate_hz: float) -> FaultPoint:
        """A unit that fails like the others although its samples come from elsewhere (`FaultPoint.deliver`).

        Args:
            target: the unit.
            size: of a sample.
            rate_hz: about how many come in a second.

        Raises:
            ValueError: the unit is there already.
        """
        point = FaultPoint(target, Reading(size), 1.0 / rate_hz, self._fault_generator(target.unit.name))
        self.faults.add((point,))
        return point

    def step(self, time_us: int) -> None:
        """Take and deliver what is due; `time_us` is the vehicle time of the truth vector."""
        schedule = self._schedule
        step = self._step + 1
        if step == schedule.period:
            step = 0
        self._step = step
        for reading in schedule.expire[step]:
            reading.fresh = False
        for act in schedule.act[step]:
            act(time_us)

    def _fault_generator(self, unit_name: str) -> np.random.Generator:
        return np.random.Generator(np.random.PCG64(self._seeds(f"fault_{unit_name.lower()}")))
