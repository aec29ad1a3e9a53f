"""MAVSDK's importer of plan files, beside ours."""

from typing import Any

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.logging import log_subscribe
from mavsdk.plugins.mission_raw import MissionRaw

from autopilot_bridge.links import UdpClient, open_link
from autopilot_bridge.mavlink import FrameEncoder, dialect
from tests.clients.sitl_process import free_port


def imported_items(text: str) -> list[Any]:
    """The mission items of a plan's text, read for a PX4 whose heartbeat is all there is of it."""
    log_subscribe(lambda *_: True)
    port = free_port()
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    heartbeat = dialect.MAVLink_heartbeat_message(
        dialect.MAV_TYPE_QUADROTOR, dialect.MAV_AUTOPILOT_PX4, 1, 0, dialect.MAV_STATE_STANDBY, 3
    )
    link, encoder = open_link(UdpClient("127.0.0.1", port)), FrameEncoder(1, 1)
    try:
        mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
        system = None
        for _ in range(50):
            link.send(encoder.encode(heartbeat))
            system = mavsdk.first_autopilot(timeout_s=0.2)
            if system is not None:
                break
        assert system is not None, "MAVSDK did not take the heartbeat"
        plugin = MissionRaw(system)
        return list(plugin.import_qgroundcontrol_mission_from_string(text).mission_items)
    finally:
        mavsdk.destroy()
        link.close()
