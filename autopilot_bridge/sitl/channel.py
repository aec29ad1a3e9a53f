"""A link as an autopilot's MAVLink channel: sequence numbers and signatures of its own, peers told apart."""

from collections.abc import Sequence
from typing import Final

from autopilot_bridge.links import Link, PeerId
from autopilot_bridge.mavlink import Frame, FrameEncoder, Intake, LinkSigning, ParserCounters
from autopilot_bridge.mavlink.frame import SIGNATURE_SIZE
from autopilot_bridge.mavlink.signing import is_unsigned_v2
from autopilot_bridge.routing import LoopGuard, Router
from autopilot_bridge.services.channel import MavlinkMessage
from autopilot_bridge.telemetry.line import LineBudget
from autopilot_bridge.telemetry.motion import MotionMessages

_MAX_PACKET: Final = 1400  # bytes: one datagram that no network splits
_MEMORY_PEER: Final[PeerId] = ("memory", 0)


class LinkChannel:
    """One link of one autopilot.

    Args:
        name: how the channel is called in tables and reports; unique per autopilot.
        link: where bytes go and come from.
        system_id, component_id: the autopilot's.
        line: what the link can carry; None: whatever there is.
        signing: signs and checks what passes; None: nothing is.

    Attributes:
        motion: set by the autopilot that the channel is added to.
    """

    __slots__ = (
        "_encoder",
        "_forward",
        "_intake",
        "_peers",
        "_signs",
        "line",
        "link",
        "motion",
        "name",
        "signing",
    )

    def __init__(
        self,
        name: str,
        link: Link,
        *,
        system_id: int,
        component_id: int = 1,
        line: LineBudget | None = None,
        signing: LinkSigning | None = None,
    ) -> None:
        self.name = name
        self.link = link
        self.line = line
        self.signing = signing
        self._signs = signing if signing is not None and signing.policy.sign else None  # while there is a key
        self.motion: MotionMessages | None = None
        self._encoder = FrameEncoder(system_id, component_id)
        self._intake: Intake[PeerId] = Intake(None if signing is None else signing.admit)
        self._peers = PeerExchange(link)
        self._forward = getattr(link, "forward", None)  # of a link that several vehicles share

    @property
    def congested(self) -> bool:
        """The link's queue is filling: lists should pause."""
        return self.link.congested or (self.line is not None and self.line.congested)

    @property
    def counters(self) -> ParserCounters:
        """Where every received byte went, over all peers; `sources` is left out."""
        return self._intake.counters

    @property
    def overrun_bytes(self) -> int:
        """Bytes that were dropped unread, because their sender had too much waiting."""
        return self._intake.overrun_bytes

    @property
    def pending_bytes(self) -> int:
        """Bytes of frames that are not complete yet."""
        return self._intake.pending_bytes

    def send(self, message: MavlinkMessage) -> None:
        """Frame a message and send it."""
        self._send(self._encoder.encode(message))

    def send_payload(self, message_id: int, payload: bytes) -> None:
        """Frame an already packed payload and send it."""
        self._send(self._encoder.encode_payload(message_id, payload))

    def send_streams(self, motion: int, payloads: Sequence[tuple[int, bytes]]) -> None:
        """Send what is due together, a packet of a network at most at a time."""
        packet = self.motion.frames(motion, self._encoder) if motion and self.motion is not None else b""
        if payloads:
            most = _MAX_PACKET
            if self._signs is not None and self._signs.signs:
                most -= SIGNATURE_SIZE * (len(payloads) + motion.bit_count())
            for frame in self._encoder.encode_payloads(payloads):
                if packet and len(packet) + len(frame) > most:
                    self._send(packet)
                    packet = b""
                packet += frame
        if packet:
            self._send(packet)

    def send_frame(self, raw: bytes) -> None:
        """Forward somebody else's frame as it is: with its own signature, or none."""
        if self._forward is None:
            self._pass_on(raw)
        else:
            self._forward(raw)

    def send_own_frame(self, raw: bytes) -> None:
        """Send a frame of another component of the vehicle, which has no key of its own."""
        signs = self._signs
        if signs is not None and signs.state.active and is_unsigned_v2(raw):
            raw = signs.sign(raw)
        self._pass_on(raw)

    def _send(self, data: bytes) -> None:
        signs = self._signs
        if signs is not None and signs.state.active:
            data = signs.sign(data)
        if self.line is not None:
            self.line.add(len(data))
        self.link.send(data)

    def _pass_on(self, data: bytes) -> None:
        if self.line is not None:
            self.line.forward(len(data))
        self.link.send(data)

    def receive(self) -> list[tuple[PeerId, list[Frame]]]:
        """Good frames that have arrived, by peer, as many as there is time for."""
        arrived = self.link.receive()
        intake = self._intake
        if not arrived and not intake.waiting:
            return []
        served = intake.take(arrived)
        self._peers.forget({peer for peer, _ in arrived if not intake.understood(peer)})
        return served

    def parse(self, data: bytes, peer: PeerId = _MEMORY_PEER) -> list[Frame]:
        """The good frames in bytes of one peer, which may come in any pieces, at once."""
        return self._intake.parse(peer, data)

    def exchange(self, frame: Frame, peer: PeerId) -> None:
        """Pass a frame of one peer of the link on to those of the others that it is meant for."""
        for other in self._peers.others(frame, peer):
            self.link.send(frame.raw, other)


class PeerExchange:
    """What the peers of one link have to say to each other.

    Args:
        link: any; those with one peer at a time have nothing to pass on.
    """

    __slots__ = ("_forget", "_link", "_loops", "_router")

    def __init__(self, link: Link) -> None:
        self._link = link
        self._forget = getattr(link, "forget", None)
        self._router: Router[PeerId] = Router()
        self._loops = LoopGuard()

    def others(self, frame: Frame, peer: PeerId) -> list[PeerId]:
        """Learn from a frame, and tell which other peers of the link it is to be sent to."""
        peers = self._link.peers
        if len(peers) < 2:
            return []
        router = self._router
        for known in router.channels:
            if known not in peers:
                router.remove(known)
        for known in peers:
            router.add(known)
        found = [other for other in router.route(frame, peer) if other in peers]
        return [] if found and self._loops.comes_round(frame.raw, peer) else found

    def forget(self, strangers: set[PeerId]) -> None:
        """Don't send to those who sent nothing that could be understood."""
        if self._forget is not None:
            for peer in strangers:
                self._forget(peer)
