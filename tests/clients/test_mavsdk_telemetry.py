"""Every stream of MAVSDK's telemetry plugin, by both of its interfaces, on every vehicle."""

from typing import Final

import pytest

pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")

from tests.clients.compatibility import not_offered
from tests.clients.mavsdk_flying import accepted
from tests.clients.mavsdk_session import Session

compatibility = pytest.mark.compatibility


_NOT_PX4: Final = {
    "actuator_control_target": "PX4 1.16 has no ACTUATOR_CONTROL_TARGET",
    "ground_truth": "the truth is in the log, not on the link",
    "raw_imu": "PX4 has no RAW_IMU",
}
_NOT_ARDUPILOT: Final = {
    "actuator_control_target": "no ACTUATOR_CONTROL_TARGET",
    "actuator_output_status": "no ACTUATOR_OUTPUT_STATUS",
    "odometry": "no ODOMETRY in 4.6",
    "ground_truth": "the truth is in the log, not on the link",
    "altitude": "no ALTITUDE in 4.6",
    "wind": "WIND, which MAVSDK does not read",
}
NO_STREAM: Final = {
    "px4": {**_NOT_PX4, "wind": "no wind estimate on a copter"},
    "px4-plane": {**_NOT_PX4, "wind": "no wind estimate before the first flight"},
    "ardupilot": _NOT_ARDUPILOT,
    "ardupilot-plane": _NOT_ARDUPILOT,
}
"""Streams that the firmware does not send, and why."""
STREAMS: Final = (
    *("position", "home", "in_air", "landed_state", "armed", "vtol_state", "attitude_quaternion"),
    *("attitude_euler", "attitude_angular_velocity_body", "velocity_ned", "gps_info", "raw_gps", "battery"),
    *("flight_mode", "health", "rc_status", "actuator_control_target", "actuator_output_status", "odometry"),
    *("position_velocity_ned", "ground_truth", "fixedwing_metrics", "imu", "scaled_imu", "raw_imu"),
    *(
        "health_all_ok",
        "unix_epoch_time",
        "distance_sensor",
        "scaled_pressure",
        "heading",
        "altitude",
        "wind",
    ),
)
RATED: Final = frozenset(
    {
        *(
            "position",
            "home",
            "in_air",
            "landed_state",
            "vtol_state",
            "attitude_quaternion",
            "attitude_euler",
        ),
        *("velocity_ned", "gps_info", "raw_gps", "battery", "rc_status", "actuator_control_target"),
        *("actuator_output_status", "odometry", "position_velocity_ned", "ground_truth", "fixedwing_metrics"),
        *("imu", "scaled_imu", "raw_imu", "unix_epoch_time", "distance_sensor", "altitude", "health"),
    }
)


@pytest.mark.parametrize("stream", STREAMS)
@compatibility(feature="telemetry")
def test_telemetry(mavsdk: Session, vehicle: str, stream: str, request: pytest.FixtureRequest) -> None:
    reason = NO_STREAM[vehicle].get(stream)
    requested = stream not in RATED or accepted(mavsdk, "telemetry", f"set_rate_{stream}", 10.0)
    if reason is None:
        assert requested
        assert mavsdk.first("telemetry", stream, wait_s=8.0) is not None
        return
    if requested:
        with pytest.raises(AssertionError, match="not seen"):
            mavsdk.first("telemetry", stream, wait_s=0.3)
    not_offered(request, f"without {stream}: {reason}")
