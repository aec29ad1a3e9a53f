"""The streamed messages of each firmware for each class of vehicle."""

from collections.abc import Callable

from autopilot_bridge.firmware.ardupilot.messages import ArdupilotMessages
from autopilot_bridge.firmware.ardupilot.plane.messages import ArduPlaneMessages
from autopilot_bridge.firmware.flavour import Flavour
from autopilot_bridge.firmware.px4.messages import Px4Messages
from autopilot_bridge.firmware.px4.plane.messages import Px4PlaneMessages
from autopilot_bridge.telemetry.common import CommonMessages, TelemetrySources
from autopilot_bridge.telemetry.streams import Values
from flightsim.airframe import AirframeKind


def telemetry_messages(
    flavour: Flavour,
    sources: TelemetrySources,
    *,
    current_mode: Callable[[], Values],
    orbit: Callable[[], tuple[float, float, float, float] | None],
) -> CommonMessages:
    """The messages of one autopilot.

    Args:
        sources: the sources of the values.
        current_mode, orbit: see `Px4Messages`.
    """
    aircraft = flavour.kind is AirframeKind.FIXED_WING
    if flavour.name == "px4":
        messages = Px4PlaneMessages if aircraft else Px4Messages
        return messages(sources, current_mode=current_mode, orbit=orbit)
    return ArduPlaneMessages(sources) if aircraft else ArdupilotMessages(sources)
