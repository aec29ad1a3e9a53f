"""The setting of the localisation study, from Steckenrider, Leamy and Furukawa 2020.

It contains the values of their Tables II, III and V, their results (Table IV), and values that are chosen
here because the text does not specify them.

All values are unitless, as in the paper. The state is (x, x', y, y').
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.lissajous.model import Discretisation
from missions.studies.lissajous_run import AUGMENTED, FILTERED, UNFILTERED

Array = NDArray[np.float64]

DT: Final = 0.05
STEPS: Final = 400
OMEGA_X: Final = 0.5 * math.pi
DELTAS: Final = (0.5, 0.75, 1.4, 2.3, 3.0)
SAMPLE_CELL: Final = (0.01, 1.4)
"""Epsilon and delta of the paper's figures 6 and 7."""

START: Final[Array] = np.array([[100.0, 0.0, 0.0, 100.0], [-100.0, 0.0, 0.0, 100.0]])
START_COVARIANCE: Final[Array] = np.array(
    [
        [[2.0, -0.9, -0.5, 1.0], [-0.9, 3.2, 0.4, -0.9], [-0.5, 0.4, 2.3, 0.8], [1.0, -0.9, 0.8, 3.8]],
        [[2.4, -1.1, -0.4, 0.8], [-1.1, 2.9, 0.8, -0.7], [-0.4, 0.8, 2.2, 0.8], [0.8, -0.7, 0.8, 3.4]],
    ]
)
PROCESS: Final[Array] = 0.005 * np.array(
    [
        [
            [0.16, 0.03, 0.07, -0.11],
            [0.03, 0.21, -0.09, -0.12],
            [0.07, -0.09, 0.19, 0.03],
            [-0.11, -0.12, 0.03, 0.32],
        ],
        [
            [0.13, 0.04, 0.09, -0.08],
            [0.04, 0.24, -0.11, -0.09],
            [0.09, -0.11, 0.18, 0.03],
            [-0.08, -0.09, 0.03, 0.29],
        ],
    ]
)
SENSOR: Final[Array] = 5.0 * np.array(
    [
        [
            [0.2, 0.1, -0.06, 0.13],
            [0.1, 0.4, 0.04, -0.11],
            [-0.06, 0.04, 0.6, 0.19],
            [0.13, -0.11, 0.19, 0.9],
        ],
        [
            [0.22, 0.09, -0.07, 0.12],
            [0.09, 0.43, 0.07, -0.15],
            [-0.07, 0.07, 0.54, 0.16],
            [0.12, -0.15, 0.16, 1.1],
        ],
    ]
)
SIGHT: Final[Array] = 0.1 * np.array([[[0.28, 0.12], [0.12, 0.31]], [[0.33, -0.14], [-0.14, 0.26]]])

TARGET_CENTRE: Final = (50.0, 50.0)
TARGET_RADIUS: Final = 100.0
TARGET_PERIOD: Final = 20.0
"""The paper specifies only a circle. Table IV depends on its mean distance, about 135."""


class Equations(StrEnum):
    """Readings of the paper's equations."""

    CORRECTED = "corrected"
    """17 with (w dt)^2 / 2, 25a with -dt^2, 28 and 29 in their correct form."""
    SIGN_AS_PRINTED = "sign as printed"
    """As corrected, except for the sign in 25a: the reading that gives the paper's Table IV."""
    AS_PRINTED = "as printed"
    """17 and 25a as printed, also 17 in the truth. 28 and 29 are still corrected."""


READINGS: Final[Mapping[str, tuple[Equations, ...]]] = MappingProxyType(
    {
        "both": tuple(Equations),
        "corrected": (Equations.CORRECTED,),
        "printed": (Equations.SIGN_AS_PRINTED, Equations.AS_PRINTED),
    }
)
"""The readings of the equations by the name of the choice."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One estimator of a table.

    Attributes:
        name: N, K, P as in the paper, and F for the frequencies as states.
        kind: kind in `lissajous_run`.
        form: computation of the filter's matrix.
        with_frequency: whether it takes the uncertainty of the frequencies into account.
    """

    name: str
    kind: int
    form: Discretisation
    with_frequency: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """Estimators that process the same flights.

    Attributes:
        equations: reading of the equations in the block's P.
        truth: computation of the drones' true motion.
        columns: the estimators.
    """

    equations: Equations
    truth: Discretisation
    columns: tuple[Column, ...]


def block_of(equations: Equations) -> Block:
    """The estimators of one reading of the equations."""
    form = {
        Equations.CORRECTED: Discretisation.SERIES,
        Equations.SIGN_AS_PRINTED: Discretisation.PRINTED_SIGN,
        Equations.AS_PRINTED: Discretisation.PRINTED,
    }[equations]
    truth = Discretisation.PRINTED if equations is Equations.AS_PRINTED else Discretisation.SERIES
    columns = [
        Column(name="N", kind=UNFILTERED, form=truth, with_frequency=False),
        Column(name="K", kind=FILTERED, form=truth, with_frequency=False),
        Column(name="P", kind=FILTERED, form=form, with_frequency=True),
    ]
    if equations is Equations.CORRECTED:
        columns.append(Column(name="F", kind=AUGMENTED, form=form, with_frequency=True))
    return Block(equations=equations, truth=truth, columns=tuple(columns))


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperCell:
    """A cell of Table IV: median errors, and the per cent of runs that each estimator won."""

    n_rmse: float
    k_rmse: float
    p_rmse: float
    n_wins: float
    k_wins: float
    p_wins: float


def _paper(*values: float) -> PaperCell:
    n, k, p, n_wins, k_wins, p_wins = values
    return PaperCell(n_rmse=n, k_rmse=k, p_rmse=p, n_wins=n_wins, k_wins=k_wins, p_wins=p_wins)


PAPER: Final[Mapping[tuple[float, float], PaperCell]] = MappingProxyType(
    {
        (0.0, 0.5): _paper(2.7892, 0.2480, 0.2480, 0.2, 99.8, 99.8),
        (0.0, 0.75): _paper(1.8666, 0.2275, 0.2275, 0.3, 99.7, 99.7),
        (0.0, 1.4): _paper(1.1671, 0.2051, 0.2051, 0.0, 100.0, 100.0),
        (0.0, 2.3): _paper(1.2182, 0.2043, 0.2043, 0.0, 100.0, 100.0),
        (0.0, 3.0): _paper(1.1329, 0.1956, 0.1956, 0.0, 100.0, 100.0),
        (0.001, 0.5): _paper(1.2714, 5.3058, 0.7088, 5.4, 0.0, 94.6),
        (0.001, 0.75): _paper(1.2150, 4.6408, 0.6231, 3.9, 0.2, 95.9),
        (0.001, 1.4): _paper(1.1624, 4.0372, 0.5808, 2.9, 0.0, 97.1),
        (0.001, 2.3): _paper(1.1723, 3.4974, 0.5303, 0.4, 0.0, 99.6),
        (0.001, 3.0): _paper(1.1350, 3.2499, 0.4870, 0.6, 0.0, 99.4),
        (0.01, 0.5): _paper(1.2869, 17.2581, 0.8359, 6.7, 0.0, 93.3),
        (0.01, 0.75): _paper(1.2112, 15.2444, 0.7737, 6.8, 0.0, 93.2),
        (0.01, 1.4): _paper(1.1817, 14.3683, 0.7764, 7.3, 0.0, 92.7),
        (0.01, 2.3): _paper(1.1909, 11.7647, 0.7685, 6.7, 0.0, 93.3),
        (0.01, 3.0): _paper(1.1698, 11.3988, 0.7339, 5.9, 0.0, 94.1),
        (0.1, 0.5): _paper(1.3145, 51.9602, 1.7753, 73.8, 0.0, 26.2),
        (0.1, 0.75): _paper(1.2452, 44.5980, 1.8362, 79.8, 0.0, 20.2),
        (0.1, 1.4): _paper(1.1960, 40.3666, 1.7573, 81.0, 0.0, 19.0),
        (0.1, 2.3): _paper(1.2031, 36.1307, 1.7633, 80.7, 0.0, 19.3),
        (0.1, 3.0): _paper(1.2014, 36.0664, 1.7099, 79.4, 0.0, 20.6),
    }
)
"""Table IV by (epsilon, delta)."""

CELLS: Final = tuple(PAPER)


def nominal_omega(delta: float) -> Array:
    """Frequencies (drones, 2) of Table II."""
    return np.array([[OMEGA_X, delta * OMEGA_X]] * 2)


def frequency_variance(epsilon: float, delta: float) -> Array:
    """Variances (drones, 2). Their row of Table II is missing in the text; epsilon times the frequency is the
    reading that gives Table IV.
    """
    variance: Array = epsilon * nominal_omega(delta)
    return variance


def target_places() -> Array:
    """The target's positions (STEPS, 2)."""
    angle = math.tau / TARGET_PERIOD * DT * np.arange(1, STEPS + 1)
    x, y = TARGET_CENTRE
    return np.stack((x + TARGET_RADIUS * np.cos(angle), y + TARGET_RADIUS * np.sin(angle)), axis=1)
