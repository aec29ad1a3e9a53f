"""Modes, arming, failsafes and home: decides what the vehicle flies. Flavour-neutral, set by a policy."""

from autopilot_bridge.commander.commander import Commander
from autopilot_bridge.commander.health import HealthMonitor, VehicleHealth
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.policy import CommanderPolicy
from autopilot_bridge.commander.verdict import Reason, Result, Verdict

__all__ = [
    "Commander",
    "CommanderParameters",
    "CommanderPolicy",
    "FlightMode",
    "HealthMonitor",
    "Reason",
    "Result",
    "VehicleHealth",
    "Verdict",
]
