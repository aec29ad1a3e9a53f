"""The particles of the paper's filter as kernels: motion, weights and transformation.

Source: Lum, Rysdyk and Pongpunwattana 2005, section III, equations 3 to 8, as corrected in docs/papers.md.

A particle is a column of an array (width, n): each quantity of all particles is contiguous, so that the
compiler vectorizes the loops. A column begins with the pose of the vehicle in the frame of the source: x
along the source's axis, y to its right, and the course psi relative to that axis, kept as cosine and sine.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel
from flightsim.foundation.layouts import Slots

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_pose = Slots()
X: Final = _pose.place()
Y: Final = _pose.place()
COS: Final = _pose.place()
SIN: Final = _pose.place()
POSE: Final = _pose.size

_LEAST_SUM: Final = 1e-200  # smaller sums of weights have lost digits


@kernel
def move(
    particles: Array,
    forward_m: float,
    right_m: float,
    turn_rad: float,
    noise: Array,
    forward_sigma_m: float,
    turn_sigma_rad: float,
) -> None:
    """Motion model, equation 3: the control of a step with its noise, equation 4, for each particle.

    Drawing normal numbers is most of the cost of a step. Each pair therefore serves four particles, with
    either sign of both (antithetic variates, Hammersley and Morton 1956); resampling puts copies of one
    particle side by side, so these four are seldom alike.

    Args:
        particles: (POSE, n), changed in place.
        forward_m, right_m: displacement of the vehicle along and across its course before the step.
        turn_rad: change of its course.
        noise: (2, a quarter of n or more) standard normal.
        forward_sigma_m, turn_sigma_rad: standard deviations of displacement and turn.
    """
    count = particles.shape[1]
    part = (count + 3) // 4
    for number in range(4):
        first, last = number * part, min(count, (number + 1) * part)
        forward_sign, turn_sign = 1.0 - 2.0 * (number % 2), 1.0 - 2.0 * (number // 2)
        _move_part(
            particles[X, first:last],
            particles[Y, first:last],
            particles[COS, first:last],
            particles[SIN, first:last],
            (forward_m, right_m),
            (math.cos(turn_rad), math.sin(turn_rad)),
            noise,
            (forward_sigma_m * forward_sign, turn_sigma_rad * turn_sign),
        )


@kernel(error_model="numpy")
def _move_part(
    xs: Array,
    ys: Array,
    cosines: Array,
    sines: Array,
    step_m: tuple[float, float],
    turn: tuple[float, float],
    noise: Array,
    sigmas: tuple[float, float],
) -> None:
    """Move consecutive particles.

    Args:
        xs, ys, cosines, sines: (n,) their poses, changed in place.
        step_m: displacement forward and right.
        turn: cosine and sine of the change of course.
        noise: as of `move`; the n first ones count.
        sigmas: factors of the noise: of the displacement, m, and of the turn, rad.
    """
    forward_m, right_m = step_m
    turn_cosine, turn_sine = turn
    forward_sigma_m, half_sigma = sigmas[0], 0.5 * sigmas[1]
    for m in range(xs.size):
        cosine, sine = cosines[m], sines[m]
        forward = forward_m + forward_sigma_m * noise[0, m]
        xs[m] += cosine * forward - sine * right_m
        ys[m] += sine * forward + cosine * right_m
        # a rotation by 2 atan(noise / 2): half the time of cosine and sine, and the norm stays one
        half = half_sigma * noise[1, m]
        scale = 1.0 / (1.0 + half * half)
        noisy_cosine, noisy_sine = (1.0 - half * half) * scale, 2.0 * half * scale
        new_cosine = turn_cosine * noisy_cosine - turn_sine * noisy_sine
        new_sine = turn_sine * noisy_cosine + turn_cosine * noisy_sine
        cosines[m] = cosine * new_cosine - sine * new_sine
        sines[m] = sine * new_cosine + cosine * new_sine


@kernel(error_model="numpy")
def weigh(
    particles: Array,
    weights: Array,
    signature: tuple[float, float, float],
    measured_nt: float,
    variance_nt2: float,
    fits: Array,
) -> float:
    """Weights (5), (6) by a measurement.

    The exponential is the only part that is not vectorized, and therefore has a loop of its own.

    Args:
        particles: (POSE, n).
        weights: (n,) before the measurement; after it, likewise with sum one.
        signature: amplitude, nT, and one over the standard deviations along and across the axis, 1/m.
        measured_nt: reading less map, less level.
        variance_nt2: of that measurement.
        fits: (n,) to work in.

    Returns:
        The paper's confidence (7), each weight over its greatest possible value: the mean of exp(-fit / 2),
        where the fit is the squared residual over its variance.
    """
    amplitude_nt, per_along, per_across = signature
    for m in range(weights.size):
        along, across = particles[X, m] * per_along, particles[Y, m] * per_across
        fits[m] = -0.5 * (along * along + across * across)
    for m in range(weights.size):
        fits[m] = amplitude_nt * math.exp(fits[m])
    for m in range(weights.size):
        residual_nt = measured_nt - fits[m]
        fits[m] = residual_nt * residual_nt / variance_nt2
    confidence = 0.0
    for m in range(weights.size):
        weights[m] *= math.exp(-0.5 * fits[m])
        confidence += weights[m]
    total = confidence
    if confidence < _LEAST_SUM:  # no particle is near: only the best fits count
        best = fits.min()
        total = 0.0
        for m in range(weights.size):
            weights[m] = math.exp(-0.5 * (fits[m] - best))
            total += weights[m]
    for m in range(weights.size):
        weights[m] /= total
    return confidence


@kernel
def copy_chosen(chosen: Indices, particles: Array, out: Array) -> None:
    """The next generation: column k of `out` is particle `chosen[k]`."""
    for i in range(particles.shape[0]):
        for k in range(chosen.size):
            out[i, k] = particles[i, chosen[k]]


@kernel
def relative_sources(particles: Array, out: Array) -> None:
    """Equation 8 in the project's frames: the source in the frame of the vehicle.

    Args:
        particles: (POSE, n).
        out: (n, 3) forward and right of the vehicle's course, and the source's axis relative to that course,
            clockwise, -pi..pi.
    """
    for m in range(particles.shape[1]):
        x, y, cosine, sine = particles[X, m], particles[Y, m], particles[COS, m], particles[SIN, m]
        out[m, 0] = -cosine * x - sine * y
        out[m, 1] = sine * x - cosine * y
        out[m, 2] = math.atan2(-sine, cosine)
