"""Public names of `autopilot_bridge.video`, each where it is defined; see `__init__.py`."""

from autopilot_bridge.video.parameters import VideoParameters as VideoParameters
from autopilot_bridge.video.service import CameraOnShow as CameraOnShow
from autopilot_bridge.video.service import VideoService as VideoService
