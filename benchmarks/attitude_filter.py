"""Cost of the attitude filter: microseconds of processor time per sample, beside the filters of `ahrs`.

    python benchmarks/attitude_filter.py

The same made flight (50 Hz; straight, with noise) goes through `AttitudeEstimator.handle`, message by message
with all its checks and counters, and, gyro and accelerometer only, through the filters of `ahrs` from PyPI
(`pip install ahrs`), sample by sample and as a whole array. A fixed wing hears its airspeed at 10 Hz between
them, which counts as samples too. Best of several runs; processor time, so that a busy machine counts less.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from autopilot_bridge.mavlink import definition
from estimators.attitude import AttitudeEstimator, AttitudeParameters
from estimators.messages import Message, message_class

SAMPLES = 20_000
PERIOD_US = 20_000
REPEATS = 7
LIMIT_US = 2.0


def best_us(run: Callable[[], object], samples: int) -> float:
    """Processor time per sample, the best of the repeats."""
    costs = []
    for _ in range(REPEATS):
        start = time.process_time()
        run()
        costs.append(time.process_time() - start)
    return min(costs) / samples * 1e6


def made(name: str, **values: float) -> Message:
    """A message with zeros where nothing is given."""
    found = definition(name)
    numbers = {field.name: 0 for field in found.wire_fields} | values
    return message_class(found)._make((1, 1, *numbers.values()))


def flight() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angular rates and specific forces."""
    rng = np.random.default_rng(1)
    return rng.normal(0.0, 0.01, (SAMPLES, 3)), rng.normal((0.0, 0.0, -9.8), 0.3, (SAMPLES, 3))


def ours(vehicle: str, gyro: NDArray[np.float64], force: NDArray[np.float64]) -> float:
    """Cost of a message through `handle`."""
    messages: list[tuple[int, Message]] = []
    for k, (rate, acc) in enumerate(zip(gyro.tolist(), force.tolist(), strict=True)):
        fields = dict(zip(("xgyro", "ygyro", "zgyro", "xacc", "yacc", "zacc"), (*rate, *acc), strict=True))
        if vehicle == "fixed_wing" and k % 5 == 0:
            hud = made("VFR_HUD", airspeed=20.0 + acc[0], throttle=50)
            messages.append((k * PERIOD_US, hud))
        messages.append(
            (k * PERIOD_US, made("HIGHRES_IMU", time_usec=k * PERIOD_US, fields_updated=63, **fields))
        )
    estimator = AttitudeEstimator(AttitudeParameters(vehicle=vehicle))  # type: ignore[arg-type]
    estimator.handle(*messages[-1])  # compiled before the clock runs

    def run() -> None:
        estimator.reset()
        handle = estimator.handle
        for time_us, message in messages:
            handle(time_us, message)

    return best_us(run, len(messages))


def theirs(gyro: NDArray[np.float64], force: NDArray[np.float64]) -> dict[str, float]:
    """Cost of a sample through the filters of `ahrs`."""
    from ahrs.filters import Complementary, Madgwick, Mahony

    some = 4000  # they are slow
    gyro, up = gyro[:some], -force[:some]
    found: dict[str, float] = {}
    for kind in (Mahony, Madgwick):
        one: Any = kind(frequency=50.0)

        def update(one: Any = one) -> None:
            q = np.array([1.0, 0.0, 0.0, 0.0])
            for rate, acc in zip(gyro, up, strict=True):
                q = one.updateIMU(q, gyr=rate, acc=acc)

        def whole(kind: Any = kind) -> None:
            kind(gyr=gyro, acc=up, frequency=50.0)

        found[f"ahrs {kind.__name__}, sample by sample"] = best_us(update, some)
        found[f"ahrs {kind.__name__}, whole array"] = best_us(whole, some)
    found["ahrs Complementary, whole array"] = best_us(
        lambda: Complementary(gyr=gyro, acc=up, frequency=50.0), some
    )
    return found


def main() -> int:
    """Print the figures; 1 when the filter is slower than it should be."""
    try:
        import ahrs  # noqa: F401
    except ImportError:
        sys.stderr.write("the comparison needs ahrs; pip install ahrs, or pip install -e .[bench]\n")
        return 2
    gyro, force = flight()
    own = {vehicle: ours(vehicle, gyro, force) for vehicle in ("fixed_wing", "multirotor")}
    for vehicle, cost in own.items():
        sys.stdout.write(f"{'attitude, ' + vehicle:38s} {cost:8.2f} us\n")
    slowest = max(own.values())
    for name, cost in theirs(gyro, force).items():
        sys.stdout.write(f"{name:38s} {cost:8.2f} us   {cost / slowest:6.1f} times ours\n")
    sys.stdout.write(f"limit: {LIMIT_US:g} us\n")
    return int(slowest > LIMIT_US)


if __name__ == "__main__":
    sys.exit(main())
