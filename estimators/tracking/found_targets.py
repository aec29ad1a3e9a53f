"""Targets that count as found: their places, and what all scans of a vehicle have in common.

A found target is measured again and again. Measurements that err in the same way, by a range that is too long
or a heading that is biased, are of the same place only when they are taken from the same side; and a target
that does not stay leaves the place where it was found. So the places of all found targets and the biases of
each vehicle's sensor are the states of one linear filter (the stochastic map of Smith, Self and Cheeseman
1990), and how far targets walk is a hypothesis: one filter for each level of `WALKS`, weighted by what it
predicts (static multiple models, Bar-Shalom, Li and Kirubarajan 2001, section 11.6). A measurement may
belong to something else; it is used in proportion to the probability that it does not (probabilistic data
association, Bar-Shalom and Tse 1975).
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.intensity import Cluster
from estimators.tracking.range_bearing import RangeBearingSensor, Viewpoint

__all__ = ["WALKS", "FoundTargets"]

Array = NDArray[np.float64]

WALKS: Final = (1.0, 2.0, 4.0, 10.0)
"""Levels of the walk, over what is stated."""
_PRIORS: Final = (0.5, 0.25, 0.15, 0.1)
_OTHER: Final = 0.1  # probability that the nearest measurement is of something else
_OTHER_M: Final = 4.0  # radius of the disc over which that one is uniform


class FoundTargets:
    """The found targets, in the order in which they were found.

    Args:
        sensor: what is known about it; its noise is independent from scan to scan.
        walk_m_sqrt_s: stated walk of a target, per axis, after one second.
        place_sigma_m: of the vehicle.
        range_bias_m, bearing_bias_rad: standard deviations of a sensor's biases; 0: it has none.
    """

    def __init__(
        self,
        sensor: RangeBearingSensor,
        *,
        walk_m_sqrt_s: float,
        place_sigma_m: float,
        range_bias_m: float,
        bearing_bias_rad: float,
    ) -> None:
        self._sensor = sensor
        self._walks_m2_s = (walk_m_sqrt_s * np.array(WALKS)) ** 2
        self._place_m2 = place_sigma_m**2
        self._bias_variances = np.array([range_bias_m**2, bearing_bias_rad**2])
        self._log_levels: Array = np.log(_PRIORS)
        self._means: Array = np.zeros((len(WALKS), 0))
        self._covariances: Array = np.zeros((len(WALKS), 0, 0))
        self._sensors: dict[int, int] = {}  # first state of the biases, by vehicle
        self._targets: list[int] = []  # first state of each target

    def __len__(self) -> int:
        return len(self._targets)

    @property
    def levels(self) -> Array:
        """Probability of each level of the walk."""
        weights = np.exp(self._log_levels - self._log_levels.max())
        return np.asarray(weights / weights.sum(), dtype=np.float64)

    @property
    def walk_m_sqrt_s(self) -> float:
        """Most probable walk of the targets."""
        return math.sqrt(float(self._walks_m2_s[int(np.argmax(self._log_levels))]))

    def predict(self, dt_s: float) -> None:
        """Let the targets walk for a time."""
        for first in self._targets:
            for state in (first, first + 1):
                self._covariances[:, state, state] += self._walks_m2_s * dt_s

    def places(self) -> tuple[Array, Array]:
        """Means (n, 2), north and east, and covariances (n, 2, 2) over the levels."""
        mean, covariance = self._moments()
        own = self._own_states()
        return mean[own], covariance[own[:, :, None], own[:, None, :]]

    def distances(self, scan: Array, viewpoint: Viewpoint, vehicle: int) -> Array:
        """Squared distances (n, m) of measurements (m, 2) from where each target is expected in the scan, in
        standard deviations. A bias that both share with the place is no distance.
        """
        mean, covariance = self._moments()
        own, expected = self._own_states(), self.bias(vehicle)
        scan = scan - expected
        places = self._sensor.places(scan, viewpoint)
        noise = self._sensor.covariances(scan, viewpoint)
        spread = covariance[own[:, :, None], own[:, None, :]][:, None] + noise
        first = self._sensors.get(vehicle)
        if first is not None:
            bias = slice(first, first + 2)
            by_bias = np.array([_bias_derivative(place, viewpoint) for place in places]).reshape(-1, 2, 2)
            shared = np.einsum("mij,njk->nmik", by_bias, covariance[bias][:, own].transpose(1, 0, 2))
            spread = spread + shared + np.swapaxes(shared, 2, 3)
            spread = spread + by_bias @ covariance[bias, bias] @ np.swapaxes(by_bias, 1, 2)
        off = places[None] - mean[own][:, None]
        found: Array = np.einsum("nmi,nmij,nmj->nm", off, np.linalg.inv(spread), off)
        return found

    def _moments(self) -> tuple[Array, Array]:
        """Mean and covariance of all states over the levels."""
        levels = self.levels
        mean = levels @ self._means
        off = self._means - mean
        return mean, np.einsum("l,lij->ij", levels, self._covariances) + (off.T * levels) @ off

    def _own_states(self) -> NDArray[np.intp]:
        """(n, 2) states of each target."""
        return np.array([(first, first + 1) for first in self._targets], dtype=np.intp).reshape(-1, 2)

    def bias(self, vehicle: int) -> Array:
        """(2,) range and bearing by which a vehicle's measurements are expected to be too large."""
        first = self._sensors.get(vehicle)
        if first is None:
            return np.zeros(2)
        return np.asarray(self.levels @ self._means[:, first : first + 2], dtype=np.float64)

    def add(self, cluster: Cluster, viewpoint: Viewpoint, vehicle: int) -> None:
        """A target is found.

        Args:
            cluster: it, by measurements less the vehicle's expected bias, as if that were certain.
            viewpoint: from which it was measured last.
            vehicle: that measured it.
        """
        bias = self._bias_states(vehicle)
        place = np.array([cluster.north_m, cluster.east_m])
        nn, ne, ee = cluster.covariance_m2
        by_bias = -_bias_derivative(place, viewpoint)
        own = np.array([[nn, ne], [ne, ee]])
        of_bias = np.einsum("ij,ljk->lik", by_bias, self._covariances[:, bias, :])
        first = self._grown()
        new = slice(first, first + 2)
        self._means[:, new] = place + (self._means[:, bias] - self.bias(vehicle)) @ by_bias.T
        self._covariances[:, new, :first] = of_bias
        self._covariances[:, :first, new] = np.swapaxes(of_bias, 1, 2)
        self._covariances[:, new, new] = own + np.einsum("lij,kj->lik", of_bias[:, :, bias], by_bias)
        self._targets.append(first)

    def take(self, number: int, measured: Array, viewpoint: Viewpoint, vehicle: int) -> None:
        """Use a measurement that is probably of a found target.

        Args:
            number: of the target.
            measured: (2,) range and bearing from the nose.
            viewpoint: of the scan.
            vehicle: whose sensor measured.
        """
        bias, first = self._bias_states(vehicle), self._targets[number]
        size = self._means.shape[1]
        corrected = measured - self.bias(vehicle)
        scan = corrected[None]
        place = self._sensor.places(scan, viewpoint)[0]
        noise = self._sensor.covariances(scan, viewpoint)[0] + self._place_m2 * np.eye(2)
        h = np.zeros((2, size))
        h[:, first : first + 2] = np.eye(2)
        h[:, bias] = _bias_derivative(place, viewpoint)
        expected = self._means @ h.T - h[:, bias] @ self.bias(vehicle)
        off = place - expected
        ph = self._covariances @ h.T
        spread = h @ ph + noise
        inverse = np.linalg.inv(spread)
        gains = ph @ inverse
        distance = np.einsum("li,lij,lj->l", off, inverse, off)
        fits = (1.0 - _OTHER) * np.exp(-0.5 * distance) * np.sqrt(np.linalg.det(inverse)) / math.tau
        density = fits + _OTHER / (math.pi * _OTHER_M**2)
        share = (fits / density)[:, None, None]
        self._log_levels = self._log_levels + np.log(density)
        moved = np.einsum("lij,lj->li", gains, off)
        self._means = self._means + share[:, 0] * moved
        self._covariances = (
            self._covariances
            - share * (gains @ spread @ np.swapaxes(gains, 1, 2))
            + share * (1.0 - share) * moved[:, :, None] * moved[:, None, :]
        )

    def _bias_states(self, vehicle: int) -> slice:
        """The states of a vehicle's biases; new ones are known as stated."""
        if vehicle not in self._sensors:
            first = self._grown()
            self._sensors[vehicle] = first
            self._covariances[:, [first, first + 1], [first, first + 1]] = self._bias_variances
        first = self._sensors[vehicle]
        return slice(first, first + 2)

    def _grown(self) -> int:
        """The first of two new states, zero so far."""
        size = self._means.shape[1]
        self._means = np.pad(self._means, ((0, 0), (0, 2)))
        self._covariances = np.pad(self._covariances, ((0, 0), (0, 2), (0, 2)))
        return size


def _bias_derivative(place: Array, viewpoint: Viewpoint) -> Array:
    """(2, 2) derivative of a measured place by the biases of range and bearing."""
    off_n, off_e = place[0] - viewpoint.north_m, place[1] - viewpoint.east_m
    range_m = math.hypot(off_n, off_e)
    cosine, sine = (off_n / range_m, off_e / range_m) if range_m > 0.0 else (1.0, 0.0)
    return np.array([[cosine, -off_e], [sine, off_n]])
