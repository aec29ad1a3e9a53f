"""The classes whose fields are the options of `flightstack fly`, by mission: module and name of each."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

PATTERN: Final = "pattern"
"""All search patterns, and a mission of the user's own."""
MISSION_FILE: Final = "mission file"

OPTIONS: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        PATTERN: ("missions.base.options", "FlightOptions"),
        "orbit": ("missions.orbit.options", "OrbitOptions"),
        "occupancy": ("missions.occupancy.options", "OccupancyOptions"),
        "multi-target": ("missions.multi_target.options", "MultiTargetOptions"),
        "handoff": ("missions.handoff.options", "HandoffOptions"),
        "survey": ("missions.survey.options", "SurveyOptions"),
        "vision-search": ("missions.vision_search.options", "VisionSearchOptions"),
        MISSION_FILE: ("missions.plan_files.options", "FileOptions"),
    }
)
"""The options of missions."""

PARTS: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        PATTERN: ("missions.pattern_search.tag_target", "TagTarget"),
        "orbit": ("missions.orbit.target_motion", "TargetMotion"),
        "occupancy": ("missions.occupancy.magnetic_target", "MagneticTarget"),
        "multi-target": ("missions.multi_target.target_field", "TargetField"),
        "handoff": ("missions.handoff.walking_targets", "WalkingTargets"),
        "survey": ("missions.survey.surveyed_field", "SurveyedField"),
        "vision-search": ("missions.vision_search.hidden_tag", "HiddenTag"),
    }
)
"""What is true in their embedded worlds."""

RUNS: Final = tuple(
    ("missions.base.run_options", name) for name in ("TeamOptions", "WorldOptions", "RunOptions")
)
"""The options of every run."""
