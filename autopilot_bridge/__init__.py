"""MAVLink wire and links (ground floor), and the emulated autopilot with its SITL (upper floor).

from autopilot_bridge import Sitl, open_link, parse_address

link = open_link(parse_address("udpin:127.0.0.1:14550"))

"""

from typing import TYPE_CHECKING, Final

from flightsim.foundation.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from autopilot_bridge.errors import BridgeError
    from autopilot_bridge.links import open_link, parse_address
    from autopilot_bridge.mavlink import decode
    from autopilot_bridge.sitl.server import SitlServer
    from autopilot_bridge.sitl.sitl import Sitl
    from autopilot_bridge.tlog import TlogReader, TlogWriter

__all__ = [
    "BridgeError",
    "Sitl",
    "SitlServer",
    "TlogReader",
    "TlogWriter",
    "decode",
    "open_link",
    "parse_address",
]

_MODULES: Final = {
    "BridgeError": "autopilot_bridge.errors",
    "Sitl": "autopilot_bridge.sitl.sitl",
    "SitlServer": "autopilot_bridge.sitl.server",
    "TlogReader": "autopilot_bridge.tlog",
    "TlogWriter": "autopilot_bridge.tlog",
    "decode": "autopilot_bridge.mavlink",
    "open_link": "autopilot_bridge.links",
    "parse_address": "autopilot_bridge.links",
}

__getattr__ = lazy_exports(__name__, _MODULES)
