"""A fixed-wing aircraft's closed loop for tests of the flight tasks."""

import math

from autopilot_bridge.control.fixed_wing import FixedWingController, FixedWingParameters
from autopilot_bridge.flight.context import FlightContext, ManualInput
from autopilot_bridge.flight.fixed_wing import FixedWingFlightParameters, LandDetector
from autopilot_bridge.flight.task import FlightTask
from autopilot_bridge.navigation import layout as n
from flightsim import truth as t
from flightsim.environment import Environment
from flightsim.vehicle import InitialState
from tests.closed_loop import WingLoop, healthy, trimmed
from tests.control.fixed_wing.aerosonde import AEROSONDE


class Aircraft(WingLoop):
    """One aircraft with its controller, flight context and land detector; the home is where it starts."""

    def __init__(
        self,
        *,
        height_m: float | None = None,
        environment: Environment | None = None,
        parameters: FixedWingFlightParameters | None = None,
        launch: str | None = None,
        seed: int = 1,
        yaw_rad: float = 0.0,
        physics_rate_hz: int = 250,
        model: str = "aerosonde",
    ) -> None:
        initial = InitialState(yaw_rad=yaw_rad, launch=launch)
        if height_m is not None:
            initial = trimmed(AEROSONDE, height_m, yaw_rad, environment)
        super().__init__(
            model,
            lambda nav, rate_hz: FixedWingController(
                FixedWingParameters.for_envelope(AEROSONDE), physics_rate_hz=rate_hz, nav=nav
            ),
            initial=initial,
            environment=environment,
            seed=seed,
            physics_rate_hz=physics_rate_hz,
        )
        self.parameters = parameters or FixedWingFlightParameters.for_envelope(AEROSONDE)
        self.ctx = ctx = FlightContext(
            nav=self.nav, setpoint=self.controller.setpoint, parameters=self.parameters
        )
        ctx.health = healthy()
        ctx.frame = self.frame
        ctx.armed = True
        self.detector = LandDetector(on_ground=height_m is None)
        ctx.landed_state = self.detector.state
        ctx.ground_contact = ctx.maybe_landed = height_m is None
        self.task: FlightTask | None = None
        self.touch_sink_m_s = math.nan  # at the first contact after the take-off
        self.touch_ned_m = (math.nan, math.nan)
        self._flown = height_m is not None
        ctx.home_ned_m[:] = (0.0, 0.0, 0.0)
        if height_m is None:
            ctx.home_ned_m[2] = self.nav[n.POS_NED_M][2]
        ctx.home_yaw_rad = yaw_rad

    def fly(self, task: FlightTask) -> None:
        """Make a task the active one."""
        self.task = task
        task.activate(self.ctx)

    def sticks(self, **values: float) -> None:
        """A pilot holds the sticks like this."""
        self.ctx.sticks = ManualInput(valid=True, **values)

    def slow(self) -> None:
        self.ctx.time_us = self.world.time_us
        self.detector.update(self.ctx, self.controller.thrust)
        if self.task is not None:
            self.task.update(self.ctx)
        self.controller.set_ground_contact(self.ctx.ground_contact)
        super().slow()

    def step(self) -> None:
        sink = float(self.vehicle.truth[t.VEL_NED_M_S][2])
        super().step()
        contact = self.vehicle.truth[t.ON_GROUND] != 0.0
        if self._flown and contact and math.isnan(self.touch_sink_m_s):
            self.touch_sink_m_s = sink
            self.touch_ned_m = (float(self.nav[n.POS_NED_M][0]), float(self.nav[n.POS_NED_M][1]))
        self._flown = self._flown or -float(self.nav[n.POS_NED_M][2]) > 10.0

    def run_until(self, condition: object, limit_s: float) -> float:
        """Fly until `condition()` holds; the time it took. Fails at the limit."""
        assert callable(condition)
        start = self.time_s
        while not condition():
            assert self.time_s - start < limit_s, f"not within {limit_s} s"
            for _ in range(self.slow_steps):
                self.step()
        return self.time_s - start
