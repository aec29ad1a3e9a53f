"""The state of the mission protocol for each channel between messages."""

from dataclasses import dataclass

from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.services.channel import Channel, Source


@dataclass(slots=True)
class Finished:
    """The last accepted upload: its last item may be repeated when the MISSION_ACK was lost."""

    partner: Source
    mission_type: MissionType
    last_seq: int
    plan_id: int


@dataclass(slots=True)
class Download:
    """A list that the client opened, with the plan at that time."""

    partner: Source
    mission_type: MissionType
    items: tuple[MissionItem, ...]
    received_us: int
    next_seq: int = 0


@dataclass(slots=True)
class ChannelSession:
    """One channel's state.

    Attributes:
        channel: the channel.
        as_int: the client uses MISSION_ITEM_INT.
        download: the open list, if any.
        finished: the last accepted upload, if any.
        warned_item, warned_request: the client was sent the text to use the integer messages.
    """

    channel: Channel
    as_int: bool = False
    download: Download | None = None
    finished: Finished | None = None
    warned_item: bool = False
    warned_request: bool = False


class Sessions:
    """The sessions of all channels on which messages were received."""

    def __init__(self) -> None:
        self._sessions: dict[int, ChannelSession] = {}

    def of(self, channel: Channel) -> ChannelSession:
        # By identity: two links may have the same name, and a session keeps its channel alive.
        session = self._sessions.get(id(channel))
        if session is None:
            session = self._sessions[id(channel)] = ChannelSession(channel)
        return session

    def all(self) -> tuple[ChannelSession, ...]:
        return tuple(self._sessions.values()) if self._sessions else ()


def mission_type_of(value: int) -> MissionType | None:
    """The mission type with a MAV_MISSION_TYPE value, None when there is none."""
    try:
        return MissionType(value)
    except ValueError:
        return None


def same_partner(a: Source, b: Source) -> bool:
    return a.channel is b.channel and a.system_id == b.system_id and a.component_id == b.component_id
