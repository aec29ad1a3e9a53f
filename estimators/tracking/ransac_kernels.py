"""Kernels of recursive RANSAC (`estimators.tracking.recursive_ransac`): Kalman filters, and the search for
new hypotheses in the window.

States are polynomials of time: position, velocity, acceleration, two axes each (x, y, vx, vy, ax, ay); the
order is 0 (position only), 1 or 2.
"""

import math

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.association import assign_rows
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]


@kernel
def transition_and_noise(order: int, dt_s: float, density: float) -> tuple[Array, Array]:
    """Transition and process noise, both (2 (order + 1),) squared: white noise in the derivative after the
    last state (Bar-Shalom, Li and Kirubarajan 2001, section 6.2).
    """
    size = 2 * (order + 1)
    transition, noise = np.zeros((size, size)), np.zeros((size, size))
    for i in range(order + 1):
        for j in range(order + 1):
            power = 2 * order - i - j + 1
            q = density * dt_s**power / (math.gamma(order - i + 1.0) * math.gamma(order - j + 1.0) * power)
            f = dt_s ** (j - i) / math.gamma(j - i + 1.0) if j >= i else 0.0
            for axis in range(2):
                transition[2 * i + axis, 2 * j + axis] = f
                noise[2 * i + axis, 2 * j + axis] = q
    return transition, noise


@kernel
def predict(count: int, means: Array, covariances: Array, transition: Array, noise: Array) -> None:
    """Advance the first `count` hypotheses."""
    for k in range(count):
        means[k] = transition @ means[k]
        covariances[k] = transition @ covariances[k] @ transition.T + noise


@kernel
def associate(
    count: int,
    means: Array,
    covariances: Array,
    places: Array,
    noises: Array,
    gate_squared: float,
    detected: float,
    clutter: float,
    rivals: Flags,
    found: Flags,
    explained: Flags,
) -> None:
    """Update each hypothesis by the measurements in its gate, by probabilistic data association.

    Measurements in the gates of several tracks are assigned first, each to one of them, and count for no
    other: targets that cross would attract each other's tracks otherwise, which become one (the coalescence
    that Blom and Bloem 2000, "Probabilistic data association avoiding track coalescence", prune away). What
    is left in several gates is shared out: its weight for track k is G_k / (S_k + R + B) with the likelihoods
    G, their sum S over k's measurements, their sum R over the other tracks, and B for none (the "cheap JPDA"
    of Fitzgerald 1986, "Development of practical PDA logic for multitarget tracking by microprocessor").

    Args:
        count: number of hypotheses.
        means, covariances: (m, s), (m, s, s).
        places, noises: (n, 2), (n, 2, 2) measurements and their covariances.
        gate_squared: of the Mahalanobis distance.
        detected: probability of detection.
        clutter: density of false measurements, per area.
        rivals: (m,) whether a hypothesis is a track, with which others share measurements.
        found: (m,) result: whether a hypothesis has a measurement in its gate.
        explained: (n,) result: whether a measurement is in any gate.
    """
    size, total = means.shape[1], places.shape[0]
    scores, shared = np.zeros((count, total)), np.zeros(total)
    for k in range(count):
        found[k] = False
        mean, covariance = means[k], covariances[k]
        for i in range(total):
            x, y = places[i, 0] - mean[0], places[i, 1] - mean[1]
            a = covariance[0, 0] + noises[i, 0, 0]
            b = covariance[0, 1] + noises[i, 0, 1]
            d = covariance[1, 1] + noises[i, 1, 1]
            determinant = a * d - b * b
            squared = (d * x * x - 2.0 * b * x * y + a * y * y) / determinant
            if squared <= gate_squared:
                scores[k, i] = detected * math.exp(-0.5 * squared) / (math.tau * math.sqrt(determinant))
                explained[i] = True
                found[k] = True
                if rivals[k]:
                    shared[i] += scores[k, i]
    missed = clutter * (1.0 - detected * (1.0 - math.exp(-0.5 * gate_squared)))
    assign(scores, rivals, missed, shared, found)
    for k in range(count):
        if not found[k]:
            continue
        mean, covariance = means[k], covariances[k]
        summed = 0.0
        best = 0
        for i in range(total):
            summed += scores[k, i]
            if scores[k, i] > scores[k, best]:
                best = i
        any_true = x = y = xx = xy = yy = 0.0
        for i in range(total):
            others = shared[i] - (scores[k, i] if rivals[k] else 0.0)
            share = scores[k, i] / (summed + others + missed)
            if scores[k, i] > 0.0:
                off_x, off_y = places[i, 0] - mean[0], places[i, 1] - mean[1]
                any_true += share
                x += share * off_x
                y += share * off_y
                xx += share * off_x * off_x
                xy += share * off_x * off_y
                yy += share * off_y * off_y
        xx, xy, yy = xx - x * x, xy - x * y, yy - y * y  # spread of the innovations
        # the gain is that of the likeliest measurement: those of one gate have nearly the same noise
        a = covariance[0, 0] + noises[best, 0, 0]
        b = covariance[0, 1] + noises[best, 0, 1]
        d = covariance[1, 1] + noises[best, 1, 1]
        determinant = a * d - b * b
        gain = np.empty((size, 2))
        for i in range(size):
            gain[i, 0] = (covariance[i, 0] * d - covariance[i, 1] * b) / determinant
            gain[i, 1] = (covariance[i, 1] * a - covariance[i, 0] * b) / determinant
            mean[i] += gain[i, 0] * x + gain[i, 1] * y
        for i in range(size):
            for j in range(size):
                # W S W' of the part that is an update, W (spread) W' of not knowing which it was
                update = gain[i, 0] * (a * gain[j, 0] + b * gain[j, 1]) + gain[i, 1] * (
                    b * gain[j, 0] + d * gain[j, 1]
                )
                spread = gain[i, 0] * (xx * gain[j, 0] + xy * gain[j, 1]) + gain[i, 1] * (
                    xy * gain[j, 0] + yy * gain[j, 1]
                )
                covariance[i, j] += spread - any_true * update


@kernel
def assign(scores: Array, rivals: Flags, missed: float, shared: Array, found: Flags) -> None:
    """Assign measurements to tracks, so that the product of the likelihoods is greatest, and take them from
    all other tracks. Without a measurement in the gates of two tracks nothing is done.

    Args:
        scores: (m, n) likelihoods, 0 outside of the gate; changed.
        rivals: (m,) whether a hypothesis is a track.
        missed: density of a track without a measurement and a false measurement in its place.
        shared: (n,) sums of the likelihoods over the tracks; changed.
        found: (m,) whether a hypothesis has a measurement; changed.
    """
    total = scores.shape[1]
    rows = np.flatnonzero(rivals & found[: rivals.size])
    disputed = False
    for i in range(total):
        gates = 0
        for k in rows:
            gates += scores[k, i] > 0.0
        disputed |= gates > 1
    if not disputed:
        return
    size = rows.size
    costs = np.full((size, total + size), 1e6)  # with a column for each track without a measurement
    for r in range(size):
        for i in range(total):
            if scores[rows[r], i] > 0.0:
                costs[r, i] = -math.log(scores[rows[r], i] / missed)
        costs[r, total + r] = 0.0
    column_of = np.zeros(size, np.int64)
    assign_rows(costs, column_of)
    for r in range(size):
        i, owner = column_of[r], rows[r]
        if i >= total or scores[owner, i] <= 0.0:
            continue
        for k in rows:
            if k != owner:
                scores[k, i] = 0.0
        shared[i] = scores[owner, i]
    for k in rows:
        found[k] = scores[k].max() > 0.0


@kernel
def search(
    place: Array,
    ages: Array,
    scans: Indices,
    places: Array,
    order: int,
    within: float,
    speed_max: float,
    enough: int,
    marks: Array,
    inliers: Flags,
) -> int:
    """RANSAC over the window: the polynomial through a new measurement that most earlier scans support.

    Args:
        place: (2,) the new measurement.
        ages: (n,) time since each earlier measurement of the window, s, above 0.
        scans: (n,) number of the scan of each, ascending from 0.
        places: (n, 2) the earlier measurements.
        order: of the polynomial; it takes `order` earlier measurements of different scans to define one.
        within: largest distance of an inlier.
        speed_max: faster polynomials are not considered.
        enough: number of supporting scans that ends the search.
        marks: (iterations, order) uniform in 0..1: which measurements are tried.
        inliers: (n,) result: inliers of the best polynomial, the nearest of each scan.

    Returns:
        Number of scans that support the best polynomial.
    """
    total = ages.size
    best, nearest, here = 0, np.full(total, -1), np.full(total, -1)
    velocity, half_acceleration = np.zeros(2), np.zeros(2)
    inliers[:] = False
    for trial in range(marks.shape[0]):
        if order > 0:
            i = min(int(marks[trial, 0] * total), total - 1)
            t = ages[i]
            if order == 1:
                for axis in range(2):
                    velocity[axis] = (place[axis] - places[i, axis]) / t
            else:
                j = min(int(marks[trial, 1] * total), total - 1)
                u = ages[j]
                if scans[i] == scans[j]:
                    continue
                # place - v t + a t^2 at both ages
                for axis in range(2):
                    p = (places[i, axis] - place[axis]) / t
                    q = (places[j, axis] - place[axis]) / u
                    half_acceleration[axis] = (p - q) / (t - u)
                    velocity[axis] = half_acceleration[axis] * t - p
            if velocity[0] * velocity[0] + velocity[1] * velocity[1] > speed_max * speed_max:
                continue
        supported, last, least = 0, -1, math.inf
        for k in range(total):
            t = ages[k]
            x = place[0] - velocity[0] * t + half_acceleration[0] * t * t - places[k, 0]
            y = place[1] - velocity[1] * t + half_acceleration[1] * t * t - places[k, 1]
            squared = x * x + y * y
            if scans[k] != last:
                last, least = scans[k], math.inf
            if squared <= within * within and squared < least:
                if least == math.inf:
                    supported += 1
                least = squared
                here[supported - 1] = k
        if supported > best:
            best = supported
            nearest[:best] = here[:best]
            if best >= enough:
                break
        if order == 0:
            break
    for k in range(best):
        inliers[nearest[k]] = True
    return best


@kernel
def fit(ages: Array, places: Array, noises: Array, order: int, mean: Array, covariance: Array) -> bool:
    """Weighted least squares of a polynomial at the present time.

    Args:
        ages: (n,) time since each measurement, s.
        places, noises: (n, 2), (n, 2, 2) measurements and their covariances.
        order: of the polynomial.
        mean, covariance: (s,), (s, s) results.

    Returns:
        Whether the measurements determine it.
    """
    size = 2 * (order + 1)
    information, vector = np.zeros((size, size)), np.zeros(size)
    terms = np.empty(order + 1)
    for k in range(ages.size):
        a, b, d = noises[k, 0, 0], noises[k, 0, 1], noises[k, 1, 1]
        determinant = a * d - b * b
        inverse = ((d / determinant, -b / determinant), (-b / determinant, a / determinant))
        for i in range(order + 1):
            terms[i] = (-ages[k]) ** i / math.gamma(i + 1.0)
        for i in range(order + 1):
            for p in range(2):
                vector[2 * i + p] += terms[i] * (inverse[p][0] * places[k, 0] + inverse[p][1] * places[k, 1])
                for j in range(order + 1):
                    for q in range(2):
                        information[2 * i + p, 2 * j + q] += terms[i] * terms[j] * inverse[p][q]
    if np.linalg.cond(information) > 1e12:
        return False
    covariance[:] = np.linalg.inv(information)
    mean[:] = covariance @ vector
    return True


@kernel
def inlier_ratios(count: int, hits: Flags, ratios: Array) -> None:
    """Share of the window's scans with a measurement of each of the first `count` hypotheses.

    Args:
        count: number of hypotheses.
        hits: (m, window) whether a scan has one.
        ratios: (m,) result.
    """
    for k in range(count):
        ratios[k] = hits[k].sum() / hits.shape[1]


@kernel
def duplicates(
    count: int, means: Array, covariances: Array, ratios: Array, near_squared: float, drop: Flags
) -> None:
    """Hypotheses of one target: of two within a Mahalanobis distance, the one with fewer inliers is dropped.

    Args:
        count: number of hypotheses, the oldest first.
        means, covariances: (m, s), (m, s, s).
        ratios: (m,) inlier ratios.
        near_squared: squared Mahalanobis distance of the states' difference.
        drop: (m,) result.
    """
    drop[:count] = False
    for i in range(count):
        for j in range(i + 1, count):
            if drop[i] or drop[j]:
                continue
            off = means[i] - means[j]
            both = covariances[i] + covariances[j]
            if off @ np.linalg.solve(both, off) <= near_squared:
                drop[j if ratios[i] >= ratios[j] else i] = True
