"""Public names of `estimators.vision`, each where it is defined; see `__init__.py`."""

from estimators.vision.camera import CameraGeometry as CameraGeometry
from estimators.vision.camera_file import CameraDescription as CameraDescription
from estimators.vision.camera_file import load_camera as load_camera
from estimators.vision.corner_flow import CornerFlowDetector as CornerFlowDetector
from estimators.vision.corner_flow import CornerFlowParameters as CornerFlowParameters
from estimators.vision.frame_difference import FrameDifferenceDetector as FrameDifferenceDetector
from estimators.vision.frame_difference import FrameDifferenceParameters as FrameDifferenceParameters
from estimators.vision.ground_registration import RegistrationParameters as RegistrationParameters
from estimators.vision.ground_registration import VideoCounts as VideoCounts
from estimators.vision.moving_objects import MovingObjectDetector as MovingObjectDetector
from estimators.vision.moving_objects import MovingObjects as MovingObjects
from estimators.vision.moving_objects import ObjectParameters as ObjectParameters
from estimators.vision.picture_watch import PictureWatch as PictureWatch
from estimators.vision.tag_detector import TagDetection as TagDetection
from estimators.vision.tag_detector import TagDetector as TagDetector
from estimators.vision.tag_detector import draw_detections as draw_detections
from estimators.vision.tag_parameters import TagDetectorParameters as TagDetectorParameters
from estimators.vision.vehicle_track import VehiclePose as VehiclePose
from estimators.vision.vehicle_track import VehicleTrack as VehicleTrack
from estimators.vision.vehicle_track import ground_place as ground_place
from estimators.vision.video_frame import CameraPose as CameraPose
from estimators.vision.video_frame import VideoFrame as VideoFrame
