"""Progress in a mission from messages that are lost, repeated and reordered."""

from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.vehicle.item_tracker import FlownOrder, ItemTracker, mission_steps

HOME = GeodeticPosition(lat_deg=47.0, lon_deg=8.0, alt_m=400.0)
FRAME = LocalFrame(HOME)
TAKEOFF, WAYPOINT, TRIGGER, JUMP, RTL = 22, 16, 206, 177, 20
RADIUS_M = 2.0


def waypoint(number: int) -> MissionItem:
    """Places on a zigzag, 40 m apart or more."""
    lat, lon, _ = FRAME.geodetic_from_ned(40.0 * number, 60.0 * (number % 2), 0.0)
    return MissionItem(command=WAYPOINT, x=lat, y=lon, z=20.0)


def tracker_of(items: list[MissionItem]) -> ItemTracker:
    order = FlownOrder.of(items)
    return ItemTracker(mission_steps(items, order, HOME, RADIUS_M), order.again_from)


@st.composite
def missions(draw, jumps: bool = False) -> list[MissionItem]:
    kinds = [WAYPOINT, WAYPOINT, TRIGGER, *([JUMP] if jumps else [])]
    items = [MissionItem(command=TAKEOFF, x=HOME.lat_deg, y=HOME.lon_deg, z=20.0)]
    for kind in draw(st.lists(st.sampled_from(kinds), min_size=1, max_size=10)):
        if kind == JUMP:
            target = draw(st.integers(0, len(items) - 1))
            items.append(MissionItem(command=JUMP, frame=2, param1=target, param2=draw(st.integers(0, 2))))
        elif kind == WAYPOINT:
            items.append(waypoint(len(items)))
        else:
            items.append(MissionItem(command=kind, frame=2))
    return items


def messages(items: list[MissionItem], coalesced: bool) -> list[tuple[str, tuple[float, ...], int]]:
    """What a vehicle sends along a mission: kind, arguments, and how many steps are truly behind by then."""
    order = FlownOrder.of(items).indices
    sent: list[tuple[str, tuple[float, ...], int]] = []
    here = (0.0, 0.0, 0.0)
    for k, index in enumerate(order):
        sent.append(("current", (index,), k))
        item = items[index]
        if item.command == WAYPOINT:
            there = FRAME.ned_from_geodetic(item.x, item.y, HOME.alt_m + item.z)
            for n in range(1, 21):
                at = [a + 0.05 * n * (b - a) for a, b in zip(here, there, strict=True)]
                sent.append(("position", FRAME.geodetic_from_ned(*at), k + (n == 20)))
            here = there
        following = items[order[k + 1]].command if k + 1 < len(order) else 0
        if not (coalesced and item.command == WAYPOINT and following == TRIGGER):
            sent.append(("reached", (index,), k + 1))
    return sent


def deliver(tracker: ItemTracker, kind: str, values: tuple[float, ...], time_us: int) -> None:
    if kind == "position":
        tracker.on_position(*values, time_us)  # type: ignore[call-arg]
    elif kind == "current":
        tracker.on_current(int(values[0]), time_us)
    else:
        tracker.on_reached(int(values[0]), time_us)


@settings(max_examples=150, deadline=None)
@given(missions(), st.booleans(), st.data())
def test_any_loss_and_order_leaves_progress_at_or_behind_the_vehicle(items, coalesced, data) -> None:
    sent = messages(items, coalesced)
    tracker = tracker_of(items)
    picked = data.draw(st.lists(st.integers(0, len(sent) - 1), max_size=60))
    truth, behind = 0, 0
    for time_us, k in enumerate(picked):
        kind, values, progress = sent[k]
        deliver(tracker, kind, values, time_us)
        truth = max(truth, progress)
        assert behind <= tracker.behind <= truth
        behind = tracker.behind
    assert [i for i, _ in tracker.reached] == list(FlownOrder.of(items).indices[:behind])


@settings(max_examples=150, deadline=None)
@given(missions(jumps=True), st.booleans(), st.data())
def test_losses_and_repeats_of_the_newest_never_lead_ahead_with_jumps(items, coalesced, data) -> None:
    sent = messages(items, coalesced)
    copies = data.draw(st.lists(st.integers(0, 3), min_size=len(sent), max_size=len(sent)))
    tracker = tracker_of(items)
    behind = 0
    for time_us, ((kind, values, progress), count) in enumerate(zip(sent, copies, strict=True)):
        for _ in range(count):
            deliver(tracker, kind, values, time_us)
            assert behind <= tracker.behind <= progress
            behind = tracker.behind


@settings(max_examples=100, deadline=None)
@given(missions(), st.booleans(), st.sampled_from(["reached", "position"]))
def test_one_kind_of_message_is_enough_to_see_the_end(items, coalesced, kind) -> None:
    tracker = tracker_of(items)
    tracker.on_current(1, 0)  # off the ground: no position shows that
    sent = [message for message in messages(items, coalesced) if message[0] == kind]
    for time_us, (_, values, _) in enumerate(sent):
        deliver(tracker, kind, values, time_us)
    if kind == "position" and sent:
        deliver(tracker, *sent[-1][:2], 10_000_000)  # it stays there
    assert tracker.over


def test_a_do_item_is_reported_for_the_waypoint_before_it() -> None:
    """MISSION_ITEM_REACHED as PX4 1.16.1 and ArduPilot 4.6.3 send it: 0, 2, 3."""
    items = [
        MissionItem(command=TAKEOFF, z=20.0),
        waypoint(1),
        MissionItem(command=TRIGGER, frame=2),
        waypoint(3),
    ]
    tracker = tracker_of(items)
    for time_us, index in enumerate((0, 2, 3)):
        tracker.on_reached(index, time_us)
    assert tracker.reached == [(0, 0), (1, 1), (2, 1), (3, 2)]
    assert tracker.finished


def test_the_end_of_the_flight_before_is_no_end() -> None:
    items = [MissionItem(command=TAKEOFF, z=20.0), waypoint(1), waypoint(2)]
    tracker = tracker_of(items)
    tracker.on_current(0, 0, state=5)
    assert tracker.behind == 0
    tracker.on_current(0, 1, state=3)
    tracker.on_current(2, 2, state=5)
    assert tracker.finished


def test_an_endless_mission_goes_round_and_does_not_finish() -> None:
    items = [waypoint(0), waypoint(1), MissionItem(command=JUMP, frame=2, param1=0.0, param2=-1.0)]
    tracker = tracker_of(items)
    for time_us, index in enumerate((0, 1) * 50):
        tracker.on_reached(index, time_us)
        tracker.on_reached(index, time_us)
    assert tracker.behind == 100
    assert not tracker.over and not tracker.finished


def test_a_place_to_circle_for_ever_is_reached_when_the_vehicle_is_there() -> None:
    items = [
        waypoint(1),
        MissionItem(command=mavlink.MAV_CMD_NAV_LOITER_UNLIM, param3=50.0, x=47.0, y=8.0, z=20.0),
    ]
    tracker = tracker_of(items)
    tracker.on_reached(0, 0)
    for time_us, north_m in enumerate((300.0, 150.0, 90.0)):
        tracker.on_position(*FRAME.geodetic_from_ned(north_m, 0.0, -20.0), time_us)
        assert tracker.over == (north_m == 90.0)


def test_the_last_place_is_seen_before_its_message() -> None:
    """PX4 holds at once at the last waypoint; REACHED may be lost."""
    items = [waypoint(1), waypoint(2), MissionItem(command=RTL, frame=2)]
    tracker = tracker_of(items)
    tracker.on_reached(0, 0)
    assert not tracker.at_the_last_place
    tracker.on_position(items[1].x, items[1].y, HOME.alt_m + 20.0, 1)
    assert tracker.at_the_last_place and not tracker.coming_down
    tracker.on_position(*FRAME.geodetic_from_ned(0.0, 0.0, -20.0), 2)
    assert tracker.coming_down


def test_orders_follow_jumps() -> None:
    jump = MissionItem(command=JUMP, frame=2, param1=1.0, param2=2.0)
    order = FlownOrder.of([waypoint(0), waypoint(1), jump, waypoint(3)])
    assert order.indices == (0, 1, 1, 1, 3)
    for repeats in (-1.0, 1e6):
        forever = MissionItem(command=JUMP, frame=2, param1=0.0, param2=repeats)
        assert FlownOrder.of([waypoint(0), forever]).endless
