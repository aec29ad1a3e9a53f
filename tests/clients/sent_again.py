"""A recorded flight, sent on a link once more."""

import socket
import time
from collections.abc import Container
from pathlib import Path

from autopilot_bridge.tlog import TlogReader


def send_again(log: Path, port: int, components: Container[int]) -> None:
    """Send the frames of these components of a log to a UDP port, 20 times as fast as they were received."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        sent_us = 0
        for time_us, frame in TlogReader(log):
            if frame.component_id not in components:
                continue
            if time_us - sent_us > 20_000:
                sent_us = time_us
                time.sleep(0.001)
            link.sendto(frame.raw, ("127.0.0.1", port))
