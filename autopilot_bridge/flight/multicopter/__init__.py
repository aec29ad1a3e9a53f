"""Flight tasks: each flies one kind of manoeuvre by writing the control setpoint. Flavour-neutral."""

from autopilot_bridge.flight.context import FlightContext, FlightPhase, LandedState, ManualInput
from autopilot_bridge.flight.multicopter.guided import GuidedTask
from autopilot_bridge.flight.multicopter.hold import BrakeTask, GotoTask, HoldTask, RepositionTask
from autopilot_bridge.flight.multicopter.land import LandTask
from autopilot_bridge.flight.multicopter.land_detector import LandDetector, LandDetectorParameters
from autopilot_bridge.flight.multicopter.manual import ManualMode, ManualTask
from autopilot_bridge.flight.multicopter.mission import MissionTask
from autopilot_bridge.flight.multicopter.offboard import OffboardTask
from autopilot_bridge.flight.multicopter.orbit import OrbitTask, OrbitYaw
from autopilot_bridge.flight.multicopter.return_home import ReturnTask
from autopilot_bridge.flight.multicopter.takeoff import TakeoffTask
from autopilot_bridge.flight.parameters import FlightParameters, YawBehaviour
from autopilot_bridge.flight.return_place import ReturnPhase
from autopilot_bridge.flight.task import (
    FlightTask,
    GuidedKind,
    IdleTask,
    OffboardKind,
    TaskStatus,
    clear_setpoint,
)

__all__ = [
    "BrakeTask",
    "FlightContext",
    "FlightParameters",
    "FlightPhase",
    "FlightTask",
    "GotoTask",
    "GuidedKind",
    "GuidedTask",
    "HoldTask",
    "IdleTask",
    "LandDetector",
    "LandDetectorParameters",
    "LandTask",
    "LandedState",
    "ManualInput",
    "ManualMode",
    "ManualTask",
    "MissionTask",
    "OffboardKind",
    "OffboardTask",
    "OrbitTask",
    "OrbitYaw",
    "RepositionTask",
    "ReturnPhase",
    "ReturnTask",
    "TakeoffTask",
    "TaskStatus",
    "YawBehaviour",
    "clear_setpoint",
]
