"""The mission protocol over links that lose, repeat, delay and reorder, and under random messages."""

import heapq
import math
import random
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.firmware.ardupilot.mission_rules import ARDUPILOT_MISSION_POLICY
from autopilot_bridge.firmware.px4.mission_rules import PX4_MISSION_POLICY
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.plans.protocol import MissionService, new_stores
from tests.services.dispatch import deliver

POLICIES = {"px4": PX4_MISSION_POLICY, "ardupilot": ARDUPILOT_MISSION_POLICY}
TICK_US = 20_000
GIVE_UP_US = 60_000_000


class LossyChannel:
    """One direction of a link; messages arrive late, twice, in another order, or not at all."""

    name = "lossy"

    def __init__(self, seed: int, loss: float, twice: float, delay_ms: int) -> None:
        self.random = random.Random(seed)
        self.loss, self.twice, self.delay_us = loss, twice, delay_ms * 1000
        self.now_us = 0
        self.queue: list[tuple[int, int, Any]] = []
        self.sent = 0

    def send(self, message: Any, /) -> None:
        for _ in range(1 + (self.random.random() < self.twice)):
            if self.random.random() >= self.loss:
                self.sent += 1
                due = self.now_us + self.random.randint(0, self.delay_us)
                heapq.heappush(self.queue, (due, self.sent, message))

    def arrived(self, now_us: int) -> list[Any]:
        self.now_us = now_us
        out = []
        while self.queue and self.queue[0][0] <= now_us:
            out.append(heapq.heappop(self.queue)[2])
        return out


class GroundStation:
    """Uploads, then downloads, as a careful client does: repeats itself after 0.7 s, gives up in the end."""

    def __init__(self, send: Any, altitude_m: float, size: int) -> None:
        self.send = send
        self.items = [self._item(seq, altitude_m) for seq in range(size)]
        self.result: int | None = None
        self.received = False
        self.got: dict[int, Any] = {}
        self.total: int | None = None
        self.downloading = False
        self.done = False
        self.asked_us = -1_000_000

    @staticmethod
    def _item(seq: int, altitude_m: float) -> Any:
        return mavlink.MAVLink_mission_item_int_message(
            1, 1, seq, 6, 16, 0, 1, 0, 0, 0, math.nan, 473977000 + seq, 85456000, altitude_m
        )

    def handle(self, message: Any, now_us: int) -> None:
        kind = message.get_type()
        if self.done:
            return
        if not self.downloading:
            if kind in ("MISSION_REQUEST", "MISSION_REQUEST_INT") and message.seq < len(self.items):
                self.received = True
                self.send(self.items[message.seq])
            elif kind == "MISSION_ACK" and message.type != mavlink.MAV_MISSION_INVALID_SEQUENCE:
                self.result = message.type
                self.downloading = True
                self.asked_us = -1_000_000
        elif kind == "MISSION_COUNT" and self.total is None:
            self.total = message.count
            self._ask(now_us)
        elif kind == "MISSION_ITEM_INT" and self.total is not None:
            self.got[message.seq] = message
            self._ask(now_us)
        elif kind == "MISSION_ACK" and message.type == mavlink.MAV_MISSION_ERROR and self.got:
            self.got, self.total = {}, None  # PX4 closed the list: start over

    def tick(self, now_us: int) -> None:
        if now_us - self.asked_us < 700_000 or self.done:
            return
        if self.downloading:
            self._ask(now_us)
        elif now_us >= GIVE_UP_US // 2:
            self.downloading = True
        elif not self.received:  # from then on it is the vehicle that repeats itself
            self.asked_us = now_us
            self.send(mavlink.MAVLink_mission_count_message(1, 1, len(self.items)))

    def _ask(self, now_us: int) -> None:
        self.asked_us = now_us
        if self.total is None:
            self.send(mavlink.MAVLink_mission_request_list_message(1, 1))
        elif len(self.got) == self.total:
            self.send(mavlink.MAVLink_mission_ack_message(1, 1, 0))
            self.done = True
        else:
            missing = min(set(range(self.total)) - set(self.got))
            self.send(mavlink.MAVLink_mission_request_int_message(1, 1, missing))


def altitudes(items: tuple[MissionItem, ...], flavour: str) -> list[float]:
    return [item.z for item in items[1 if flavour == "ardupilot" else 0 :]]


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    flavour=st.sampled_from(list(POLICIES)),
    seed=st.integers(0, 2**32 - 1),
    loss=st.sampled_from([0.0, 0.1, 0.3]),
    twice=st.sampled_from([0.0, 0.3]),
    delay_ms=st.sampled_from([0, 60, 500]),
    size=st.integers(2, 9),
)
def test_never_half_a_plan_and_always_an_end(
    flavour: str, seed: int, loss: float, twice: float, delay_ms: int, size: int
) -> None:
    up = LossyChannel(seed, loss, twice, delay_ms)
    down = LossyChannel(seed + 1, loss, twice, delay_ms)

    class Links:
        channels = (down,)

    stores = new_stores()
    store = stores[MissionType.MISSION]
    old = tuple(MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, x=47.0, y=8.0, z=5.0) for _ in range(4))
    store.replace(old, 1)
    service = MissionService(
        POLICIES[flavour], stores, Links(), lambda severity, text: None, home=lambda: None
    )
    station = GroundStation(up.send, 20.0, size)
    source = Source(down, 255, 190)
    legal = [altitudes(old, flavour), [20.0] * (size - (flavour == "ardupilot"))]
    now_us = 0
    while now_us < GIVE_UP_US:
        now_us += TICK_US
        for message in up.arrived(now_us):
            deliver(message, source, now_us, service)
        service.tick(now_us)
        for message in down.arrived(now_us):
            station.handle(message, now_us)
        station.tick(now_us)
        assert altitudes(store.items, flavour) in legal
        if station.done:
            break
    if station.result == mavlink.MAV_MISSION_ACCEPTED:
        assert altitudes(store.items, flavour) == legal[1]
    if loss == 0.0 and twice == 0.0 and delay_ms == 0:
        assert station.result == mavlink.MAV_MISSION_ACCEPTED
        assert station.done
    if station.done:
        read = [station.got[seq].z for seq in range(1 if flavour == "ardupilot" else 0, station.total or 0)]
        assert read in legal
    # whatever happened, the vehicle comes to rest and takes the next upload
    up.queue.clear()
    for _ in range(500):
        now_us += TICK_US
        service.tick(now_us)
    down.queue.clear()
    down.loss = down.delay_us = 0
    down.twice = 0.0
    down.now_us = now_us
    deliver(mavlink.MAVLink_mission_count_message(1, 1, 2), source, now_us, service)
    for seq in range(2):
        deliver(GroundStation._item(seq, 30.0), source, now_us, service)
    assert down.arrived(now_us)[-1].type == mavlink.MAV_MISSION_ACCEPTED
    assert altitudes(store.items, flavour)[0] == 30.0


byte = st.integers(0, 255)
word = st.one_of(st.integers(0, 6), st.integers(0, 65535))
short = st.one_of(st.integers(-2, 6), st.integers(-(2**15), 2**15 - 1))
real = st.one_of(st.sampled_from([0.0, 1.0, 3.0, 10.0]), st.floats(width=32))
whole = st.one_of(st.integers(-10, 10), st.integers(-(2**31), 2**31 - 1))
frame = st.sampled_from([0, 1, 2, 3, 5, 6, 10, 99])
command = st.one_of(st.sampled_from([16, 20, 21, 22, 177, 178, 5001, 5003, 5100]), st.integers(0, 65535))
kind = st.sampled_from([0, 0, 0, 1, 2, 7, 255])
number = st.integers(0, 4)
MESSAGES = st.one_of(
    st.builds(mavlink.MAVLink_mission_count_message, byte, byte, number | word, kind),
    st.builds(
        mavlink.MAVLink_mission_item_int_message,
        *(byte, byte, number | word, frame, command, st.integers(0, 3), byte),
        *(real, real, real, real, whole, whole, real, kind),
    ),
    st.builds(
        mavlink.MAVLink_mission_item_message,
        *(byte, byte, number | word, frame, command, st.integers(0, 3), byte),
        *(real, real, real, real, real, real, real, kind),
    ),
    st.builds(mavlink.MAVLink_mission_request_message, byte, byte, number | word, kind),
    st.builds(mavlink.MAVLink_mission_request_int_message, byte, byte, number | word, kind),
    st.builds(mavlink.MAVLink_mission_request_list_message, byte, byte, kind),
    st.builds(mavlink.MAVLink_mission_ack_message, byte, byte, byte, kind),
    st.builds(mavlink.MAVLink_mission_clear_all_message, byte, byte, kind),
    st.builds(mavlink.MAVLink_mission_set_current_message, byte, byte, number | word),
    st.builds(mavlink.MAVLink_mission_write_partial_list_message, byte, byte, short, short, kind),
    st.builds(mavlink.MAVLink_mission_request_partial_list_message, byte, byte, short, short, kind),
)


class Sink:
    name = "sink"

    def __init__(self) -> None:
        self.packer = mavlink.MAVLink(None, 1, 1)

    def send(self, message: Any, /) -> None:
        message.pack(self.packer)  # what is sent must fit the wire


@pytest.mark.parametrize("flavour", POLICIES)
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(traffic=st.lists(st.tuples(MESSAGES, st.booleans(), st.sampled_from([0, 1, 20, 600])), max_size=25))
@pytest.mark.sampled(1)
def test_whatever_arrives_nothing_raises(flavour: str, traffic: list[tuple[Any, bool, int]]) -> None:
    here, there = Sink(), Sink()

    class Links:
        channels = (here, there)

    stores = new_stores()
    service = MissionService(
        POLICIES[flavour],
        stores,
        Links(),
        lambda severity, text: None,
        home=lambda: None,
        on_guided_item=lambda item: True,
    )
    now_us = 0
    for message, first, ticks in traffic:
        deliver(message, Source(here if first else there, 255, 190), now_us, service)
        for _ in range(ticks):
            now_us += TICK_US
            service.tick(now_us)
        service.problems()
        here.send(service.current_message())
    for store in stores.values():
        for item in store.items:
            numbers = (item.param1, item.param2, item.param3, item.param4, item.x, item.y, item.z)
            assert not any(map(math.isinf, numbers))
