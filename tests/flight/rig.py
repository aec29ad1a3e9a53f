"""A multicopter's closed loop for tests of control laws and flight tasks."""

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.multicopter import MulticopterController, MulticopterParameters
from autopilot_bridge.flight.multicopter import FlightContext, FlightParameters, FlightTask, LandDetector
from autopilot_bridge.navigation import layout as nav_layout
from flightsim.environment import Environment
from flightsim.vehicle import InitialState
from tests.closed_loop import ClosedLoop, healthy

Array = NDArray[np.float64]


class Rig(ClosedLoop):
    """One vehicle with its controller, flight context and land detector."""

    def __init__(
        self,
        *,
        height_m: float | None = None,
        environment: Environment | None = None,
        parameters: FlightParameters | None = None,
        control: MulticopterParameters | None = None,
        seed: int = 1,
        physics_rate_hz: int = 250,
    ) -> None:
        initial = InitialState()
        if height_m is not None:
            initial = InitialState(height_m=height_m, rotor_rad_s=485.0, yaw_rad=0.0)
        super().__init__(
            "iris",
            lambda nav, rate_hz: MulticopterController(control, physics_rate_hz=rate_hz, nav=nav),
            initial=initial,
            environment=environment,
            seed=seed,
            physics_rate_hz=physics_rate_hz,
        )
        self.ctx = FlightContext(nav=self.nav, setpoint=self.controller.setpoint, parameters=parameters)
        self.ctx.health = healthy()
        self.ctx.frame = self.frame
        self.ctx.home_ned_m[:] = 0.0
        self.ctx.home_yaw_rad = 0.0
        self.ctx.armed = True
        self.detector = LandDetector(on_ground=height_m is None)
        self.ctx.landed_state = self.detector.state
        self.ctx.ground_contact = self.ctx.maybe_landed = height_m is None
        self.task: FlightTask | None = None
        self.landed_log: list[int] = []

    def fly(self, task: FlightTask) -> None:
        """Make a task the active one."""
        self.task = task
        task.activate(self.ctx)

    def slow(self) -> None:
        self.ctx.time_us = self.world.time_us
        self.ctx.hover_thrust = self.controller.hover_thrust
        self.detector.update(self.ctx, self.controller.thrust)
        if self.task is not None:
            self.task.update(self.ctx)
        super().slow()
        self.landed_log.append(int(self.ctx.landed_state))


def positions(log: Array) -> Array:
    """NED positions of a log, (n, 3)."""
    return log[:, nav_layout.POS_NED_M]


def velocities(log: Array) -> Array:
    """NED velocities of a log, (n, 3)."""
    return log[:, nav_layout.VEL_NED_M_S]


def tilts(log: Array) -> Array:
    """Angles between the body's down axis and down, rad, (n,)."""
    roll, pitch, _ = log[:, nav_layout.EULER_RAD].T
    return np.arccos(np.clip(np.cos(roll) * np.cos(pitch), -1.0, 1.0))
