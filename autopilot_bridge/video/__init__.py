"""The pictures of the cameras of a SITL for users: RTSP streams, photos and recordings.

Pictures are made in a separate process, and only while a player is connected or a file is to be written. The
vehicles' process answers requests for a camera's view, and never waits.
"""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
