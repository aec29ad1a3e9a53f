"""The particles of one hypothesis as kernels: motion, weights and transformation.

Source: Lum, Rysdyk and Pongpunwattana 2005, section III, equations 3 to 8, as corrected in docs/papers.md.

A particle is a row of an array (n, width). It begins with the pose of the vehicle in the frame of the source:
x along the source's axis, y to its right, and the course psi relative to that axis, kept as cosine and sine.
What the measurement depends on linearly is not sampled: a Kalman filter in each row has the factors of the
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
        particles: (n, width), changed in place.
        forward_m, right_m: displacement of the vehicle along and across its course before the step.
        turn_rad: change of its course.
        noise: (2, half of n or more) standard normal.
        forward_sigma_m, turn_sigma_rad: standard deviations of displacement and turn.
    """
    turn_cosine, turn_sine = math.cos(turn_rad), math.sin(turn_rad)
    first_half = (particles.shape[0] + 1) // 2
    for m in range(particles.shape[0]):
        cosine, sine = particles[m, COS], particles[m, SIN]
        drawn, sign = (m, 1.0) if m < first_half else (m - first_half, -1.0)
        forward = forward_m + forward_sigma_m * sign * noise[0, drawn]
        particles[m, X] += cosine * forward - sine * right_m
        particles[m, Y] += sine * forward + cosine * right_m
        # a rotation by 2 atan(noise / 2): half the time of cosine and sine, and the norm stays one
        half = 0.5 * turn_sigma_rad * sign * noise[1, drawn]
        scale = 1.0 / (1.0 + half * half)
        noisy_cosine, noisy_sine = (1.0 - half * half) * scale, 2.0 * half * scale
        new_cosine = turn_cosine * noisy_cosine - turn_sine * noisy_sine
        new_sine = turn_sine * noisy_cosine + turn_cosine * noisy_sine
        particles[m, COS] = cosine * new_cosine - sine * new_sine
        particles[m, SIN] = sine * new_cosine + cosine * new_sine


@kernel
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

    Args:
        particles: (n, GAUSSIAN), changed in place.
        weights: (n,) before the measurement; after it, likewise with sum one.
        signature: (3,) amplitude, nT, and standard deviations along and across, m.
        measured_nt: reading less map, less level.
        white_nt2: variance of the white noise of the measurement.
        decay, drive_nt2: of the error of the map since the last measurement: its factor, and the variance
            that is added.
        fits: (n, 2) to work in.

    Returns:
        As `_next_weights`.
    """
    per_along, per_across = 1.0 / signature[1], 1.0 / signature[2]
    for m in range(particles.shape[0]):
        per_size = 1.0 / particles[m, SIZE]
        along, across = particles[m, X] * per_along * per_size, particles[m, Y] * per_across * per_size
        term = signature[0] * math.exp(-0.5 * (along * along + across * across))
        map_nt = decay * particles[m, MAP]
        aa, ab, bb = (
            particles[m, AMPLITUDE_VAR],
            decay * particles[m, AMPLITUDE_MAP],
            decay * decay * particles[m, MAP_VAR] + drive_nt2,
        )
        residual_nt = measured_nt - term * particles[m, AMPLITUDE] - map_nt
        gain_a, gain_b = term * aa + ab, term * ab + bb
        total = term * gain_a + gain_b + white_nt2
        per_total = 1.0 / total
        share = residual_nt * per_total
        particles[m, AMPLITUDE] += gain_a * share
        particles[m, MAP] = map_nt + gain_b * share
        particles[m, AMPLITUDE_VAR] = aa - gain_a * gain_a * per_total
        particles[m, AMPLITUDE_MAP] = ab - gain_a * gain_b * per_total
        particles[m, MAP_VAR] = bb - gain_b * gain_b * per_total
        fits[m, 0] = residual_nt * share
        fits[m, 1] = total
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
        particles: (n, DIPOLE), changed in place.
        field: (3,) direction of the Earth's field, NED.
        height_m: of the sensor above the map's home.
        weights, measured_nt, white_nt2, decay, drive_nt2, fits: as of `weigh_gaussian`.

    Returns:
        As `_next_weights`.
    """
    row, gains = np.ones(TERMS), np.empty(TERMS)
    last = TERMS - 1
    for m in range(particles.shape[0]):
        x, y = particles[m, X], particles[m, Y]
        up = max(1.0, height_m - particles[m, HEIGHT])
        distance2 = x * x + y * y + up * up
        reach = particles[m, RANGE]
        scale = reach * reach * reach / (distance2 * math.sqrt(distance2))
        along = 3.0 * (x * field[0] + y * field[1] - up * field[2]) / distance2
        row[0] = scale * (along * x - field[0])
        row[1] = scale * (along * y - field[1])
        row[2] = scale * (-along * up - field[2])
        particles[m, MEANS + last] *= decay
        for i in range(last):
            particles[m, COVARIANCE + TERMS * i + last] *= decay
            particles[m, COVARIANCE + TERMS * last + i] *= decay
        corner = COVARIANCE + TERMS * last + last
        particles[m, corner] = decay * decay * particles[m, corner] + drive_nt2
        residual_nt, total = measured_nt, white_nt2
        for i in range(TERMS):
            gains[i] = 0.0
            for j in range(TERMS):
                gains[i] += particles[m, COVARIANCE + TERMS * i + j] * row[j]
            residual_nt -= row[i] * particles[m, MEANS + i]
            total += row[i] * gains[i]
        for i in range(TERMS):
            particles[m, MEANS + i] += gains[i] * residual_nt / total
            for j in range(TERMS):
                particles[m, COVARIANCE + TERMS * i + j] -= gains[i] * gains[j] / total
        fits[m, 0] = residual_nt * residual_nt / total
        fits[m, 1] = total
    return _next_weights(weights, fits)


@kernel
def _next_weights(weights: Array, fits: Array) -> tuple[float, float]:
    """Multiply the weights by the likelihoods, and normalize them.

    Args:
        weights: (n,), changed in place.
        fits: (n, 2) squared innovation over its variance, and that variance, nT^2.

    Returns:
        Logarithm of the measurement's density given those before it, 1/nT; and the paper's confidence (7),
        each weight over its greatest possible value: the mean of exp(-fit / 2).
    """
    count = weights.size
    confidence = summed = 0.0
    for m in range(count):
        value = weights[m] * math.exp(-0.5 * fits[m, 0])
        confidence += value
        weights[m] = value / math.sqrt(fits[m, 1])
        summed += weights[m]
    before = 0.0
    if summed < _LEAST_SUM:  # no particle is near: only the best fits count
        best = fits[0, 0]
        for m in range(count):
            best = min(best, fits[m, 0])
        before, summed = -0.5 * best, 0.0
        for m in range(count):
            weights[m] = math.exp(-0.5 * (fits[m, 0] - best)) / math.sqrt(fits[m, 1])
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
    """The next generation: row k of `out` is particle `chosen[k]`."""
    for k in range(chosen.size):
        for i in range(particles.shape[1]):
            out[k, i] = particles[chosen[k], i]


@kernel
def relative_sources(particles: Array, out: Array) -> None:
    """Equation 8 in the project's frames: the source in the frame of the vehicle.

    Args:
        particles: (n, width).
        out: (n, 3) forward and right of the vehicle's course, and the source's axis relative to that course,
            clockwise, -pi..pi.
    """
    for m in range(particles.shape[0]):
        x, y, cosine, sine = particles[m, X], particles[m, Y], particles[m, COS], particles[m, SIN]
        out[m, 0] = -cosine * x - sine * y
        out[m, 1] = sine * x - cosine * y
        out[m, 2] = math.atan2(-sine, cosine)
