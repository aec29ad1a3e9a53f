"""The pictures of the cameras of a SITL for users: RTSP streams, photos and recordings.

Pictures are made in a separate process, and only while a player is connected or a file is to be written. The
vehicles' process answers requests for a camera's view, and never waits.
"""

from autopilot_bridge.video.service import CameraOnShow, VideoParameters, VideoService

__all__ = ["CameraOnShow", "VideoParameters", "VideoService"]
