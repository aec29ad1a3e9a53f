"""Error messages for users when a link can't be opened."""

import errno
from typing import Final

from autopilot_bridge.errors import LinkError

_HUNG_UP: Final = "the other end hung up at once: check what listens there"


def open_error(address: str, error: OSError) -> LinkError:
    """A LinkError with the problem of the address and its solution."""
    advice = {
        errno.EADDRINUSE: "the port is in use: stop the other program or choose another port",
        errno.EADDRNOTAVAIL: "no interface of this machine has that address: use 127.0.0.1 or 0.0.0.0",
        errno.EACCES: "not permitted: choose a port above 1023",
        errno.ECONNREFUSED: "nothing listens there: start the vehicle or the simulator first, check the port",
        errno.ECONNRESET: _HUNG_UP,
        errno.ENOTCONN: _HUNG_UP,
        errno.EHOSTUNREACH: "the host can't be reached: check the network",
        errno.ENETUNREACH: "the network can't be reached: check the network",
        errno.ETIMEDOUT: "no answer: check the host and the port",
    }.get(error.errno or 0, "check the address")
    return LinkError(f"can't open {address}: {error.strerror or error}; {advice}")
