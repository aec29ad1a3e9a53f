"""A link as a mission sees it: the newest message of each kind, streams of messages, and waiting for one.

Several hundred messages a second arrive, and a mission uses few of them. A frame that no task waits for costs
one dictionary entry; it is decoded only when it is requested. An autopilot in this process hands over packets
with the ids of their messages, which are not parsed, and are taken apart only when one of them is requested.
"""

import asyncio
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from types import TracebackType
from typing import Final, Generic, Protocol, Self, TypeVar, cast, overload

from autopilot_bridge.clock import Clock, TelemetryClock
from autopilot_bridge.links import Link
from autopilot_bridge.mavlink import (
    Frame,
    FrameEncoder,
    Intake,
    LinkSigning,
    MAVLinkMessage,
    Packet,
    decode,
    definition,
    dialect,
)
from autopilot_bridge.mavlink.components import (
    AUTOPILOT_COMPONENT,
    GROUND_STATION,
    ONBOARD_COMPUTER_COMPONENT,
)
from autopilot_bridge.mavlink.signing import SETUP_SIGNING
from missions.errors import LinkClosed
from missions.vehicle.peers import NewestFrames

MessageT = TypeVar("MessageT", bound=MAVLinkMessage)

ONBOARD_COMPUTER: Final = (1, ONBOARD_COMPUTER_COMPONENT)
"""System and component id of a mission on board of system 1."""

_HEARTBEAT_PERIOD_S: Final = 1.0
_STREAM_LIMIT: Final = 4096
_AT_ONCE: Final = 64  # largest number of messages that are read in a row without giving other tasks a turn
_TIMESTAMPED: Final = {2: 8, 30: 0, 31: 0, 32: 0, 33: 0}  # message id: offset of time_boot_ms in the payload
_MOST_LOOKED_UP: Final = 1024  # on a link packets may have any message ids
_POLL_S: Final = 0.002  # for links without a file descriptor


class Recorder(Protocol):
    """Receives all frames of a connection, in both directions."""

    @property
    def acts(self) -> bool:
        """Whether it acts on the frames, so that their order among the calls of listeners counts."""
        ...

    def record(self, packet: Packet, time_us: int) -> None:
        """Process frames that were sent or received together at a vehicle time."""
        ...


Listener = Callable[[Frame], None]
Wanted = tuple[tuple[int, int], ...]
"""Index in a packet, and message id, of each frame that has listeners."""
_NOT_LOOKED_UP: Final[Wanted] = ((-1, -1),)


class Connection:
    """MAVLink over one link, for asyncio tasks on vehicle time.

    Nothing is opened, sent or started before `start` (or `async with`).

    Args:
        link: an open link; the connection closes it. One that calls `on_receive` (memory) is not polled.
        clock: vehicle time; a `TelemetryClock` is fed from the vehicle's timestamps.
        recorder: receives every frame of both directions.
        identity: system and component id of this client.
        vehicle_system_id: of the vehicle whose time the clock follows; None: the first autopilot received.
        signing: signs sent frames, and drops received frames that it does not accept. None: no signing.

    Attributes:
        parsers: one for each of the newest peers; their counters account for every byte ever received. Frames
            from a channel in this process are not parsed, and not in them.
        signing: as passed to the constructor.
    """

    def __init__(
        self,
        link: Link,
        clock: Clock,
        recorder: Recorder | None = None,
        *,
        identity: tuple[int, int] = GROUND_STATION,
        vehicle_system_id: int | None = None,
        signing: LinkSigning | None = None,
    ) -> None:
        self.clock = clock
        self.signing = signing
        self.parsers: Intake[object] = Intake(None if signing is None else signing.admit)
        self.system_id, self.component_id = identity
        self._link = link
        self._forget = getattr(link, "forget", None)
        self._recorder = recorder
        self._recorder_acts = recorder is not None and recorder.acts
        self._encoder = FrameEncoder(*identity)
        self._newest = NewestFrames()
        self._listeners: dict[int, list[Listener]] = {}
        # listeners that depend on the order, by message id; packets with a key are looked at more closely too
        self._in_order = Counter([SETUP_SIGNING])
        self._wanted: dict[tuple[int, ...], Wanted | None] = {}  # by message ids of a packet
        self._observed = clock if isinstance(clock, TelemetryClock) else None
        self._clock_source = vehicle_system_id
        self._tasks: list[asyncio.Task[None]] = []
        self._watched: list[int] = []
        self._closed = False

    async def __aenter__(self) -> Self:
        self.start()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    def start(self) -> None:
        """Start receiving, and sending a HEARTBEAT each second of vehicle time."""
        loop = asyncio.get_running_loop()
        self._watched = list(self._link.filenos())
        for fileno in self._watched:
            loop.add_reader(fileno, self._drain)
        self._drain()
        if hasattr(self._link, "on_receive"):
            self._link.on_receive = partial(self._on_bytes, None)
            if hasattr(self._link, "on_packet") and self.signing is None:
                self._link.on_packet = self._on_packet
        else:
            self._tasks.append(loop.create_task(self._keep_looking_after_link()))
        self._tasks.append(loop.create_task(self._keep_sending_heartbeats()))

    async def close(self) -> None:
        """Stop receiving and sending, and close the link."""
        if self._closed:
            return
        self._closed = True
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._unwatch()
        if hasattr(self._link, "on_packet"):
            self._link.on_packet = None
        self._link.close()

    def _unwatch(self) -> None:
        loop = asyncio.get_running_loop()
        for fileno in self._watched:
            loop.remove_reader(fileno)
        self._watched = []

    # receiving

    def _drain(self) -> None:
        for peer, data in self._link.receive():
            self._on_bytes(peer, data)
            if self._forget is not None and not self.parsers.understood(peer):
                self._forget(peer)  # an unknown peer on a server's port must not receive commands

    def _on_bytes(self, peer: object, data: bytes) -> None:
        frames = self.parsers.parse(peer, data)
        if self._observed is None:
            for packet in Packet.by_sender(frames):
                self._on_packet(packet)
            return
        for frame in frames:  # each may set the clock
            if frame.message_id in _TIMESTAMPED:
                self._observe(frame)
            self._on_packet(Packet.of([frame]))

    def _on_packet(self, packet: Packet) -> None:
        wanted = self._wanted.get(packet.message_ids, _NOT_LOOKED_UP)
        if wanted is _NOT_LOOKED_UP:
            wanted = self._look_up(packet.message_ids)
        if wanted is None:
            self._on_frames(packet)
            return
        if self._recorder is not None:
            self._recorder.record(packet, self.clock.time_us)
        self._newest.put(packet)
        for index, message_id in wanted:
            frame = packet.frame(index)
            for listener in tuple(self._listeners.get(message_id, ())):
                listener(frame)

    def _look_up(self, message_ids: tuple[int, ...]) -> Wanted | None:
        """Which frames of such a packet have listeners. None: their order counts."""
        wanted = None
        if not self._recorder_acts and self._in_order.keys().isdisjoint(message_ids):
            wanted = tuple((k, number) for k, number in enumerate(message_ids) if number in self._listeners)
        if len(self._wanted) >= _MOST_LOOKED_UP:
            self._wanted.clear()
        self._wanted[message_ids] = wanted
        return wanted

    def _on_frames(self, packet: Packet) -> None:
        listeners = self._listeners
        begin = 0
        for index, message_id in enumerate(packet.message_ids):
            if message_id in listeners:
                # recorded and newest is then what came before its frame, not what follows in the same packet
                self._keep(packet.part(begin, index + 1))
                begin = index + 1
                frame = packet.frame(index)
                for listener in tuple(listeners[message_id]):
                    listener(frame)
        if begin < len(packet):
            self._keep(packet.part(begin, len(packet)))

    def _keep(self, packet: Packet) -> None:
        self._record(packet)
        self._newest.put(packet)

    def _record(self, packet: Packet) -> None:
        """Record what a log may contain: no keys."""
        if self._recorder is None:
            return
        if SETUP_SIGNING in packet.message_ids:
            frames = [frame for frame in packet if frame.message_id != SETUP_SIGNING]
            if not frames:
                return
            packet = Packet.of(frames)
        self._recorder.record(packet, self.clock.time_us)

    def _observe(self, frame: Frame) -> None:
        """Set the clock from the messages of the vehicle's autopilot."""
        assert self._observed is not None
        if frame.component_id == AUTOPILOT_COMPONENT:
            if self._clock_source is None:
                self._clock_source = frame.system_id
            if frame.system_id == self._clock_source:
                offset = _TIMESTAMPED[frame.message_id]
                self._observed.observe(int.from_bytes(frame.payload[offset : offset + 4], "little") * 1000)

    async def _keep_looking_after_link(self) -> None:
        """Poll links whose descriptors change (servers, reconnecting clients) or that have none."""
        loop = asyncio.get_running_loop()
        while True:
            current = list(self._link.filenos())
            if current != self._watched:
                self._unwatch()
                for fileno in current:
                    loop.add_reader(fileno, self._drain)
                self._watched = current
            self._drain()
            await asyncio.sleep(0.05 if current else _POLL_S)

    def keep_of_another_link(self, frame: Frame) -> None:
        """Record a frame that another link has carried, such as one between vehicles."""
        self._record(Packet.of([frame]))

    # sending

    def speak_as(self, system_id: int, component_id: int) -> None:
        """Change the sender ids: a process on board learns its system id from the vehicle."""
        if (system_id, component_id) != (self.system_id, self.component_id):
            self.system_id, self.component_id = system_id, component_id
            self._encoder = FrameEncoder(system_id, component_id)

    def send(self, message: MAVLinkMessage) -> None:
        """Send one message with the connection's own ids.

        Raises:
            LinkClosed: the connection was closed.
        """
        if self._closed:
            raise LinkClosed("the connection to the vehicle is closed")
        data = self._encoder.encode(message)
        if self.signing is not None and self.signing.signs:
            data = self.signing.sign(data)
        self._record(Packet.of_one(data))
        self._link.send(data)

    async def _keep_sending_heartbeats(self) -> None:
        message = dialect.MAVLink_heartbeat_message(
            dialect.MAV_TYPE_GCS
            if self.component_id == GROUND_STATION[1]
            else dialect.MAV_TYPE_ONBOARD_CONTROLLER,
            dialect.MAV_AUTOPILOT_INVALID,
            0,
            0,
            dialect.MAV_STATE_ACTIVE,
            3,
        )
        while True:
            self.send(message)
            await self.clock.sleep(_HEARTBEAT_PERIOD_S)

    # looking and waiting

    @overload
    def latest(
        self, kind: type[MessageT], system_id: int, component_id: int = AUTOPILOT_COMPONENT
    ) -> MessageT | None: ...

    @overload
    def latest(
        self, kind: str, system_id: int, component_id: int = AUTOPILOT_COMPONENT
    ) -> MAVLinkMessage | None: ...

    def latest(
        self, kind: type[MessageT] | str, system_id: int, component_id: int = AUTOPILOT_COMPONENT
    ) -> MAVLinkMessage | None:
        """Newest message of a class, or of a name, from one component, or None."""
        message_id = definition(kind).message_id if isinstance(kind, str) else kind.id
        return self._newest.latest((system_id, component_id), message_id)

    @property
    def autopilots_received(self) -> list[int]:
        """System ids of the autopilots received on this link, in ascending order."""
        return sorted(s for s, component in self._newest.components if component == AUTOPILOT_COMPONENT)

    def newest(self, system_id: int, component_id: int = AUTOPILOT_COMPONENT) -> Mapping[int, Frame]:
        """The present newest frame of each message from one component, by message id."""
        return self._newest.of((system_id, component_id))

    def newest_frame(
        self, message_id: int, system_id: int, component_id: int = AUTOPILOT_COMPONENT
    ) -> Frame | None:
        """Newest frame of a message from one component, or None."""
        return self._newest.frame((system_id, component_id), message_id)

    @property
    def bytes_per_s(self) -> float | None:
        """Capacity of the link in bytes per second; None: not known, or a network."""
        capacity: float | None = getattr(self._link, "bytes_per_s", None)
        return capacity

    def keep(self, system_id: int) -> None:
        """Keep this system's autopilot among the newest messages, however many other systems are received."""
        self._newest.keep((system_id, AUTOPILOT_COMPONENT))

    def listen(self, name: str, listener: Listener, *, in_order: bool = True) -> Callable[[], None]:
        """Call `listener` with each frame of a message name; returns a function that ends this.

        Args:
            name: of the message.
            listener: is called when the frame has been recorded and is the newest one.
            in_order: frames that follow in the same packet are then not recorded yet, nor the newest. Without
                it, which is faster, the listener must look at its frame only, and send nothing.
        """
        message_id = definition(name).message_id
        self._listeners.setdefault(message_id, []).append(listener)
        if in_order:
            self._in_order[message_id] += 1
        self._wanted.clear()

        def stop() -> None:
            listeners = self._listeners.get(message_id, [])
            if listener not in listeners:
                return
            self._wanted.clear()
            listeners.remove(listener)
            if not listeners:
                del self._listeners[message_id]
            if in_order:
                self._in_order[message_id] -= 1
                if not self._in_order[message_id]:
                    del self._in_order[message_id]

        return stop

    def messages(
        self, *kinds: type[MessageT], system_id: int | None = None, component_id: int | None = None
    ) -> "MessageStream[MessageT]":
        """Stream of the messages of these classes, decoded:
        `async for message in connection.messages(dialect.MAVLink_attitude_message)`.

        The stream begins with the first message that arrives after this call.
        """
        return MessageStream(self, kinds, system_id, component_id)


class MessageStream(Generic[MessageT]):
    """Decoded messages as they arrive, in order. Close it, or use it as a context manager.

    Attributes:
        dropped: number of messages lost because the reader was more than 4096 messages behind.
    """

    def __init__(
        self,
        connection: Connection,
        kinds: Iterable[type[MessageT]],
        system_id: int | None,
        component_id: int | None,
    ) -> None:
        self._queue: deque[Frame] = deque()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._waiting: asyncio.Future[None] | None = None
        self._system_id, self._component_id = system_id, component_id
        self._stops = [connection.listen(kind.msgname, self._on_frame, in_order=False) for kind in kinds]
        self._at_once = 0
        self.dropped = 0

    def _on_frame(self, frame: Frame) -> None:
        if self._system_id is not None and frame.system_id != self._system_id:
            return
        if self._component_id is not None and frame.component_id != self._component_id:
            return
        if len(self._queue) >= _STREAM_LIMIT:
            self._queue.popleft()
            self.dropped += 1
        self._queue.append(frame)
        if self._waiting is not None and not self._waiting.done():
            self._waiting.set_result(None)

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> MessageT:
        return cast(MessageT, decode(await self.frame()))

    async def frame(self) -> Frame:
        """The next frame, when it has arrived; it is not decoded."""
        self._at_once += 1
        if self._queue and self._at_once >= _AT_ONCE:  # a full queue must not keep other tasks from running
            self._at_once = 0
            await asyncio.sleep(0)
        while not self._queue:
            self._at_once = 0
            if self._loop is None:
                self._loop = asyncio.get_running_loop()
            self._waiting = self._loop.create_future()
            try:
                await self._waiting
            finally:
                self._waiting = None
        return self._queue.popleft()

    def take(self) -> MessageT | None:
        """The next message if one has arrived, else None; does not wait."""
        return cast(MessageT, decode(self._queue.popleft())) if self._queue else None

    def close(self) -> None:
        """Stop receiving messages."""
        for stop in self._stops:
            stop()
        self._stops = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
