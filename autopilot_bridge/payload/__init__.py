"""MAVLink components beside the autopilot: camera (100), gimbal (154), survey magnetometer (158).

Each speaks for one device of `flightsim.payload`. They are sans-IO: decoded messages and device outputs in,
frames out.
"""

from autopilot_bridge.payload.camera import CAMERA_COMPONENT, CameraComponent
from autopilot_bridge.payload.component import Component
from autopilot_bridge.payload.gimbal import GimbalComponent
from autopilot_bridge.payload.gimbal_messages import GIMBAL_COMPONENT
from autopilot_bridge.payload.magnetometer import MAGNETOMETER_COMPONENT, MagnetometerComponent
from autopilot_bridge.payload.station import PayloadStation

__all__ = [
    "CAMERA_COMPONENT",
    "GIMBAL_COMPONENT",
    "MAGNETOMETER_COMPONENT",
    "CameraComponent",
    "Component",
    "GimbalComponent",
    "MagnetometerComponent",
    "PayloadStation",
]
