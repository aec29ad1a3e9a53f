"""Roll commands that lead into a circle around a moving point and keep it there (Tolman et al. 2021, IV-A).

Everything is relative: p is the horizontal offset to the target, v = -dp/dt the velocity of the aircraft
against it. The angle from v to p, chi = atan2((v x p)_3, v . p), is +90 deg with the target abeam to the
right (the paper's formula for it, with norms, loses the sign). Equation 35 requires

    chi_d = lambda (pi/2 - atan(k_o (rho - rho_d))),

so far away the aircraft flies straight to the target, and on the circle the target is abeam. The paper
commands phi = phi_ff + k_p e + k_d de/dt, e = chi - chi_d, with phi_ff of the circle. Here the same terms are
written as a turn rate of v:

    omega = d(bearing)/dt - d(chi_d)/dt + k e,

whose feed-forward equals the circle's on the circle and is also correct elsewhere, so that de/dt = -k e
everywhere; the derivative terms come from the estimated velocity, not from differences of noisy angles. Bank
makes the turn: v omega = g tan(phi) cos(crab). Crab is the angle between heading and v, since lift acts
across the heading and not across v. In wind v changes along the circle, and the bank changes with it. The
bank contains v^2 / (g rho) where the paper prints v / (g rho). docs/papers.md lists these corrections.
"""

import math
from dataclasses import dataclass
from typing import Final

from estimators.orbit_target.relative_target import RelativeState
from flightsim.foundation.atmosphere import GRAVITY_M_S2

_LEAST_SPEED_M_S: Final = 1.0
_LEAST_COS_CRAB: Final = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class OrbitParameters:
    """The circle and the gains.

    Attributes:
        radius_m: horizontal radius around the target.
        direction: +1 clockwise seen from above, -1 counter-clockwise (the paper's lambda).
        approach_gain: k_o times the radius; a larger gain corrects an error of the radius more steeply.
        turn_gain_per_s: k, 1/s.
        bank_max_rad: largest commanded bank.
        bank_rate_max_rad_s: largest rate of the commanded bank.
    """

    radius_m: float
    direction: int = 1
    approach_gain: float = 2.0
    turn_gain_per_s: float = 0.7
    bank_max_rad: float = math.radians(45.0)
    bank_rate_max_rad_s: float = math.radians(60.0)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.radius_m) and self.radius_m > 0.0):
            raise ValueError(f"an orbit of radius {self.radius_m} m is not possible; ask for more than 0 m")
        if self.direction not in (-1, 1):
            raise ValueError(f"direction {self.direction} is not 1 (clockwise) or -1 (counter-clockwise)")
        if not 0.0 < self.bank_max_rad < 0.5 * math.pi:
            raise ValueError(f"a bank limit of {math.degrees(self.bank_max_rad):g} degrees is not in 0..90")
        for name in ("approach_gain", "turn_gain_per_s", "bank_rate_max_rad_s"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} = {getattr(self, name)} is not possible; it must be more than 0")


@dataclass(frozen=True, slots=True, kw_only=True)
class OrbitCommand:
    """The guidance's command for an estimate.

    Attributes:
        roll_rad: commanded roll.
        radius_m: estimated distance to the target.
        radius_error_m: positive outside the commanded radius.
        chi_error_rad: e.
    """

    roll_rad: float
    radius_m: float
    radius_error_m: float
    chi_error_rad: float


def bearing_off_velocity_rad(velocity_ne_m_s: tuple[float, float], offset_ne_m: tuple[float, float]) -> float:
    """chi: angle from the velocity to the direction of the target, positive to the right, -pi..pi."""
    (vn, ve), (pn, pe) = velocity_ne_m_s, offset_ne_m
    return math.atan2(vn * pe - ve * pn, vn * pn + ve * pe)


class OrbitGuidance:
    """Computes roll commands from relative states.

    Args:
        parameters: circle and gains.
    """

    def __init__(self, parameters: OrbitParameters) -> None:
        self.parameters = parameters
        self._roll_rad: float | None = None
        self._time_us = 0

    def command(self, state: RelativeState, heading_rad: float, roll_rad: float) -> OrbitCommand:
        """The roll command for the present state.

        Args:
            state: state of the target relative to the aircraft.
            heading_rad: heading of the aircraft.
            roll_rad: present bank, from which the command starts.
        """
        p = self.parameters
        velocity = (-state.offset_rate_ne_m_s[0], -state.offset_rate_ne_m_s[1])
        speed = max(_LEAST_SPEED_M_S, math.hypot(*velocity))
        rho = math.hypot(*state.offset_ne_m)
        chi = bearing_off_velocity_rad(velocity, state.offset_ne_m)
        k_o = p.approach_gain / p.radius_m
        excess = k_o * (rho - p.radius_m)
        chi_d = p.direction * (0.5 * math.pi - math.atan(excess))
        error = math.remainder(chi - chi_d, math.tau)
        # inside the circle the bearing turns fast: limited to the rate on a circle of half the radius
        bearing_rate = speed * math.sin(chi) / max(rho, 0.5 * p.radius_m)
        closing = speed * math.cos(chi)
        chi_d_rate = p.direction * k_o * closing / (1.0 + excess * excess)
        turn_rate = bearing_rate - chi_d_rate + p.turn_gain_per_s * error
        crab = math.remainder(math.atan2(velocity[1], velocity[0]) - heading_rad, math.tau)
        wanted = math.atan(speed * turn_rate / (GRAVITY_M_S2 * max(_LEAST_COS_CRAB, math.cos(crab))))
        return OrbitCommand(
            roll_rad=self._limited(wanted, roll_rad, state.time_us),
            radius_m=rho,
            radius_error_m=rho - p.radius_m,
            chi_error_rad=error,
        )

    def _limited(self, wanted_rad: float, roll_rad: float, time_us: int) -> float:
        p = self.parameters
        before = roll_rad if self._roll_rad is None else self._roll_rad
        dt = 0.02 if self._roll_rad is None else min(0.5, max(0.0, (time_us - self._time_us) * 1e-6))
        step = p.bank_rate_max_rad_s * dt
        limited = max(-p.bank_max_rad, min(p.bank_max_rad, wanted_rad))
        self._roll_rad = max(before - step, min(before + step, limited))
        self._time_us = time_us
        return self._roll_rad
