"""A commander with everything around it, on a vehicle that follows its setpoints exactly."""

import math
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.commander import Commander
from autopilot_bridge.commander.events import Event
from autopilot_bridge.commander.health import HealthMonitor
from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.flight.context import FlightContext, FlightPhase, LandedState
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.parameters import ParameterStore
from flightsim import interface
from flightsim.airframe import AirframeKind
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.interface import SensorReadings

PERIOD_US = 20_000
READY_S = 45.0
ORIGIN = GeodeticPosition(lat_deg=47.39774, lon_deg=8.54559, alt_m=489.0)


class Judgement:
    """The filter's word, set by the test."""

    def __init__(self) -> None:
        self.attitude_valid = True
        self.altitude_valid = True
        self.velocity_valid = True
        self.position_valid = True
        self.position_accuracy_m = 0.5
        self.external = False
        self.airspeed_rejected = False


class FollowerLandDetector:
    """On the ground at zero height when nothing wants up."""

    def update(self, ctx: FlightContext, thrust: float) -> LandedState:
        height_m = -float(ctx.nav[nav.POS_NED_M][2])
        if ctx.setpoint.size != sp.SETPOINT_SIZE:
            ctx.landed_state = LandedState.ON_GROUND if height_m <= 0.02 else LandedState.IN_AIR
            return ctx.landed_state
        resting = height_m <= 0.02 and not (
            ctx.armed and ctx.setpoint[sp.LEVEL] > sp.IDLE and ctx.setpoint[sp.VEL + 2] < 0.0
        )
        ctx.ground_contact = ctx.maybe_landed = resting
        if resting:
            ctx.landed_state = LandedState.ON_GROUND
        elif ctx.phase is FlightPhase.TAKEOFF:
            ctx.landed_state = LandedState.TAKEOFF
        elif ctx.phase is FlightPhase.LANDING:
            ctx.landed_state = LandedState.LANDING
        else:
            ctx.landed_state = LandedState.IN_AIR
        return ctx.landed_state


class Rig:
    """One commander of a flavour; `run` advances it, `events` collects what happened."""

    def __init__(
        self,
        flavour: str = "px4",
        *,
        kind: AirframeKind = AirframeKind.MULTICOPTER,
        start_s: float = READY_S,
        **parameters: float,
    ) -> None:
        self.flavour = get_flavour(flavour, kind)
        self.store = ParameterStore(self.flavour.parameter_definitions(), parameters)
        self.readings = SensorReadings()
        self.judgement = Judgement()
        self.context = FlightContext(parameters=self.flavour.flight_parameters(self.store))
        self.context.nav[:] = 0.0
        self.context.nav[nav.Q_NED_FROM_FRD] = (1.0, 0.0, 0.0, 0.0)
        self.context.nav[nav.HEIGHT_ABOVE_GROUND_M] = math.nan
        self.context.frame = LocalFrame(ORIGIN)
        self.navigation = NavigationHealth()
        self.navigation.uninitialised = False
        self.context.health = self.navigation
        self.missions = MissionStore()
        self.fence = MissionStore()
        self.mission_valid = True
        self.sensors_on = True
        self.spoil: Any = None
        self.time_us = round(start_s * 1e6)
        self.events: list[Event] = []
        self.detector: Any = FollowerLandDetector()
        self._write_readings()
        self.commander = Commander(
            self.context,
            policy=self.flavour.policy,
            parameters=self.flavour.commander_parameters(self.store),
            vehicle=self.flavour.flight.vehicle_tasks(self.context, self.missions, self.flavour.policy),
            health=HealthMonitor(self.readings, self.judgement, airspeed=self.flavour.flight.has_airspeed),
            land_detector=self.detector,
            thrust=lambda: 0.3,
            missions=self.missions,
            fence=self.fence,
            mission_valid=lambda: self.mission_valid,
        )
        self.tick()

    @property
    def time_s(self) -> float:
        return self.time_us * 1e-6

    @property
    def height_m(self) -> float:
        return -float(self.context.nav[nav.POS_NED_M][2])

    def set_parameter(self, name: str, value: float) -> None:
        self.store.set(name, value)
        self.commander.parameters = self.flavour.commander_parameters(self.store)
        self.commander.guidance.set_parameters(self.flavour.flight_parameters(self.store))

    def tick(self) -> None:
        self.time_us += PERIOD_US
        valid = self.judgement
        self.navigation.attitude = valid.attitude_valid
        self.navigation.position_vertical_absolute = valid.altitude_valid
        self.navigation.velocity_horizontal = valid.velocity_valid
        self.navigation.position_horizontal_absolute = valid.position_valid
        self._write_readings()
        self.commander.update(self.time_us)
        self.events.extend(self.commander.drain_events())
        self._follow()

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 1e6) // PERIOD_US):
            self.tick()

    def run_until(self, condition: Any, limit_s: float) -> float:
        """Seconds until `condition()`; fails after the limit."""
        start_us = self.time_us
        while not condition():
            assert self.time_us - start_us < limit_s * 1e6, (
                f"not within {limit_s} s; mode {self.commander.mode}"
            )
            self.tick()
        return (self.time_us - start_us) * 1e-6

    def happened(self, kind: type) -> list[Any]:
        return [event for event in self.events if isinstance(event, kind)]

    def texts(self) -> list[str]:
        return [notice.text for event in self.events for notice in self.flavour.texts.notices(event)]

    def put_in_air(self, height_m: float = 10.0) -> None:
        """Armed and hovering, without the way there."""
        commander = self.commander
        assert commander.arm().accepted, commander.arming_reasons
        self.context.nav[nav.POS_NED_M] = (0.0, 0.0, -height_m)
        self.context.landed_state = LandedState.IN_AIR
        commander.tasks.enter(commander.mode)
        self.tick()
        assert commander.airborne
        self.context.nav[nav.POS_NED_M] = 0.0
        commander.home.begin_flight()  # home where it stood, not where it appeared
        self.context.nav[nav.POS_NED_M] = (0.0, 0.0, -height_m)

    def waypoint(
        self,
        north_m: float,
        east_m: float,
        height_m: float = 10.0,
        command: int = mavlink.MAV_CMD_NAV_WAYPOINT,
    ) -> MissionItem:
        assert self.context.frame is not None
        lat, lon, _ = self.context.frame.geodetic_from_ned(north_m, east_m, 0.0)
        return MissionItem(command=command, frame=6, x=lat, y=lon, z=height_m)

    def upload(self, *items: MissionItem) -> None:
        home = (self.waypoint(0.0, 0.0, 0.0),) if self.flavour.policy.mission_first_item else ()
        self.missions.replace((*home, *items), 1)

    def _write_readings(self) -> None:
        if not self.sensors_on:
            return
        readings, jitter = self.readings, 1e-6 * (self.time_us // PERIOD_US % 7)
        readings.airspeed.values[:] = (1.0 + jitter, 15.0)
        imu = readings.imu.values
        imu[interface.IMU_GYRO_FRD_RAD_S] = jitter
        imu[interface.IMU_ACCEL_FRD_M_S2] = (jitter, 0.0, -9.81)
        readings.barometer.values[:] = (95_000.0 + jitter, 15.0)
        readings.magnetometer.values[:] = (0.2 + jitter, 0.0, 0.4)
        gps = readings.gps.values
        gps[:] = 0.0
        gps[interface.GPS_LAT_DEG] = ORIGIN.lat_deg + jitter
        gps[interface.GPS_FIX_TYPE], gps[interface.GPS_SATELLITES], gps[interface.GPS_EPH_M] = 3.0, 10.0, 0.8
        if not np.isfinite(readings.battery.values).all():
            readings.battery.values[:] = (16.2, 1.0, 0.0, 1.0)
        readings.battery.values[interface.BATTERY_CURRENT_A] = 1.0 + jitter
        for reading in (
            readings.imu,
            readings.barometer,
            readings.magnetometer,
            readings.gps,
            readings.battery,
            readings.airspeed,
        ):
            reading.time_us = self.time_us
        if self.spoil is not None:
            self.spoil()

    def _follow(self) -> None:
        """The vehicle does what the setpoint says."""
        ctx, dt_s = self.context, PERIOD_US * 1e-6
        position, velocity = ctx.nav[nav.POS_NED_M], ctx.nav[nav.VEL_NED_M_S]
        velocity[:] = 0.0
        if self.flavour.kind is AirframeKind.FIXED_WING:
            return  # the test moves it
        if not ctx.armed or ctx.setpoint[sp.LEVEL] <= sp.IDLE:
            return
        wanted, speed = ctx.setpoint[sp.POS_NED_M], ctx.setpoint[sp.VEL_NED_M_S]
        for axis in range(3):
            if math.isfinite(wanted[axis]):
                step = min(0.5, max(-0.5, wanted[axis] - position[axis]))
                position[axis] += step
                velocity[axis] = step / dt_s
            elif math.isfinite(speed[axis]):
                position[axis] += speed[axis] * dt_s
                velocity[axis] = speed[axis]
        if position[2] >= 0.0:
            position[2] = velocity[2] = 0.0
        yaw = ctx.setpoint[sp.YAW_RAD]
        if math.isfinite(yaw):
            ctx.nav[nav.EULER_RAD] = (0.0, 0.0, yaw)
