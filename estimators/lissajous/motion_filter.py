"""Filter of one vehicle's motion along a Lissajous pattern, with a short history, on plain numbers."""

import math
from bisect import bisect_right

import numpy as np

from estimators.lissajous.model import (
    AUGMENTED,
    AXIS,
    MOTION,
    OMEGA_X,
    OMEGA_Y,
    Array,
    Discretisation,
    axis,
    correct,
    predict,
    predict_augmented,
)
from estimators.lissajous.parameters import Form, LissajousParameters

_EXACT = int(Discretisation.EXACT)
_UNKNOWN_VELOCITY_M_S = 1e3
_TOO_OFTEN = 0.1
_SLOWEST, _FASTEST = 0.2, 5.0  # limits of a corrected frequency, as multiples of the nominal one


def off_pattern_remarks(share: float) -> dict[str, float | str]:
    """Summary entries for a filter's `off_pattern`: the share, and a warning when it is large."""
    remarks: dict[str, float | str] = {"off_pattern": share}
    if share > _TOO_OFTEN:
        remarks["warning"] = (
            f"off the pattern in {100.0 * share:.0f} % of the samples: check omega_x_rad_s, omega_y_rad_s, "
            "orientation_rad and centre_*, or set form=measurement"
        )
    return remarks


class MotionFilter:
    """State (x, x', y, y') relative to the pattern's centre, along its axes, from samples at irregular times.

    Args:
        parameters: parameters of the estimator.

    Attributes:
        time_us: time of the newest sample; None before the first.
        state, covariance: (4,), (4, 4), or with frequencies (6,), (6, 6).
        distance: squared Mahalanobis distance of the newest sample from its prediction.
        samples: number of samples.
        restarts: number of samples that were so far off that the filter restarted.
    """

    def __init__(self, parameters: LissajousParameters) -> None:
        p = self.parameters = parameters
        self.time_us: int | None = None
        self.distance = 0.0
        self.samples = 0
        self.restarts = 0
        size = AUGMENTED if p.frequency else MOTION
        self.state: Array = np.zeros(size)
        self.covariance: Array = np.zeros((size, size))
        self._max_gap_us = round(1e6 * p.max_gap_s)
        self._nominal = (p.omega_x_rad_s, p.omega_y_rad_s)
        position_m, velocity_m_s = p.sigmas
        self._noise: Array = np.diag([position_m**2, velocity_m_s**2, position_m**2, velocity_m_s**2])
        self._blind: Array = np.diag(
            [position_m**2, _UNKNOWN_VELOCITY_M_S**2, position_m**2, _UNKNOWN_VELOCITY_M_S**2]
        )
        share = p.epsilon_rad_s if p.form is Form.PROPOSED else 0.0
        self._frequency_covariance: Array = np.diag([share * omega for omega in self._nominal])
        self._axes: Array = np.zeros((2, AXIS))
        self._process: Array = np.zeros((4, 4))
        self._jacobian: Array = np.zeros((2, 2))
        self._work: Array = np.zeros((4, 6 + AUGMENTED))
        self._measured: Array = np.zeros(4)
        self._times: list[int] = []
        self._states: list[Array] = []
        self._covariances: list[Array] = []

    def reset(self) -> None:
        """Forget all samples."""
        self.time_us = None
        self.distance = 0.0
        self._times.clear()
        self._states.clear()
        self._covariances.clear()

    @property
    def off_pattern(self) -> float:
        """Share of the samples that were so far off that the filter restarted: 0 on the pattern, a few per
        cent including the transit there and back, and near 1 when the specified pattern is wrong.
        """
        return self.restarts / self.samples if self.samples else 0.0

    @property
    def omega_rad_s(self) -> tuple[float, float]:
        """The present estimates of the frequencies."""
        if self.parameters.frequency and self.time_us is not None:
            return float(self.state[OMEGA_X]), float(self.state[OMEGA_Y])
        return self._nominal

    def take(self, time_us: int, x: float, vx: float, y: float, vy: float) -> None:
        """Predict to a sample's time and correct by the sample. NaN as velocity means not measured.

        Times must not go back. After a gap longer than `max_gap_s` the sample restarts the filter. Messages
        of a receiver without a fix count as a gap.
        """
        if self.time_us is not None and time_us - self.time_us > self._max_gap_us:
            self.reset()
        self.samples += 1
        measured, noise = self._measured, self._noise
        measured[:] = x, vx, y, vy
        if math.isnan(vx) or math.isnan(vy):
            measured[1] = measured[3] = 0.0
            noise = self._blind
        if self.time_us is None or self.parameters.form is Form.MEASUREMENT:
            self._start(measured, noise)
        else:
            self._predict(self.state, self.covariance, 1e-6 * (time_us - self.time_us))
            if noise is self._blind:  # predictions replace values that were not measured
                measured[1], measured[3] = self.state[1], self.state[3]
            self.distance = correct(self.state, self.covariance, measured, noise, self._work)
            if 0.0 < self.parameters.off_pattern_gate < self.distance:
                self.restarts += 1
                self._start(measured, noise)
            if self.parameters.frequency:
                self._keep_frequencies()
        self.time_us = time_us
        self._remember(time_us)

    def move_origin(self, x: float, y: float) -> None:
        """Move the origin to the place (x, y) of the present frame."""
        for state in (self.state, *self._states):
            state[0] -= x
            state[2] -= y

    def covers(self, time_us: int) -> bool:
        """Whether `at` this time needs no more samples: unfiltered samples are interpolated between two."""
        if self.time_us is None:
            return False
        return self.parameters.form is not Form.MEASUREMENT or self.time_us >= time_us

    def at(self, time_us: int) -> tuple[Array, Array] | None:
        """State and covariance at a time, from the samples up to then; None before the oldest kept sample,
        and later than `max_gap_s` after the newest.

        A filter predicts from the previous sample. Unfiltered samples are interpolated or, after the last
        one, extrapolated at constant velocity.
        """
        found = bisect_right(self._times, time_us) - 1
        if found < 0 or time_us - self._times[found] > self._max_gap_us:
            return None
        state, covariance = self._states[found].copy(), self._covariances[found].copy()
        dt_s = 1e-6 * (time_us - self._times[found])
        if dt_s == 0.0:
            return state, covariance
        if self.parameters.form is not Form.MEASUREMENT:
            self._predict(state, covariance, dt_s)
        elif found + 1 < len(self._times):
            share = 1e6 * dt_s / (self._times[found + 1] - self._times[found])
            state += share * (self._states[found + 1] - state)
            covariance = (1.0 - share) ** 2 * covariance + share**2 * self._covariances[found + 1]
        else:
            moved = np.eye(4)
            moved[0, 1] = moved[2, 3] = dt_s
            state = moved @ state
            covariance = moved @ covariance @ moved.T + self._process_over(dt_s)
        return state, covariance

    def _start(self, measured: Array, noise: Array) -> None:
        self.state[:MOTION] = measured
        self.covariance[:] = 0.0
        self.covariance[:MOTION, :MOTION] = noise
        if self.parameters.frequency:
            self.state[MOTION:] = self._nominal
            self.covariance[MOTION:, MOTION:] = self._frequency_covariance

    def _predict(self, state: Array, covariance: Array, dt_s: float) -> None:
        omega = (state[OMEGA_X], state[OMEGA_Y]) if self.parameters.frequency else self._nominal
        for i in range(2):
            axis(_EXACT, omega[i], dt_s, self._axes[i])
        process = self._process_over(dt_s)
        if self.parameters.frequency:
            gained = self.parameters.frequency_walk_rad2_s3 * dt_s
            predict_augmented(state, covariance, self._axes, process, gained, self._jacobian)
        else:
            predict(state, covariance, self._axes, process, self._frequency_covariance, self._jacobian)

    def _process_over(self, dt_s: float) -> Array:
        """Covariance of position and velocity of both axes from white acceleration over a step."""
        q, process = self.parameters.acceleration_psd_m2_s3, self._process
        for i in (0, 2):
            process[i, i] = q * dt_s**3 / 3.0
            process[i, i + 1] = process[i + 1, i] = q * dt_s**2 / 2.0
            process[i + 1, i + 1] = q * dt_s
        return process

    def _keep_frequencies(self) -> None:
        for i, nominal in enumerate(self._nominal):
            self.state[MOTION + i] = min(
                max(float(self.state[MOTION + i]), _SLOWEST * nominal), _FASTEST * nominal
            )

    def _remember(self, time_us: int) -> None:
        if self._times and self._times[-1] == time_us:
            self._states[-1], self._covariances[-1] = self.state.copy(), self.covariance.copy()
            return
        self._times.append(time_us)
        self._states.append(self.state.copy())
        self._covariances.append(self.covariance.copy())
        oldest_us = time_us - round(1e6 * self.parameters.history_s)
        drop = bisect_right(self._times, oldest_us) - 1  # the one before the oldest is still needed
        if drop > 0:
            del self._times[:drop], self._states[:drop], self._covariances[:drop]
