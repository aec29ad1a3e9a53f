"""The parts of an autopilot around a commander rig, for the tests of a single microservice."""

from typing import Any

from autopilot_bridge.autopilot.firmware import FIRMWARES
from autopilot_bridge.services.microservice import AutopilotParts
from tests.services.command_rig import ServiceRig


def parts_of(rig: ServiceRig, **more: Any) -> AutopilotParts:
    """The rig's parts; `more` replaces some of them."""
    chosen: dict[str, Any] = {
        "flavour": rig.flavour,
        "system_id": 1,
        "commander": rig.commander,
        "navigation": None,
        "parameters": rig.store,
        "readings": rig.readings,
        "stores": {},
        "missions": FIRMWARES[rig.flavour.name, rig.flavour.kind].missions,
        "broadcast": rig,
        "announce": rig.status.announce,
        "memory": None,
    }
    return AutopilotParts(**{**chosen, **more})
