"""The embedded SITL: a simulated world in this process that missions are flown in."""

from typing import TYPE_CHECKING, Final

from flightsim.foundation.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from missions.embedded.rendered_motion import MotionSource, RenderedMotion
    from missions.embedded.rendered_tags import RenderedTags
    from missions.embedded.sitl import MAX_FLIGHT_S, EmbeddedSitl, alone, model_kind

__all__ = [
    "MAX_FLIGHT_S",
    "EmbeddedSitl",
    "MotionSource",
    "RenderedMotion",
    "RenderedTags",
    "alone",
    "model_kind",
]

_SITL: Final = "missions.embedded.sitl"

__getattr__ = lazy_exports(
    __name__,
    {
        **dict.fromkeys(("MAX_FLIGHT_S", "EmbeddedSitl", "alone", "model_kind"), _SITL),
        "RenderedTags": "missions.embedded.rendered_tags",
        **dict.fromkeys(("MotionSource", "RenderedMotion"), "missions.embedded.rendered_motion"),
    },
)
