"""Tags in pictures: a camera's geometry, a detector of AprilTags, and the vehicle's pose at an exposure.

`picture_watch` makes the messages of a camera from pictures of any source, `video` reads them.
"""

from estimators.vision.camera import CameraGeometry
from estimators.vision.camera_file import CameraDescription, load_camera
from estimators.vision.picture_watch import PictureWatch
from estimators.vision.tag_detector import TagDetection, TagDetector, TagDetectorParameters, draw_detections
from estimators.vision.vehicle_track import VehiclePose, VehicleTrack, ground_place

__all__ = [
    "CameraDescription",
    "CameraGeometry",
    "PictureWatch",
    "TagDetection",
    "TagDetector",
    "TagDetectorParameters",
    "VehiclePose",
    "VehicleTrack",
    "draw_detections",
    "ground_place",
    "load_camera",
]
