"""The links of one vehicle: received frames go to the autopilot and to the systems they are addressed to.

Frames are forwarded by the MAVLink routing rules between links, and between the clients that share one. A
frame for another component of the vehicle goes there; as long as no message of that component was received,
it goes to the autopilot, which may answer for it (ArduPilot).
"""

from collections.abc import Callable, Sequence

from autopilot_bridge.links import Link, MemoryLink, PeerId, Reach
from autopilot_bridge.mavlink import Frame
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.signing import SETUP_SIGNING
from autopilot_bridge.routing import LoopGuard, Router
from autopilot_bridge.sitl.backend import BackendLinks
from autopilot_bridge.sitl.channel import LinkChannel
from autopilot_bridge.sitl.signing import VehicleSigning, answer_to_key
from autopilot_bridge.telemetry.line import LineBudget


class Switchboard:
    """The open links of one vehicle.

    Args:
        autopilot: receives and sends on all of them; None: it has links of its own.
        system_id: the vehicle's.
        signing: keys of the vehicle.

    Attributes:
        channels: the open links.
        echoes: the autopilot's own frames that came back on a link; they are dropped.
        signing: as given.
    """

    def __init__(self, autopilot: BackendLinks | None, *, system_id: int, signing: VehicleSigning) -> None:
        self.channels: list[LinkChannel] = []
        self.echoes = 0
        self.signing = signing
        self._autopilot = autopilot
        self._roles: dict[LinkChannel, str] = {}
        self._system_id = system_id
        self._router: Router[LinkChannel] = Router()
        self._loops = LoopGuard()
        self._reach: dict[LinkChannel, Reach] = {}
        self._contained: Callable[[Exception], None] | None = None

    def contain(self, failed: Callable[[Exception], None]) -> None:
        """Call a function when a received frame makes the vehicle fail, instead of raising."""
        self._contained = failed

    def open(
        self,
        link: Link,
        *,
        name: str | None = None,
        role: str = "onboard",
        bytes_per_s: float | None = None,
        reach: Reach | None = None,
    ) -> LinkChannel:
        """Add a link to the autopilot.

        Args:
            name: unique per vehicle; None: made from the link.
            role: which default streams run on it ("onboard", "gcs" or "payload").
            bytes_per_s: the link's capacity in a second of vehicle time; streams are reduced to fit.
            reach: which processes can reach it; None: only this process when it is a memory link, else the
                network.
        """
        if name is None:
            name = f"{role}{len(self.channels)} {link.description}"
        if reach is None:
            reach = Reach.PROCESS if isinstance(link, MemoryLink) else Reach.NETWORK
        line = None if bytes_per_s is None else LineBudget(bytes_per_s)
        signing = self.signing.link(reach)
        channel = LinkChannel(name, link, system_id=self._system_id, line=line, signing=signing)
        self.channels.append(channel)
        self._router.add(channel)
        self._reach[channel] = reach
        self._roles[channel] = role
        if self._autopilot is not None:
            self._autopilot.add_channel(channel, role=role)
        return channel

    def close(self, channel: LinkChannel) -> None:
        """Remove a channel and close its link."""
        self.channels.remove(channel)
        if self._autopilot is not None:
            self._autopilot.remove_channel(channel)
        self._router.remove(channel)
        del self._reach[channel], self._roles[channel]
        channel.link.close()

    def restart(self, autopilot: BackendLinks | None) -> None:
        """Connect the links to an autopilot that starts; None: there is no autopilot, and nothing answers."""
        self._autopilot = autopilot
        if autopilot is not None:
            for channel in self.channels:
                autopilot.add_channel(channel, role=self._roles[channel])

    def send_to_all(self, raw: bytes) -> None:
        """Send a frame of a component of the vehicle on every link."""
        for channel in self.channels:
            channel.send_own_frame(raw)

    def poll(self) -> None:
        """Receive from all links."""
        for channel in self.channels:
            for peer, frames in channel.receive():
                self.take(channel, frames, peer)

    def take(self, channel: LinkChannel, frames: Sequence[Frame], peer: PeerId | None = None) -> None:
        """Pass frames received on a channel to the autopilot, and to the addressed links and clients.

        Args:
            peer: the sender among several on the link; None: there is only one, or the link routes between
                them.
        """
        try:
            self._take(channel, frames, peer)
        except Exception as error:
            if self._contained is None:
                raise
            self._contained(error)

    def _take(self, channel: LinkChannel, frames: Sequence[Frame], peer: PeerId | None) -> None:
        own = self._system_id
        several = len(self.channels) > 1
        for frame in frames:
            if frame.system_id == own and frame.component_id == AUTOPILOT_COMPONENT:
                self.echoes += 1  # its own frames, sent back by a bridge
                continue
            if frame.message_id == SETUP_SIGNING:
                self._take_key(frame, channel)
                continue
            others = self._router.route(frame, channel) if several else ()
            if self._autopilot is not None and (
                not others or frame.target_system != own or frame.target_component in (0, AUTOPILOT_COMPONENT)
            ):
                self._autopilot.receive(frame, channel)
            if frame.target_system == own and frame.target_component == AUTOPILOT_COMPONENT:
                continue
            if peer is not None:
                channel.exchange(frame, peer)
            if not others or self._loops.comes_round(frame.raw, channel):
                continue
            within = self._reach[channel] is Reach.PROCESS
            for other in others:
                if within:
                    other.send_own_frame(frame.raw)
                else:
                    other.send_frame(frame.raw)

    def _take_key(self, frame: Frame, channel: LinkChannel) -> None:
        assert channel.signing is not None
        text = self.signing.take_setup(frame, channel.signing, self._reach[channel])
        if text is not None:
            channel.send(answer_to_key(text))
