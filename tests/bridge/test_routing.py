"""The routing guide's rules."""

from pymavlink.dialects.v20 import all as dialect

from autopilot_bridge.mavlink import FrameEncoder, FrameParser
from autopilot_bridge.routing import Router


def frame(message, system_id, component_id=1):
    (parsed,) = FrameParser().feed(FrameEncoder(system_id, component_id).encode(message))
    return parsed


def heartbeat(system_id, component_id=1):
    return frame(dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3), system_id, component_id)


def command(target_system, target_component, system_id=255, component_id=190):
    message = dialect.MAVLink_command_long_message(
        target_system, target_component, 400, 0, 1, 0, 0, 0, 0, 0, 0
    )
    return frame(message, system_id, component_id)


def router():
    made = Router()
    for channel in ("autopilot", "camera", "ground", "second ground"):
        made.add(channel)
    made.route(heartbeat(1, 1), "autopilot")
    made.route(heartbeat(1, 100), "camera")
    made.route(heartbeat(255, 190), "ground")
    made.route(heartbeat(254, 190), "second ground")
    return made


def test_no_target_goes_everywhere_but_back():
    assert router().route(heartbeat(1, 1), "autopilot") == ["camera", "ground", "second ground"]


def test_broadcast_goes_everywhere_but_back():
    assert router().route(command(0, 0), "ground") == ["autopilot", "camera", "second ground"]


def test_a_component_is_reached_where_it_was_received():
    assert router().route(command(1, 100), "ground") == ["camera"]
    assert router().route(command(1, 1), "ground") == ["autopilot"]


def test_all_components_of_a_system():
    assert router().route(command(1, 0), "ground") == ["autopilot", "camera"]


def test_an_unknown_target_is_not_forwarded():
    assert router().route(command(9, 1), "ground") == []
    assert router().route(command(1, 154), "ground") == []


def test_a_system_received_only_at_the_source_is_not_sent_back():
    assert router().route(command(255, 190, 1, 1), "ground") == []


def test_senders_are_learned_per_channel():
    made = router()
    assert made.destinations(7, 1) == []
    made.route(heartbeat(7), "second ground")
    assert made.destinations(7, 1) == ["second ground"]
    made.route(heartbeat(7), "ground")
    assert made.destinations(7, 1) == ["ground", "second ground"]
    assert made.senders("ground") == {(255, 190), (7, 1)}
    made.remove("ground")
    assert made.destinations(7, 1) == ["second ground"]
    assert made.channels == ("autopilot", "camera", "second ground")
