"""The Aerosonde as the book has it, without JSBSim: equations of motion, trim, linear modes.

Beard and McLain, Small Unmanned Aircraft: Theory and Practice. Chapter 3 (equations 3.14 to 3.17: rigid body
over a flat Earth), chapter 4 in the authors' newer edition (equations 4.6 to 4.20: forces and moments, stall
blend, electric motor with propeller), chapter 5 (trim, linearisation), appendix E of the newer edition (the
numbers). Frames, signs and units are the book's: positive elevator pitches the nose down, rad.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, fsolve, minimize_scalar

Array = NDArray[np.float64]

G_M_S2 = 9.81
ELEVATOR_TRAVEL_RAD = math.radians(45.0)
RPM_PER_V = 145.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Aerosonde:
    """Appendix E, newer edition."""

    mass: float = 11.0
    jx: float = 0.8244
    jy: float = 1.135
    jz: float = 1.759
    jxz: float = 0.1204
    s: float = 0.55
    b: float = 2.8956
    c: float = 0.18994
    e: float = 0.9
    cl0: float = 0.23
    cl_alpha: float = 5.61
    cl_q: float = 7.95
    cl_de: float = 0.13
    cd_p: float = 0.043
    cd_q: float = 0.0
    cd_de: float = 0.0135
    cm0: float = 0.0135
    cm_alpha: float = -2.74
    cm_q: float = -38.21
    cm_de: float = -0.99
    m: float = 50.0
    alpha0: float = 0.47
    cy_beta: float = -0.98
    cy_da: float = 0.075
    cy_dr: float = 0.19
    cell_beta: float = -0.13
    cell_p: float = -0.51
    cell_r: float = 0.25
    cell_da: float = 0.17
    cell_dr: float = 0.0024
    cn_beta: float = 0.073
    cn_p: float = 0.069
    cn_r: float = -0.095
    cn_da: float = -0.011
    cn_dr: float = -0.069
    d_prop: float = 0.508
    k_motor: float = 60.0 / (2.0 * math.pi * RPM_PER_V)
    r_motor: float = 0.042
    i0: float = 1.5
    v_max: float = 44.4
    ct: tuple[float, float, float] = (0.09357, -0.06044, -0.1079)
    cq: tuple[float, float, float] = (0.005230, 0.004970, -0.01664)


@dataclass(frozen=True, slots=True, kw_only=True)
class BookTrim:
    """Steady flight: true airspeed, attitude, surfaces in rad (book's signs), throttle."""

    airspeed: float
    alpha: float
    phi: float
    theta: float
    gamma: float
    da: float
    de: float
    dr: float
    dt: float
    rates: tuple[float, float, float]


class Book:
    """The model in air of one density."""

    def __init__(self, density_kg_m3: float, parameters: Aerosonde | None = None) -> None:
        self.p = parameters or Aerosonde()
        self.rho = density_kg_m3

    def lift(self, alpha: float) -> float:
        """Lift coefficient, equations 4.9 and 4.10."""
        p = self.p
        low, high = math.exp(-p.m * (alpha - p.alpha0)), math.exp(p.m * (alpha + p.alpha0))
        sigma = (1.0 + low + high) / ((1.0 + low) * (1.0 + high))
        plate = 2.0 * math.copysign(1.0, alpha) * math.sin(alpha) ** 2 * math.cos(alpha)
        return (1.0 - sigma) * (p.cl0 + p.cl_alpha * alpha) + sigma * plate

    def drag(self, alpha: float) -> float:
        """Drag coefficient, equation 4.11."""
        p = self.p
        return p.cd_p + (p.cl0 + p.cl_alpha * alpha) ** 2 / (math.pi * p.e * p.b**2 / p.s)

    def propeller(self, airspeed: float, throttle: float) -> tuple[float, float]:
        """Thrust (N) and torque (N m): motor and propeller in balance, a quadratic in rotor speed."""
        p, rho, d = self.p, self.rho, self.p.d_prop
        a = p.cq[0] * rho * d**5 / (2.0 * math.pi) ** 2
        b = p.cq[1] * rho * d**4 * airspeed / (2.0 * math.pi) + p.k_motor**2 / p.r_motor
        c = p.cq[2] * rho * d**3 * airspeed**2 - p.k_motor * p.v_max * throttle / p.r_motor + p.k_motor * p.i0
        omega = (-b + math.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)
        n = omega / (2.0 * math.pi)
        j = airspeed / (n * d)
        thrust = rho * n**2 * d**4 * (p.ct[0] + p.ct[1] * j + p.ct[2] * j * j)
        torque = rho * n**2 * d**5 * (p.cq[0] + p.cq[1] * j + p.cq[2] * j * j)
        return thrust, torque

    def derivative(self, x: Array, controls: tuple[float, float, float, float]) -> Array:
        """d/dt of (u v w p q r phi theta) under (aileron, elevator, rudder, throttle)."""
        k = self.p
        u, v, w, p, q, r, phi, theta = x.tolist()
        da, de, dr, dt = controls
        va = math.sqrt(u * u + v * v + w * w)
        alpha, beta = math.atan2(w, u), math.asin(v / va)
        pressure = 0.5 * self.rho * va**2 * k.s
        lift = pressure * (self.lift(alpha) + k.cl_q * k.c * q / (2.0 * va) + k.cl_de * de)
        drag = pressure * (self.drag(alpha) + k.cd_q * k.c * q / (2.0 * va) + k.cd_de * de)
        thrust, torque = self.propeller(va, dt)
        mg = k.mass * G_M_S2
        fx = thrust - drag * math.cos(alpha) + lift * math.sin(alpha) - mg * math.sin(theta)
        fy = pressure * (k.cy_beta * beta + k.cy_da * da + k.cy_dr * dr) + mg * math.cos(theta) * math.sin(
            phi
        )
        fz = -drag * math.sin(alpha) - lift * math.cos(alpha) + mg * math.cos(theta) * math.cos(phi)
        ph, rh = k.b * p / (2.0 * va), k.b * r / (2.0 * va)
        ell = (
            pressure
            * k.b
            * (k.cell_beta * beta + k.cell_p * ph + k.cell_r * rh + k.cell_da * da + k.cell_dr * dr)
        )
        ell -= torque
        m = pressure * k.c * (k.cm0 + k.cm_alpha * alpha + k.cm_q * k.c * q / (2.0 * va) + k.cm_de * de)
        n = pressure * k.b * (k.cn_beta * beta + k.cn_p * ph + k.cn_r * rh + k.cn_da * da + k.cn_dr * dr)
        inertia = np.array([[k.jx, 0.0, -k.jxz], [0.0, k.jy, 0.0], [-k.jxz, 0.0, k.jz]])
        rates = np.array([p, q, r])
        turning = np.linalg.solve(inertia, np.array([ell, m, n]) - np.cross(rates, inertia @ rates))
        return np.array(
            [
                r * v - q * w + fx / k.mass,
                p * w - r * u + fy / k.mass,
                q * u - p * v + fz / k.mass,
                *turning,
                p + (q * math.sin(phi) + r * math.cos(phi)) * math.tan(theta),
                q * math.cos(phi) - r * math.sin(phi),
            ]
        )

    def trim(
        self, airspeed: float, *, radius: float = math.inf, gamma: float = 0.0, throttle: float | None = None
    ) -> BookTrim:
        """Steady flight without sideslip, straight or in a turn; with a throttle, gamma is found instead."""

        def parts(unknowns: Array) -> tuple[Array, tuple[float, float, float, float], float, float]:
            alpha, phi, da, de, dr, last = unknowns.tolist()
            climb, dt = (gamma, last) if throttle is None else (last, throttle)
            rate = airspeed * math.cos(climb) / radius
            theta = _theta(alpha, phi, climb)
            x = np.array(
                [
                    airspeed * math.cos(alpha),
                    0.0,
                    airspeed * math.sin(alpha),
                    -rate * math.sin(theta),
                    rate * math.sin(phi) * math.cos(theta),
                    rate * math.cos(phi) * math.cos(theta),
                    phi,
                    theta,
                ]
            )
            return x, (da, de, dr, dt), climb, theta

        def left_over(unknowns: Array) -> Array:
            x, controls, _, _ = parts(unknowns)
            return self.derivative(x, controls)[:6]

        bank = math.atan(airspeed**2 / (G_M_S2 * radius))
        k = self.p
        lift = k.mass * G_M_S2 / (0.5 * self.rho * airspeed**2 * k.s * math.cos(bank))
        alpha = (lift - k.cl0) / k.cl_alpha
        elevator = -(k.cm0 + k.cm_alpha * alpha) / k.cm_de
        guess = np.array([alpha, bank, 0.0, elevator, 0.0, 0.7 if throttle is None else -0.2])
        solution, _, success, message = fsolve(left_over, guess, full_output=True, xtol=1e-12)
        if success != 1:
            raise ArithmeticError(f"no trim at {airspeed} m/s, radius {radius} m: {message}")
        x, (da, de, dr, dt), climb, theta = parts(solution)
        return BookTrim(
            airspeed=airspeed,
            alpha=float(solution[0]),
            phi=float(solution[1]),
            theta=theta,
            gamma=climb,
            da=da,
            de=de,
            dr=dr,
            dt=dt,
            rates=(float(x[3]), float(x[4]), float(x[5])),
        )

    def modes(self, airspeed: float) -> dict[str, complex]:
        """One root of each mode of level flight, from central differences of the equations."""
        trim = self.trim(airspeed)
        x = np.array(
            [
                airspeed * math.cos(trim.alpha),
                0.0,
                airspeed * math.sin(trim.alpha),
                *trim.rates,
                trim.phi,
                trim.theta,
            ]
        )
        controls = (trim.da, trim.de, trim.dr, trim.dt)
        a = np.empty((8, 8))
        for i in range(8):
            shift = np.zeros(8)
            shift[i] = 1e-4
            a[:, i] = (self.derivative(x + shift, controls) - self.derivative(x - shift, controls)) / 2e-4
        longitudinal = np.linalg.eigvals(a[np.ix_((0, 2, 4, 7), (0, 2, 4, 7))])
        lateral = np.linalg.eigvals(a[np.ix_((1, 3, 5, 6), (1, 3, 5, 6))])
        upper = sorted((r for r in longitudinal if r.imag > 0.0), key=abs, reverse=True)
        real = sorted((r for r in lateral if abs(r.imag) < 1e-9), key=abs, reverse=True)
        swinging = next(r for r in lateral if r.imag > 1e-9)
        return {
            "short period": complex(upper[0]),
            "phugoid": complex(upper[1]),
            "Dutch roll": complex(swinging),
            "roll": complex(real[0]),
            "spiral": complex(real[1]),
        }

    def stall_speed(self) -> float:
        """Lowest speed of a power-off glide: full elevator."""
        return float(
            brentq(lambda v: self.trim(v, throttle=0.0).de + ELEVATOR_TRAVEL_RAD, 13.0, 20.0, xtol=1e-4)
        )

    def best_glide(self, slowest: float) -> tuple[float, float]:
        """Speed and ratio of the flattest glide with the throttle closed (the motor brakes)."""
        found = minimize_scalar(
            lambda v: -self.trim(v, throttle=0.0).gamma, bounds=(slowest, 30.0), method="bounded"
        )
        return float(found.x), 1.0 / math.tan(found.fun)

    def best_lift_over_drag(self) -> float:
        """Of the airframe alone, elevator trimmed."""
        p = self.p

        def ratio(alpha: float) -> float:
            de = -(p.cm0 + p.cm_alpha * alpha) / p.cm_de
            return -(self.lift(alpha) + p.cl_de * de) / (self.drag(alpha) + p.cd_de * de)

        return -float(minimize_scalar(ratio, bounds=(0.0, 0.3), method="bounded").fun)


def _theta(alpha: float, phi: float, gamma: float) -> float:
    """Pitch of a path that climbs by gamma, without sideslip."""
    a, b = math.cos(alpha), math.cos(phi) * math.sin(alpha)
    rise = math.sin(gamma)
    return math.atan2(a * b + rise * math.sqrt(a * a - rise * rise + b * b), a * a - rise * rise)
