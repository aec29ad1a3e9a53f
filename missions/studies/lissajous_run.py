"""One run of the localisation study, compiled: two drones on Lissajous paths observe a moving target.

The filter and the fusion are those of the live estimators (`estimators.lissajous.model`,
`estimators.target_fusion.transform`); this module contains the truth, the measurements and the score.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.lissajous.model import (
    AXIS,
    OMEGA_X,
    OMEGA_Y,
    axis,
    correct,
    course,
    course_variance,
    move,
    predict,
    predict_augmented,
)
from estimators.target_fusion.transform import INFORMATION, add_information, belief_of, ground_target
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

# kinds of estimator
UNFILTERED: Final = 0
FILTERED: Final = 1  # with the frequency covariance of its row, which may be zero
AUGMENTED: Final = 2

NORMALS: Final = 10  # per drone and step: process 4, drone sensor 4, target sensor 2


@kernel
def _noise(root: Array, normals: Array, first: int, count: int, out: Array) -> None:
    """out = root normals[first:first + count], root lower triangular."""
    for i in range(count):
        total = 0.0
        for k in range(i + 1):
            total += root[i, k] * normals[first + k]
        out[i] = total


@kernel
def run_once(
    dt_s: float,
    truth_form: int,
    truth_omega: Array,
    truth_start: Array,
    nominal_omega: Array,
    start: Array,
    start_covariance: Array,
    frequency_variance: Array,
    process: Array,
    process_root: Array,
    sensor: Array,
    sensor_root: Array,
    sight: Array,
    sight_root: Array,
    target: Array,
    kinds: NDArray[np.int64],
    forms: NDArray[np.int64],
    with_frequency: Array,
    normals: Array,
    errors: Array,
    trace: Array,
) -> None:
    """Simulate and estimate. The error of each estimator is the mean over time of sqrt((ex^2 + ey^2) / 2).

    Args:
        dt_s: step.
        truth_form: `Discretisation` of the truth.
        truth_omega, nominal_omega: (drones, 2), true frequencies, and those that the filters assume.
        truth_start, start: (drones, 4), true and assumed state at time zero.
        start_covariance, process, sensor: (drones, 4, 4); `_root`: their lower Cholesky factors.
        frequency_variance: (drones, 2), assumed by the filters.
        sight: (drones, 2, 2) covariance of the target's position in the drone's frame.
        target: (steps, 2), its positions.
        kinds, forms, with_frequency: (estimators,): kind, `Discretisation`, factor on the frequency
            variance (0: plain Kalman).
        normals: (steps, drones, NORMALS), standard.
        errors: (estimators,), overwritten.
        trace: (steps, drones + estimators, 4) or with zero steps: true drone states, then drone 0's estimate
            of its own place and the target's place by each estimator.
    """
    steps, drones, count = normals.shape[0], truth_start.shape[0], kinds.shape[0]
    traced = trace.shape[0] == steps
    truth = truth_start.copy()
    truth_axes = np.zeros((drones, 2, AXIS))
    axes = np.zeros((count, drones, 2, AXIS))
    states = np.zeros((count, drones, 6))
    covariances = np.zeros((count, drones, 6, 6))
    motion_covariances = np.zeros((count, drones, 4, 4))
    frequency_covariances = np.zeros((count, drones, 2, 2))
    for d in range(drones):
        for i in range(2):
            axis(truth_form, truth_omega[d, i], dt_s, truth_axes[d, i])
        for e in range(count):
            states[e, d, :4] = start[d]
            states[e, d, 4:] = nominal_omega[d]
            motion_covariances[e, d] = start_covariance[d]
            covariances[e, d, :4, :4] = start_covariance[d]
            for i in range(2):
                axis(forms[e], nominal_omega[d, i], dt_s, axes[e, d, i])
                frequency_covariances[e, d, i, i] = with_frequency[e] * frequency_variance[d, i]
                covariances[e, d, 4 + i, 4 + i] = frequency_variance[d, i]
    shake, wrong, blur = np.zeros(4), np.zeros(4), np.zeros(2)
    measured, seen = np.zeros((drones, 4)), np.zeros((drones, 2))
    jacobian, work = np.zeros((2, 2)), np.zeros((4, 12))
    belief, information = np.zeros(5), np.zeros(INFORMATION)
    errors[:] = 0.0
    for k in range(steps):
        for d in range(drones):
            own = truth[d]
            move(own, truth_axes[d])
            row = normals[k, d]
            _noise(process_root[d], row, 0, 4, shake)
            _noise(sensor_root[d], row, 4, 4, wrong)
            _noise(sight_root[d], row, 8, 2, blur)
            for i in range(4):
                own[i] += shake[i]
                measured[d, i] = own[i] + wrong[i]
            heading = course(own)
            c, s = math.cos(heading), math.sin(heading)
            dx, dy = target[k, 0] - own[0], target[k, 1] - own[2]
            seen[d, 0] = c * dx + s * dy + blur[0]
            seen[d, 1] = -s * dx + c * dy + blur[1]
            if traced:
                trace[k, d] = own
        for e in range(count):
            information[:] = 0.0
            for d in range(drones):
                if kinds[e] == UNFILTERED:
                    state, covariance = measured[d], sensor[d]
                elif kinds[e] == FILTERED:
                    state, covariance = states[e, d, :4], motion_covariances[e, d]
                    predict(state, covariance, axes[e, d], process[d], frequency_covariances[e, d], jacobian)
                    correct(state, covariance, measured[d], sensor[d], work)
                else:
                    state, covariance = states[e, d], covariances[e, d]
                    axis(forms[e], state[OMEGA_X], dt_s, axes[e, d, 0])
                    axis(forms[e], state[OMEGA_Y], dt_s, axes[e, d, 1])
                    predict_augmented(state, covariance, axes[e, d], process[d], 0.0, jacobian)
                    correct(state, covariance, measured[d], sensor[d], work)
                ground_target(
                    state[0],
                    state[2],
                    covariance[0, 0],
                    covariance[0, 2],
                    covariance[2, 2],
                    course(state),
                    course_variance(state, covariance),
                    seen[d],
                    sight[d],
                    belief,
                )
                add_information(belief, information)
                if traced and d == 0:
                    trace[k, drones + e, 0] = state[0]
                    trace[k, drones + e, 1] = state[2]
            belief_of(information, belief)
            ex, ey = belief[0] - target[k, 0], belief[1] - target[k, 1]
            errors[e] += math.sqrt(0.5 * (ex * ex + ey * ey))
            if traced:
                trace[k, drones + e, 2] = belief[0]
                trace[k, drones + e, 3] = belief[1]
    errors /= steps
