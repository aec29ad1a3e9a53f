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
PER_ALONG: Final = _gaussian.place()  # one over the standard deviation along the axis, 1/m
PER_ACROSS: Final = _gaussian.place()
AMPLITUDE: Final = _gaussian.place()  # mean of the amplitude, over the expected one
MAP: Final = _gaussian.place()  # mean of the error of the map, nT
AMPLITUDE_VAR: Final = _gaussian.place()
AMPLITUDE_MAP: Final = _gaussian.place()
MAP_VAR: Final = _gaussian.place()
GAUSSIAN: Final = _gaussian.size

TERMS: Final = 4  # linear terms of a dipole: its strength north, east and down, and the error of the map
COVARIANCES: Final = TERMS * (TERMS + 1) // 2
_dipole = Slots(POSE)
HEIGHT: Final = _dipole.place()  # of the dipole above the map's home
RANGE: Final = _dipole.place()  # distance at which the strength is stated
MEANS: Final = _dipole.place(TERMS)
COVARIANCE: Final = _dipole.place(COVARIANCES)  # the upper triangle, row by row: NN, NE, ND, NM, EE, ...
STRENGTH_VARIANCES: Final = (COVARIANCE, COVARIANCE + 4, COVARIANCE + 7)
DIPOLE_MAP_VAR: Final = COVARIANCE + COVARIANCES - 1
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

    Drawing normal numbers is most of the cost of a step. Each pair therefore serves four particles, with
    either sign of both (antithetic variates, Hammersley and Morton 1956); resampling puts copies of one
    particle side by side, so these four are seldom alike.

    Args:
        particles: (width, n), changed in place.
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
def weigh_gaussian(
    particles: Array,
    weights: Array,
    amplitude_nt: float,
    measured_nt: float,
    white_nt2: float,
    decay: float,
    drive_nt2: float,
    fits: Array,
) -> tuple[float, float, float]:
    """Update the particles of a Gaussian signature by a measurement: weights (5), (6), and linear factors.

    The exponential is the only part that is not vectorized, and therefore has a loop of its own.

    Args:
        particles: (GAUSSIAN, n), changed in place.
        weights: (n,) before the measurement; after it, likewise with sum one.
        amplitude_nt: what the particles' amplitudes are relative to.
        measured_nt: reading less map, less level.
        white_nt2: variance of the white noise of the measurement.
        decay, drive_nt2: of the error of the map since the last measurement: its factor, and the variance
            that is added.
        fits: (3, n) to work in.

    Returns:
        As `_next_weights`.
    """
    terms = fits[0]
    for m in range(weights.size):
        along, across = particles[X, m] * particles[PER_ALONG, m], particles[Y, m] * particles[PER_ACROSS, m]
        terms[m] = -0.5 * (along * along + across * across)
    for m in range(weights.size):
        terms[m] = amplitude_nt * math.exp(terms[m])
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
        fits[2, m] = residual_nt
    return _next_weights(weights, fits)


@kernel(error_model="numpy")
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
) -> tuple[float, float, float]:
    """Update the particles of a dipole; its frame is north and east, as its moment has any direction.

    The anomaly is the part of B = mu_0 / 4 pi (3 (m r) r / r^5 - m / r^3) along the Earth's field (Blakely
    1995, section 8.3): linear in the moment. The Kalman filter is written out term by term, so that the
    compiler vectorizes the loop.

    Args:
        particles: (DIPOLE, n), changed in place.
        field: (3,) direction of the Earth's field, NED.
        height_m: of the sensor above the map's home.
        weights, measured_nt, white_nt2, decay, drive_nt2, fits: as of `weigh_gaussian`.

    Returns:
        As `_next_weights`.
    """
    field_n, field_e, field_d = field[0], field[1], field[2]
    c = COVARIANCE
    for m in range(weights.size):
        x, y = particles[X, m], particles[Y, m]
        up = max(1.0, height_m - particles[HEIGHT, m])
        distance2 = x * x + y * y + up * up
        reach = particles[RANGE, m]
        scale = reach * reach * reach / (distance2 * math.sqrt(distance2))
        along = 3.0 * (x * field_n + y * field_e - up * field_d) / distance2
        term_n = scale * (along * x - field_n)
        term_e = scale * (along * y - field_e)
        term_d = scale * (-along * up - field_d)
        map_nt = decay * particles[MEANS + 3, m]
        nn, ne, nd = particles[c, m], particles[c + 1, m], particles[c + 2, m]
        ee, ed, dd = particles[c + 4, m], particles[c + 5, m], particles[c + 7, m]
        nm, em, dm = decay * particles[c + 3, m], decay * particles[c + 6, m], decay * particles[c + 8, m]
        mm = decay * decay * particles[c + 9, m] + drive_nt2
        gain_n = term_n * nn + term_e * ne + term_d * nd + nm
        gain_e = term_n * ne + term_e * ee + term_d * ed + em
        gain_d = term_n * nd + term_e * ed + term_d * dd + dm
        gain_m = term_n * nm + term_e * em + term_d * dm + mm
        residual_nt = (
            measured_nt
            - term_n * particles[MEANS, m]
            - term_e * particles[MEANS + 1, m]
            - term_d * particles[MEANS + 2, m]
            - map_nt
        )
        total = term_n * gain_n + term_e * gain_e + term_d * gain_d + gain_m + white_nt2
        per_total = 1.0 / total
        share = residual_nt * per_total
        particles[MEANS, m] += gain_n * share
        particles[MEANS + 1, m] += gain_e * share
        particles[MEANS + 2, m] += gain_d * share
        particles[MEANS + 3, m] = map_nt + gain_m * share
        particles[c, m] = nn - gain_n * gain_n * per_total
        particles[c + 1, m] = ne - gain_n * gain_e * per_total
        particles[c + 2, m] = nd - gain_n * gain_d * per_total
        particles[c + 3, m] = nm - gain_n * gain_m * per_total
        particles[c + 4, m] = ee - gain_e * gain_e * per_total
        particles[c + 5, m] = ed - gain_e * gain_d * per_total
        particles[c + 6, m] = em - gain_e * gain_m * per_total
        particles[c + 7, m] = dd - gain_d * gain_d * per_total
        particles[c + 8, m] = dm - gain_d * gain_m * per_total
        particles[c + 9, m] = mm - gain_m * gain_m * per_total
        fits[0, m] = residual_nt * share
        fits[1, m] = total
        fits[2, m] = residual_nt
    return _next_weights(weights, fits)


@kernel(error_model="numpy")
def _next_weights(weights: Array, fits: Array) -> tuple[float, float, float]:
    """Multiply the weights by the likelihoods, and normalize them.

    Args:
        weights: (n,), changed in place.
        fits: (3, n) squared innovation over its variance, that variance, nT^2, and the innovation, nT.

    Returns:
        Logarithm of the measurement's density given those before it, 1/nT; the paper's confidence (7), each
        weight over its greatest possible value: the mean of exp(-fit / 2); and the square of the difference
        between measurement and prediction of all particles together, over its variance.
    """
    count = weights.size
    mean = square = 0.0
    for m in range(count):
        mean += weights[m] * fits[2, m]
        square += weights[m] * (fits[2, m] * fits[2, m] + fits[1, m])
    misfit = mean * mean / (square - mean * mean)
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
        return before + math.log(summed) - 0.5 * _LOG_2PI, confidence, misfit
    per_sum = 1.0 / summed
    for m in range(count):
        weights[m] *= per_sum
    return math.log(summed) - 0.5 * _LOG_2PI, confidence, misfit


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
