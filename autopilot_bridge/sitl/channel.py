"""A link as an autopilot's MAVLink channel: own sequence numbers and signatures, one parser for each peer."""

from collections.abc import Sequence
from typing import Final

from autopilot_bridge.links import Link, MemoryLink, PeerId
from autopilot_bridge.mavlink import (
    Frame,
    FrameEncoder,
    Intake,
    LinkSigning,
    MAVLinkMessage,
    Packet,
    ParserCounters,
)
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.frame import SIGNATURE_SIZE
from autopilot_bridge.mavlink.signing import is_unsigned_v2
from autopilot_bridge.routing import LoopGuard, Router
from autopilot_bridge.telemetry.line import LineBudget
from autopilot_bridge.telemetry.motion import MotionMessages

_MAX_PACKET: Final = 1400  # bytes: one datagram that no network fragments
_MEMORY_PEER: Final[PeerId] = ("memory", 0)


class LinkChannel:
    """One link of one autopilot.

    Args:
        name: the name of the channel in tables and reports; unique per autopilot.
        link: sends and receives the bytes.
        system_id, component_id: the autopilot's.
        line: the capacity of the link; None: unlimited.
        signing: signs sent frames and checks received frames; None: no signing.

    Attributes:
        motion: set by the autopilot that the channel is added to.
    """

    def __init__(
        self,
        name: str,
        link: Link,
        *,
        system_id: int,
        component_id: int = AUTOPILOT_COMPONENT,
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
        self._memory = link if isinstance(link, MemoryLink) else None
        self._forward = getattr(link, "forward", None)  # of a link shared by several vehicles

    @property
    def congested(self) -> bool:
        """The link's queue is filling: parameter lists should pause."""
        return self.link.congested or (self.line is not None and self.line.congested)

    @property
    def counters(self) -> ParserCounters:
        """Counters of all received bytes, over all peers; `sources` is left out."""
        return self._intake.counters

    @property
    def overrun_bytes(self) -> int:
        """Bytes that were dropped unread, because too many bytes of their sender were waiting."""
        return self._intake.overrun_bytes

    @property
    def pending_bytes(self) -> int:
        """Bytes of frames that are not complete yet."""
        return self._intake.pending_bytes

    def send(self, message: MAVLinkMessage) -> None:
        """Frame a message and send it."""
        self._send(self._encoder.encode(message))

    def send_payload(self, message_id: int, payload: bytes) -> None:
        """Frame an already packed payload and send it."""
        self._send(self._encoder.encode_payload(message_id, payload))

    def send_streams(self, motion: int, payloads: Sequence[tuple[int, bytes]]) -> None:
        """Send the payloads that are due together, in packets of at most one datagram."""
        memory = self._packet_link
        if memory is not None:
            self._hand_over(memory, motion, payloads)
            return
        packet, _ = self._motion_packet(motion)
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

    @property
    def _packet_link(self) -> MemoryLink | None:
        """The link, if its other end is in this process and receives packets that need not be parsed."""
        # An embedded mission receives thousands of frames a second. Their ids and lengths are known here, so
        # parsing the bytes again at the other end would only cost time. Signed frames go as bytes:
        # the receiver has to see the signature.
        memory = self._memory
        if memory is None or not memory.takes_packets or (self._signs is not None and self._signs.signs):
            return None
        return memory

    def _hand_over(self, memory: MemoryLink, motion: int, payloads: Sequence[tuple[int, bytes]]) -> None:
        """Send the payloads that are due together, as one packet."""
        data, message_ids = self._motion_packet(motion)
        if payloads:
            data += b"".join(self._encoder.encode_payloads(payloads))
            message_ids += tuple([message_id for message_id, _ in payloads])
        if data:
            if self.line is not None:
                self.line.add(len(data))
            memory.send_packet(Packet(data, message_ids))

    def _motion_packet(self, motion: int) -> tuple[bytes, tuple[int, ...]]:
        """Frames of the motion messages that are due, and their message ids."""
        return self.motion.packet(motion, self._encoder) if motion and self.motion is not None else (b"", ())

    def send_frame(self, raw: bytes) -> None:
        """Forward a frame of another system unchanged: with its own signature, or without one."""
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
        self._put(data)

    def _pass_on(self, data: bytes) -> None:
        if self.line is not None:
            self.line.forward(len(data))
        self._put(data)

    def _put(self, data: bytes) -> None:
        memory = self._packet_link
        if memory is None:
            self.link.send(data)
        else:
            memory.send_packet(Packet.of_one(data))

    def receive(self) -> list[tuple[PeerId, list[Frame]]]:
        """Valid frames that have arrived, by peer, as many as the time budget allows."""
        arrived = self.link.receive()
        intake = self._intake
        if not arrived and not intake.waiting:
            return []
        served = intake.take(arrived)
        self._peers.forget({peer for peer, _ in arrived if not intake.understood(peer)})
        return served

    def parse(self, data: bytes, peer: PeerId = _MEMORY_PEER) -> list[Frame]:
        """The valid frames in bytes of one peer, which may be split at any place."""
        return self._intake.parse(peer, data)

    def exchange(self, frame: Frame, peer: PeerId) -> None:
        """Forward a frame of one peer of the link to the other peers that it is addressed to."""
        for other in self._peers.others(frame, peer):
            self.link.send(frame.raw, other)


class PeerExchange:
    """Routes frames between the peers of one link.

    Args:
        link: any link; one with a single peer at a time has nothing to forward.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._forget = getattr(link, "forget", None)
        self._router: Router[PeerId] = Router()
        self._loops = LoopGuard()

    def others(self, frame: Frame, peer: PeerId) -> list[PeerId]:
        """Learn from a frame, and return the other peers of the link that it is to be sent to."""
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
        """Send nothing to peers that have sent no valid frame."""
        if self._forget is not None:
            for peer in strangers:
                self._forget(peer)
