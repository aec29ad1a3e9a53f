"""What cameras of a SITL see, for other people's eyes: RTSP streams, photos and recordings.

Pictures are made in a process of their own, and only while somebody watches or something is to be kept. The
vehicles' process answers questions about where a camera is, and waits for nothing.
"""

from autopilot_bridge.video.service import CameraOnShow, VideoParameters, VideoService

__all__ = ["CameraOnShow", "VideoParameters", "VideoService"]
