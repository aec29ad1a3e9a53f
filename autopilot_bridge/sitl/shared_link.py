"""One link for several vehicles, as behind one telemetry radio: frames go to the addressed vehicle."""

from autopilot_bridge.links import Link, LinkCounters, PeerId, Reach
from autopilot_bridge.mavlink import Frame, Intake
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.routing import LoopGuard
from autopilot_bridge.sitl.channel import LinkChannel, PeerExchange
from autopilot_bridge.sitl.switchboard import Switchboard


class SharedLink:
    """A link that several vehicles share.

    The frames of all vehicles reach the clients. A client's frame goes to the vehicle whose system id it is
    addressed to, or to all vehicles when it is addressed to none of them; and to other clients by the routing
    rules.

    Args:
        link: sends and receives the bytes.
        reach: which processes can reach the link.

    Attributes:
        link: as given.
        echoes: the vehicles' own frames that a client sent back; they are dropped.
    """

    def __init__(self, link: Link, *, reach: Reach) -> None:
        self.echoes = 0
        self.link = link
        self._reach = reach
        self._intake: Intake[PeerId] = Intake()
        self._peers = PeerExchange(link)
        self._known: set[PeerId] = set()  # peers that have sent an accepted frame
        self._loops = LoopGuard()
        self._members: dict[int, tuple[Switchboard, LinkChannel]] = {}

    def join(
        self, switchboard: Switchboard, system_id: int, *, role: str, bytes_per_s: float | None = None
    ) -> LinkChannel:
        """Open the link for one more vehicle.

        Args:
            switchboard: of the vehicle.
            system_id: of the vehicle.
            role: which default streams run on it ("onboard" or "gcs").
            bytes_per_s: the vehicle's share of the link's capacity.
        """
        port = _Port(self, system_id)
        channel = switchboard.open(port, role=role, reach=self._reach, bytes_per_s=bytes_per_s)
        port.channel = channel
        self._members[system_id] = (switchboard, channel)
        return channel

    def poll(self) -> None:
        """Deliver received frames to the vehicles and clients that they are addressed to."""
        arrived = self.link.receive()
        intake = self._intake
        if not arrived and not intake.waiting:
            return
        accepted = [
            (peer, frame, members)
            for peer, frames in intake.take(arrived)
            for frame in frames
            if (members := self._members_for(frame))
        ]
        self._known.update(peer for peer, _, _ in accepted)
        self._peers.forget({peer for peer, _ in arrived} - self._known)
        self._known.intersection_update(self.link.peers)
        for peer, frame, members in accepted:
            for switchboard, channel in members:
                switchboard.take(channel, (frame,))
            for other in self._peers.others(frame, peer):
                self.link.send(frame.raw, other)

    def _members_for(self, frame: Frame) -> list[tuple[Switchboard, LinkChannel]]:
        """The vehicles that get a frame: the addressed one or else all, if they accept its signature."""
        if frame.component_id == AUTOPILOT_COMPONENT and frame.system_id in self._members:
            self.echoes += 1
            return []
        addressed = self._members.get(frame.target_system)
        members = self._members.values() if addressed is None else (addressed,)
        return [member for member in members if member[1].signing is None or member[1].signing.admit([frame])]

    def forward(self, raw: bytes, member: int) -> None:
        """Send a frame that vehicle `member` received on another link, once if several have received it."""
        if not self._loops.comes_round(raw, member):
            self.link.send(raw)

    def leave(self, member: int) -> None:
        """Remove a vehicle; the last one closes the link."""
        self._members.pop(member, None)
        if not self._members:
            self.link.close()


class _Port:
    """One vehicle's part of a shared link; `SharedLink.poll` delivers the received frames."""

    def __init__(self, shared: SharedLink, member: int) -> None:
        self._shared = shared
        self._member = member
        self.channel: LinkChannel | None = None

    @property
    def description(self) -> str:
        return self._shared.link.description

    @property
    def counters(self) -> LinkCounters:
        return self._shared.link.counters

    @property
    def peers(self) -> tuple[PeerId, ...]:
        return self._shared.link.peers

    @property
    def congested(self) -> bool:
        return self._shared.link.congested

    def send(self, data: bytes, to: PeerId | None = None) -> None:
        self._shared.link.send(data, to)

    def receive(self) -> list[tuple[PeerId, bytes]]:
        return []

    def filenos(self) -> tuple[int, ...]:
        return ()

    def forward(self, raw: bytes) -> None:
        self._shared.forward(raw, self._member)

    def close(self) -> None:
        self._shared.leave(self._member)
