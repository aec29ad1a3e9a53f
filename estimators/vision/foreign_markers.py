"""Markers of other dictionaries in pictures in which no tag of ours is found: a hint for the user."""

from collections import Counter
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ["ForeignMarkers"]

_DICTIONARIES: Final = (
    "APRILTAG_16h5",
    "APRILTAG_25h9",
    "APRILTAG_36h10",
    "4X4_50",
    "5X5_100",
    "6X6_250",
    "7X7_1000",
    "ARUCO_ORIGINAL",
)
"""Of OpenCV, by the names behind `DICT_`. The larger dictionaries of a size begin with the markers of the
smaller ones.
"""
_MOST_PICTURES: Final = 32
"""Pictures that are searched, ever farther apart: a search takes eight times as long as that for our tags."""
_LEAST: Final = 3
"""Pictures that show the same marker before it counts: few bits are found in noise now and then."""


class ForeignMarkers:
    """Counts markers of other dictionaries in some of the pictures without a tag."""

    def __init__(self) -> None:
        settings = cv2.aruco.DetectorParameters()
        settings.errorCorrectionRate = 0.0
        self._detectors = {
            name: cv2.aruco.ArucoDetector(
                cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}")), settings
            )
            for name in _DICTIONARIES
        }
        self._pictures = 0
        self._next = 1
        self._searched = 0
        self._seen: Counter[tuple[str, int]] = Counter()

    def look(self, picture: NDArray[np.uint8]) -> None:
        """Search a picture (height, width) or (height, width, 3) BGR without a tag of ours, if one is due."""
        self._pictures += 1
        if self._pictures < self._next or self._searched >= _MOST_PICTURES:
            return
        self._searched += 1
        self._next = max(self._pictures + 1, round(1.25 * self._pictures))
        grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY) if picture.ndim == 3 else picture
        for name, detector in self._detectors.items():
            _, numbers, _ = detector.detectMarkers(grey)
            if numbers is not None:
                self._seen.update({(name, int(number)) for number in numbers.ravel()})

    def warning(self) -> str:
        """What was seen, as text; "": nothing that counts."""
        seen = [(count, name, number) for (name, number), count in self._seen.items() if count >= _LEAST]
        if not seen:
            return ""
        count, name, number = max(seen)
        return (
            f"no tag of the family 36h11 was found, but marker {number} of the dictionary {name} is seen in "
            f"{count} of {self._searched} pictures that were searched for it; print tags of 36h11"
        )
