"""Cost of the control laws: the controllers' `step` per physics step and flight tasks per 50 Hz update.

python benchmarks/control.py
"""

import argparse
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from autopilot_bridge.control.fixed_wing import FixedWingController
from autopilot_bridge.control.fixed_wing import setpoint as fixed_wing_sp
from autopilot_bridge.control.multicopter import MulticopterController
from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.multicopter import (
    FlightContext,
    GotoTask,
    HoldTask,
    LandDetector,
    LandedState,
    MissionTask,
    OffboardTask,
    OrbitTask,
)
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as nav_layout
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.navigation.layout import NAV_SIZE
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

_ROUNDS = 40


def mean_us(call: Callable[[], object], repeats: int) -> float:
    """Mean time of a call, microseconds; the best of many short rounds, so that other work on the machine
    hardly shows."""
    call()
    best = float("inf")
    for _ in range(_ROUNDS):
        start = time.perf_counter()
        for _ in range(repeats // _ROUNDS):
            call()
        best = min(best, time.perf_counter() - start)
    return best / (repeats // _ROUNDS) * 1e6


def flying_context() -> FlightContext:
    """A context of a vehicle that hovers at the origin."""
    nav = np.zeros(NAV_SIZE)
    nav[nav_layout.Q] = 1.0
    nav[nav_layout.FORCE + 2] = -9.81
    ctx = FlightContext(nav=nav)
    health = NavigationHealth()
    health.position_horizontal_absolute = health.velocity_horizontal = True
    health.position_vertical_absolute = health.velocity_vertical = True
    ctx.health = health
    ctx.home_ned_m[:] = 0.0
    ctx.armed = True
    ctx.landed_state = LandedState.IN_AIR
    ctx.frame = LocalFrame(GeodeticPosition(lat_deg=47.4, lon_deg=8.5, alt_m=490.0))
    return ctx


def flying_aircraft() -> FixedWingController:
    """A controller of an aircraft that follows a course at a height."""
    nav = np.zeros(NAV_SIZE)
    nav[nav_layout.Q] = 1.0
    nav[nav_layout.FORCE + 2] = -9.81
    nav[nav_layout.VEL_NED_M_S] = (15.0, 2.0, 0.0)
    nav[nav_layout.AIRSPEED_M_S] = nav[nav_layout.AIRSPEED_TRUE_M_S] = 15.0
    controller = FixedWingController(physics_rate_hz=250.0, nav=nav)
    controller.setpoint[fixed_wing_sp.LEVEL] = fixed_wing_sp.FLY
    controller.setpoint[fixed_wing_sp.COURSE_RAD] = 0.2
    controller.setpoint[fixed_wing_sp.DOWN_M] = -5.0
    return controller


def main() -> None:
    """Print one line per measurement."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--repeats", type=int, default=20_000)
    repeats = parser.parse_args().repeats
    ctx = flying_context()
    controller = MulticopterController(physics_rate_hz=250.0, nav=ctx.nav)
    controller.setpoint[:] = np.nan
    controller.setpoint[sp.POS_NED_M] = 0.0
    controller.setpoint[sp.YAW_RAD] = 0.0
    controller.setpoint[sp.LEVEL] = sp.TRAJECTORY
    lines = [
        ("multicopter step", mean_us(controller.step, 5 * repeats)),
        ("fixed wing step", mean_us(flying_aircraft().step, 5 * repeats)),
    ]

    assert ctx.frame is not None
    lat, lon, _ = ctx.frame.geodetic_from_ned(500.0, 0.0, 0.0)
    store = MissionStore()
    store.replace((MissionItem(command=dialect.MAV_CMD_NAV_WAYPOINT, x=lat, y=lon, z=10.0),), 1)
    offboard = OffboardTask()
    offboard.set_trajectory((0.0, 0.0, -1.0))
    tasks: dict[str, Any] = {
        "HoldTask": HoldTask(),
        "GotoTask": GotoTask(np.array([500.0, 0.0, -10.0])),
        "MissionTask": MissionTask(store),
        "OrbitTask": OrbitTask(np.zeros(3), 20.0, 3.0),
        "OffboardTask": offboard,
    }
    for name, task in tasks.items():
        task.activate(ctx)
        lines.append((f"{name}.update", mean_us(lambda task=task: task.update(ctx), repeats)))  # type: ignore[misc]
    detector = LandDetector(on_ground=False)
    lines.append(("LandDetector.update", mean_us(lambda: detector.update(ctx, 0.45), repeats)))
    for name, us in lines:
        sys.stdout.write(f"{name:24s} {us:8.2f} us\n")


if __name__ == "__main__":
    main()
