"""The data for flight tasks: one mutable context per vehicle, filled by the autopilot before each 50 Hz
update.

All values come from the navigation filter, the parameters and the pilot; never from truth or a clock.
Positions are local NED metres at the filter's origin.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing import setpoint as fixed_wing_setpoint
from autopilot_bridge.control.multicopter.setpoint import SETPOINT_SIZE
from autopilot_bridge.flight.parameters import FlightParameters
from autopilot_bridge.flight.surroundings import Surroundings
from autopilot_bridge.mission_plan import MissionStore
from autopilot_bridge.navigation import layout as nav_layout
from autopilot_bridge.navigation.health import NavigationHealth
from flightsim.foundation.geodesy import LocalFrame

if TYPE_CHECKING:
    from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters

Array = NDArray[np.float64]

TASK_RATE_HZ: Final = 50.0


class LandedState(IntEnum):
    """MAV_LANDED_STATE."""

    UNDEFINED = 0
    ON_GROUND = 1
    IN_AIR = 2
    TAKEOFF = 3
    LANDING = 4


class FlightPhase(IntEnum):
    """The phase of the active task, as far as the landed state shows it."""

    CRUISE = 0
    TAKEOFF = 1
    LANDING = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class ManualInput:
    """Sticks as in MANUAL_CONTROL, -1..1: positive is right, stick forward, up, clockwise. `valid` is False
    without input from a pilot; `simulated` is True for a simulated radio with untouched sticks.
    """

    roll: float = 0.0
    pitch: float = 0.0  # positive: stick forward, fly forward
    throttle: float = 0.0
    yaw: float = 0.0
    valid: bool = False
    simulated: bool = False

    def __post_init__(self) -> None:
        for name in ("roll", "pitch", "throttle", "yaw"):
            value = getattr(self, name)
            if not -1.0 <= value <= 1.0:
                raise ValueError(f"manual input {name} = {value} is not in -1..1")


class RoiMode(IntEnum):
    """MAV_ROI."""

    NONE = 0
    NEXT_WAYPOINT = 1
    WAYPOINT = 2
    LOCATION = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class RegionOfInterest:
    """A region of interest.

    Attributes:
        mode: its kind.
        place_ned_m: local NED, (3,), of a LOCATION.
        index: item of a WAYPOINT.
        yaw_offset_rad: added to the direction of the NEXT_WAYPOINT.
    """

    mode: RoiMode
    place_ned_m: Array | None = None
    index: int = -1
    yaw_offset_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class WaypointReached:
    """A mission item was completed (MISSION_ITEM_REACHED).

    `navigation` is False for DO_ and CONDITION_ items.
    """

    seq: int
    navigation: bool = True


@dataclass(frozen=True, slots=True)
class WaypointStarted:
    """A mission item became the current one."""

    seq: int


@dataclass(frozen=True, slots=True)
class MissionFinished:
    """The last item of the plan is finished; the vehicle holds its position."""


@dataclass(frozen=True, slots=True)
class MissionModeRequested:
    """A mission item requires another mode (NAV_RETURN_TO_LAUNCH)."""

    command: int


@dataclass(frozen=True, slots=True)
class HomeChangeRequested:
    """A mission item commands a new home (DO_SET_HOME), local NED."""

    north_m: float
    east_m: float
    down_m: float


@dataclass(frozen=True, slots=True)
class ItemCommanded:
    """An item of the plan that other equipment or another part of the autopilot executes."""

    seq: int


@dataclass(frozen=True, slots=True)
class TaskFinished:
    """The active task is finished."""

    task: str


@dataclass(frozen=True, slots=True)
class ReturnStarted:
    """A return begins: down coordinates, local NED, of its flight and of its destination."""

    down_m: float
    destination_down_m: float


@dataclass(frozen=True, slots=True)
class ReturnLandingStarted:
    """A return lands at its destination."""


@dataclass(frozen=True, slots=True)
class TouchedDown:
    """A landing task has detected the final touchdown."""


FlightEvent = (
    WaypointReached
    | WaypointStarted
    | MissionFinished
    | MissionModeRequested
    | HomeChangeRequested
    | ItemCommanded
    | TaskFinished
    | ReturnStarted
    | ReturnLandingStarted
    | TouchedDown
)


class FlightContext:
    """State shared by the autopilot, its flight tasks and the land detector.

    Attributes:
        time_us: vehicle time of this update.
        dt_s: time since the previous update (the task period).
        nav: navigation state, layout `navigation.layout` (shared with the filter).
        attitude_setpoint: q_ned_from_frd that the attitude loop follows, a view; None: not available.
        health: the filter's own state; None before the first solution.
        setpoint: control setpoint, layout `control.setpoint` or `control.fixed_wing.setpoint` (shared with
            the controller); tasks write it.
        home_ned_m: home in the local frame, (3,); NaN while unset.
        home_yaw_rad: heading at home, NaN while unset.
        parameters: limits and preferences of flight, of the vehicle's kind (`multicopter`, `fixed_wing`).
        landed_state: newest result of the land detector.
        ground_contact: the land detector has detected ground contact but not yet the landing.
        maybe_landed: the thrust is low and nothing moves; one step before ON_GROUND.
        phase: whether the active task takes off or lands.
        armed: motors may turn.
        sticks: newest pilot input.
        frame: local frame of the filter's origin, None before it is known.
        rally: the uploaded rally points; None: there are none.
        roi: the region of interest, by the mission or a command, until the mode changes; None: none.
        nose_on_roi: the nose points to it in every task (a mission decides for itself).
        surroundings: targets and obstacles that other systems have reported.
        within_fence: returns whether a position, local NED, (3,), is inside the geofence; None: not known.
        events: the events since the autopilot last emptied the list.
        hover_thrust: the controller's estimate, 0..1.
    """

    def __init__(
        self,
        *,
        nav: Array | None = None,
        setpoint: Array | None = None,
        parameters: FlightParameters | FixedWingFlightParameters | None = None,
    ) -> None:
        self.time_us = 0
        self.dt_s = 1.0 / TASK_RATE_HZ
        self.nav: Array = np.full(nav_layout.NAV_SIZE, np.nan) if nav is None else nav
        self.health: NavigationHealth | None = None
        self.attitude_setpoint: Array | None = None
        self.parameters: FlightParameters | FixedWingFlightParameters = (
            FlightParameters() if parameters is None else parameters
        )
        if setpoint is None:
            multicopter = isinstance(self.parameters, FlightParameters)
            size = SETPOINT_SIZE if multicopter else fixed_wing_setpoint.SETPOINT_SIZE
            setpoint = np.full(size, np.nan)
        self.setpoint: Array = setpoint
        self.home_ned_m: Array = np.full(3, np.nan)
        self.home_yaw_rad = math.nan
        self.landed_state = LandedState.ON_GROUND
        self.ground_contact = True
        self.maybe_landed = True
        self.phase = FlightPhase.CRUISE
        self.armed = False
        self.sticks = ManualInput()
        self.frame: LocalFrame | None = None
        self.rally: MissionStore | None = None
        self.roi: RegionOfInterest | None = None
        self.nose_on_roi = False
        self.surroundings = Surroundings()
        self.within_fence: Callable[[Array], bool] | None = None
        self.events: list[FlightEvent] = []
        self.hover_thrust = 0.5

    def look_at(self, roi: RegionOfInterest | None, *, nose: bool = False) -> None:
        """Set a region of interest; with `nose` the nose points to it in every task."""
        self.roi = roi
        self.nose_on_roi = nose and roi is not None

    @property
    def multicopter(self) -> FlightParameters:
        """The parameters of a multicopter.

        Raises:
            TypeError: the vehicle is no multicopter.
        """
        parameters = self.parameters
        if not isinstance(parameters, FlightParameters):
            raise TypeError(f"{type(parameters).__name__} is not what a multicopter's task flies by")
        return parameters

    @property
    def fixed_wing(self) -> FixedWingFlightParameters:
        """The parameters of a fixed wing.

        Raises:
            TypeError: the vehicle is no fixed wing.
        """
        parameters = self.parameters
        if isinstance(parameters, FlightParameters):
            raise TypeError(f"{type(parameters).__name__} is not what a fixed wing's task flies by")
        return parameters

    @property
    def on_ground(self) -> bool:
        """The land detector reports ground."""
        return self.landed_state is LandedState.ON_GROUND

    @property
    def position_valid(self) -> bool:
        """The horizontal position can be used for flight."""
        health = self.health
        return health is not None and (
            health.position_horizontal_relative or health.position_horizontal_absolute
        )

    @property
    def velocity_valid(self) -> bool:
        """The horizontal velocity can be used for flight."""
        return self.health is not None and self.health.velocity_horizontal

    @property
    def altitude_valid(self) -> bool:
        """The vertical position and velocity can be used for flight."""
        return self.health is not None and self.health.position_vertical_absolute

    @property
    def height_above_home_m(self) -> float:
        """Height over home; over the filter's origin while home is unset."""
        home_down_m = float(self.home_ned_m[2])
        down_m = float(self.nav[nav_layout.POS_NED_M][2])
        return -down_m if math.isnan(home_down_m) else home_down_m - down_m
