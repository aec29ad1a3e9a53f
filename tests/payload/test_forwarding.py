"""What the autopilot sends to its camera and gimbal: for commands of clients, and for items of a mission."""

import math
from typing import Any

import pytest

from autopilot_bridge.commander.events import ItemCommanded, ModeChanged
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.flight.context import RoiMode
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem, MissionStore, MissionType
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.command import Command
from autopilot_bridge.services.equipment.payload_commands import PayloadCommands
from autopilot_bridge.services.plans.equipment import MissionEquipment
from tests.services.command_rig import Channel, ServiceRig
from tests.services.dispatch import deliver
from tests.services.parts_rig import parts_of, service_of

ACCEPTED, DENIED, UNSUPPORTED, FAILED = 0, 2, 3, 4
CAMERA, GIMBAL = 100, 154
CONFIGURE, PITCHYAW = dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
LOCATION, ROI, NO_ROI = (
    dialect.MAV_CMD_DO_SET_ROI_LOCATION,
    dialect.MAV_CMD_DO_SET_ROI,
    dialect.MAV_CMD_DO_SET_ROI_NONE,
)
NEXT_WAYPOINT = dialect.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET
LAT, LON = 47.3986, 8.5456  # some 95 m north of the vehicle


def sent_values(message: Any) -> tuple[Any, ...]:
    """(component, command, parameters...) of a COMMAND_LONG; with the frame, of a COMMAND_INT."""
    assert message.target_system == 1
    first = (message.param1, message.param2, message.param3, message.param4)
    if message.get_type() == "COMMAND_LONG":
        assert message.confirmation == 0
        more: tuple[Any, ...] = (message.param5, message.param6, message.param7)
        return (message.target_component, message.command, *first, *more)
    assert (message.current, message.autocontinue) == (0, 0)
    more = (message.x, message.y, message.z)
    return (message.target_component, message.command, message.frame, *first, *more)


class Talk:
    """A vehicle with the service that forwards commands."""

    def __init__(self, flavour: str, *present: int) -> None:
        self.rig = ServiceRig(flavour)
        self.service = service_of(self.rig, PayloadCommands)
        self.gcs = Source(Channel(), 255, 190)
        for component in present:
            self.heartbeat(1, component)

    def heartbeat(self, system: int, component: int) -> None:
        message = dialect.MAVLink_heartbeat_message(dialect.MAV_TYPE_CAMERA, 8, 0, 0, 4, 3)
        deliver(message, Source(Channel(), system, component), self.rig.time_us, self.service)

    def controlled_by(self, primary: tuple[int, int], secondary: tuple[int, int] = (0, 0)) -> None:
        message = dialect.MAVLink_gimbal_manager_status_message(0, 0, 1, *primary, *secondary)
        deliver(message, Source(Channel(), 1, GIMBAL), self.rig.time_us, self.service)

    def ask(
        self,
        number: int,
        *values: float,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        frame: int | None = None,
        source: Source | None = None,
    ) -> Any:
        """The answer; `sent` has what is forwarded."""
        self.rig.channel.sent.clear()
        p1, p2, p3, p4 = (*values, *(0.0,) * (4 - len(values)))
        command = Command(number, p1, p2, p3, p4, x, y, z, frame)
        return self.service.commands[number](command, source or self.gcs)

    @property
    def sent(self) -> list[tuple[Any, ...]]:
        return [sent_values(message) for message in self.rig.channel.sent]


def test_a_command_is_forwarded_with_all_its_parameters() -> None:
    talk = Talk("px4", CAMERA)
    number = dialect.MAV_CMD_DO_DIGICAM_CONTROL
    assert talk.ask(number, 1.0, 2.0, 3.0, 4.0, x=5.0, y=6.0, z=7.0) == ACCEPTED
    assert talk.sent == [(CAMERA, number, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)]
    assert talk.ask(number, 1.0, 2.0, 3.0, 4.0, x=LAT, y=-LON, z=7.0, frame=6) == ACCEPTED
    assert talk.sent == [(CAMERA, number, 6, 1.0, 2.0, 3.0, 4.0, 473986000, -85456000, 7.0)]


@pytest.mark.parametrize(
    ("degrees", "e7"), [(math.nan, 0), (1e9, 2**31 - 1), (-1e9, -(2**31)), (214.7483647, 2**31 - 1)]
)
def test_a_place_that_does_not_fit_is_limited(degrees: float, e7: int) -> None:
    talk = Talk("px4", CAMERA)
    talk.ask(dialect.MAV_CMD_DO_DIGICAM_CONTROL, x=degrees, y=degrees, frame=6)
    assert talk.sent[0][7:9] == (e7, e7)


@pytest.mark.parametrize(("flavour", "absent"), [("px4", None), ("ardupilot", UNSUPPORTED)])
@pytest.mark.parametrize(("after_s", "present"), [(4.98, True), (5.0, False)])
def test_a_device_is_present_for_5_seconds_after_its_heartbeat(
    flavour: str, absent: int | None, after_s: float, present: bool
) -> None:
    talk = Talk(flavour, CAMERA, GIMBAL)
    talk.rig.run(after_s)
    for number in (dialect.MAV_CMD_DO_DIGICAM_CONTROL, PITCHYAW):
        assert talk.ask(number) == (ACCEPTED if present else absent)
        assert bool(talk.sent) == present


@pytest.mark.parametrize(("system", "component"), [(2, CAMERA), (1, 101), (1, 1)])
def test_the_heartbeat_of_another_device_is_not_the_cameras(system: int, component: int) -> None:
    talk = Talk("px4")
    talk.heartbeat(system, component)
    assert talk.ask(dialect.MAV_CMD_DO_DIGICAM_CONTROL) is None


@pytest.mark.parametrize(
    ("requested", "forwarded"),
    [
        ((-2.0, -2.0, -1.0, -1.0), (255, 190, -1, -1)),
        ((-1.0, -1.0, -2.0, -2.0), (-1, -1, 255, 190)),
        ((-3.0, -3.0, -1.0, -1.0), (-1, -1, -1, -1)),  # it is not in control
        ((7.0, 8.0, 0.0, 0.0), (7, 8, 0, 0)),
    ],
)
def test_the_client_itself_takes_control_and_gives_it_up(
    requested: tuple[float, ...], forwarded: tuple[float, ...]
) -> None:
    talk = Talk("px4", GIMBAL)
    assert talk.ask(CONFIGURE, *requested) == ACCEPTED
    assert talk.sent[0][2:6] == forwarded
    talk.controlled_by((255, 190))
    talk.ask(CONFIGURE, -3.0, -3.0, -1.0, -1.0)
    assert talk.sent[0][2:6] == (0, 0, -1, -1)


@pytest.mark.parametrize(
    ("primary", "secondary", "answer"),
    [
        ((0, 0), (0, 0), ACCEPTED),
        ((0, 0), (9, 9), ACCEPTED),
        ((255, 190), (0, 0), ACCEPTED),
        ((1, 1), (255, 190), ACCEPTED),
        ((255, 191), (0, 0), DENIED),
        ((254, 190), (0, 0), DENIED),
        ((0, 190), (0, 0), DENIED),
    ],
)
def test_the_clients_in_control_point_the_gimbal(
    primary: tuple[int, int], secondary: tuple[int, int], answer: int
) -> None:
    talk = Talk("px4", GIMBAL)
    talk.controlled_by(primary, secondary)
    assert talk.ask(PITCHYAW, -30.0) == answer
    assert talk.ask(LOCATION, x=LAT, y=LON) == answer
    assert len(talk.sent) == (answer == ACCEPTED)


@pytest.mark.parametrize(("flavour", "refusal"), [("px4", DENIED), ("ardupilot", FAILED)])
@pytest.mark.parametrize(
    ("x", "y", "valid"),
    [
        (90.0, 180.0, True),
        (-90.0, -180.0, True),
        (90.1, 0.0, False),
        (-90.1, 0.0, False),
        (0.0, 180.1, False),
        (0.0, -180.1, False),
        (math.nan, 0.0, False),
    ],
)
def test_a_region_of_interest_is_a_place_on_earth(
    flavour: str, refusal: int, x: float, y: float, valid: bool
) -> None:
    talk = Talk(flavour, GIMBAL)
    assert talk.ask(LOCATION, x=x, y=y) == (ACCEPTED if valid else refusal)
    assert len(talk.sent) == valid


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_another_vehicle_is_a_region_of_interest_of_the_gimbal_alone(flavour: str) -> None:
    assert Talk(flavour).ask(dialect.MAV_CMD_DO_SET_ROI_SYSID, 2.0, x=math.nan) == ACCEPTED
    talk = Talk(flavour, GIMBAL)
    assert talk.ask(dialect.MAV_CMD_DO_SET_ROI_SYSID, 2.0, x=math.nan) == ACCEPTED and len(talk.sent) == 1


def nose(flavour: str, *commands: tuple[Any, ...], **changed: Any) -> Any:
    """The context of a multicopter without a gimbal in the mode that takes regions of interest."""
    talk = Talk(flavour)
    talk.rig.fly()
    if flavour == "px4":
        talk.rig.upload(talk.rig.waypoint(50.0, 0.0), talk.rig.waypoint(0.0, 50.0))
        assert talk.rig.commander.set_mode(FlightMode.MISSION).accepted
        talk.rig.tick()
    for number, *values in commands:
        assert talk.ask(number, *values, **changed) == ACCEPTED
        assert talk.sent == []
    return talk.rig.context


@pytest.mark.parametrize("frame", [None, 0, 3, 5, 6])
def test_the_nose_turns_to_a_place_without_a_gimbal(frame: int | None) -> None:
    """The altitude is over mean sea level in a COMMAND_LONG, else as in the frame."""
    for flavour in ("px4", "ardupilot"):
        context = nose(flavour, (LOCATION,), x=LAT, y=LON, z=500.0, frame=frame)
        assert context.roi is not None and context.roi.mode is RoiMode.LOCATION
        assert float(context.roi.place_ned_m[0]) == pytest.approx(95.6, abs=0.5)
        over_home = frame in (3, 6)
        down_m = -500.0 if over_home else 489.0 - 500.0
        assert float(context.roi.place_ned_m[2]) == pytest.approx(down_m, abs=0.5)
        assert context.nose_on_roi == (flavour == "ardupilot")  # PX4's missions decide for themselves


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.parametrize("end", [(NO_ROI,), (LOCATION,), (ROI,)])
def test_a_region_of_interest_ends(flavour: str, end: tuple[int, ...]) -> None:
    """0/0 is no place; with SET_ROI_NONE, a place does not matter."""
    talk = Talk(flavour)
    talk.rig.fly()
    if flavour == "px4":
        talk.rig.upload(talk.rig.waypoint(50.0, 0.0))
        assert talk.rig.commander.set_mode(FlightMode.MISSION).accepted
        talk.rig.tick()
    assert talk.ask(LOCATION, x=LAT, y=LON) == ACCEPTED and talk.rig.context.roi is not None
    place = {"x": 200.0, "y": 500.0} if end == (NO_ROI,) else {}
    assert talk.ask(*end, **place) == ACCEPTED
    assert talk.rig.context.roi is None


@pytest.mark.parametrize(
    ("kind", "mode"), [(1, RoiMode.NEXT_WAYPOINT), (2, RoiMode.WAYPOINT), (3, RoiMode.LOCATION), (0, None)]
)
def test_px4_distinguishes_the_kinds_of_regions_of_interest(kind: int, mode: RoiMode | None) -> None:
    """Only the kind 3 has a place; the index of a waypoint is in param2."""
    place = {"x": LAT, "y": LON} if kind == 3 else {"x": 200.0, "y": LON}
    roi = nose("px4", (ROI, float(kind), 1.0), **place).roi
    assert (roi and roi.mode) is mode
    if mode is RoiMode.WAYPOINT:
        assert roi.index == 1


def test_px4_turns_the_nose_beside_the_next_waypoint() -> None:
    roi = nose("px4", (NEXT_WAYPOINT,), x=200.0, z=30.0).roi
    assert roi.mode is RoiMode.NEXT_WAYPOINT and roi.yaw_offset_rad == pytest.approx(math.radians(30.0))
    roi = nose("px4", (NEXT_WAYPOINT,), z=math.nan).roi
    assert roi.yaw_offset_rad == 0.0
    assert NEXT_WAYPOINT not in Talk("ardupilot").service.commands


def test_ardupilots_region_of_interest_is_always_a_place() -> None:
    roi = nose("ardupilot", (ROI, 1.0), x=LAT, y=LON).roi
    assert roi.mode is RoiMode.LOCATION


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_the_nose_does_not_turn_on_the_ground_or_in_other_modes(flavour: str) -> None:
    ground = Talk(flavour)
    assert ground.ask(LOCATION, x=LAT, y=LON) == ACCEPTED and ground.rig.context.roi is None
    other = Talk(flavour)
    other.rig.fly()
    other.rig.commander.set_mode(FlightMode.LAND)
    other.rig.tick()
    assert other.ask(LOCATION, x=LAT, y=LON) == ACCEPTED and other.rig.context.roi is None


# items of a mission


class Mission:
    """A vehicle that flies a plan, and the service for the items that are not flown."""

    def __init__(self, *items: MissionItem, flavour: str = "px4") -> None:
        self.rig = ServiceRig(flavour)
        store = MissionStore()
        store.replace(items, 1)
        self.executed: list[Command] = []
        self.service = MissionEquipment(
            parts_of(self.rig, stores={MissionType.MISSION: store}, execute=self.executed.append)
        )

    def due(self, index: int) -> list[tuple[Any, ...]]:
        """What is sent when this item is due."""
        self.rig.channel.sent.clear()
        self.service.follow(ItemCommanded(time_us=self.rig.time_us, index=index))
        return [sent_values(message) for message in self.rig.channel.sent]

    def end(self, previous: FlightMode = FlightMode.MISSION) -> list[tuple[Any, ...]]:
        self.rig.channel.sent.clear()
        changed = ModeChanged(time_us=self.rig.time_us, mode=FlightMode.HOLD, previous=previous)
        self.service.follow(changed)
        return [sent_values(message) for message in self.rig.channel.sent]


def item(command: int, *first: float, **more: Any) -> MissionItem:
    p1, p2, p3, p4 = (*first, *(0.0,) * (4 - len(first)))
    return MissionItem(command=command, **{"param1": p1, "param2": p2, "param3": p3, "param4": p4, **more})


WAYPOINT = item(dialect.MAV_CMD_NAV_WAYPOINT, x=LAT, y=LON, z=20.0)
TAKEN = (GIMBAL, CONFIGURE, 1, 1, -1, -1, 0, 0, 0)  # by the autopilot, component 1
GIVEN_UP = (GIMBAL, CONFIGURE, -3, -3, -1, -1, 0, 0, 0)


def same(sent: list[tuple[Any, ...]], *wanted: tuple[Any, ...]) -> bool:
    return len(sent) == len(wanted) and all(
        one == pytest.approx(other, nan_ok=True) for one, other in zip(sent, wanted, strict=True)
    )


def test_a_camera_item_goes_to_the_camera() -> None:
    number = dialect.MAV_CMD_IMAGE_START_CAPTURE
    mission = Mission(item(number, 1.0, 2.0, 3.0, 4.0, x=5.0, y=6.0, z=7.0))
    assert same(mission.due(0), (CAMERA, number, 1, 2, 3, 4, 5, 6, 7))
    assert mission.end() == []  # the gimbal was not taken


def test_the_mission_takes_the_gimbal_once_and_gives_it_up_with_the_mode() -> None:
    pitch = item(PITCHYAW, -30.0, 10.0, x=12.0)
    mission = Mission(pitch, pitch)
    wanted = (GIMBAL, PITCHYAW, -30, 10, 0, 0, 12, 0, 0)
    assert same(mission.due(0), TAKEN, wanted)
    assert same(mission.due(1), wanted)
    assert mission.end(FlightMode.HOLD) == []
    assert same(mission.end(), GIVEN_UP)
    assert mission.end() == []
    assert same(mission.due(0), TAKEN, wanted)


@pytest.mark.parametrize("index", [-1, 1])
def test_an_item_that_was_removed_meanwhile_is_not_executed(index: int) -> None:
    assert Mission(item(PITCHYAW)).due(index) == []


NAN = math.nan
LEVEL = dialect.GIMBAL_MANAGER_FLAGS_ROLL_LOCK | dialect.GIMBAL_MANAGER_FLAGS_PITCH_LOCK


@pytest.mark.parametrize(
    ("mount", "sent"),
    [
        (item(dialect.MAV_CMD_DO_MOUNT_CONTROL, -20.0, 5.0, 40.0, z=2.0), (-20, 40, NAN, NAN, LEVEL, 0, 0)),
        (item(dialect.MAV_CMD_DO_MOUNT_CONTROL, -20.0, 5.0, 40.0, z=0.0), (NAN, NAN, NAN, NAN, 1, 0, 0)),
        (item(dialect.MAV_CMD_DO_MOUNT_CONTROL, -20.0, 5.0, 40.0, z=1.0), (NAN, NAN, NAN, NAN, 2, 0, 0)),
        (item(dialect.MAV_CMD_DO_MOUNT_CONTROL, -20.0, 5.0, 40.0, z=3.0), None),
        (item(dialect.MAV_CMD_DO_MOUNT_CONTROL, -20.0, 5.0, 40.0, z=NAN), None),
        (item(dialect.MAV_CMD_DO_MOUNT_CONFIGURE, 0.0, z=2.0), (NAN, NAN, NAN, NAN, 1, 0, 0)),
        (item(dialect.MAV_CMD_DO_MOUNT_CONFIGURE, 1.0, z=2.0), (NAN, NAN, NAN, NAN, 2, 0, 0)),
        (item(dialect.MAV_CMD_DO_MOUNT_CONFIGURE, 2.0, z=0.0), None),
    ],
)
def test_mount_items_become_gimbal_commands(mount: MissionItem, sent: tuple[float, ...] | None) -> None:
    """Mode 0 retracts, 1 is neutral, 2 has the angles: pitch in param1, yaw in param3."""
    wanted = [TAKEN] if sent is None else [TAKEN, (GIMBAL, PITCHYAW, *sent)]
    assert same(Mission(mount).due(0), *wanted)


def look(x: float, y: float, z: float, frame: int = 6) -> tuple[Any, ...]:
    return (GIMBAL, LOCATION, frame, 0, 0, 0, 0, round(x * 1e7), round(y * 1e7), z)


ENDED = (GIMBAL, NO_ROI, 0, 0, 0, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("roi", "sent"),
    [
        (item(LOCATION, x=47.1, y=8.1, z=3.0), look(47.1, 8.1, 3.0)),
        (item(LOCATION, x=47.1, y=8.1, z=3.0, frame=11), look(47.1, 8.1, 3.0)),  # terrain: over home
        (item(LOCATION, x=47.1, y=8.1, z=3.0, frame=0), look(47.1, 8.1, 3.0, 0)),
        (item(LOCATION, x=0.0, y=8.1, z=3.0), look(0.0, 8.1, 3.0)),
        (item(LOCATION, x=47.1, y=0.0, z=3.0), look(47.1, 0.0, 3.0)),
        (item(LOCATION, x=0.0, y=0.0, z=3.0), ENDED),
        (item(LOCATION, x=1.0, y=1.0, frame=2), ENDED),
        (item(NO_ROI, x=47.1, y=8.1), ENDED),
        (item(NEXT_WAYPOINT), look(LAT + 0.01, LON, 20.0)),
        (item(ROI, 1.0), look(LAT + 0.01, LON, 20.0)),
        (item(ROI, 2.0, 0.0), look(LAT, LON, 20.0)),
        (item(ROI, 2.0, 2.0), look(LAT + 0.01, LON, 20.0)),
        (item(ROI, 2.0, 1.0), ENDED),  # not a waypoint
        (item(ROI, 2.0, 3.0), ENDED),
        (item(ROI, 2.0, -1.0), ENDED),
        (item(ROI, 2.0, NAN), ENDED),
        (item(ROI, 3.0, x=47.1, y=8.1, z=3.0), look(47.1, 8.1, 3.0)),
        (item(ROI, NAN, x=47.1, y=8.1, z=3.0), look(47.1, 8.1, 3.0)),
        (item(dialect.MAV_CMD_NAV_ROI, 1.0), look(LAT + 0.01, LON, 20.0)),
        (item(LOCATION, 1.0, x=47.1, y=8.1, z=3.0), look(47.1, 8.1, 3.0)),  # param1 has no kind here
    ],
)
def test_a_region_of_interest_goes_to_the_gimbal(roi: MissionItem, sent: tuple[Any, ...]) -> None:
    last = item(dialect.MAV_CMD_NAV_WAYPOINT, x=LAT + 0.01, y=LON, z=20.0)
    assert same(Mission(WAYPOINT, roi, last).due(1), TAKEN, sent)


def test_no_waypoint_follows_the_last_item() -> None:
    assert same(Mission(WAYPOINT, item(NEXT_WAYPOINT)).due(1), TAKEN, ENDED)


def test_all_other_items_are_executed_as_commands() -> None:
    number = dialect.MAV_CMD_DO_CHANGE_SPEED
    mission = Mission(item(number, 1, 2, 3, 4, x=5.0, y=6.0, z=7.0, frame=2), item(number, x=LAT, frame=0))
    assert mission.due(0) == mission.due(1) == []
    assert mission.executed == [
        Command(number, 1, 2, 3, 4, 5.0, 6.0, 7.0, None),
        Command(number, 0, 0, 0, 0, LAT, 0.0, 0.0, 0),
    ]
