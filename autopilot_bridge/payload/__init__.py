"""MAVLink components beside the autopilot: target sensor (26), range radio (27), moving-point camera
(28), camera (100), gimbal (154), survey magnetometer (158).

Each represents one device of `flightsim.payload`. They do no I/O: they take decoded messages and device
outputs, and produce frames.
"""

from autopilot_bridge.mavlink.components import (
    CAMERA_COMPONENT,
    GIMBAL_COMPONENT,
    MOVING_POINT_COMPONENT,
    RANGE_RADIO_COMPONENT,
    SURVEY_MAGNETOMETER_COMPONENT,
    TARGET_SENSOR_COMPONENT,
)
from autopilot_bridge.payload.camera import CameraComponent
from autopilot_bridge.payload.component import Component
from autopilot_bridge.payload.gimbal import GimbalComponent
from autopilot_bridge.payload.moving_points import MovingPointComponent
from autopilot_bridge.payload.range_radio import RangeRadioComponent
from autopilot_bridge.payload.station import PayloadStation
from autopilot_bridge.payload.survey_magnetometer import SurveyMagnetometerComponent
from autopilot_bridge.payload.target_sensor import TargetSensorComponent

__all__ = [
    "CAMERA_COMPONENT",
    "GIMBAL_COMPONENT",
    "MOVING_POINT_COMPONENT",
    "RANGE_RADIO_COMPONENT",
    "SURVEY_MAGNETOMETER_COMPONENT",
    "TARGET_SENSOR_COMPONENT",
    "CameraComponent",
    "Component",
    "GimbalComponent",
    "MovingPointComponent",
    "PayloadStation",
    "RangeRadioComponent",
    "SurveyMagnetometerComponent",
    "TargetSensorComponent",
]
