"""What cameras see: tags in pictures, moving objects in videos, and the vehicle's pose at an exposure.

`picture_watch` makes the messages of a camera from pictures of any source, `video` reads them.
"""

from estimators.vision.camera import CameraGeometry
from estimators.vision.camera_file import CameraDescription, load_camera
from estimators.vision.corner_flow import CornerFlowDetector, CornerFlowParameters
from estimators.vision.frame_difference import FrameDifferenceDetector, FrameDifferenceParameters
from estimators.vision.ground_registration import RegistrationParameters, VideoCounts
from estimators.vision.moving_objects import MovingObjectDetector, MovingObjects, ObjectParameters
from estimators.vision.picture_watch import PictureWatch
from estimators.vision.tag_detector import TagDetection, TagDetector, TagDetectorParameters, draw_detections
from estimators.vision.vehicle_track import VehiclePose, VehicleTrack, ground_place
from estimators.vision.video_frame import CameraPose, VideoFrame

__all__ = [
    "CameraDescription",
    "CameraGeometry",
    "CameraPose",
    "CornerFlowDetector",
    "CornerFlowParameters",
    "FrameDifferenceDetector",
    "FrameDifferenceParameters",
    "MovingObjectDetector",
    "MovingObjects",
    "ObjectParameters",
    "PictureWatch",
    "RegistrationParameters",
    "TagDetection",
    "TagDetector",
    "TagDetectorParameters",
    "VehiclePose",
    "VehicleTrack",
    "VideoCounts",
    "VideoFrame",
    "draw_detections",
    "ground_place",
    "load_camera",
]
