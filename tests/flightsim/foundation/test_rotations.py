"""Rotations in plain numbers, of arrays and in kernels: against the matrix, and the same to the bit."""

import math

import numpy as np
import pytest

from flightsim.foundation import rotations, vectors
from tests.rotations import rotation_matrix

ANGLES = [(0.3, -0.4, 2.5), (-3.0, 1.2, -0.1), (0.0, 0.0, 0.0), (1.0, -1.5, 3.1)]
V = (0.7, -1.3, 2.1)


def compiled(function, *arguments, size):
    out = np.zeros(size)
    function(*map(np.array, arguments), out)
    return tuple(out.tolist())


@pytest.mark.parametrize("angles", ANGLES)
def test_quaternions_of_euler_angles_and_back(angles):
    q = vectors.from_euler(*angles)
    matrix = rotation_matrix(q)
    assert np.linalg.norm(q) == pytest.approx(1.0)
    assert matrix[:, 0] == pytest.approx(
        (
            math.cos(angles[1]) * math.cos(angles[2]),
            math.cos(angles[1]) * math.sin(angles[2]),
            -math.sin(angles[1]),
        )
    )
    assert math.atan2(matrix[2, 1], matrix[2, 2]) == pytest.approx(angles[0])
    assert vectors.euler_of(q) == pytest.approx(angles)
    assert vectors.yaw_of(q) == rotations.yaw_of(np.array(q)) == vectors.euler_of(q)[2]
    out = np.zeros(4)
    rotations.quaternion_from_euler(*angles, out)  # type: ignore[call-arg]
    assert tuple(out) == q
    assert compiled(rotations.euler_from_quaternion, q, size=3) == vectors.euler_of(q)


def test_arrays_are_converted_as_single_quaternions():
    q = vectors.quaternions_from_euler(*np.array(ANGLES).T)
    assert q == pytest.approx(np.array([vectors.from_euler(*angles) for angles in ANGLES]), abs=1e-15)
    assert np.column_stack(vectors.euler_from_quaternions(q)) == pytest.approx(np.array(ANGLES))


@pytest.mark.parametrize("angles", ANGLES)
def test_rotations_are_those_of_the_matrix(angles):
    q = vectors.from_euler(*angles)
    matrix = rotation_matrix(q)
    assert vectors.rotate(q, V) == pytest.approx(matrix @ V)
    assert compiled(rotations.rotate, q, V, size=3) == vectors.rotate(q, V)
    assert compiled(rotations.rotate_inverse, q, V, size=3) == pytest.approx(matrix.T @ V)
    for axis in range(3):
        assert rotations.body_axis(*q, axis) == pytest.approx(matrix[:, axis], abs=1e-15)


def test_products_are_products_of_the_matrices():
    a, b = vectors.from_euler(*ANGLES[0]), vectors.from_euler(*ANGLES[1])
    assert rotation_matrix(vectors.product(a, b)) == pytest.approx(rotation_matrix(a) @ rotation_matrix(b))
    assert compiled(rotations.multiply, a, b, size=4) == vectors.product(a, b)
    assert vectors.product(a, vectors.conjugate(a)) == pytest.approx((1.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [(0.0, 0.0), (179.0, 179.0), (180.0, -180.0), (-180.0, -180.0), (190.0, -170.0), (-541.0, 179.0)],
)
def test_wrapped_angles(angle, wrapped):
    assert vectors.wrap_180(angle) == rotations.wrap_180(angle) == wrapped
    assert vectors.wrap_180(np.array([angle])).tolist() == [wrapped]
    rad = vectors.wrap_pi(math.radians(angle))
    assert rad == pytest.approx(math.radians(wrapped))
    assert rotations.wrap_pi(math.radians(angle)) == rad == vectors.wrap_pi(np.array(math.radians(angle)))
