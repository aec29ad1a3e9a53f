"""Parts of a picture on which targets are painted."""

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from flightsim.picture.window import Window

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

NEAREST_M: Final = 0.1
LARGEST_PX: Final = 20_000.0  # what fills more than the picture many times over is not painted


def box_of(low: Array, high: Array, window: Window) -> tuple[int, int, int, int] | None:
    """The pixels of a part of a picture that a box covers: left, top, right, bottom; None: none."""
    left, top = max(window.left, math.floor(low[0])), max(window.top, math.floor(low[1]))
    right, bottom = min(window.right, math.ceil(high[0])), min(window.bottom, math.ceil(high[1]))
    return (left, top, right, bottom) if left < right and top < bottom else None


def part_of(picture: Picture, window: Window, box: tuple[int, int, int, int]) -> Picture:
    """Those pixels of a part of a picture."""
    left, top, right, bottom = box
    return picture[top - window.top : bottom - window.top, left - window.left : right - window.left]


def blend(part: Picture, colour: NDArray[Any], cover: Array) -> None:
    """Lay a colour over pixels, as far as it covers them."""
    share = cover[:, :, None]
    part[:] = np.round(part * (1.0 - share) + colour * share).astype(np.uint8)
