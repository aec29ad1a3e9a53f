"""The particles of one hypothesis as kernels: motion, weights and transformation.

Source: Lum, Rysdyk and Pongpunwattana 2005, section III, equations 3 to 8, as corrected in docs/papers.md.

A particle is a column of an array (width, n): each quantity of all particles is contiguous, so that the
compiler vectorizes the loops. A column begins with the pose of the vehicle in the frame of the source: x
along the source's axis, y to its right, and the course psi relative to that axis, kept as cosine and sine.

What the measurement depends on linearly is not sampled: a Kalman filter in each column has the factors of the
signature's terms and, as the last one, the error of the map (Rao-Blackwellization; Doucet, Godsill and
Andrieu 2000). With spreads of zero its innovation is the paper's residual.
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

_gaussian = Slots(POSE)
SIZE: Final = _gaussian.place()  # factor of the extent
AMPLITUDE: Final = _gaussian.place()  # mean of the amplitude, over the expected one
MAP: Final = _gaussian.place()  # mean of the error of the map, nT
AMPLITUDE_VAR: Final = _gaussian.place()
AMPLITUDE_MAP: Final = _gaussian.place()
MAP_VAR: Final = _gaussian.place()
GAUSSIAN: Final = _gaussian.size

TERMS: Final = 4  # linear terms of a dipole: its strength north, east and down, and the error of the map
_dipole = Slots(POSE)
HEIGHT: Final = _dipole.place()  # of the dipole above the map's home
RANGE: Final = _dipole.place()  # distance at which the strength is stated
MEANS: Final = _dipole.place(TERMS)
COVARIANCE: Final = _dipole.place(TERMS * TERMS)  # row by row
DIPOLE: Final = _dipole.size

_LOG_2PI: Final = math.log(2.0 * math.pi)
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

    Drawing normal numbers is most of the cost of a step. Each therefore serves two particles, with either
    sign (antithetic variates, Hammersley and Morton 1956); resampling puts copies of one particle side by
    side, so these two are seldom alike.

    Args:
        particles: (width, n), changed in place.
        forward_m, right_m: displacement of the vehicle along and across its course before the step.
        turn_rad: change of its course.
        noise: (2, half of n or more) standard normal.
        forward_sigma_m, turn_sigma_rad: standard deviations of displacement and turn.
    """
    count = particles.shape[1]
    half = (count + 1) // 2
    for first, last, sign in ((0, half, 1.0), (half, count, -1.0)):
        _move_part(
            particles[X, first:last],
            particles[Y, first:last],
            particles[COS, first:last],
            particles[SIN, first:last],
            (forward_m, right_m),
            (math.cos(turn_rad), math.sin(turn_rad)),
            noise,
            (forward_sigma_m * sign, turn_sigma_rad * sign),
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
def weigh_gaussian(
    particles: Array,
    weights: Array,
    signature: Array,
    measured_nt: float,
    white_nt2: float,
    decay: float,
    drive_nt2: float,
    fits: Array,
) -> tuple[float, float]:
    """Update the particles of a Gaussian signature by a measurement: weights (5), (6), and linear factors.

    The exponential is the only part that is not vectorized, and therefore has a loop of its own.

    Args:
        particles: (GAUSSIAN, n), changed in place.
        weights: (n,) before the measurement; after it, likewise with sum one.
        signature: (3,) amplitude, nT, and standard deviations along and across, m.
        measured_nt: reading less map, less level.
        white_nt2: variance of the white noise of the measurement.
        decay, drive_nt2: of the error of the map since the last measurement: its factor, and the variance
            that is added.
        fits: (2, n) to work in.

    Returns:
        As `_next_weights`.
    """
    per_along, per_across = 1.0 / signature[1], 1.0 / signature[2]
    terms = fits[0]
    for m in range(weights.size):
        per_size = 1.0 / particles[SIZE, m]
        along, across = particles[X, m] * per_along * per_size, particles[Y, m] * per_across * per_size
        terms[m] = -0.5 * (along * along + across * across)
    for m in range(weights.size):
        terms[m] = signature[0] * math.exp(terms[m])
    for m in range(weights.size):
        term = fits[0, m]
        map_nt = decay * particles[MAP, m]
        aa, ab, bb = (
            particles[AMPLITUDE_VAR, m],
            decay * particles[AMPLITUDE_MAP, m],
            decay * decay * particles[MAP_VAR, m] + drive_nt2,
        )
        residual_nt = measured_nt - term * particles[AMPLITUDE, m] - map_nt
        gain_a, gain_b = term * aa + ab, term * ab + bb
        total = term * gain_a + gain_b + white_nt2
        per_total = 1.0 / total
        share = residual_nt * per_total
        particles[AMPLITUDE, m] += gain_a * share
        particles[MAP, m] = map_nt + gain_b * share
        particles[AMPLITUDE_VAR, m] = aa - gain_a * gain_a * per_total
        particles[AMPLITUDE_MAP, m] = ab - gain_a * gain_b * per_total
        particles[MAP_VAR, m] = bb - gain_b * gain_b * per_total
        fits[0, m] = residual_nt * share
        fits[1, m] = total
    return _next_weights(weights, fits)


@kernel
def weigh_dipole(
    particles: Array,
    weights: Array,
    field: Array,
    height_m: float,
    measured_nt: float,
    white_nt2: float,
    decay: float,
    drive_nt2: float,
    fits: Array,
) -> tuple[float, float]:
    """Update the particles of a dipole; its frame is north and east, as its moment has any direction.

    The anomaly is the part of B = mu_0 / 4 pi (3 (m r) r / r^5 - m / r^3) along the Earth's field (Blakely
    1995, section 8.3): linear in the moment.

    Args:
        particles: (DIPOLE, n), changed in place.
        field: (3,) direction of the Earth's field, NED.
        height_m: of the sensor above the map's home.
        weights, measured_nt, white_nt2, decay, drive_nt2, fits: as of `weigh_gaussian`.

    Returns:
        As `_next_weights`.
    """
    row, gains = np.ones(TERMS), np.empty(TERMS)
    last = TERMS - 1
    for m in range(particles.shape[1]):
        x, y = particles[X, m], particles[Y, m]
        up = max(1.0, height_m - particles[HEIGHT, m])
        distance2 = x * x + y * y + up * up
        reach = particles[RANGE, m]
        scale = reach * reach * reach / (distance2 * math.sqrt(distance2))
        along = 3.0 * (x * field[0] + y * field[1] - up * field[2]) / distance2
        row[0] = scale * (along * x - field[0])
        row[1] = scale * (along * y - field[1])
        row[2] = scale * (-along * up - field[2])
        particles[MEANS + last, m] *= decay
        for i in range(last):
            particles[COVARIANCE + TERMS * i + last, m] *= decay
            particles[COVARIANCE + TERMS * last + i, m] *= decay
        corner = COVARIANCE + TERMS * last + last
        particles[corner, m] = decay * decay * particles[corner, m] + drive_nt2
        residual_nt, total = measured_nt, white_nt2
        for i in range(TERMS):
            gains[i] = 0.0
            for j in range(TERMS):
                gains[i] += particles[COVARIANCE + TERMS * i + j, m] * row[j]
            residual_nt -= row[i] * particles[MEANS + i, m]
            total += row[i] * gains[i]
        for i in range(TERMS):
            particles[MEANS + i, m] += gains[i] * residual_nt / total
            for j in range(TERMS):
                particles[COVARIANCE + TERMS * i + j, m] -= gains[i] * gains[j] / total
        fits[0, m] = residual_nt * residual_nt / total
        fits[1, m] = total
    return _next_weights(weights, fits)


@kernel(error_model="numpy")
def _next_weights(weights: Array, fits: Array) -> tuple[float, float]:
    """Multiply the weights by the likelihoods, and normalize them.

    Args:
        weights: (n,), changed in place.
        fits: (2, n) squared innovation over its variance, and that variance, nT^2.

    Returns:
        Logarithm of the measurement's density given those before it, 1/nT; and the paper's confidence (7),
        each weight over its greatest possible value: the mean of exp(-fit / 2).
    """
    count = weights.size
    confidence = summed = 0.0
    for m in range(count):
        weights[m] *= math.exp(-0.5 * fits[0, m])
        confidence += weights[m]
    for m in range(count):
        weights[m] /= math.sqrt(fits[1, m])
    for m in range(count):
        summed += weights[m]
    before = 0.0
    if summed < _LEAST_SUM:  # no particle is near: only the best fits count
        best = fits[0].min()
        before, summed = -0.5 * best, 0.0
        for m in range(count):
            weights[m] = math.exp(-0.5 * (fits[0, m] - best)) / math.sqrt(fits[1, m])
            summed += weights[m] / count
        for m in range(count):
            weights[m] /= summed * count
        return before + math.log(summed) - 0.5 * _LOG_2PI, confidence
    per_sum = 1.0 / summed
    for m in range(count):
        weights[m] *= per_sum
    return math.log(summed) - 0.5 * _LOG_2PI, confidence


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
        particles: (width, n).
        out: (n, 3) forward and right of the vehicle's course, and the source's axis relative to that course,
            clockwise, -pi..pi.
    """
    for m in range(particles.shape[1]):
        x, y, cosine, sine = particles[X, m], particles[Y, m], particles[COS, m], particles[SIN, m]
        out[m, 0] = -cosine * x - sine * y
        out[m, 1] = sine * x - cosine * y
        out[m, 2] = math.atan2(-sine, cosine)
