"""What the vehicles' process and the picture process send each other."""

from autopilot_bridge.video.messages import pack, unpack, view_from_json, view_to_json
from flightsim.payload import CameraView, TargetShape, TargetView


def test_a_view_arrives_as_it_was_sent() -> None:
    targets = tuple(
        TargetView(position_ned_m=(1.0, 2.0, 0.0), size_m=4.0, tag_id=tag, shape=shape, course_rad=0.7)
        for tag, shape in ((-1, TargetShape.VEHICLE), (3, TargetShape.BALL))
    )
    view = CameraView(
        time_us=5,
        eye_ned_m=(0.0, 1.0, -2.0),
        q_ned_from_mount=(1.0, 0.0, 0.0, 0.0),
        exposure_s=0.004,
        velocity_ned_m_s=(3.0, 0.0, 0.0),
        targets=targets,
    )
    assert view_from_json(unpack(pack(view_to_json(view)))) == view
