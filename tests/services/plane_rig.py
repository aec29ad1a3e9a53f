"""Services around the commander of an aircraft, which flies straight on where it is put."""

import math

import numpy as np

from autopilot_bridge.commander.commander import Commander
from autopilot_bridge.commander.health import HealthMonitor
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.flight.context import FlightContext, LandedState
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.parameters import ParameterStore
from flightsim.airframe import AirframeKind
from flightsim.foundation.geodesy import LocalFrame
from flightsim.interface import SensorReadings
from tests.commander.rig import ORIGIN, READY_S, Judgement
from tests.services.aircraft import SMALL_AIRCRAFT
from tests.services.command_rig import ServiceRig

GUIDED, HOLD = FlightMode.GUIDED, FlightMode.HOLD
HEIGHT_M = 100.0


class StillLandDetector:
    """Leaves the landed state as the test sets it."""

    def update(self, ctx: FlightContext, thrust: float) -> LandedState:
        return ctx.landed_state


class PlaneRig(ServiceRig):
    """A commander of an aircraft with its services."""

    def __init__(self, flavour: str, *, start_s: float = READY_S, **parameters: float) -> None:
        self.flavour = get_flavour(flavour, AirframeKind.FIXED_WING)
        airframe = self.flavour.airframe_of
        assert airframe is not None
        self.store = ParameterStore(
            self.flavour.parameter_definitions(), {**airframe(SMALL_AIRCRAFT), **parameters}
        )
        self.readings = SensorReadings()
        self.judgement = Judgement()
        self.context = FlightContext(parameters=self._flight_parameters())
        self.context.nav[:] = 0.0
        self.context.nav[nav.Q_NED_FROM_FRD] = (1.0, 0.0, 0.0, 0.0)
        self.context.nav[nav.HEIGHT_ABOVE_GROUND_M] = math.nan
        self.context.frame = LocalFrame(ORIGIN)
        self.navigation = NavigationHealth()
        self.navigation.uninitialised = False
        self.context.health = self.navigation
        self.missions, self.fence = MissionStore(), MissionStore()
        self.mission_valid = self.sensors_on = True
        self.spoil = None
        self.time_us = round(start_s * 1e6)
        self.events = []
        self._write_readings()
        self.commander = Commander(
            self.context,
            policy=self.flavour.policy,
            parameters=self.flavour.commander_parameters(self.store),
            vehicle=self.flavour.flight.vehicle_tasks(self.context, self.missions, self.flavour.policy),
            health=HealthMonitor(self.readings, self.judgement),
            land_detector=StillLandDetector(),
            thrust=lambda: 0.3,
            missions=self.missions,
            fence=self.fence,
            mission_valid=lambda: self.mission_valid,
        )
        self.tick()
        self.tick()
        self.connect()

    def _flight_parameters(self):
        return self.flavour.flight_parameters(self.store, envelope=SMALL_AIRCRAFT)

    def _follow(self) -> None:
        """Straight on, north at the trim airspeed, while it is in the air."""
        if self.context.landed_state is LandedState.IN_AIR:
            self.context.nav[nav.VEL_NED_M_S] = (25.0, 0.0, 0.0)
            self.context.nav[nav.AIRSPEED_M_S] = self.context.nav[nav.AIRSPEED_TRUE_M_S] = 25.0

    def fly(self, mode: FlightMode | None = None) -> "PlaneRig":
        """In the air, in the mode that goes to places unless another is requested."""
        start = FlightMode.MANUAL if self.flavour.name == "ardupilot" else HOLD
        self.commander.set_mode(start)
        assert self.commander.arm().accepted, self.commander.arming_reasons
        self.context.nav[nav.POS_NED_M] = (0.0, 0.0, -HEIGHT_M)
        self.context.landed_state = LandedState.IN_AIR
        self.tick()
        wanted = mode or (GUIDED if self.flavour.name == "ardupilot" else HOLD)
        assert self.commander.set_mode(wanted).accepted
        self.commander.tasks.enter(self.commander.mode)
        self.tick()
        assert self.commander.airborne
        return self

    def plan(self, *items: MissionItem) -> None:
        self.upload(*items)
        self.tick()

    def place(self, north_m: float, east_m: float) -> tuple[int, int]:
        assert self.context.frame is not None
        lat, lon, _ = self.context.frame.geodetic_from_ned(north_m, east_m, 0.0)
        return round(lat * 1e7), round(lon * 1e7)

    def centre(self) -> np.ndarray:
        """Centre and height of the circle being flown."""
        task = self.commander.tasks.task
        return getattr(task, "circle", task).centre_ned_m
