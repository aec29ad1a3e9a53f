"""What cameras see: tags in pictures, moving objects in videos, and the vehicle's pose at an exposure.

`picture_watch` makes the messages of a camera from pictures of any source, `video` reads them.
"""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
