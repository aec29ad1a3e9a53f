"""Hands messages to services as the autopilot does: by message id."""

from typing import Any

from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.microservice import Microservice, receivers_by_id


def deliver(message: Any, source: Source, time_us: int, *services: Microservice) -> bool:
    """Call the methods that handle the message's id; False when there are none."""
    receivers = receivers_by_id(services).get(message.get_msgId(), ())
    for receiver in receivers:
        receiver(message, source, time_us)
    return bool(receivers)
