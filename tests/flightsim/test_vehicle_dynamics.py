"""The Iris-class quadrotor's motion against closed forms, from its parameters as published (see iris.xml)."""

import math

import numpy as np
import pytest
from scipy.optimize import fsolve

from flightsim import truth as t
from flightsim.environment import Environment
from flightsim.foundation.rotations import rotate
from flightsim.home import Home
from flightsim.initial_state import InitialState
from flightsim.interface import MAX_ACTUATORS
from flightsim.vehicle import Vehicle
from tests.flightsim.hover_trim import HoverTrim, trim_hover

MASS_KG = 1.5
INERTIA_KG_M2 = (0.029125, 0.029125, 0.055225)
ARM_M = 0.25 / math.sqrt(2.0)
DIAMETER_M = 0.254
CT, CP = 0.1210, 0.0488
ROTOR_INERTIA_KG_M2 = 3.5e-5
DRAG_AREA_Z_M2 = 0.06
TORQUE_CONSTANT = 60.0 / (2.0 * math.pi * 850.0)
RESISTANCE_OHM = 0.24
FRICTION = 7.6e-6
G_M_S2 = 9.8069  # at home: 47.4 deg north, 488 m (WGS84)
HOME = Home()


def thrust_n(omega: float, density: float, advance: float = 0.0) -> float:
    n = omega / (2.0 * math.pi)
    return CT * density * n**2 * DIAMETER_M**4 * (1.0 - 0.90 * advance - 0.94 * advance**2)


def torque_nm(omega: float, density: float, advance: float = 0.0) -> float:
    n = omega / (2.0 * math.pi)
    factor = 1.0 - 0.127 * advance - 1.22 * advance**2
    return CP * density * n**2 * DIAMETER_M**5 / (2.0 * math.pi) * factor


def make(initial: InitialState) -> Vehicle:
    return Vehicle(
        home=HOME, environment=Environment(), seed_sequence=np.random.SeedSequence(0), initial=initial
    )


def command(*motors: float) -> np.ndarray:
    actuators = np.zeros(MAX_ACTUATORS)
    actuators[: len(motors)] = motors
    return actuators


@pytest.fixture(scope="module")
def hover() -> HoverTrim:
    return trim_hover(home=HOME)


def start(hover: HoverTrim, **changes: object) -> InitialState:
    values: dict[str, object] = {
        "height_m": 100.0,
        "roll_rad": hover.roll_rad,
        "pitch_rad": hover.pitch_rad,
        "rotor_rad_s": hover.rotor_rad_s,
    }
    return InitialState(**{**values, **changes})  # type: ignore[arg-type]


def test_free_fall_with_drag() -> None:
    """Motors off, level: v = v_t tanh(g t / v_t), v_t^2 = 2 m g / (rho A)."""
    vehicle = make(InitialState(height_m=500.0))
    density = vehicle.truth[t.DENSITY_KG_M3]
    terminal = math.sqrt(2.0 * MASS_KG * G_M_S2 / (density * DRAG_AREA_Z_M2))
    off = command()
    for step in range(1, 751):
        vehicle.step(off)
        if step % 125 == 0:
            expected = terminal * math.tanh(G_M_S2 * step * 0.004 / terminal)
            assert vehicle.truth[5] == pytest.approx(expected, rel=0.005)
    fallen = terminal**2 / G_M_S2 * math.log(math.cosh(G_M_S2 * 3.0 / terminal))
    assert 500.0 - vehicle.truth[t.HEIGHT_ABOVE_GROUND_M] == pytest.approx(fallen, rel=0.005)
    assert np.max(np.abs(vehicle.truth[t.VEL_NED_M_S][:2])) < 0.01


def test_weightless_at_the_start_of_the_fall() -> None:
    vehicle = make(InitialState(height_m=500.0))
    np.testing.assert_allclose(vehicle.truth[t.SPECIFIC_FORCE_FRD_M_S2], 0.0, atol=1e-6)


def test_terminal_velocity() -> None:
    vehicle = make(InitialState(height_m=1500.0, vel_ned_m_s=(0.0, 0.0, 30.0)))
    off = command()
    for _ in range(2500):
        vehicle.step(off)
    terminal = math.sqrt(2.0 * MASS_KG * G_M_S2 / (vehicle.truth[t.DENSITY_KG_M3] * DRAG_AREA_Z_M2))
    assert vehicle.truth[5] == pytest.approx(terminal, rel=0.01)


def test_hover_stays(hover: HoverTrim) -> None:
    vehicle = make(start(hover))
    actuators = command(*hover.actuators)
    place = vehicle.truth[:3].copy()
    for _ in range(500):
        vehicle.step(actuators)
    assert np.max(np.abs(vehicle.truth[t.VEL_NED_M_S])) < 0.01
    assert abs(vehicle.truth[t.ALT_M] - place[2]) < 0.01
    assert vehicle.truth[15] == pytest.approx(-G_M_S2, abs=0.01)


def test_hover_rotor_speed(hover: HoverTrim) -> None:
    density = make(start(hover)).truth[t.DENSITY_KG_M3]
    per_rotor = MASS_KG * G_M_S2 / 4.0
    assert thrust_n(hover.rotor_rad_s[0], density) == pytest.approx(per_rotor, rel=5e-4)
    assert 0.5 <= hover.actuators[0] <= 0.6


def test_full_throttle_lifts_twice_the_weight() -> None:
    vehicle = make(InitialState(height_m=100.0, rotor_rad_s=700.0))
    for _ in range(50):
        vehicle.step(command(1.0, 1.0, 1.0, 1.0))
    assert 2.0 < -vehicle.truth[15] / G_M_S2 < 2.5


def test_climb_rate(hover: HoverTrim) -> None:
    """Steady climb solves thrust = weight + drag and motor torque = propeller torque together."""
    duty = 0.7
    vehicle = make(start(hover))
    for _ in range(1500):
        vehicle.step(command(duty, duty, duty, duty))
    density, voltage = vehicle.truth[t.DENSITY_KG_M3], vehicle.truth[t.BATTERY_VOLTAGE_V]

    def balance(unknowns: np.ndarray) -> list[float]:
        omega, climb = unknowns
        advance = climb / (omega / (2.0 * math.pi) * DIAMETER_M)
        drag = 0.5 * density * DRAG_AREA_Z_M2 * climb**2
        current = (duty * voltage - TORQUE_CONSTANT * omega) / RESISTANCE_OHM
        return [
            4.0 * thrust_n(omega, density, advance) - MASS_KG * G_M_S2 - drag,
            1e3 * (TORQUE_CONSTANT * current - FRICTION * omega - torque_nm(omega, density, advance)),
        ]

    omega, climb = fsolve(balance, [550.0, 4.0])
    assert climb > 3.0
    assert -vehicle.truth[5] == pytest.approx(climb, rel=0.01)
    assert vehicle.truth[32] == pytest.approx(omega, rel=0.003)


@pytest.mark.parametrize(
    ("faster", "axis", "sign"),
    [((1, 2), 0, 1.0), ((0, 3), 0, -1.0), ((0, 2), 1, 1.0), ((1, 3), 1, -1.0)],
    ids=["left rolls right", "right rolls left", "front pitches up", "rear pitches down"],
)
def test_differential_thrust_turns_the_right_way(
    hover: HoverTrim, faster: tuple[int, int], axis: int, sign: float
) -> None:
    """Angular acceleration = arm x difference of thrust / inertia, in the first step."""
    speeds = list(hover.rotor_rad_s)
    for i in faster:
        speeds[i] += 20.0
    vehicle = make(start(hover, rotor_rad_s=tuple(speeds)))
    density = vehicle.truth[t.DENSITY_KG_M3]
    before = vehicle.truth[t.RATES_FRD_RAD_S].copy()
    vehicle.step(command(*hover.actuators))
    change = vehicle.truth[t.RATES_FRD_RAD_S] - before
    difference = thrust_n(hover.rotor_rad_s[0] + 20.0, density) - thrust_n(hover.rotor_rad_s[0], density)
    expected = sign * 0.004 * 2.0 * ARM_M * difference / INERTIA_KG_M2[axis]
    assert change[axis] == pytest.approx(expected, rel=1e-3)
    assert abs(change[1 - axis]) < 1e-3 * abs(expected)


def test_yaw_angular_momentum_is_kept(hover: HoverTrim) -> None:
    """Body and rotors together: Izz r + J sum(s w) changes by the air's torque alone.

    That is the propellers' torque, and their drag along the circle the hubs turn on.
    """
    vehicle = make(start(hover))
    density = vehicle.truth[t.DENSITY_KG_M3]
    duty = hover.actuators[0]
    actuators = command(duty + 0.1, duty + 0.1, duty - 0.1, duty - 0.1)
    direction = np.array([-1.0, -1.0, 1.0, 1.0])  # counterclockwise is negative about the down axis
    impulse = 0.0
    rate = vehicle.truth[12]
    momentum = ROTOR_INERTIA_KG_M2 * direction @ vehicle.truth[32:36]
    before = INERTIA_KG_M2[2] * rate + momentum
    for _ in range(100):
        old = vehicle.truth[32:36].copy()
        vehicle.step(actuators)
        speeds = 0.5 * (old + vehicle.truth[32:36])
        impulse += 0.004 * sum(-s * torque_nm(w, density) for s, w in zip(direction, speeds, strict=True))
        impulse -= 0.004 * 1.1e-4 * (math.sqrt(2.0) * ARM_M) ** 2 * float(speeds.sum()) * vehicle.truth[12]
    momentum = ROTOR_INERTIA_KG_M2 * direction @ vehicle.truth[32:36]
    vehicle.step(actuators)  # the torque of a step turns the body in the next one
    after = INERTIA_KG_M2[2] * vehicle.truth[12] + momentum
    assert vehicle.truth[12] > 0.3  # counterclockwise rotors faster: nose to the right
    assert after - before == pytest.approx(impulse, rel=0.02)


def test_rotors_are_gyroscopes(hover: HoverTrim) -> None:
    """Rolling at p with net rotor momentum H gives the pitch moment p H, besides thrust by inflow."""
    slow, fast, p = 450.0, 550.0, 2.0
    vehicle = make(
        start(hover, rotor_rad_s=(slow, slow, fast, fast), rates_frd_rad_s=(p, 0.0, 0.0), pitch_rad=0.0)
    )
    density = vehicle.truth[t.DENSITY_KG_M3]
    before = vehicle.truth[t.RATES_FRD_RAD_S].copy()
    vehicle.step(command(*hover.actuators))
    momentum = 2.0 * ROTOR_INERTIA_KG_M2 * (fast - slow)

    def at(omega: float, climb: float) -> float:
        return thrust_n(omega, density, climb / (omega / (2.0 * math.pi) * DIAMETER_M))

    arm = p * ARM_M
    inflow = ARM_M * (at(slow, -arm) + at(fast, arm) - at(slow, arm) - at(fast, -arm))
    # the hubs stand 23 mm above the centre of gravity and move sideways: no force along x
    expected = 0.004 * (p * momentum + inflow) / INERTIA_KG_M2[1]
    assert vehicle.truth[11] - before[1] == pytest.approx(expected, rel=0.02)


def test_balanced_rotors_do_not_couple(hover: HoverTrim) -> None:
    vehicle = make(start(hover, rates_frd_rad_s=(3.0, 0.0, 0.0)))
    for _ in range(10):
        vehicle.step(command(*hover.actuators))
    assert abs(vehicle.truth[11]) < 2e-3
    assert 2.0 < vehicle.truth[10] < 3.0  # inflow damps the roll


def test_motor_lag(hover: HoverTrim) -> None:
    """A small step of duty on all motors: first order with J / (K^2 / R' + b + 2 Q / w).

    R' = R + 4 u^2 r, for the battery's resistance carries the surge of all four.
    """
    vehicle = make(start(hover))
    omega = hover.rotor_rad_s[0]
    load = torque_nm(omega, vehicle.truth[t.DENSITY_KG_M3]) / omega
    resistance = RESISTANCE_OHM + 4.0 * hover.actuators[0] ** 2 * 0.030
    tau = ROTOR_INERTIA_KG_M2 / (TORQUE_CONSTANT**2 / resistance + FRICTION + 2.0 * load)
    assert tau == pytest.approx(0.050, abs=0.002)
    actuators = command(*(duty + 0.01 for duty in hover.actuators))
    speeds = []
    for _ in range(75):
        vehicle.step(actuators)
        speeds.append(vehicle.truth[32])
    rise = (np.array(speeds) - omega) / (speeds[-1] - omega)
    reached = float(np.interp(1.0 - math.exp(-1.0), rise, 0.004 * np.arange(1, 76)))
    assert reached == pytest.approx(tau, rel=0.02)


def test_forward_flight_drag() -> None:
    """Trim pitch in a headwind balances body drag and rotor drag: tan(pitch) = -D / W, nearly."""
    wind = 6.0
    hover = trim_hover(home=HOME, environment=Environment(wind_ned_m_s=(-wind, 0.0, 0.0)))
    u, w = wind * math.cos(hover.pitch_rad), wind * math.sin(-hover.pitch_rad)
    density = 1.158
    force_x = 1.1e-4 * sum(hover.rotor_rad_s) * u + 0.5 * density * 0.025 * u * u
    assert -math.sin(hover.pitch_rad) * MASS_KG * G_M_S2 == pytest.approx(force_x, rel=0.03)
    assert w > 0.0


def test_inertial_rates_and_velocity_agree_with_the_imu(hover: HoverTrim) -> None:
    """Strapdown: the change of velocity is the rotated specific force plus gravity, summed."""
    vehicle = make(start(hover))
    actuators = command(*hover.actuators)
    actuators[0] += 0.01
    velocity = vehicle.truth[t.VEL_NED_M_S].copy()
    for _ in range(150):
        attitude = vehicle.truth[t.Q_NED_FROM_FRD].copy()
        vehicle.step(actuators)
        step = np.empty(3)
        rotate(attitude, vehicle.truth[t.SPECIFIC_FORCE_FRD_M_S2].copy(), step)
        step[2] += G_M_S2
        velocity += 0.004 * step
    assert np.linalg.norm(vehicle.truth[t.VEL_NED_M_S]) > 0.2
    np.testing.assert_allclose(velocity, vehicle.truth[t.VEL_NED_M_S], atol=2e-3)
