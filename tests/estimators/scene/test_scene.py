"""The scene of messages, of what estimators and missions show, and of a recorded run. 1 s."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.tlog import TlogReader
from estimators.logs import open_log
from estimators.messages import read_message
from estimators.scene.estimates import items_of
from estimators.scene.messages import MessageScene
from estimators.scene.placing import placed
from estimators.scene.recording import SUFFIX, SceneWriter, read_scene
from estimators.scene.scene import Scene, entries_of_log
from estimators.scene.shown import Estimates, Showing, Shown, Subject
from estimators.scene_items import (
    Camera,
    Cleared,
    Field,
    Gaussian,
    Item,
    Line,
    Origin,
    Picture,
    PointSet,
    Pose,
    Relative,
    Role,
    Text,
    Value,
)
from estimators.vehicle_time import VehicleTime
from flightsim.foundation.geodesy import GeodeticPosition

HOME = GeodeticPosition(lat_deg=47.39774, lon_deg=8.54559, alt_m=490.0)
NORTH_E7 = 8994  # 100 m in degE7


def home():
    return dialect.MAVLink_home_position_message(473977400, 85455900, 490000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)


def position(time_s, north=0, lat=473977400):
    north_e7 = round(north * NORTH_E7 / 100)
    return dialect.MAVLink_global_position_int_message(
        round(1e3 * time_s), lat + north_e7, 85455900 if lat else 0, 500000, 10000, 300, 400, 0, 9000
    )


def truth(time_s, north=0.0, component=25):
    q = [math.cos(0.05), math.sin(0.05), 0.0, 0.0]  # rolled by 0.1 rad
    north_e7 = round(north * NORTH_E7 / 100)
    return dialect.MAVLink_hil_state_quaternion_message(
        round(1e6 * time_s), q, 0, 0, 0, 473977400 + north_e7, 85455900, 500000, 0, 0, 0, 0, 0, 0, 0, 0
    )


def a_flight(log):
    """Home, ten seconds with positions and truth, a plan, a fence, GPS lost, texts and a target."""
    log.heartbeat()
    log.say(position(0.9))  # before home is known: no place
    log.say(home())
    log.say(truth(1.0), system=251, component=1)
    log.say(dialect.MAVLink_estimator_status_message(1, 0, 0, 0, 0, 0, 0, 0, 2.5, 1.0))
    for k in range(100):
        time_s = 1.0 + 0.05 * k
        log.say(truth(time_s, north=k))
        log.attitude(time_s, roll=0.2)
        log.say(position(time_s, north=k + 3))
        log.say(position(time_s, lat=0))  # no position yet, as ArduPilot sends
    for fix in (3, 3, 1, 3):
        log.say(dialect.MAVLink_gps_raw_int_message(6_000_000, fix, 0, 0, 0, 0, 0, 0, 0, 9))
    log.say(dialect.MAVLink_statustext_message(4, b"Low battery"))
    for seq, (east, command) in enumerate(((0, 22), (500, 16), (1000, 16))):
        log.say(
            dialect.MAVLink_mission_item_int_message(
                1, 1, seq, 6, command, 0, 1, 0, 0, 0, 0, 473977400, 85455900 + east, 20.0, 0
            ),
            system=255,
            component=190,
        )
    circle = (1, 1, 0, 0, 5003, 0, 1, 60.0, 0, 0, 0, 473977400, 85455900, 0.0, 1)
    log.say(dialect.MAVLink_mission_item_int_message(*circle), system=255, component=190)
    log.heartbeat(armed=False)
    return log.close()


@pytest.fixture
def log(make_log):
    return a_flight(make_log("flight.tlog"))


def test_messages_become_places_with_attitude_errors_with_bands_plans_and_events(log):
    scene = Scene.of_log(open_log(log))
    assert scene.origin is not None and scene.origin.lat_deg == pytest.approx(HOME.lat_deg, abs=1e-9)
    estimate, true = scene["vehicles/1/estimate"], scene["vehicles/1/truth"]
    assert len(estimate) == len(true) == 50  # ten a second of the twenty that came
    assert estimate[-1].item.pos_ned_m == pytest.approx((101.0, 0.0, -10.0), abs=0.1)
    assert true[-1].item.pos_ned_m == pytest.approx((98.0, 0.0, -10.0), abs=0.1)
    assert true[-1].item.role is Role.TRUTH
    error = scene["vehicles/1/error/position"][-1].item
    assert (error.unit, error.sigma, error.error) == ("m", 2.5, True)
    assert error.value == pytest.approx(3.0, abs=0.1)
    assert scene["vehicles/1/error/attitude"][-1].item.value == pytest.approx(
        math.degrees(math.hypot(0.1, 0.1)), abs=0.1
    )  # roll and yaw
    assert scene["vehicles/1/speed/ground"][-1].item.value == pytest.approx(5.0)
    assert scene["targets/1/truth"][0].item.pos_ned_m == pytest.approx((0.0, 0.0, -10.0))
    assert [entry.item.text for entry in scene["vehicles/1/gps/fix"]] == [
        *("GPS: 3D fix", "GPS: no fix", "GPS: 3D fix")
    ]
    assert scene["vehicles/1/texts"][0].item == Text(text="Low battery", warning=True)
    assert [entry.item.text for entry in scene["vehicles/1/armed"]] == ["armed", "disarmed"]
    waypoints = scene["vehicles/1/waypoints"][-1].item.points_ned_m
    assert waypoints.shape == (3, 3) and np.allclose(waypoints[:, 2], -20.0)
    fence = scene["vehicles/1/fence/0"][0].item
    assert fence.closed and np.allclose(np.hypot(*fence.points_ned_m.T[:2]), 60.0)


def test_frames_one_by_one_give_the_scene_of_their_log(log):
    live, time = MessageScene(), VehicleTime()
    entries = []
    for _, frame in TlogReader(log):
        message = read_message(frame)
        entries += live.take(time.stamp(message), message)
    recorded = list(entries_of_log(open_log(log)))
    assert [entry[:2] for entry in entries] == [entry[:2] for entry in recorded]
    assert len(entries) > 300


def test_a_log_without_a_position_has_a_scene_without_places(make_log):
    log = make_log()
    log.attitude(1.0)
    log.say(dialect.MAVLink_statustext_message(6, b"ready"))
    scene = Scene.of_log(open_log(log.close()))
    assert scene.origin is None
    assert scene.paths == ("vehicles/1/texts",)


def test_a_vehicle_that_reports_no_home_has_places_from_its_first_height(make_log):
    log = make_log()
    for k in range(150):
        log.say(position(1.0 + 0.1 * k))
    scene = Scene.of_log(open_log(log.close()))
    assert scene.origin is not None and scene.origin.alt_m == 490.0
    assert scene["vehicles/1/height"][-1].item.value == pytest.approx(10.0)


def test_a_second_boot_follows_the_first_on_the_timeline(make_log):
    log = make_log()
    for _ in range(2):
        log.say(home())
        for k in range(100):
            log.say(position(1.0 + 0.1 * k))
    scene = Scene.of_log(open_log(log.close()))
    times = [entry.time_us for entry in scene["vehicles/1/height"]]
    assert times == sorted(times)
    assert times[-1] - times[0] == pytest.approx(24.8e6)  # twice 9.9 s, and 5 s between


ITEMS: tuple[Item, ...] = (
    Origin(lat_deg=1.0, lon_deg=2.0, alt_m=3.0),
    Pose(pos_ned_m=(1.0, 2.0, 3.0), q_ned_from_frd=(1.0, 0.0, 0.0, 0.0), label="a"),
    Line(points_ned_m=np.ones((4, 3)), closed=True, role=Role.AREA),
    PointSet(points_ned_m=np.ones((2, 3)), weights=np.array([0.5, 0.25]), labels=("a", "b")),
    Gaussian(mean_ned_m=(1.0, 2.0, 0.0), covariance_m2=np.diag([4.0, 9.0])),
    Field(values=np.ones((3, 2), dtype=np.float32), south_m=0.0, west_m=1.0, cell_m=2.0, unit="probability"),
    Camera(
        pos_ned_m=(0.0, 0.0, -5.0),
        q_ned_from_camera=(1.0, 0.0, 0.0, 0.0),
        width_px=64,
        height_px=48,
        focal_px=(50.0, 50.0),
        centre_px=(32.0, 24.0),
    ),
    Picture(pixels=np.zeros((4, 6), dtype=np.uint8), marks_px=np.ones((1, 2))),
    Value(value=1.0, unit="m", sigma=2.0, error=True),
    Text(text="found", warning=True),
    Cleared(),
    Relative(item=Pose(pos_ned_m=(1.0, 0.0, 0.0)), system_id=1),
)


def test_what_is_shown_is_read_back_from_the_file_of_the_run(tmp_path):
    path = (tmp_path / "flight.tlog").with_suffix(SUFFIX)
    writer = SceneWriter(path)
    shown = [
        Shown(Subject(base="mission", system_id=k % 2), f"item/{k}", 1000 * k, HOME if k % 3 else None, item)
        for k, item in enumerate(ITEMS)
    ]
    for one in shown:
        writer.write(one)
    writer.close()
    found = list(read_scene(path))
    assert [one[:4] for one in found] == [one[:4] for one in shown]
    assert Showing(Subject(base="mission")).changes(0, {"x": ITEMS[0]})
    for one, item in zip(found, ITEMS, strict=True):
        assert not isinstance(one.item, Estimates)
        keeper = Showing(Subject(base="mission"))
        keeper.changes(0, {"x": item})
        assert keeper.changes(1, {"x": one.item}) == [], item
    path.write_bytes(path.read_bytes()[:-3])
    assert len(list(read_scene(path))) == len(ITEMS) - 1


def test_only_what_has_changed_is_shown_and_what_is_gone_is_cleared():
    showing = Showing(Subject(base="mission"))
    area, found = Line(points_ned_m=np.zeros((2, 3))), Text(text="found")
    assert len(showing.changes(1, {"area": area, "found": found})) == 2
    assert showing.changes(2, {"area": Line(points_ned_m=np.zeros((2, 3))), "found": found}) == []
    (gone,) = showing.changes(3, {"area": area})
    assert (gone.name, gone.item) == ("found", Cleared())


def test_items_get_their_place_from_vehicles_and_origins(log):
    messages, time = MessageScene(), VehicleTime()
    relative = Shown(
        Subject(base="mission"),
        "target",
        1,
        None,
        Relative(item=Pose(pos_ned_m=(5.0, 0.0, 10.0)), system_id=1),
    )
    assert placed(relative, messages) == []  # nothing was received yet
    for _, frame in TlogReader(log):
        message = read_message(frame)
        messages.take(time.stamp(message), message)
    (entry,) = placed(relative, messages)
    assert entry.path == "mission/target"
    assert entry.item.pos_ned_m == pytest.approx((103.0, 0.0, 0.0), abs=0.1)  # from the true place
    elsewhere = GeodeticPosition(lat_deg=HOME.lat_deg + 1e-3, lon_deg=HOME.lon_deg, alt_m=HOME.alt_m)
    (moved,) = placed(Shown(Subject(base="m"), "p", 1, elsewhere, Pose(pos_ned_m=(0.0, 0.0, 0.0))), messages)
    assert moved.item.pos_ned_m[0] == pytest.approx(111.2, abs=0.3)


def test_what_a_run_showed_is_on_the_scene_of_its_log(log):
    writer = SceneWriter(log.with_suffix(SUFFIX))
    field = Field(values=np.ones((2, 2)), south_m=0.0, west_m=0.0, cell_m=1.0, unit="probability")
    writer.write(Shown(Subject(base="mission"), "grid", 500_000, None, field))  # before home is known
    writer.write(Shown(Subject(base="mission"), "grid", 3_000_000, None, Cleared()))
    writer.close()
    scene = Scene.of_log(open_log(log))
    assert isinstance(scene.at(2_000_000)["mission/grid"], Field)
    assert scene.at(3_000_000)["mission/grid"] == Cleared()
    assert "mission/grid" not in scene.at(400_000)


def test_estimates_are_shown_by_the_names_of_their_columns():
    columns = ("north_m", "east_m", "north_sigma_m", "east_sigma_m", "north_east_correlation")
    values = np.array([[10.0, 20.0, 2.0, 1.0, 0.5, 0.1, 0.0004]])
    columns += ("roll_rad", "roll_variance_rad2")
    items = items_of(Estimates(columns=columns, values=values, of_set=False, system_id=1), {"roll_rad": 0.05})
    place = items["place"]
    assert isinstance(place, Gaussian) and place.mean_ned_m == (10.0, 20.0, 0.0)
    assert np.allclose(place.covariance_m2, [[4.0, 1.0], [1.0, 1.0]])
    assert place.half_axes_m[0] > 6.0  # three sigma
    error = items["error_roll"]
    assert isinstance(error, Value) and error.unit == "deg"
    assert (error.value, error.sigma) == pytest.approx((math.degrees(0.05), math.degrees(0.02)))


@pytest.mark.parametrize(
    "item",
    [
        Field(values=np.ones(4), south_m=0.0, west_m=0.0, cell_m=1.0, unit=""),
        Line(points_ned_m=np.ones((2, 2))),
        Pose(pos_ned_m=(1.0, 2.0)),
        Pose(pos_ned_m=("a", "b", "c")),
        PointSet(points_ned_m=np.array([[b"a", b"b", b"c"]])),
    ],
)
def test_an_item_of_another_shape_ends_the_file(tmp_path, item):
    writer = SceneWriter(tmp_path / "flight.scene")
    for one in (Text(text="before"), item, Text(text="after")):
        writer.write(Shown(Subject(base="mission"), "x", 1, None, one))
    writer.close()
    assert [shown.item for shown in read_scene(tmp_path / "flight.scene")] == [Text(text="before")]
