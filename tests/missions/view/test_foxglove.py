"""MCAP with Foxglove's schemas, read back by mcap's decoders. 2 s."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import FrameEncoder, dialect
from autopilot_bridge.tlog import TlogWriter
from estimators.logs import open_log
from missions.view.of_log import draw_log
from tests.missions.view.a_scene import a_scene

pytest.importorskip("foxglove", reason="foxglove-sdk is not installed: pip install 'flightstack[view]'")
pytest.importorskip(
    "mcap_protobuf", reason="mcap-protobuf-support is not installed: pip install 'flightstack[test]'"
)


def decoded(path):
    """The messages of a file by topic: (schema, log time ns, message)."""
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    found = {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.message_encoding == "json":
                content = message.data
            else:
                content = DecoderFactory().decoder_for(channel.message_encoding, schema)(message.data)
            found.setdefault(channel.topic, []).append((schema.name, message.log_time, content))
    return found


@pytest.fixture
def messages(tmp_path):
    """Those of a scene."""
    from missions.view.foxglove_viewers import FoxgloveFile

    viewer = FoxgloveFile(tmp_path / "scene.mcap")
    viewer.begin("a scene")
    viewer.draw(list(a_scene(5)))
    viewer.finish()
    return decoded(tmp_path / "scene.mcap")


def test_each_kind_of_item_has_its_well_known_schema(messages):
    schemas = {topic: found[0][0] for topic, found in messages.items()}
    assert schemas == {
        "/vehicles/1/estimate/pose": "foxglove.PoseInFrame",
        "/vehicles/1/estimate/location": "foxglove.LocationFix",
        "/vehicles/1/estimate/trail": "foxglove.SceneUpdate",
        "/vehicles/1/truth/pose": "foxglove.PoseInFrame",
        "/vehicles/1/truth/location": "foxglove.LocationFix",
        "/vehicles/1/truth/trail": "foxglove.SceneUpdate",
        "/tf": "foxglove.FrameTransform",
        "/mission/area": "foxglove.SceneUpdate",
        "/mission/target": "foxglove.SceneUpdate",
        "/mission/particles": "foxglove.PointCloud",
        "/mission/grid": "foxglove.Grid",
        "/mission/grid/label": "foxglove.SceneUpdate",
        "/vehicles/1/camera/calibration": "foxglove.CameraCalibration",
        "/vehicles/1/camera/picture": "foxglove.CompressedImage",
        "/vehicles/1/camera/picture/marks": "foxglove.ImageAnnotations",
        "/events": "foxglove.Log",
        "/vehicles/1/error/position": "flightstack.Value",
    }


def test_places_are_east_north_up_and_on_the_earth(messages):
    _, time_ns, last = messages["/vehicles/1/truth/pose"][-1]
    place = last.pose.position
    assert (place.x, place.y, place.z) == pytest.approx((1.0, 24.5, 20.0))
    q = last.pose.orientation  # the vehicle looks north: x (forward) is y (north) of the map
    assert (q.x, q.y, abs(q.z), abs(q.w)) == pytest.approx((0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))
    assert q.z * q.w > 0.0  # turned to the left from east
    assert time_ns == 4_900_000_000
    fix = messages["/vehicles/1/truth/location"][-1][2]
    assert fix.latitude == pytest.approx(47.4 + 24.5 / 111_190, abs=1e-6)
    assert fix.altitude == pytest.approx(510.0)


def test_the_first_row_of_a_grid_is_the_southern_one(messages):
    grid = messages["/mission/grid"][-1][2]
    cells = np.frombuffer(grid.data, np.dtype([("value", "<f4"), ("rgba", "u1", 4)]))
    assert (grid.column_count, len(cells)) == (20, 200)
    assert (grid.pose.position.x, grid.pose.position.y) == (-50.0, 0.0)
    assert cells["value"][-1] == pytest.approx(0.4)  # north-east
    assert np.count_nonzero(cells["value"]) == 1


def test_what_is_gone_is_deleted(messages):
    assert messages["/mission/particles"][-1][2].data == b""


def test_a_log_has_its_raw_messages_beside_the_scene_at_the_same_times(tmp_path):
    from missions.view.foxglove_viewers import FoxgloveFile

    path, encoder = tmp_path / "flight.tlog", FrameEncoder(1, 1)
    writer, epoch_us = TlogWriter(path), 1_700_000_000_000_000
    home = dialect.MAVLink_home_position_message(473977400, 85455900, 490000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)
    writer.write(epoch_us, encoder.encode(home))
    for k in range(1, 30):
        place = (473977400 + 10 * k, 85455900, 500000, 10000, 0, 0, 0, 0)
        message = dialect.MAVLink_global_position_int_message(100 * k, *place)
        writer.write(epoch_us + 100_000 * k, encoder.encode(message))
    writer.close()
    viewer = FoxgloveFile(tmp_path / "flight.mcap")
    assert draw_log(open_log(path), viewer, "a flight")
    found = decoded(tmp_path / "flight.mcap")
    raw = found["/1/1/GLOBAL_POSITION_INT"]
    assert len(raw) == 29
    poses = found["/vehicles/1/estimate/pose"]
    assert poses[-1][1] == pytest.approx(raw[-1][1], abs=1e6)  # ns
