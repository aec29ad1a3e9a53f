"""What small objects in a picture look like: their colour against the ground around them."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_RADIUS_PX: Final = 6  # of the patch: the ground around an object of a few pixels
_INNER_PX: Final = 3  # half of the part in which the object is
_RING_PX: Final = 4  # from here on it is ground
_PIXELS: Final = (
    5  # that differ most from the ground: an object of a few pixels has no more of its own colour
)

_OFFSETS = np.arange(-_RADIUS_PX, _RADIUS_PX + 1)
_AWAY = np.maximum(np.abs(_OFFSETS)[:, None], np.abs(_OFFSETS))


def patch_looks(picture: NDArray[np.uint8], middles_px: Array) -> Array:
    """Colours of objects against the ground: of the pixels that differ most from the median around them.

    Args:
        picture: (height, width, 3) BGR.
        middles_px: (n, 2) middles, from the corner of the picture.

    Returns:
        (n, 3) brightness, red less green and blue less green, in levels; NaN at the picture's edge.
    """
    height, width = picture.shape[:2]
    found = np.full((len(middles_px), 3), np.nan)
    for row, (x, y) in enumerate(np.floor(middles_px).astype(np.int64).tolist()):
        left, top = x - _RADIUS_PX, y - _RADIUS_PX
        if left < 0 or top < 0 or left + len(_OFFSETS) > width or top + len(_OFFSETS) > height:
            continue
        patch = picture[top : top + len(_OFFSETS), left : left + len(_OFFSETS)].astype(np.float64)
        off = (patch - np.median(patch[_AWAY >= _RING_PX], axis=0))[_AWAY <= _INNER_PX]
        most = np.argsort(-np.square(off).sum(axis=1), kind="stable")[:_PIXELS]
        blue, green, red = off[most].mean(axis=0)
        found[row] = (blue + green + red) / 3.0, red - green, blue - green
    return found
