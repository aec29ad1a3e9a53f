"""Control allocation against the vehicle's geometry, and what happens at its limits."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopilot_bridge.control.multicopter.mixer import ALLOCATION, allocate, command_from_thrust

# front right, rear left, front left, rear right: (forward, right) of the rotor, +1 counterclockwise (torque
# on the
# body clockwise, positive about down)
ROTORS = ((1.0, 1.0, 1.0), (-1.0, -1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0))


def mix(roll: float, pitch: float, yaw: float, thrust: float) -> tuple[np.ndarray, np.ndarray]:
    motor, unallocated = np.zeros(4), np.zeros(3)
    allocate(roll, pitch, yaw, thrust, motor, unallocated)
    return motor, unallocated


def test_allocation_agrees_with_geometry() -> None:
    for row, (forward, right, spin) in zip(ALLOCATION, ROTORS, strict=True):
        # force is -z at (x, y): torque about x is -y F, about y is x F
        assert np.sign(row[0]) == -right
        assert np.sign(row[1]) == forward
        assert row[2] == spin
        assert row[3] == 1.0
    # columns are orthogonal: no axis disturbs another
    gram = ALLOCATION.T @ ALLOCATION
    assert gram == pytest.approx(np.diag(np.diag(gram)))


def test_inside_the_range_everything_is_given() -> None:
    motor, unallocated = mix(0.1, -0.05, 0.03, 0.5)
    assert motor == pytest.approx(ALLOCATION @ [0.1, -0.05, 0.03, 0.5])
    assert unallocated == pytest.approx(np.zeros(3))


@settings(max_examples=300, deadline=None)
@given(*[st.floats(-2.0, 2.0)] * 3, st.floats(0.0, 1.0))
def test_motors_stay_in_range_and_thrust_never_rises(
    roll: float, pitch: float, yaw: float, thrust: float
) -> None:
    motor, unallocated = mix(roll, pitch, yaw, thrust)
    assert (motor >= 0.0).all()
    assert (motor <= 1.0).all()
    assert np.isfinite(unallocated).all()
    if abs(roll) + abs(pitch) < 0.4 and 0.3 < thrust < 0.7:
        assert motor.mean() <= thrust + 1e-9
        # roll and pitch have right of way over yaw
        assert unallocated[:2] == pytest.approx([0.0, 0.0], abs=0.1)


def test_yaw_gives_way_to_roll() -> None:
    _, unallocated = mix(0.4, 0.0, 1.0, 0.5)
    assert abs(unallocated[0]) < 0.05
    assert unallocated[2] > 0.5


def test_full_thrust_gives_way_to_roll() -> None:
    motor, unallocated = mix(0.3, 0.0, 0.0, 1.0)
    assert unallocated[0] == pytest.approx(0.0, abs=1e-9)
    assert motor.mean() < 1.0


@pytest.mark.parametrize("factor", [0.0, 0.3, 0.5, 1.0])
def test_thrust_curve_inverts(factor: float) -> None:
    for thrust in np.linspace(0.0, 1.0, 21):
        c = command_from_thrust(thrust, factor)
        assert factor * c * c + (1.0 - factor) * c == pytest.approx(thrust, abs=1e-12)


def test_thrust_curve_clips() -> None:
    assert command_from_thrust(1.7, 0.5) == 1.0
    assert command_from_thrust(-0.2, 0.5) == 0.0
    assert math.isfinite(command_from_thrust(0.5, 1e-9))


def px4_desaturated(
    motors: np.ndarray, direction: np.ndarray, upper: float, *, down_only: bool
) -> np.ndarray:
    """One step of PX4's `ControlAllocationSequentialDesaturation::desaturateActuators`: along `direction` as
    far as the motors beyond their limits ask for, then half of what is still missing."""

    def gain(motors: np.ndarray) -> float:
        needed = np.where(motors < 0.0, -motors, np.where(motors > upper, upper - motors, 0.0)) / direction
        return min(0.0, needed.min()) + max(0.0, needed.max())

    first = gain(motors)
    if down_only and first > 0.0:
        return motors
    motors = motors + first * direction
    return motors + 0.5 * gain(motors) * direction


@settings(max_examples=300, deadline=None)
@given(*[st.floats(-1.5, 1.5)] * 3, st.floats(0.0, 1.0))
def test_at_its_limits_it_mixes_as_px4_without_airmode(
    roll: float, pitch: float, yaw: float, thrust: float
) -> None:
    """`mixAirmodeDisabled`: thrust down, roll, pitch; then `mixYaw` with 15 % more room, and thrust down."""
    half = math.sqrt(0.5)
    x, y = np.array([-half, half, half, -half]), np.array([half, -half, half, -half])
    turn, up = np.array([1.0, 1.0, -1.0, -1.0]), np.ones(4)
    motors = roll * x + pitch * y + thrust * up
    motors = px4_desaturated(motors, up, 1.0, down_only=True)
    motors = px4_desaturated(motors, x, 1.0, down_only=False)
    motors = px4_desaturated(motors, y, 1.0, down_only=False)
    motors = px4_desaturated(motors + yaw * turn, turn, 1.15, down_only=False)
    motors = np.clip(px4_desaturated(motors, up, 1.0, down_only=True), 0.0, 1.0)
    mixed, unallocated = mix(roll, pitch, yaw, thrust)
    np.testing.assert_allclose(mixed, motors, atol=1e-12)
    # the torques that these motors give: least squares over the four columns
    given_roll, given_pitch, given_yaw, _ = np.linalg.lstsq(
        np.column_stack([x, y, turn, up]), motors, rcond=None
    )[0]
    np.testing.assert_allclose(
        unallocated, [roll - given_roll, pitch - given_pitch, yaw - given_yaw], atol=1e-12
    )
