"""Embedded worlds: a simulated world in this process that missions are flown in."""

from typing import TYPE_CHECKING, Final

from flightsim.foundation.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from missions.embedded.hidden_tag import HiddenTag, vision_search_world
    from missions.embedded.rendered_motion import MotionSource, RenderedMotion
    from missions.embedded.rendered_tags import RenderedTags
    from missions.embedded.sitl import MAX_FLIGHT_S, EmbeddedSitl, alone, model_kind
    from missions.embedded.survey_worlds import survey_world
    from missions.embedded.tag_search import TagTarget, search_camera, tag_search_world
    from missions.embedded.target_fields import TargetField, multi_target_world, terrain_targets_world
    from missions.embedded.walking_targets import WalkingTargets, handoff_world
    from missions.embedded.worlds import (
        CAMERA,
        MAGNETOMETER,
        MotionKind,
        carrying,
        motion_of,
        occupancy_world,
        orbit_world,
    )

__all__ = [
    "CAMERA",
    "MAGNETOMETER",
    "MAX_FLIGHT_S",
    "EmbeddedSitl",
    "HiddenTag",
    "MotionKind",
    "MotionSource",
    "RenderedMotion",
    "RenderedTags",
    "TagTarget",
    "TargetField",
    "WalkingTargets",
    "alone",
    "carrying",
    "handoff_world",
    "model_kind",
    "motion_of",
    "multi_target_world",
    "occupancy_world",
    "orbit_world",
    "search_camera",
    "survey_world",
    "tag_search_world",
    "terrain_targets_world",
    "vision_search_world",
]

_SITL: Final = "missions.embedded.sitl"
_RENDERED_TAGS: Final = "missions.embedded.rendered_tags"
_TAG_SEARCH: Final = "missions.embedded.tag_search"
_TARGET_FIELDS: Final = "missions.embedded.target_fields"
_WORLDS: Final = "missions.embedded.worlds"

__getattr__ = lazy_exports(
    __name__,
    {
        **dict.fromkeys(("MAX_FLIGHT_S", "EmbeddedSitl", "alone", "model_kind"), _SITL),
        "RenderedTags": _RENDERED_TAGS,
        **dict.fromkeys(("MotionSource", "RenderedMotion"), "missions.embedded.rendered_motion"),
        **dict.fromkeys(("WalkingTargets", "handoff_world"), "missions.embedded.walking_targets"),
        **dict.fromkeys(("HiddenTag", "vision_search_world"), "missions.embedded.hidden_tag"),
        **dict.fromkeys(("TagTarget", "search_camera", "tag_search_world"), _TAG_SEARCH),
        **dict.fromkeys(("TargetField", "multi_target_world", "terrain_targets_world"), _TARGET_FIELDS),
        **dict.fromkeys(("CAMERA", "MAGNETOMETER", "MotionKind", "carrying", "motion_of"), _WORLDS),
        "survey_world": "missions.embedded.survey_worlds",
        **dict.fromkeys(("occupancy_world", "orbit_world"), _WORLDS),
    },
)
