"""When each sensor is due: a table over one common period, so that a physics step needs no search."""

import math
from collections.abc import Callable, Iterable

from flightsim.interface import Reading
from flightsim.sensors.sensor import Sensor


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
