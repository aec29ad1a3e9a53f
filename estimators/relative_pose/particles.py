"""Particles of a relative pose, in the level frame of the handoff aircraft: motion, weights, modes.

The paper's state is (rho, bearing, z, psi), equation 24. The particles hold the same pose as a position and
as cosine and sine of the heading: equation 26 is the polar form of a rotation and a translation, which need
no trigonometric function here and have no singularity at rho = 0. Over a step both yaw rates are constant.
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
FORWARD: Final = _pose.place()
RIGHT: Final = _pose.place()
DOWN: Final = _pose.place()
COS: Final = _pose.place()
SIN: Final = _pose.place()
POSE: Final = _pose.size

_motion = Slots()
V_FORWARD: Final = _motion.place()
V_RIGHT: Final = _motion.place()
V_DOWN: Final = _motion.place()
YAW_RATE: Final = _motion.place()
MOTION: Final = _motion.size

NOISES: Final = 4
BINS: Final = 72
_EMPTY: Final = 0.02  # of the densest bin: bins below it separate groups


@kernel
def displacements(own: Array, other: Array, dt_s: float) -> tuple[float, float, float, float, float, float]:
    """Displacements over a step: own and the other aircraft's, forward and right in the level frame of each
    at the start of the step, the change of the depth, and the change of the relative heading.

    Args:
        own, other: (MOTION,) of the handoff and of the tracking aircraft.
        dt_s: step.
    """
    half_own, half_other = 0.5 * own[YAW_RATE] * dt_s, 0.5 * other[YAW_RATE] * dt_s
    c, s = math.cos(half_own) * dt_s, math.sin(half_own) * dt_s
    own_forward = c * own[V_FORWARD] - s * own[V_RIGHT]
    own_right = s * own[V_FORWARD] + c * own[V_RIGHT]
    c, s = math.cos(half_other) * dt_s, math.sin(half_other) * dt_s
    other_forward = c * other[V_FORWARD] - s * other[V_RIGHT]
    other_right = s * other[V_FORWARD] + c * other[V_RIGHT]
    down = (other[V_DOWN] - own[V_DOWN]) * dt_s
    turn = (own[YAW_RATE] - other[YAW_RATE]) * dt_s
    return own_forward, own_right, other_forward, other_right, down, turn


@kernel
def move(particles: Array, own: Array, other: Array, dt_s: float, noise: Array, sigmas: Array) -> None:
    """Equation 26, with the tracker's yaw rate in its last row.

    Args:
        particles: (POSE, n), changed in place.
        own, other: (MOTION,) of the handoff and of the tracking aircraft.
        dt_s: step.
        noise: (NOISES, n) standard normal.
        sigmas: (3,) standard deviations of the step's noise: horizontal per axis, vertical, heading.
    """
    own_f, own_r, other_f, other_r, down, turn = displacements(own, other, dt_s)
    yaw = own[YAW_RATE] * dt_s
    yaw_c, yaw_s = math.cos(yaw), math.sin(yaw)
    turn_c, turn_s = math.cos(turn), math.sin(turn)
    for k in range(particles.shape[1]):
        c, s = particles[COS, k], particles[SIN, k]
        x = particles[FORWARD, k] + c * other_f + s * other_r - own_f + sigmas[0] * noise[0, k]
        y = particles[RIGHT, k] - s * other_f + c * other_r - own_r + sigmas[0] * noise[1, k]
        particles[FORWARD, k] = yaw_c * x + yaw_s * y
        particles[RIGHT, k] = -yaw_s * x + yaw_c * y
        particles[DOWN, k] += down + sigmas[1] * noise[2, k]
        particles[COS, k], particles[SIN, k] = _turned(c, s, turn_c, turn_s, sigmas[2] * noise[3, k])


@kernel
def weigh(particles: Array, weights: Array, measured: Array, sigmas: Array, fits: Array) -> float:
    """Equations 30 and 32: weights times the likelihoods of the measurements, normalized.

    The likelihood of the heading is that of von Mises, exp((cos d - 1) / sigma^2): a Gaussian for small d.

    Args:
        particles: (POSE, n).
        weights: (n,) sum one, before and after.
        measured: (3,) slant range, depth, relative heading; NaN: not measured.
        sigmas: (3,) their standard deviations.
        fits: (n,) to work in.

    Returns:
        Squared innovation of the range over its predicted variance; NaN without a range.
    """
    count = weights.size
    with_range, with_down = not math.isnan(measured[0]), not math.isnan(measured[1])
    with_heading = not math.isnan(measured[2])
    per_range, per_down = 0.5 / (sigmas[0] * sigmas[0]), 0.5 / (sigmas[1] * sigmas[1])
    per_heading = 1.0 / (sigmas[2] * sigmas[2])
    c, s = math.cos(measured[2]), math.sin(measured[2])
    least, mean, square = math.inf, 0.0, 0.0
    for k in range(count):
        fit = 0.0
        if with_range:
            off = (
                math.sqrt(
                    particles[FORWARD, k] * particles[FORWARD, k]
                    + particles[RIGHT, k] * particles[RIGHT, k]
                    + particles[DOWN, k] * particles[DOWN, k]
                )
                - measured[0]
            )
            mean += weights[k] * off
            square += weights[k] * off * off
            fit = off * off * per_range
        if with_down:
            off = particles[DOWN, k] - measured[1]
            fit += off * off * per_down
        if with_heading:
            fit += (1.0 - c * particles[COS, k] - s * particles[SIN, k]) * per_heading
        fits[k] = fit
        least = min(least, fit)
    total = 0.0
    for k in range(count):
        weights[k] *= math.exp(least - fits[k])
        total += weights[k]
    if total > 0.0:
        for k in range(count):
            weights[k] /= total
    else:  # no particle with weight is near: the fits alone count
        for k in range(count):
            weights[k] = math.exp(least - fits[k])
            total += weights[k]
        for k in range(count):
            weights[k] /= total
    if not with_range:
        return math.nan
    return mean * mean / (max(0.0, square - mean * mean) + sigmas[0] * sigmas[0])


@kernel
def spreads(particles: Array, weights: Array, out: Array) -> None:
    """Standard deviations of slant range, depth and heading.

    Args:
        particles: (POSE, n).
        weights: (n,) sum one.
        out: (3,) result.
    """
    slant_mean = slant_square = down_mean = down_square = cosine = sine = 0.0
    for k in range(weights.size):
        w, down = weights[k], particles[DOWN, k]
        square = particles[FORWARD, k] ** 2 + particles[RIGHT, k] ** 2 + down * down
        slant_mean += w * math.sqrt(square)
        slant_square += w * square
        down_mean += w * down
        down_square += w * down * down
        cosine += w * particles[COS, k]
        sine += w * particles[SIN, k]
    out[0] = math.sqrt(max(0.0, slant_square - slant_mean * slant_mean))
    out[1] = math.sqrt(max(0.0, down_square - down_mean * down_mean))
    out[2] = math.sqrt(max(0.0, -math.log(max(1e-300, cosine * cosine + sine * sine))))


@kernel
def copy_chosen(chosen: Indices, particles: Array, weights: Array, noise: Array, out: Array) -> None:
    """The next generation: column k of `out` is particle `chosen[k]` with noise; all weights become equal.

    Args:
        chosen: (n,) indices.
        particles: (POSE, n).
        weights: (n,) result.
        noise: (NOISES, n) of forward, right, down and heading.
        out: (POSE, n) result.
    """
    for k in range(chosen.size):
        m = chosen[k]
        for i in range(3):
            out[i, k] = particles[i, m] + noise[i, k]
        out[COS, k], out[SIN, k] = _turned(particles[COS, m], particles[SIN, m], 1.0, 0.0, noise[3, k])
        weights[k] = 1.0 / chosen.size


@kernel
def _turned(c: float, s: float, turn_c: float, turn_s: float, small: float) -> tuple[float, float]:
    """Cosine and sine of an angle, turned by an angle and a small angle.

    The small one is 2 atan(small / 2): no cosine and sine, and the norm stays one.
    """
    half = 0.5 * small
    scale = 1.0 / (1.0 + half * half)
    a, b = (1.0 - half * half) * scale, 2.0 * half * scale
    new_c, new_s = turn_c * a - turn_s * b, turn_s * a + turn_c * b
    return c * new_c - s * new_s, s * new_c + c * new_s


@kernel
def bearing_groups(
    particles: Array, weights: Array, group_weights: Array, means: Array, covariances: Array
) -> int:
    """Groups of particles that empty bearings separate, as Gaussians.

    Args:
        particles: (POSE, n).
        weights: (n,) sum one.
        group_weights, means, covariances: (BINS,), (BINS, 4), (BINS, 4, 4) of the groups: results.

    Returns:
        Number of groups.
    """
    count = weights.size
    bins, which = np.zeros(BINS), np.empty(count, dtype=np.int64)
    for k in range(count):
        bearing = math.atan2(particles[RIGHT, k], particles[FORWARD, k])
        which[k] = int((bearing + math.pi) * (BINS / math.tau)) % BINS
        bins[which[k]] += weights[k]
    limit = _EMPTY * bins.max()
    group, empty = np.full(BINS, -1), -1
    for b in range(BINS):
        if bins[b] <= limit:
            empty = b
            break
    groups = 0
    if empty < 0:
        group[:] = 0
        groups = 1
    else:
        inside = False
        for step in range(1, BINS + 1):
            b = (empty + step) % BINS
            if bins[b] > limit:
                if not inside:
                    groups += 1
                inside = True
                group[b] = groups - 1
            else:
                inside = False
    group_weights[:groups] = 0.0
    means[:groups] = 0.0
    covariances[:groups] = 0.0
    sines = np.zeros(groups)
    for k in range(count):
        g = group[which[k]]
        if g >= 0:
            w = weights[k]
            group_weights[g] += w
            for i in range(3):
                means[g, i] += w * particles[i, k]
            means[g, 3] += w * particles[COS, k]
            sines[g] += w * particles[SIN, k]
    for g in range(groups):
        for i in range(3):
            means[g, i] /= group_weights[g]
        means[g, 3] = math.atan2(sines[g], means[g, 3])
    off = np.empty(4)
    for k in range(count):
        g = group[which[k]]
        if g >= 0:
            for i in range(3):
                off[i] = particles[i, k] - means[g, i]
            c, s = math.cos(means[g, 3]), math.sin(means[g, 3])
            off[3] = math.atan2(
                c * particles[SIN, k] - s * particles[COS, k], c * particles[COS, k] + s * particles[SIN, k]
            )
            w = weights[k] / group_weights[g]
            for i in range(4):
                for j in range(i + 1):
                    covariances[g, i, j] += w * off[i] * off[j]
    for g in range(groups):
        for i in range(4):
            for j in range(i):
                covariances[g, j, i] = covariances[g, i, j]
    return groups
