"""What a lens, a sensor and a video link do to the levels of a picture: falloff, brightness, compression."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

_BLOCK_PX = 16  # of JPEG with halved chroma: blocks of a part are those of the whole picture


def falloff(rays: Array, vignetting: float) -> NDArray[np.float32]:
    """Light (...) that rays (..., 2) in normalised image coordinates get, as a share of that on the axis: the
    natural vignetting of a lens, cos^4 of the angle to the axis (Hecht, Optics, 5th ed., section 5.4), to a
    power.
    """
    cos2 = 1.0 / (1.0 + np.sum(rays * rays, axis=-1))
    return np.asarray(cos2 ** (2.0 * vignetting), np.float32)


def lit(picture: Picture, gain: NDArray[np.float32] | float) -> Picture:
    """The picture with its light times a gain, (height, width) or one for all. What is beyond the sensor's
    range saturates (EMVA Standard 1288, linear camera model).
    """
    factor = gain[..., None] if isinstance(gain, np.ndarray) else np.float32(gain)
    return np.minimum(picture * factor + np.float32(0.5), np.float32(255.0)).astype(np.uint8)


def compressed(picture: Picture, quality: int, corner_px: tuple[int, int] = (0, 0)) -> Picture:
    """The picture after baseline JPEG (ITU-T T.81) of a quality from 1 to 100.

    Args:
        picture: BGR, or a part of one.
        quality: of the encoder.
        corner_px: column and row of the part's first pixel. Its blocks are those of the whole picture; blocks
            that its edges cut are filled up with the edge.
    """
    height, width = picture.shape[:2]
    left, top = corner_px[0] % _BLOCK_PX, corner_px[1] % _BLOCK_PX
    right = math.ceil((left + width) / _BLOCK_PX) * _BLOCK_PX - left - width
    bottom = math.ceil((top + height) / _BLOCK_PX) * _BLOCK_PX - top - height
    filled = cv2.copyMakeBorder(picture, top, bottom, left, right, cv2.BORDER_REPLICATE)
    _, encoded = cv2.imencode(".jpg", filled, [cv2.IMWRITE_JPEG_QUALITY, quality])
    decoded = cv2.imdecode(encoded, cv2.IMREAD_COLOR)
    assert decoded is not None  # what the encoder has just made
    return np.asarray(decoded[top : top + height, left : left + width], np.uint8)
