"""A mavutil connection with room for what comes while a test has no time to read."""

import socket
from typing import Any, Final

from pymavlink import mavutil

_BUFFER_BYTES: Final = 4 << 20
"""Else a datagram is lost after a tenth of a second, at 25 times real time; an answer may be the one."""


def mavutil_link(url: str, **options: Any) -> Any:
    """`mavutil.mavlink_connection` to a UDP or TCP URL; the system may allow less room."""
    link = mavutil.mavlink_connection(url, **options)
    link.port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
    return link
