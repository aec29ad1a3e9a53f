"""MAVLink wire and links (ground floor), and the emulated autopilot with its SITL (upper floor).

from autopilot_bridge import Sitl, open_link, parse_address

link = open_link(parse_address("udpin:127.0.0.1:14550"))

"""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
