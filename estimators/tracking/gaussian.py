"""Gaussian beliefs: the update of an (extended) Kalman filter in Joseph form.

Reference: Bar-Shalom, Li and Kirubarajan 2001, Estimation with Applications to Tracking and Navigation,
sections 5.2 and 10.3.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Innovation:
    """A measurement compared with its prediction.

    Attributes:
        residual: (m,) measurement minus prediction.
        jacobian: (m, n) derivative of the prediction by the state.
        covariance: (m, m) covariance of the residual: of the prediction and of the measurement together.
        inverse: (m, m) inverse of that covariance.
    """

    residual: Array
    jacobian: Array
    covariance: Array
    inverse: Array

    @property
    def distance_squared(self) -> float:
        """Normalized innovation squared (squared Mahalanobis distance)."""
        return float(self.residual @ self.inverse @ self.residual)


class Gaussian:
    """Mean and covariance of a state.

    Args:
        size: number of states.

    Attributes:
        mean: (size,).
        covariance: (size, size).
    """

    def __init__(self, size: int) -> None:
        self.mean: Array = np.zeros(size)
        self.covariance: Array = np.zeros((size, size))
        self._unit: Array = np.eye(size)

    def predict(self, transition: Array, noise: Array) -> None:
        """Propagate the covariance; the mean is moved by the motion model.

        Args:
            transition: (size, size) derivative of the new state by the old one.
            noise: (size,) variances that the motion adds.
        """
        self.covariance[:] = transition @ self.covariance @ transition.T
        self.covariance[np.diag_indices_from(self.covariance)] += noise

    def innovation(self, residual: Array, jacobian: Array, noise: Array) -> Innovation:
        """Compare a measurement with the belief.

        Args:
            residual: (m,) measurement minus prediction, angles wrapped.
            jacobian: (m, size).
            noise: (m, m) covariance of the measurement.
        """
        covariance = jacobian @ self.covariance @ jacobian.T + noise
        inverse: Array = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
        return Innovation(residual=residual, jacobian=jacobian, covariance=covariance, inverse=inverse)

    def update(self, seen: Innovation) -> None:
        """Fuse a measurement; the Joseph form keeps the covariance symmetric and positive."""
        h = seen.jacobian
        gain = self.covariance @ h.T @ seen.inverse
        self.mean += gain @ seen.residual
        left = self._unit - gain @ h
        noise = seen.covariance - h @ self.covariance @ h.T
        self.covariance[:] = left @ self.covariance @ left.T + gain @ noise @ gain.T
