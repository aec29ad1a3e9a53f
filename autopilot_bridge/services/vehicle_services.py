"""Calibration, actuators, traffic, modes and sticks: the services of a firmware for a class of vehicle."""

from autopilot_bridge.firmware.ardupilot.calibration import ArdupilotCalibration
from autopilot_bridge.firmware.ardupilot.compass_calibration import CompassCalibration
from autopilot_bridge.firmware.px4.calibration import Px4Calibration
from autopilot_bridge.services.commands.available_modes import AvailableModes
from autopilot_bridge.services.equipment.actuators import (
    ArducopterActuators,
    ArduplaneActuators,
    Px4Actuators,
)
from autopilot_bridge.services.inputs.manual import ManualService
from autopilot_bridge.services.inputs.traffic import ARDUPILOT_TRAFFIC, PX4_TRAFFIC, TrafficService
from autopilot_bridge.services.microservice import AutopilotParts, Microservice
from flightsim.airframe import AirframeKind


def small_services(parts: AutopilotParts) -> tuple[Microservice, ...]:
    """The services of one autopilot."""
    manual = ManualService.of(parts)
    if parts.flavour.name == "px4":
        return (
            manual,
            Px4Calibration(parts),
            Px4Actuators(parts),
            TrafficService(parts, PX4_TRAFFIC),
            AvailableModes(parts.flavour),
        )
    aircraft = parts.flavour.kind is AirframeKind.FIXED_WING
    return (
        manual,
        ArdupilotCalibration(parts),
        CompassCalibration(parts),
        ArduplaneActuators(parts) if aircraft else ArducopterActuators(parts),
        TrafficService(parts, ARDUPILOT_TRAFFIC),
    )
