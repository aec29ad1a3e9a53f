"""Listening to a link with our own parser: the components on it, and the share of lost frames.

MAVSDK does not pass on sequence numbers, does not count losses, and reports nothing about a link without an
autopilot. The frames themselves contain both.
"""

import asyncio
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from autopilot_bridge.links import Address, open_link
from autopilot_bridge.mavlink import DEFINITIONS, FrameEncoder, FrameParser, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT, GROUND_STATION

_LOOK_S = 0.02
_GCS_HEARTBEAT_S = 1.0


SIGNED = (
    "it signs its messages, and may accept no message without its key; this command can't sign: use a link "
    "that takes unsigned frames (serial, USB), or clear the key"
)
"""The reason why a vehicle does not answer although its messages are received."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkQuality:
    """The frames received in an interval.

    Attributes:
        seconds: duration of listening.
        frames, lost: valid frames of the autopilot, and frames missing in its sequence.
        bytes_total, bytes_junk: bytes received, and bytes that belonged to no frame.
        rates_hz: rates of the autopilot's messages, by name.
        components: (system, component) pairs received.
        signed: whether the autopilot signs its messages.
    """

    seconds: float
    frames: int
    lost: int
    bytes_total: int
    bytes_junk: int
    rates_hz: Mapping[str, float]
    components: tuple[tuple[int, int], ...]
    signed: bool = False

    @property
    def loss(self) -> float:
        """Share of the autopilot's frames that were lost, 0..1."""
        return self.lost / max(1, self.frames + self.lost)

    def description(self) -> str:
        """What was received, as text for an error."""
        if not self.bytes_total:
            return f"nothing was received in {self.seconds:.0f} s: is it on, is this the right link?"
        if not self.components:
            return (
                f"{self.bytes_total} bytes were received in {self.seconds:.0f} s, and none of it is MAVLink: "
                "is the baud rate right?"
            )
        if "HEARTBEAT" in self.rates_hz:
            ids = ", ".join(
                str(system) for system, component in self.components if component == AUTOPILOT_COMPONENT
            )
            return f"received now: autopilot with system id {ids}; try again, or choose it with `system_id`"
        names = ", ".join(f"{system}/{component}" for system, component in self.components)
        return f"received were components {names} (system/component), none of them an autopilot's heartbeat"


async def listen(address: Address, seconds: float, system_id: int | None = None) -> LinkQuality:
    """Open a link and listen for the given time, sending heartbeats as a ground station.

    Args:
        system_id: system id of the autopilot whose frames are counted; None: the lowest received.

    Raises:
        BridgeError: the link can't be opened.
    """
    loop = asyncio.get_running_loop()
    link = open_link(address)
    parser, encoder = FrameParser(), FrameEncoder(*GROUND_STATION)
    counts: dict[tuple[int, int], Counter[int]] = {}
    last: dict[tuple[int, int], int] = {}
    lost: Counter[tuple[int, int]] = Counter()
    total, started_s, beat_s, signed = 0, loop.time(), 0.0, False
    heartbeat = dialect.MAVLink_heartbeat_message(
        dialect.MAV_TYPE_GCS, dialect.MAV_AUTOPILOT_INVALID, 0, 0, dialect.MAV_STATE_ACTIVE, 3
    )
    try:
        while (now_s := loop.time()) - started_s < seconds:
            if now_s >= beat_s:
                link.send(encoder.encode(heartbeat))
                beat_s = now_s + _GCS_HEARTBEAT_S
            for _, data in link.receive():
                total += len(data)
                for frame in parser.feed(data):
                    who = (frame.system_id, frame.component_id)
                    if who in last:
                        gap = (frame.sequence - last[who] - 1) & 0xFF
                        if gap < 128:  # a larger gap means that a frame came late
                            lost[who] += gap
                    last[who] = frame.sequence
                    signed |= frame.signed and frame.component_id == AUTOPILOT_COMPONENT
                    counts.setdefault(who, Counter())[frame.message_id] += 1
            await asyncio.sleep(_LOOK_S)
    finally:
        link.close()
    autopilots = sorted(who for who in counts if who[1] == 1 and system_id in (None, who[0]))
    chosen = autopilots[0] if autopilots else (0, 0)
    own = counts.get(chosen, Counter())
    return LinkQuality(
        seconds=seconds,
        frames=sum(own.values()),
        lost=lost[chosen],
        bytes_total=total,
        bytes_junk=parser.counters.bytes_junk,
        rates_hz={DEFINITIONS[k].name: n / seconds for k, n in sorted(own.items())},
        components=tuple(sorted(counts)),
        signed=signed,
    )
