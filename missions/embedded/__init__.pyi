"""Public names of `missions.embedded`, each where it is defined; see `__init__.py`."""

from missions.embedded.rendered_motion import MotionSource as MotionSource
from missions.embedded.rendered_motion import RenderedMotion as RenderedMotion
from missions.embedded.rendered_tags import RenderedTags as RenderedTags
from missions.embedded.sitl import MAX_FLIGHT_S as MAX_FLIGHT_S
from missions.embedded.sitl import EmbeddedSitl as EmbeddedSitl
from missions.embedded.sitl import alone as alone
from missions.embedded.sitl import model_kind as model_kind
