"""The magnetic field that an aircraft makes at its own magnetometer (Tolles and Lawson).

Three parts change the magnitude of the field: remanence of the airframe (permanent), magnetization by the
Earth's field (induced), and eddy currents in moving conductors:

    dB = sum p_i u_i + B sum a_ij u_i u_j + B sum b_ij u_i du_j/dt

with the direction cosines u of the Earth's field in the body frame (Leliak 1961, "Identification and
evaluation of magnetic-field sources of magnetic airborne detector equipped aircraft", IRE Transactions on
Aerospace and Navigational Electronics 8).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import NotNegative
from flightsim.foundation.options import Options

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleFieldParameters(Options):
    """Size of an aircraft's field at its magnetometer, one sigma of each coefficient. The defaults are those
    of a small aircraft with the sensor on a wing tip, before compensation.

    Attributes:
        permanent_nt: of each axis.
        induced: of each product of two axes, relative to the Earth's field.
        eddy_s: of each product of an axis and the rate of another.
    """

    permanent_nt: NotNegative = 12.0
    induced: NotNegative = 1.5e-4
    eddy_s: NotNegative = 3e-5


class VehicleField:
    """One aircraft's field; its coefficients are drawn once.

    Args:
        parameters: their sizes.
        rng: random numbers.
    """

    def __init__(self, parameters: VehicleFieldParameters, rng: np.random.Generator) -> None:
        self._permanent_nt: Array = parameters.permanent_nt * rng.standard_normal(3)
        induced = parameters.induced * rng.standard_normal((3, 3))
        self._induced: Array = 0.5 * (induced + induced.T)
        self._eddy_s: Array = parameters.eddy_s * rng.standard_normal((3, 3))

    def total_nt(self, direction_frd: Array, rates_frd_rad_s: Array, strength_nt: float) -> float:
        """What it adds to the magnitude of the field.

        Args:
            direction_frd: (3,) unit vector of the Earth's field in the body frame.
            rates_frd_rad_s: (3,) angular rates of the body.
            strength_nt: magnitude of the Earth's field.
        """
        u = direction_frd
        # the field stands still, the body turns: du/dt = u x w
        change = np.cross(u, rates_frd_rad_s)
        return float(
            self._permanent_nt @ u + strength_nt * (u @ self._induced @ u + u @ self._eddy_s @ change)
        )
