"""Flight tasks of the fixed wing, over the setpoint of `control.fixed_wing.setpoint`. Flavour-neutral."""

from autopilot_bridge.flight.fixed_wing.descend import DescendTask
from autopilot_bridge.flight.fixed_wing.guided import GuidedTask
from autopilot_bridge.flight.fixed_wing.land_detector import LandDetector, LandDetectorParameters
from autopilot_bridge.flight.fixed_wing.landing import LandPhase, LandTask
from autopilot_bridge.flight.fixed_wing.loiter import LoiterTask
from autopilot_bridge.flight.fixed_wing.manual import ManualMode, ManualTask
from autopilot_bridge.flight.fixed_wing.mission import MissionTask
from autopilot_bridge.flight.fixed_wing.offboard import OffboardTask
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters, LaunchKind, TurnInRule
from autopilot_bridge.flight.fixed_wing.path_guidance import PathGuidance
from autopilot_bridge.flight.fixed_wing.return_home import ReturnTask
from autopilot_bridge.flight.fixed_wing.takeoff import TakeoffPhase, TakeoffTask
from autopilot_bridge.flight.parameters import ReturnDestination
from autopilot_bridge.flight.return_place import ReturnPhase
from autopilot_bridge.flight.task import GuidedKind, OffboardKind

__all__ = [
    "DescendTask",
    "FixedWingFlightParameters",
    "GuidedKind",
    "GuidedTask",
    "LandDetector",
    "LandDetectorParameters",
    "LandPhase",
    "LandTask",
    "LaunchKind",
    "LoiterTask",
    "ManualMode",
    "ManualTask",
    "MissionTask",
    "OffboardKind",
    "OffboardTask",
    "PathGuidance",
    "ReturnDestination",
    "ReturnPhase",
    "ReturnTask",
    "TakeoffPhase",
    "TakeoffTask",
    "TurnInRule",
]
