"""What is PX4's and what is ArduPilot's: mode numbers, parameters, policies, texts, identity."""

from typing import TYPE_CHECKING, Final

from flightsim.airframe import AirframeKind

if TYPE_CHECKING:
    from autopilot_bridge.firmware.flavour import Flavour

FLAVOUR_NAMES: Final = ("px4", "ardupilot")


def get_flavour(name: str, kind: AirframeKind = AirframeKind.MULTICOPTER) -> "Flavour":
    """The flavour of that name for a kind of vehicle.

    Raises:
        ValueError: there is none; the message lists the names.
    """
    # imported on demand: a program uses one flavour, and each loads its own parameter table
    fixed_wing = kind is AirframeKind.FIXED_WING
    if name == "px4" and fixed_wing:
        from autopilot_bridge.firmware.px4.plane.flavour import PX4_PLANE

        return PX4_PLANE
    if name == "ardupilot" and fixed_wing:
        from autopilot_bridge.firmware.ardupilot.plane.flavour import ARDUPILOT_PLANE

        return ARDUPILOT_PLANE
    if name == "px4":
        from autopilot_bridge.firmware.px4.copter.flavour import PX4

        return PX4
    if name == "ardupilot":
        from autopilot_bridge.firmware.ardupilot.copter.flavour import ARDUPILOT

        return ARDUPILOT
    raise ValueError(f"no autopilot flavour {name!r}; accepted: {', '.join(FLAVOUR_NAMES)}")
