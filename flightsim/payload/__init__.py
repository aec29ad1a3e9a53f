"""Simulated mission payload: the devices that a vehicle carries for its mission, and their targets.

A camera on a gimbal with a detector, and a sensor of range and bearing, over ground targets; a survey
magnetometer over a magnetic map with targets' signatures in it. All read the vehicle's truth and give
measurements.
"""

from flightsim.foundation.main_field import MainField
from flightsim.payload.camera import Camera, CameraParameters
from flightsim.payload.camera_model import PinholeModel, camera_from_gimbal, gimbal_from_camera
from flightsim.payload.camera_view import CameraView, TargetView
from flightsim.payload.daily_variation import DailyVariation, DailyVariationParameters
from flightsim.payload.detection import (
    CameraFrame,
    Detection,
    DetectionModel,
    FrameReader,
    FrameReaderParameters,
    PictureDetection,
    ResolutionDetection,
    SeenTargets,
)
from flightsim.payload.device import Carrier, Device, DeviceParameters
from flightsim.payload.gimbal import LEVEL, Gimbal, GimbalFlags, GimbalParameters
from flightsim.payload.home_frame import HomeFrame
from flightsim.payload.imager import BrownDistortion, ImagerParameters
from flightsim.payload.magnetic_field import MagneticField
from flightsim.payload.magnetic_map import MagneticMap, MagneticMapError
from flightsim.payload.magnetic_spec import InducedDipole, MagneticSpec, SignatureSpec, magnetic_field_of
from flightsim.payload.moving_points import (
    MovingPointCamera,
    MovingPointParameters,
    MovingPointScan,
    PointReader,
    PointReaderParameters,
)
from flightsim.payload.payload import DeviceOutage, Payload, PayloadParameters
from flightsim.payload.range_radio import MeasuredRange, RangeRadio, RangeRadioParameters
from flightsim.payload.signature import DipoleSignature, GaussianSignature, Signature
from flightsim.payload.survey import SurveyParameters, surveyed, truth_behind
from flightsim.payload.survey_magnetometer import (
    MagneticReading,
    SurveyMagnetometer,
    SurveyMagnetometerParameters,
)
from flightsim.payload.synthetic_map import SyntheticMapParameters, synthetic_map
from flightsim.payload.target_motion import (
    Circle,
    ConstantVelocity,
    RandomWalk,
    Static,
    TargetMotion,
    Trajectory,
)
from flightsim.payload.target_sensor import ScanDisturbance, TargetScan, TargetSensor, TargetSensorParameters
from flightsim.payload.target_shape import TargetShape
from flightsim.payload.targets import NO_TAG, GroundTarget, GroundTargetParameters, GroundTargets
from flightsim.payload.terrain import Terrain, TerrainSpec
from flightsim.payload.vehicle_field import VehicleField, VehicleFieldParameters

__all__ = [
    "LEVEL",
    "NO_TAG",
    "BrownDistortion",
    "Camera",
    "CameraFrame",
    "CameraParameters",
    "CameraView",
    "Carrier",
    "Circle",
    "ConstantVelocity",
    "DailyVariation",
    "DailyVariationParameters",
    "Detection",
    "DetectionModel",
    "Device",
    "DeviceOutage",
    "DeviceParameters",
    "DipoleSignature",
    "FrameReader",
    "FrameReaderParameters",
    "GaussianSignature",
    "Gimbal",
    "GimbalFlags",
    "GimbalParameters",
    "GroundTarget",
    "GroundTargetParameters",
    "GroundTargets",
    "HomeFrame",
    "ImagerParameters",
    "InducedDipole",
    "MagneticField",
    "MagneticMap",
    "MagneticMapError",
    "MagneticReading",
    "MagneticSpec",
    "MainField",
    "MeasuredRange",
    "MovingPointCamera",
    "MovingPointParameters",
    "MovingPointScan",
    "Payload",
    "PayloadParameters",
    "PictureDetection",
    "PinholeModel",
    "PointReader",
    "PointReaderParameters",
    "RandomWalk",
    "RangeRadio",
    "RangeRadioParameters",
    "ResolutionDetection",
    "ScanDisturbance",
    "SeenTargets",
    "Signature",
    "SignatureSpec",
    "Static",
    "SurveyMagnetometer",
    "SurveyMagnetometerParameters",
    "SurveyParameters",
    "SyntheticMapParameters",
    "TargetMotion",
    "TargetScan",
    "TargetSensor",
    "TargetSensorParameters",
    "TargetShape",
    "TargetView",
    "Terrain",
    "TerrainSpec",
    "Trajectory",
    "VehicleField",
    "VehicleFieldParameters",
    "camera_from_gimbal",
    "gimbal_from_camera",
    "magnetic_field_of",
    "surveyed",
    "synthetic_map",
    "truth_behind",
]
