"""Clusters of weighted points in the plane, by mean shift from the densest places (Comaniciu and Meer 2002).

The paper uses K-means, which needs the number of clusters and a start. Here each cluster is a disc of a fixed
radius around a centre of mass, found where most of the remaining mass is; what lies in it is taken out before
the next one is searched.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.intensity import Cluster
from flightsim.foundation.kernels import kernel

__all__ = ["find_clusters", "inside"]

Array = NDArray[np.float64]

_MOST: Final = 1000
_LEAST_MASS: Final = 0.05
_SHIFTS: Final = 8
_LARGEST_GRID: Final = 400_000


def find_clusters(
    north_m: Array, east_m: Array, mass: Array, *, radius_m: float, least_mass: float = _LEAST_MASS
) -> list[Cluster]:
    """The clusters, the largest mass first.

    Args:
        north_m, east_m, mass: (n,) of each point; masses are not negative.
        radius_m: radius of a cluster.
        least_mass: smaller clusters are left out.
    """
    if not len(mass) or not float(mass.sum()) > least_mass:
        return []
    found = np.empty((_MOST, 6))
    count = _clusters(
        np.ascontiguousarray(north_m),
        np.ascontiguousarray(east_m),
        np.array(mass),
        radius_m,
        least_mass,
        found,
    )
    clusters = [
        Cluster(
            north_m=north,
            east_m=east,
            mass=total,
            width_m=math.sqrt(0.5 * (nn + ee)),
            covariance_m2=(nn, ne, ee),
        )
        for north, east, total, nn, ne, ee in found[:count].tolist()
    ]
    return sorted(clusters, key=lambda cluster: -cluster.mass)


def inside(north_m: Array, east_m: Array, cluster: Cluster, radius_m: float) -> NDArray[np.bool_]:
    """Which points lie in a cluster's disc."""
    found: NDArray[np.bool_] = (
        np.square(north_m - cluster.north_m) + np.square(east_m - cluster.east_m) <= radius_m * radius_m
    )
    return found


@kernel
def _clusters(
    north_m: Array, east_m: Array, mass: Array, radius_m: float, least_mass: float, found: Array
) -> int:
    """Write centre, mass and covariance of each cluster; `mass` is used up. Returns their number."""
    south, west, north, east = north_m[0], east_m[0], north_m[0], east_m[0]
    for i in range(mass.size):
        south, north = min(south, north_m[i]), max(north, north_m[i])
        west, east = min(west, east_m[i]), max(east, east_m[i])
    cell = radius_m
    while ((north - south) / cell + 1.0) * ((east - west) / cell + 1.0) > _LARGEST_GRID:
        cell *= 2.0
    columns = int((east - west) / cell) + 1
    cells = np.zeros((int((north - south) / cell) + 1) * columns)
    cell_of = np.empty(mass.size, dtype=np.int64)
    for i in range(mass.size):
        cell_of[i] = int((north_m[i] - south) / cell) * columns + int((east_m[i] - west) / cell)
        cells[cell_of[i]] += mass[i]
    squared_radius = radius_m * radius_m
    count = 0
    while count < found.shape[0]:
        densest = int(np.argmax(cells))
        if not cells[densest] > 0.25 * least_mass:
            break
        # start: the centre of mass in the densest cell
        total, centre_n, centre_e = 0.0, 0.0, 0.0
        for i in range(mass.size):
            if cell_of[i] == densest and mass[i] > 0.0:
                total += mass[i]
                centre_n += mass[i] * north_m[i]
                centre_e += mass[i] * east_m[i]
        if not total > 0.0:
            cells[densest] = 0.0
            continue
        centre_n, centre_e = centre_n / total, centre_e / total
        for _ in range(_SHIFTS):
            total, sum_n, sum_e = 0.0, 0.0, 0.0
            for i in range(mass.size):
                n, e = north_m[i] - centre_n, east_m[i] - centre_e
                if n * n + e * e <= squared_radius:
                    total += mass[i]
                    sum_n += mass[i] * n
                    sum_e += mass[i] * e
            if not total > 0.0:
                break
            centre_n, centre_e = centre_n + sum_n / total, centre_e + sum_e / total
            if sum_n * sum_n + sum_e * sum_e < 1e-8 * total * total:
                break
        total, sum_n, sum_e, nn, ne, ee = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(mass.size):
            n, e = north_m[i] - centre_n, east_m[i] - centre_e
            if mass[i] > 0.0 and n * n + e * e <= squared_radius:
                total += mass[i]
                sum_n += mass[i] * n
                sum_e += mass[i] * e
                nn += mass[i] * n * n
                ne += mass[i] * n * e
                ee += mass[i] * e * e
                cells[cell_of[i]] -= mass[i]
                mass[i] = 0.0
        if not total > 0.0:
            cells[densest] = 0.0
            continue
        if total >= least_mass:
            mean_n, mean_e = sum_n / total, sum_e / total
            found[count, 0], found[count, 1], found[count, 2] = centre_n + mean_n, centre_e + mean_e, total
            found[count, 3] = nn / total - mean_n * mean_n
            found[count, 4] = ne / total - mean_n * mean_e
            found[count, 5] = ee / total - mean_e * mean_e
            count += 1
    return count
