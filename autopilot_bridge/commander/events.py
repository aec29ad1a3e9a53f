"""Events of the vehicle, with types. Flavours convert them into the texts that a ground station shows."""

import math
from dataclasses import dataclass
from enum import Enum, IntEnum, auto

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason
from flightsim.foundation.geodesy import GeodeticPosition


class DisarmReason(Enum):
    """Why the motors stopped."""

    COMMAND = auto()
    FORCED = auto()  # a command with the override number, also in the air
    PREFLIGHT_TIMEOUT = auto()  # armed, never took off
    LANDED = auto()
    FAILSAFE = auto()
    TERMINATION = auto()


class FailsafeKind(Enum):
    """Conditions with a separate failsafe."""

    OFFBOARD_LOST = auto()
    GCS_LOST = auto()
    MANUAL_LOST = auto()
    BATTERY_LOW = auto()
    BATTERY_CRITICAL = auto()
    BATTERY_EMERGENCY = auto()
    POSITION_LOST = auto()
    GEOFENCE = auto()
    MANUAL_LOST_LONG = auto()  # the second stage of a lost radio (ArduPlane's long failsafe)
    POSITION_INACCURATE = auto()
    ATTITUDE_EXCESSIVE = auto()


class Aid(Enum):
    """An aid of the flight that may be lost."""

    GROUND_STATION = auto()
    STICKS = auto()
    GPS = auto()  # as used by the navigation filter


class FailsafeAction(IntEnum):
    """The action of a failsafe. The order is the precedence: the greatest of all active actions is flown."""

    NONE = 0
    WARN = 1
    POSITION = 2  # fall back to position, altitude or stabilised mode, flown by stick
    ALTITUDE = 3
    STABILIZED = 4
    HOLD = 5
    CIRCLE = 6  # at the present place, if necessary without a position (ArduPlane)
    BRAKE = 7
    FENCE_POINT = 8  # to the fence's return point in GUIDED (ArduPlane)
    RETURN = 9
    MISSION = 10  # the plan, with its landing (ArduPlane)
    LAND = 11
    GLIDE = 12  # level, without power (ArduPlane)
    DESCEND = 13
    TERMINATE = 14
    DISARM = 15


class BatteryLevel(IntEnum):
    """Battery warning level, as MAV_BATTERY_CHARGE_STATE: 1 ok, 2 low, 3 critical, 4 emergency."""

    OK = 1
    LOW = 2
    CRITICAL = 3
    EMERGENCY = 4


class SystemStatus(IntEnum):
    """MAVLink MAV_STATE."""

    UNINIT = 0
    BOOT = 1
    CALIBRATING = 2
    STANDBY = 3
    ACTIVE = 4
    CRITICAL = 5
    EMERGENCY = 6
    POWEROFF = 7
    FLIGHT_TERMINATION = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """An event, with its time (microseconds since boot)."""

    time_us: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Booted(Event):
    """The boot sequence is over; the vehicle may not be ready to fly yet."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationReady(Event):
    """The navigation filter has a position for the first time, or again after a loss."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeChanged(Event):
    """The mode being flown changed, by command or by failsafe."""

    mode: FlightMode
    previous: FlightMode


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeDenied(Event):
    """A requested mode cannot be entered."""

    mode: FlightMode | None
    reason: Reason
    custom_mode: int | None = None


class SetpointFault(Enum):
    """Why a streamed setpoint is not used."""

    FRAME = auto()
    FORCES = auto()
    NOTHING = auto()  # to control


@dataclass(frozen=True, slots=True, kw_only=True)
class SetpointDenied(Event):
    """A streamed setpoint is not used, and the firmware reports it (PX4)."""

    message: str
    fault: SetpointFault
    frame: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Armed(Event):
    """Motors may turn."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Disarmed(Event):
    """Motors are stopped."""

    reason: DisarmReason


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmingDenied(Event):
    """A client or pilot requested arming; these checks failed.

    Attributes:
        faults: the parameter values that are meant by `Reason.PARAMETERS`, in the firmware's words.
    """

    mode: FlightMode
    reasons: tuple[Reason, ...]
    check_only: bool = False
    faults: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class DisarmingDenied(Event):
    """A client or pilot requested disarming in the air."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandDenied(Event):
    """A command was refused with a reason that is reported as a text."""

    command: int
    reason: Reason


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandAccepted(Event):
    """A command was accepted that some firmwares report as a text."""

    command: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FailsafeActivated(Event):
    """A failsafe condition became active and its action is taken."""

    kind: FailsafeKind
    action: FailsafeAction


@dataclass(frozen=True, slots=True, kw_only=True)
class FailsafeCleared(Event):
    """The condition of an active failsafe has cleared."""

    kind: FailsafeKind
    action: FailsafeAction


@dataclass(frozen=True, slots=True, kw_only=True)
class TakeoffDetected(Event):
    """The vehicle left the ground."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LandingDetected(Event):
    """The vehicle stands on the ground."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionItemReached(Event):
    """An item of the mission is finished; `index` counts as in the stored plan.

    `distance_m`: distance from its position, for an item that an aircraft flew past; NaN for others.
    `navigation`: it was flown; False for DO_ and CONDITION_ items.
    """

    index: int
    distance_m: float = math.nan
    navigation: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionFinished(Event):
    """The last item of the mission is finished; `landed`: it ended on the ground."""

    landed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ReturnStarted(Event):
    """A return begins: its altitude over mean sea level, and its height over the destination."""

    alt_amsl_m: float
    above_destination_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ReturnLandingStarted(Event):
    """A return has come to its destination and lands there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HomeSet(Event):
    """Home has a new position."""

    home: GeodeticPosition


@dataclass(frozen=True, slots=True, kw_only=True)
class FenceBreached(Event):
    """The vehicle has crossed a wall of the geofence; `walls` are the newly breached `FenceType` bits."""

    walls: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FenceSwitched(Event):
    """The geofence was switched automatically (FENCE_AUTOENABLE); `walls` are `FenceType` bits."""

    walls: int
    on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ItemCommanded(Event):
    """A mission item is due that equipment or another part of the autopilot executes."""

    index: int


@dataclass(frozen=True, slots=True, kw_only=True)
class BatteryWarning(Event):
    """The battery's warning level rose."""

    level: BatteryLevel
    voltage_v: float
    used_ah: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AidChanged(Event):
    """An aid of the flight was lost, or is available again after `after_s` seconds."""

    aid: Aid
    present: bool
    after_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationLost(Event):
    """The navigation filter has no position any more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Crashed(Event):
    """The vehicle does not move, and its attitude is far from the setpoint."""

    angle_error_deg: float
    acceleration_m_s2: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AirspeedChanged(Event):
    """The airspeed sensor was disabled in flight, or is used again."""

    valid: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class RebootRequested(Event):
    """A client requested a reboot, and it is allowed (disarmed)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LaunchDetected(Event):
    """An aircraft's take-off begins: the launch was detected, or no detection is required.

    `acceleration_m_s2` along the body, `delay_s` until power is applied.
    """

    acceleration_m_s2: float
    delay_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TakeoffStarted(Event):
    """An aircraft's take-off has motor power: its ground speed, target height over home and heading."""

    ground_speed_m_s: float
    height_m: float
    heading_deg: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LandingApproachStarted(Event):
    """An aircraft is on its final approach, with its height over home."""

    height_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FlareStarted(Event):
    """An aircraft flares: height over the ground, sink rate, ground speed."""

    height_m: float
    sink_m_s: float
    ground_speed_m_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LandingAborted(Event):
    """A landing was aborted; the aircraft climbs to a height over home (NaN: the height set before)."""

    height_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AltitudeChanged(Event):
    """A streamed setpoint commanded another height over home to an aircraft."""

    height_m: float
