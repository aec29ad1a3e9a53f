"""Public names of `autopilot_bridge`, each where it is defined; see `__init__.py`."""

from autopilot_bridge.errors import BridgeError as BridgeError
from autopilot_bridge.links.address import Address as Address
from autopilot_bridge.links.address import parse_address as parse_address
from autopilot_bridge.links.factory import open_link as open_link
from autopilot_bridge.links.link import Link as Link
from autopilot_bridge.mavlink.decoder import decode as decode
from autopilot_bridge.mavlink.signing import SigningKey as SigningKey
from autopilot_bridge.sitl.server import SitlServer as SitlServer
from autopilot_bridge.sitl.sitl import Sitl as Sitl
from autopilot_bridge.tlog import TlogReader as TlogReader
from autopilot_bridge.tlog import TlogWriter as TlogWriter
