"""What flies the two classes of vehicles, the same for both firmwares."""

from typing import Final

from autopilot_bridge.commander.fixed_wing_tasks import FixedWingTasks
from autopilot_bridge.commander.multicopter_tasks import MulticopterTasks
from autopilot_bridge.control.fixed_wing import FixedWingController
from autopilot_bridge.control.multicopter import MulticopterController
from autopilot_bridge.firmware.flavour import FlightParts
from autopilot_bridge.flight import fixed_wing
from autopilot_bridge.flight.multicopter import land_detector

MULTICOPTER: Final = FlightParts(
    controller=MulticopterController,
    vehicle_tasks=MulticopterTasks,
    land_detector=land_detector.LandDetector,
    has_airspeed=False,
)
FIXED_WING: Final = FlightParts(
    controller=FixedWingController,
    vehicle_tasks=FixedWingTasks,
    land_detector=fixed_wing.LandDetector,
    has_airspeed=True,
)
