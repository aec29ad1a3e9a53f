"""Cost of the navigation filter: microseconds per physics step at 250 Hz with the default sensors.

    python benchmarks/navigation_filter.py

Made-up sensor readings are replayed, so that only the filter is timed: of a hover, and of a fixed wing that
flies straight at 25 m/s and 100 m, whose filter also estimates the wind.
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from autopilot_bridge.navigation import NavigationFilter, NavigationParameters, mechanisation
from flightsim.foundation.random_streams import RandomStreams
from flightsim.interface import SensorReadings

WING = NavigationParameters(fixed_wing=True)
QUADROTOR = NavigationParameters()
AIRSPEED_M_S = 25.0
CLIMB_S = 4.0  # the wing's: aligned at rest until then, at height and speed from then on
RATE_HZ = 250
PERIOD_US = 1_000_000 // RATE_HZ
SECONDS = 60
WARM_S = 20
REPEATS = 5


def feed(readings: SensorReadings, rng: np.random.Generator, step: int, *, wing: bool) -> None:
    """Readings of a vehicle that hovers in place, or flies north, at the default sensors' rates."""
    time_us = (step + 1) * PERIOD_US
    flown_s = max(0.0, time_us * 1e-6 - CLIMB_S) if wing else 0.0
    speed, height = (AIRSPEED_M_S, 100.0) if flown_s else (0.0, 0.0)
    readings.imu.values[:6] = rng.normal(0.0, 0.004, 6)
    readings.imu.values[5] -= 9.8076
    readings.imu.fresh = True
    slow = step % 5 == 0
    for reading in (readings.barometer, readings.magnetometer):
        reading.fresh = slow
    readings.rangefinder.fresh = step % 10 == 0
    readings.gps.fresh = step % 50 == 27
    if slow:
        readings.barometer.values[:] = 95600.0 - 11.2 * height + rng.normal(0.0, 1.2), 20.0
        readings.barometer.time_us = time_us
        readings.magnetometer.values[:] = np.array([0.2156, 0.012, 0.4305]) + rng.normal(0.0, 0.003, 3)
        readings.magnetometer.time_us = time_us
    if readings.rangefinder.fresh:
        readings.rangefinder.values[:] = 5.0 + rng.normal(0.0, 0.02), 0.1, 12.0
        readings.rangefinder.time_us = time_us
    if readings.gps.fresh:
        noise = rng.normal(0.0, 1.0, 6)
        readings.gps.values[:] = (
            47.397742 + 2e-6 * noise[0] + speed * flown_s / 111_200.0,
            8.545594 + 3e-6 * noise[1],
            488.0 + height + 0.5 * noise[2],
            speed + 0.06 * noise[3],
            0.08 * noise[4],
            0.16 * noise[5],
            0.23,
            0.56,
            0.11,
            3.0,
            10.0,
            0.7,
            1.1,
        )
        readings.gps.time_us = time_us - 112_000
    if wing and step % 10 == 0:
        readings.airspeed.values[:] = 0.55 * speed * speed + rng.normal(0.0, 1.5), 20.0
        readings.airspeed.time_us = time_us


def per_step_us(parameters: NavigationParameters, *, with_filter: bool) -> float:
    """Mean wall time of a step with feeding, with or without the filter."""
    readings = SensorReadings()
    rng = RandomStreams(1).generator("benchmark")
    nav = NavigationFilter(parameters, readings=readings, physics_rate_hz=RATE_HZ)
    wing = parameters.fixed_wing
    start = 0.0
    for step in range(SECONDS * RATE_HZ):
        if step == WARM_S * RATE_HZ:  # aligned, origin set, aloft, everything compiled
            start = time.perf_counter()
        feed(readings, rng, step, wing=wing)
        if with_filter:
            nav.step((step + 1) * PERIOD_US)
    elapsed = time.perf_counter() - start
    health = nav.health
    if with_filter and not (health.position_horizontal_absolute and health.sideslip_in_use == wing):
        raise RuntimeError("the filter found no position or no wind: the benchmark's readings are wrong")
    return elapsed / ((SECONDS - WARM_S) * RATE_HZ) * 1e6


def mechanisation_us() -> float:
    """Wall time of the mechanisation kernel's call alone."""
    readings = SensorReadings()
    nav = NavigationFilter(QUADROTOR, readings=readings, physics_rate_hz=RATE_HZ)
    rng = RandomStreams(1).generator("benchmark")
    for step in range(2 * RATE_HZ):
        feed(readings, rng, step, wing=False)
        nav.step((step + 1) * PERIOD_US)
    solution = nav._solution
    core, history, imu = solution.core.copy(), solution.history, readings.imu.values
    count = 50_000
    start = time.perf_counter()
    for _ in range(count):
        mechanisation.step(core, nav.state, history, imu, 0.004, 60.0, 400.0, 0.2, True, 0)
    return (time.perf_counter() - start) / count * 1e6


def main() -> None:
    """Print the figures."""
    kernel = min(mechanisation_us() for _ in range(REPEATS))
    sys.stdout.write(
        f"navigation filter at {RATE_HZ} Hz, best of {REPEATS}:\n"
        f"  mechanisation kernel  {kernel:6.2f} us per step\n"
    )
    for name, parameters in (("quadrotor", QUADROTOR), ("fixed wing", WING)):
        bare = min(per_step_us(parameters, with_filter=False) for _ in range(REPEATS))
        full = min(per_step_us(parameters, with_filter=True) for _ in range(REPEATS))
        line = f"{name}, whole filter"
        sys.stdout.write(f"  {line:24}  {full - bare:6.2f} us per step, all updates included\n")


if __name__ == "__main__":
    main()
