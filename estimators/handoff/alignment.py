"""Alignment of two windows of the same track by a rotation about the vertical and a translation.

Source: Tolman et al. 2021, equations 42 and 43 (orthogonal Procrustes problem, Schönemann 1966; rotations
only, Kabsch 1978). In the plane the singular value decomposition has the closed form
atan2(sum of cross products, sum of dot products) of the centred points.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Alignment:
    """The rotation and translation that take the tracker's window to the handoff aircraft's.

    A place (x, y) of the tracker becomes (c x + s y, -s x + c y) + translation, with cosine and sine of
    `heading_rad`: the same convention as that of the relative heading psi_h - psi_r.

    Attributes:
        heading_rad: -pi..pi.
        translation_m: forward and right, in the handoff aircraft's level frame (the paper's xi).
        residual_m: Frobenius norm of what is left, over all points.
        rms_m: the same as a root mean square per point.
    """

    heading_rad: float
    translation_m: tuple[float, float]
    residual_m: float
    rms_m: float


def align(handoff: Array, tracker: Array) -> Alignment:
    """Align two windows of places at the same times.

    Args:
        handoff: (n, 2) forward and right in the present level frame of the handoff aircraft.
        tracker: (n, 2) the same of the tracker.

    Raises:
        ValueError: the windows differ in length or are empty.
    """
    if handoff.shape != tracker.shape or handoff.ndim != 2 or not len(handoff):
        raise ValueError(
            f"windows of shapes {handoff.shape} and {tracker.shape} are not two of the same times"
        )
    h_mean, r_mean = handoff.mean(axis=0), tracker.mean(axis=0)
    h, r = handoff - h_mean, tracker - r_mean
    dot = float(np.sum(h * r))
    cross = float(np.sum(r[:, 1] * h[:, 0] - r[:, 0] * h[:, 1]))
    heading = math.atan2(cross, dot) if cross or dot else 0.0
    c, s = math.cos(heading), math.sin(heading)
    turn = np.array([[c, -s], [s, c]])  # a row times it is a place of the tracker, turned
    # |h - R r|^2 = |h|^2 + |r|^2 - 2 |(dot, cross)|, but that difference loses digits
    left = float(np.sqrt(np.sum((h - r @ turn) ** 2)))
    moved = h_mean - r_mean @ turn
    return Alignment(
        heading_rad=heading,
        translation_m=(float(moved[0]), float(moved[1])),
        residual_m=left,
        rms_m=left / math.sqrt(len(handoff)),
    )
