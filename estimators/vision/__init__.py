"""Tags in pictures: a camera's geometry, a detector of AprilTags, and the vehicle's pose at an exposure."""

from estimators.vision.camera import CameraGeometry
from estimators.vision.tag_detector import TagDetection, TagDetector, TagDetectorParameters, draw_detections
from estimators.vision.vehicle_track import VehiclePose, VehicleTrack, ground_place

__all__ = [
    "CameraGeometry",
    "TagDetection",
    "TagDetector",
    "TagDetectorParameters",
    "VehiclePose",
    "VehicleTrack",
    "draw_detections",
    "ground_place",
]
