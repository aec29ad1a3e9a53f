"""Checks on the ground whether a magnetometer is quiet enough for a threshold."""

import asyncio
import math
from typing import Final

import numpy as np

from missions.errors import PlanError, VehicleTimeout
from missions.occupancy.options import LEAST_SIGMAS
from missions.vehicle.vehicle import Vehicle

_READINGS: Final = 20
_LONGEST_S: Final = 15.0


def white_noise_nt(readings_nt: list[float]) -> float:
    """Standard deviation of the noise between consecutive readings; slow drift does not count.

    Allan deviation at one interval: the root of half the mean square of the differences.
    """
    if len(readings_nt) < 2:
        return math.nan
    return float(np.sqrt(0.5 * np.mean(np.diff(np.array(readings_nt)) ** 2)))


async def require_quiet(vehicle: Vehicle, *, threshold_nt: float) -> float:
    """Measure the noise of a vehicle's survey magnetometer, and refuse a threshold that is within the noise.

    Returns:
        Standard deviation of one reading, nT.

    Raises:
        VehicleTimeout: too few readings were received.
        PlanError: the noise alone would exceed the threshold.
    """
    readings_nt: list[float] = []
    enough = asyncio.Event()

    def take(_time_us: int, total_nt: float) -> None:
        readings_nt.append(total_nt)
        if len(readings_nt) >= _READINGS:
            enough.set()

    stop = vehicle.payload.on_total_field(take)
    try:
        async with vehicle.link.deadline(_LONGEST_S, "readings of the survey magnetometer"):
            await enough.wait()
    except TimeoutError:
        raise VehicleTimeout(
            f"the survey magnetometer gave {len(readings_nt)} readings in {_LONGEST_S:g} s, fewer than "
            f"{_READINGS}; {vehicle.link.last_received()}"
        ) from None
    finally:
        stop()
    noise_nt = white_noise_nt(readings_nt)
    if threshold_nt < LEAST_SIGMAS * noise_nt:
        raise PlanError(
            f"`threshold_nt` {threshold_nt:g} nT is below {LEAST_SIGMAS:g} times the noise of vehicle "
            f"{vehicle.system_id}'s magnetometer, {noise_nt:.2f} nT: noise would make anomalies; raise "
            f"`threshold_nt` to {math.ceil(10.0 * LEAST_SIGMAS * noise_nt) / 10.0:g} or more"
        )
    return noise_nt
