"""A point mass that turns by bank angle, for tests of guidance apart from any control law or aerodynamics.

Bank, airspeed and climb rate follow what is requested as first-order lags; the course is flown through the
wind triangle with a proportional law of its own.
"""

import math

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import FlightContext, LandedState
from autopilot_bridge.flight.fixed_wing import FixedWingFlightParameters
from autopilot_bridge.flight.task import FlightTask
from autopilot_bridge.navigation import layout as n
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from tests.closed_loop import healthy

Array = NDArray[np.float64]

GRAVITY_M_S2 = 9.80665
DT_S = 0.02


def wrap(angle: float) -> float:
    """Angle in -pi..pi."""
    return math.remainder(angle, 2.0 * math.pi)


class PointMass:
    """One flying point mass and its flight context.

    Args:
        place_ned_m: where it starts.
        heading_rad: through the air.
        wind_ne_m_s: velocity of the air.
    """

    def __init__(
        self,
        place_ned_m: tuple[float, float, float] = (0.0, 0.0, -100.0),
        heading_rad: float = 0.0,
        wind_ne_m_s: tuple[float, float] = (0.0, 0.0),
        parameters: FixedWingFlightParameters | None = None,
    ) -> None:
        p = parameters or FixedWingFlightParameters()
        self.parameters = p
        self.place = list(place_ned_m)
        self.heading = heading_rad
        self.wind = wind_ne_m_s
        self.roll = 0.0
        self.airspeed = p.airspeed_trim_m_s
        self.climb = 0.0
        self.throttle = p.trim_throttle
        self.ctx = FlightContext(parameters=p)
        self.ctx.health = healthy()
        self.ctx.frame = LocalFrame(GeodeticPosition(lat_deg=47.4, lon_deg=8.5, alt_m=489.0))
        self.ctx.armed = True
        self.ctx.landed_state = LandedState.IN_AIR
        self.ctx.ground_contact = self.ctx.maybe_landed = False
        self.ctx.home_ned_m[:] = 0.0
        self.ctx.home_yaw_rad = 0.0
        self.task: FlightTask | None = None
        self.log: list[tuple[float, float, float, float, float]] = []  # north, east, down, roll, airspeed
        self.observe()

    @property
    def velocity(self) -> tuple[float, float]:
        """Over ground."""
        return (
            self.airspeed * math.cos(self.heading) + self.wind[0],
            self.airspeed * math.sin(self.heading) + self.wind[1],
        )

    def observe(self) -> None:
        """Write the navigation state."""
        nav = self.ctx.nav
        nav[n.POS_NED_M] = self.place
        nav[n.VEL_NED_M_S] = (*self.velocity, -self.climb)
        nav[n.EULER_RAD] = (self.roll, 0.05, self.heading)
        nav[n.RATES_FRD_RAD_S] = 0.0
        nav[n.ACC_NED_M_S2] = 0.0
        nav[n.SPECIFIC_FORCE_FRD_M_S2] = (0.0, 0.0, -GRAVITY_M_S2)
        nav[n.WIND_NED_M_S] = (*self.wind, 0.0)
        nav[n.AIRSPEED_M_S] = nav[n.AIRSPEED_TRUE_M_S] = self.airspeed

    def fly(self, task: FlightTask) -> None:
        """Make a task the active one."""
        self.task = task
        task.activate(self.ctx)

    def run(self, duration_s: float) -> Array:
        """Fly for a while; (north, east, down, roll, airspeed) at 50 Hz of that time."""
        start = len(self.log)
        for _ in range(round(duration_s / DT_S)):
            if self.task is not None:
                self.task.update(self.ctx)
            self.ctx.time_us += 20_000
            self._move(self.ctx.setpoint)
            self.observe()
            self.log.append((*self.place, self.roll, self.airspeed))
        return np.array(self.log[start:])

    def _wanted_roll(self, s: Array) -> float:
        if math.isfinite(s[sp.ROLL_RAD]):
            return float(s[sp.ROLL_RAD])
        acceleration = float(s[sp.LATERAL_ACCELERATION_M_S2])
        acceleration = acceleration if math.isfinite(acceleration) else 0.0
        heading = float(s[sp.HEADING_RAD])
        course = float(s[sp.COURSE_RAD])
        if math.isfinite(course):
            cross = self.wind[1] * math.cos(course) - self.wind[0] * math.sin(course)
            heading = course - math.asin(min(1.0, max(-1.0, cross / self.airspeed)))
        if math.isfinite(heading):
            acceleration += (
                0.8885
                * self.airspeed
                * math.sin(min(0.5 * math.pi, max(-0.5 * math.pi, wrap(heading - self.heading))))
            )
        limit = float(s[sp.ROLL_LIMIT_RAD])
        limit = limit if math.isfinite(limit) else self.parameters.bank_max_rad
        return min(limit, max(-limit, math.atan(acceleration / GRAVITY_M_S2)))

    def _wanted_climb(self, s: Array) -> float:
        rate = float(s[sp.HEIGHT_RATE_M_S])
        rate = rate if math.isfinite(rate) else 0.0
        if math.isfinite(s[sp.DOWN_M]):
            rate += 0.4 * (self.place[2] - float(s[sp.DOWN_M]))
        p = self.parameters
        return min(p.climb_max_m_s, max(-p.sink_max_m_s, rate))

    def _move(self, s: Array) -> None:
        if s[sp.LEVEL] != sp.FLY:
            return
        p = self.parameters
        self.roll += DT_S / p.roll_time_constant_s * (self._wanted_roll(s) - self.roll)
        wanted = float(s[sp.AIRSPEED_M_S])
        wanted = wanted if math.isfinite(wanted) else p.airspeed_trim_m_s
        self.airspeed += DT_S / 2.0 * (wanted - self.airspeed)
        self.climb += DT_S / 1.0 * (self._wanted_climb(s) - self.climb)
        self.heading = wrap(self.heading + DT_S * GRAVITY_M_S2 * math.tan(self.roll) / self.airspeed)
        north, east = self.velocity
        self.place[0] += north * DT_S
        self.place[1] += east * DT_S
        self.place[2] -= self.climb * DT_S
