"""Colours of a scene's items, the same in all viewers."""

from collections.abc import Mapping
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from estimators.scene_items import Origin, Placed, Role

__all__ = ["Colour", "colour_of", "colour_scale"]

Colour = tuple[int, int, int]

_OF_ROLE: Final[Mapping[Role, Colour]] = {
    Role.TRUTH: (255, 255, 255),
    Role.ESTIMATE: (74, 163, 255),
    Role.COMMANDED: (140, 148, 162),
    Role.BELIEF: (250, 189, 64),
    Role.FOUND: (255, 70, 70),
    Role.MEASURED: (120, 224, 160),
    Role.AREA: (110, 120, 150),
    Role.FENCE: (200, 100, 230),
}
_OF_VEHICLES: Final[tuple[Colour, ...]] = (
    *((74, 163, 255), (255, 138, 76), (88, 214, 120), (186, 134, 255), (255, 107, 129), (64, 208, 224)),
)
"""Of the vehicles of a team, by system id."""


def colour_of(path: str, item: Placed) -> Colour:
    """Colour of an item: of its role, and of its vehicle what a vehicle reports."""
    parts = path.split("/")
    role = Role.ESTIMATE if isinstance(item, Origin) else item.role
    if parts[0] == "vehicles" and role is Role.ESTIMATE and parts[1].isdigit():
        return _OF_VEHICLES[(int(parts[1]) - 1) % len(_OF_VEHICLES)]
    return _OF_ROLE[role]


def colour_scale(values: NDArray[np.floating], low: float, high: float) -> NDArray[np.uint8]:
    """Colours (..., 4), RGBA, of values between two ends, dark to bright; not a number: transparent.

    They are those of viridis, which all eyes distinguish.
    """
    known = np.isfinite(values)
    share = np.clip((np.where(known, values, low) - low) / (high - low), 0.0, 1.0)
    levels = np.rint(255.0 * share).astype(np.uint8)
    blue_first = cv2.applyColorMap(levels.reshape(-1, 1), cv2.COLORMAP_VIRIDIS)
    colours = np.empty((*values.shape, 4), dtype=np.uint8)
    colours[..., :3] = blue_first.reshape(*values.shape, 3)[..., ::-1]
    colours[..., 3] = np.where(known, 255, 0)
    return colours
