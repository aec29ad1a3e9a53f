"""OpenCV's VideoCapture as a client of a camera's stream, in this process, with deadlines."""

import os
import time
from collections.abc import Callable
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

os.environ.setdefault("OPENCV_LOG_LEVEL", "ERROR")

Picture = NDArray[np.uint8]
OPEN_DEADLINE_MS: Final = 60_000  # the picture process starts when the first player comes
WATCH_DEADLINE_S: Final = 100.0


def watch(uri: str) -> Any:
    """An open capture."""
    capture = cv2.VideoCapture(
        uri,
        cv2.CAP_FFMPEG,
        [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, OPEN_DEADLINE_MS, cv2.CAP_PROP_READ_TIMEOUT_MSEC, OPEN_DEADLINE_MS],
    )
    assert capture.isOpened(), f"{uri} can't be opened"
    return capture


def picture_where(capture: Any, found: Callable[[Picture], bool], what: str) -> Picture:
    """The first picture that satisfies `found`."""
    deadline_s = time.monotonic() + WATCH_DEADLINE_S
    while time.monotonic() < deadline_s:
        ok, picture = capture.read()
        assert ok, "the stream has ended"
        if found(picture):
            return picture
    raise AssertionError(f"{what} was not seen")


def tags(picture: Picture) -> dict[int, NDArray[np.float64]]:
    """Middle of each tag that OpenCV reads in a picture, pixels from the picture's corner."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.adaptiveThreshWinSizeMax = 53
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    corners, ids, _ = cv2.aruco.ArucoDetector(family, parameters).detectMarkers(picture)
    if ids is None:
        return {}
    return {
        int(number): crossing(quad.reshape(4, 2)) + 0.5
        for number, quad in zip(ids.ravel(), corners, strict=True)
    }


def crossing(quad: NDArray[Any]) -> NDArray[np.float64]:
    """Where the diagonals of a square (4, 2) cross: its middle, whatever the perspective."""
    a, b, c, d = quad.astype(np.float64)
    along, _ = np.linalg.solve(np.column_stack((c - a, b - d)), b - a)
    middle: NDArray[np.float64] = a + along * (c - a)
    return middle


def plate_middle(colour: NDArray[np.bool_]) -> tuple[float, float]:
    """Middle of the plate whose margin has a colour, pixels from the picture's corner."""
    outlines, _ = cv2.findContours(colour.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    hull = cv2.convexHull(max(outlines, key=cv2.contourArea))
    for tolerance in np.linspace(0.01, 0.1, 19):
        quad = cv2.approxPolyDP(hull, tolerance * cv2.arcLength(hull, True), True)
        if len(quad) == 4:
            u, v = (crossing(quad.reshape(4, 2)) + 0.5).tolist()
            return u, v
    raise AssertionError("what has the colour is no square")


def yellow(picture: Picture) -> NDArray[np.bool_]:
    """What has the colour of a tag's margin."""
    b, g, r = (picture[..., c].astype(int) for c in range(3))
    return (r > 150) & (g > 120) & (b < 0.55 * np.minimum(r, g))
