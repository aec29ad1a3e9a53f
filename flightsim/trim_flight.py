"""Trim of a fixed-wing aircraft: attitude and commands of steady straight or turning flight."""

import math
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.airframe import Airframe, Role
from flightsim.environment import Environment
from flightsim.flight_trim import FlightTrim, flight_pitch_rad, flight_state
from flightsim.home import Home
from flightsim.interface import AILERON, ELEVATOR, MAX_ACTUATORS, RUDDER, THROTTLE
from flightsim.wind_tunnel import WindTunnel

__all__ = ["FlightTrim", "TrimError", "trim_flight", "trim_in_tunnel"]

Array = NDArray[np.float64]

_G_M_S2: Final = 9.81
_TOLERANCE: Final = 2e-4  # m/s2 and rad/s2
_DELTAS: Final = (1e-3, 1e-3, 1e-2, 1e-2, 1e-2, 1e-2)
_SLOW_CONVERGENCE: Final = 0.3  # a new Jacobian when an iteration leaves more than that of the residual
_STEP_LIMIT: Final = 0.15
_FIRST_ALPHAS_RAD: Final = (0.05, 0.15, -0.05)
"""Angles of attack at which the iteration begins without a flight nearby, in the order of the tries."""
_ALPHA_MIN_RAD: Final = math.radians(-20.0)
_ALPHA_MAX_RAD: Final = math.radians(40.0)


AIRSPEEDS_M_S: Final = (1.0, 500.0)
"""Airspeeds at which a flight can be trimmed."""


class TrimError(ArithmeticError):
    """The model cannot fly steadily under the given conditions."""


def trim_flight(
    model: str | Path | Airframe,
    *,
    airspeed_m_s: float,
    climb_angle_rad: float = 0.0,
    turn_radius_m: float | None = None,
    bank_rad: float | None = None,
    throttle: float | None = None,
    home: Home | None = None,
    environment: Environment | None = None,
    height_m: float = 100.0,
) -> FlightTrim:
    """Solve for zero accelerations of the whole JSBSim model in steady flight without sideslip.

    A Newton iteration with a Jacobian by differences over angle of attack, bank, surfaces and throttle; each
    evaluation holds the aircraft in its state until actuators and engines have settled.

    Args:
        model: as for `Vehicle`.
        airspeed_m_s: true airspeed.
        climb_angle_rad: of the path; not with `throttle`.
        turn_radius_m: of the circle over ground in still air, positive to the right; None flies straight.
        bank_rad: instead of the radius.
        throttle: flown with this throttle, climbing or sinking as it will; gliders with 0.
        home, environment, height_m: place and temperature, as for `WindTunnel`.

    Raises:
        AirframeError: no fixed wing, or no usable model.
        TrimError: no such flight exists; the message gives the reason.
        ValueError: arguments that contradict each other.
    """
    tunnel = WindTunnel(model, home=home, environment=environment, height_m=height_m)
    return trim_in_tunnel(
        tunnel,
        airspeed_m_s=airspeed_m_s,
        climb_angle_rad=climb_angle_rad,
        turn_radius_m=turn_radius_m,
        bank_rad=bank_rad,
        throttle=throttle,
    )


def trim_in_tunnel(
    tunnel: WindTunnel,
    *,
    airspeed_m_s: float,
    climb_angle_rad: float = 0.0,
    turn_radius_m: float | None = None,
    bank_rad: float | None = None,
    throttle: float | None = None,
    near: FlightTrim | None = None,
    iterations: int = 25,
) -> FlightTrim:
    """As `trim_flight`, in a tunnel that is there already, starting from a flight `near` the wanted one."""
    slowest, fastest = AIRSPEEDS_M_S
    if not slowest <= airspeed_m_s <= fastest:
        raise ValueError(f"airspeed {airspeed_m_s} m/s is not in {slowest:g}..{fastest:g} m/s")
    if turn_radius_m is not None and bank_rad is not None:
        raise ValueError("give the turn's radius or its bank, not both")
    if turn_radius_m is not None and not abs(turn_radius_m) >= 1.0:
        raise ValueError(f"turn radius {turn_radius_m} m is less than 1 m")
    if bank_rad is not None and not abs(bank_rad) <= 1.4:
        raise ValueError(f"bank {bank_rad} rad is not in -1.4..1.4 rad")
    if throttle is None and not tunnel.powered:
        throttle = 0.0
    problem = _Problem(
        tunnel,
        airspeed_m_s,
        climb_angle_rad,
        turn_radius_m,
        bank_rad,
        throttle if throttle is not None else None,
    )
    if near is not None:
        return problem.solve(problem.first_guess(near), iterations)
    refused: TrimError | None = None
    for alpha_rad in _FIRST_ALPHAS_RAD:
        try:
            return problem.solve(problem.first_guess(None, alpha_rad), iterations)
        except TrimError as error:
            refused = refused or error
    assert refused is not None
    raise refused


class _Problem:
    """Unknowns of one trim and the accelerations that the wind tunnel gives for them.

    Unknowns: angle of attack, bank (or rate of turn, where the bank is given), aileron, elevator, rudder (or
    sideslip, for an aircraft without), throttle (or climb angle, where the throttle is given).
    """

    def __init__(
        self,
        tunnel: WindTunnel,
        airspeed_m_s: float,
        climb_angle_rad: float,
        turn_radius_m: float | None,
        bank_rad: float | None,
        throttle: float | None,
    ) -> None:
        self.tunnel = tunnel
        self.airspeed_m_s = airspeed_m_s
        self.climb_angle_rad = climb_angle_rad
        self.turn_radius_m = turn_radius_m
        self.bank_rad = bank_rad
        self.throttle = throttle
        self.has_rudder = Role.RUDDER in tunnel.actuators.roles
        self.low = np.array([_ALPHA_MIN_RAD, -1.5, -1.0, -1.0, -1.0, 0.0 if throttle is None else -1.2])
        self.high = np.array([_ALPHA_MAX_RAD, 1.5, 1.0, 1.0, 1.0, 1.0 if throttle is None else 1.2])

    def first_guess(self, near: FlightTrim | None, alpha: float = 0.0) -> Array:
        """Where the iteration begins: a flight that is known, or level at an angle of attack."""
        rate = 0.0
        bank = self.bank_rad or 0.0
        if self.turn_radius_m is not None:
            rate = self.airspeed_m_s / self.turn_radius_m
            bank = math.atan(rate * self.airspeed_m_s / _G_M_S2)
        elif bank:
            rate = _G_M_S2 * math.tan(bank) / self.airspeed_m_s
        aileron, elevator, rudder = 0.0, 0.0, 0.0
        last = 0.5 if self.throttle is None else -0.05
        if near is not None:
            alpha, aileron, elevator = near.angle_of_attack_rad, near.aileron, near.elevator
            rudder = near.rudder if self.has_rudder else near.sideslip_rad
            last = near.throttle if self.throttle is None else near.climb_angle_rad
        return np.array([alpha, bank if self.bank_rad is None else rate, aileron, elevator, rudder, last])

    def parts(self, unknowns: Array) -> tuple[float, float, float, float, float, tuple[float, ...]]:
        """Angle of attack, sideslip, bank, climb angle, rate of turn and commands of the unknowns."""
        alpha, second, aileron, elevator, fifth, last = unknowns.tolist()
        climb = self.climb_angle_rad if self.throttle is None else last
        bank, rate = second, 0.0
        if self.bank_rad is not None:
            bank, rate = self.bank_rad, second
        elif self.turn_radius_m is not None:
            rate = self.airspeed_m_s * math.cos(climb) / self.turn_radius_m
        commands = [0.0] * MAX_ACTUATORS
        commands[AILERON], commands[ELEVATOR] = aileron, elevator
        commands[THROTTLE] = last if self.throttle is None else self.throttle
        if self.has_rudder:
            commands[RUDDER] = fifth
        return alpha, 0.0 if self.has_rudder else fifth, bank, climb, rate, tuple(commands)

    def read(self, unknowns: Array, *, engines: bool = True) -> Array:
        alpha, beta, bank, climb, rate, commands = self.parts(unknowns)
        state = flight_state(self.airspeed_m_s, alpha, beta, bank, climb, rate, commands)
        return self.tunnel.measure(state, engines=engines).accelerations

    def jacobian(self, unknowns: Array, left: Array) -> Array:
        matrix = np.empty((6, 6))
        for i, delta in enumerate(_DELTAS):
            shift = delta if unknowns[i] + delta <= self.high[i] else -delta
            shifted = unknowns.copy()
            shifted[i] += shift
            throttle = i == 5 and self.throttle is None
            matrix[:, i] = (self.read(shifted, engines=throttle) - left) / shift
        return matrix

    def solve(self, guess: Array, iterations: int) -> FlightTrim:
        unknowns = np.clip(guess, self.low, self.high)
        left = self.read(unknowns)
        jacobian = self.jacobian(unknowns, left)
        fresh = True
        for _ in range(iterations):
            step = -np.linalg.lstsq(jacobian, left, rcond=1e-9)[0]
            step *= min(1.0, _STEP_LIMIT / max(float(np.max(np.abs(step))), 1e-12))
            wanted = unknowns + step
            before, unknowns = float(np.linalg.norm(left)), np.clip(wanted, self.low, self.high)
            left = self.read(unknowns)
            if float(np.max(np.abs(left))) < _TOLERANCE:
                return self.result(unknowns, left)
            if self.stuck(wanted, unknowns, left, jacobian) and fresh:
                break
            fresh = float(np.linalg.norm(left)) > _SLOW_CONVERGENCE * before
            if fresh:
                jacobian = self.jacobian(unknowns, left)
        raise TrimError(self.refusal(unknowns, left, jacobian))

    def stuck(self, wanted: Array, unknowns: Array, left: Array, jacobian: Array) -> bool:
        """Whether a limit stands against any better: no step within the limits makes it smaller."""
        if np.all(wanted == unknowns):
            return False
        free = wanted == unknowns
        step = np.zeros(6)
        step[free] = -np.linalg.lstsq(jacobian[:, free], left, rcond=1e-9)[0]
        rest = left + jacobian @ step
        return bool(np.linalg.norm(rest) > 0.98 * np.linalg.norm(left)) and float(np.max(np.abs(step))) < 0.02

    def refusal(self, unknowns: Array, left: Array, jacobian: Array) -> str:
        """Why there is no trim, in plain words."""
        wanted = unknowns - np.linalg.lstsq(jacobian, left, rcond=1e-9)[0]
        name = self.tunnel.airframe.name
        what = f"vehicle '{name}' cannot hold steady flight at {self.airspeed_m_s:.1f} m/s true airspeed"
        if self.throttle is None and unknowns[5] >= 1.0 and wanted[5] > 1.0:
            return f"{what}: it needs {wanted[5]:.2f} of full throttle"
        if self.throttle is None and unknowns[5] <= 0.0 and wanted[5] < 0.0:
            return f"{what}: it gains speed even with the throttle closed"
        for i, control in ((3, "elevator"), (2, "aileron"), (4, "rudder")):
            if abs(unknowns[i]) >= 1.0:
                return f"{what}: full {control} is not enough (it needs {wanted[i]:.2f} of it)"
        alpha_deg = math.degrees(unknowns[0])
        if jacobian[2, 0] >= 0.0:  # downward acceleration by angle of attack
            return f"{what}: at an angle of attack of {alpha_deg:.1f} degrees a larger one gives less lift"
        return (
            f"{what}: at an angle of attack of {alpha_deg:.1f} degrees, accelerations of "
            f"{np.max(np.abs(left[:3])):.3f} m/s2 and {np.max(np.abs(left[3:])):.3f} rad/s2 are left over"
        )

    def result(self, unknowns: Array, left: Array) -> FlightTrim:
        alpha, beta, bank, climb, rate, commands = self.parts(unknowns)
        return FlightTrim(
            airspeed_m_s=self.airspeed_m_s,
            angle_of_attack_rad=alpha,
            sideslip_rad=beta,
            roll_rad=bank,
            pitch_rad=flight_pitch_rad(alpha, beta, bank, climb),
            climb_angle_rad=climb,
            turn_rate_rad_s=rate,
            aileron=commands[AILERON],
            elevator=commands[ELEVATOR],
            rudder=commands[RUDDER],
            throttle=commands[THROTTLE],
            rotor_rad_s=self.tunnel.rotor_rad_s(),
            voltage_v=self.tunnel.truth_value(t.BATTERY_VOLTAGE_V),
            current_a=self.tunnel.truth_value(t.BATTERY_CURRENT_A),
            residual_m_s2=float(np.max(np.abs(left[:3]))),
            residual_rad_s2=float(np.max(np.abs(left[3:]))),
        )
