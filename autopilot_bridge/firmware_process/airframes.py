"""The parameters with which a real firmware flies a vehicle of the world: geometry, outputs, gains, speeds.

Gains and speeds are those of the emulated autopilot of the same firmware (`Flavour.airframe` and
`airframe_of`), so that both fly with equal parameters. The geometry of a multicopter and its thrust in hover
are measured on its model (`flightsim.hover_figures`), the surfaces of an aircraft are those that its
description has. Numbers of functions: PX4's and ArduPilot's parameter references.
"""

from collections.abc import Mapping
from typing import Final

from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.sitl.backend import BackendSetup
from flightsim.airframe import Airframe, AirframeKind, LaunchKind, Role
from flightsim.hover_figures import HoverFigures, hover_figures
from flightsim.interface import MAX_ACTUATORS

_PX4_MOTOR: Final = 101  # PWM_MAIN_FUNCn of the first motor
_PX4_SERVO: Final = 201  # of the first servo
# Type, and the axis with the sign that a positive command has (`flightsim.interface`), of a control surface
_PX4_SURFACES: Final[Mapping[Role, tuple[int, str]]] = {
    Role.AILERON: (15, "R"),  # one channel for both sides
    Role.ELEVATOR: (3, "P"),
    Role.RUDDER: (4, "Y"),
    Role.FLAPS: (9, ""),
    Role.STEERING: (16, ""),
}
_ARDUPILOT_FUNCTIONS: Final[Mapping[Role, int]] = {  # SERVOn_FUNCTION
    Role.AILERON: 4,
    Role.ELEVATOR: 19,
    Role.THROTTLE: 70,
    Role.RUDDER: 21,
    Role.FLAPS: 3,
    Role.STEERING: 26,
}
_ARDUCOPTER_FIRST_MOTOR: Final = 33
_SERVO_RANGE: Final = {"MIN": 1000, "MAX": 2000, "TRIM": 1500}
# Signs of (forward, right, yaw moment) of the rotors of ArduPilot's quadrotor X, in its order of motors
_QUAD_X: Final = ((1, 1, 1), (-1, -1, 1), (1, -1, -1), (-1, 1, -1))


def airframe_parameters(setup: BackendSetup) -> dict[str, float]:
    """What the emulated autopilot of the same firmware has for this vehicle and its launch.

    Raises:
        ValueError: an aircraft that can't fly.
    """
    airframe, vehicle = setup.airframe, setup.vehicle
    flavour = get_flavour(vehicle.autopilot, airframe.kind)
    launch = airframe.launch_kind if vehicle.launch is None else LaunchKind(vehicle.launch)
    values = dict(flavour.airframe)
    if flavour.airframe_of is not None:
        from flightsim.flight_envelope import flight_envelope  # SciPy, which a multicopter does not need

        values |= flavour.airframe_of(
            flight_envelope(airframe, home=setup.world.place, environment=setup.world.air)
        )
    return values | dict(flavour.launch_parameters.get(launch, {}))


def px4_outputs(setup: BackendSetup) -> dict[str, float]:
    """PX4's control allocation, with its outputs in the order of our actuators.

    Raises:
        ValueError: a multicopter that does not get off the ground.
    """
    airframe = setup.airframe
    values: dict[str, float] = {f"PWM_MAIN_FUNC{output}": 0 for output in range(1, MAX_ACTUATORS + 1)}
    if airframe.kind is AirframeKind.MULTICOPTER:
        figures = _hover(setup)
        values |= {
            "CA_AIRFRAME": 0,
            "CA_ROTOR_COUNT": len(figures.rotors),
            "MPC_THR_HOVER": figures.thrust_fraction,
            "THR_MDL_FAC": figures.thrust_curve,
        }
        for index, rotor in enumerate(figures.rotors):
            values |= {
                f"CA_ROTOR{index}_PX": rotor.forward_m,
                f"CA_ROTOR{index}_PY": rotor.right_m,
                f"CA_ROTOR{index}_KM": rotor.moment_ratio_m,
                f"PWM_MAIN_FUNC{index + 1}": _PX4_MOTOR + index,
            }
        return values
    roles = _roles(airframe)
    surfaces = [role for role in roles if role in _PX4_SURFACES]
    values |= {"CA_AIRFRAME": 1, "CA_ROTOR_COUNT": 1, "CA_SV_CS_COUNT": len(surfaces)}
    if Role.THROTTLE in roles:
        values[f"PWM_MAIN_FUNC{Role.THROTTLE.command + 1}"] = _PX4_MOTOR
    for index, role in enumerate(surfaces):
        kind, axis = _PX4_SURFACES[role]
        values[f"CA_SV_CS{index}_TYPE"] = kind
        values |= {f"CA_SV_CS{index}_TRQ_{each}": float(each == axis) for each in "RPY"}
        values[f"PWM_MAIN_FUNC{role.command + 1}"] = _PX4_SERVO + index
    return values


def ardupilot_outputs(setup: BackendSetup) -> dict[str, float]:
    """ArduPilot's frame and servo functions, with its outputs in the order of our actuators.

    Raises:
        ValueError: a multicopter whose rotors are not those of a quadrotor X, or that does not get off the
            ground.
    """
    airframe = setup.airframe
    values: dict[str, float] = {}
    if airframe.kind is AirframeKind.MULTICOPTER:
        figures = _hover(setup)
        signs = tuple(
            (_sign(rotor.forward_m), _sign(rotor.right_m), _sign(rotor.moment_ratio_m))
            for rotor in figures.rotors
        )
        if signs != _QUAD_X:
            raise ValueError(
                f"vehicle '{airframe.name}': its rotors are at (forward, right, yaw moment) {signs}; "
                f"accepted with ArduPilot is a quadrotor X in its order of motors, {_QUAD_X}"
            )
        values |= {
            "FRAME_CLASS": 1,
            "FRAME_TYPE": 1,
            "MOT_THST_HOVER": figures.thrust_fraction,
            "MOT_THST_EXPO": figures.thrust_curve,
        }
        functions = {index: _ARDUCOPTER_FIRST_MOTOR + index for index in range(len(figures.rotors))}
    else:
        functions = {
            role.command: number for role, number in _ARDUPILOT_FUNCTIONS.items() if role in _roles(airframe)
        }
    for index in range(MAX_ACTUATORS):
        values[f"SERVO{index + 1}_FUNCTION"] = functions.get(index, 0)
        values |= {f"SERVO{index + 1}_{name}": value for name, value in _SERVO_RANGE.items()}
    return values


def _hover(setup: BackendSetup) -> HoverFigures:
    figures = hover_figures(setup.airframe, home=setup.world.place, battery_ah=setup.vehicle.battery_ah)
    if figures is None:
        raise ValueError(f"vehicle '{setup.airframe.name}' does not get off the ground with full commands")
    return figures


def _roles(airframe: Airframe) -> tuple[Role, ...]:
    """The actuators of an aircraft that a firmware commands, in our order."""
    return tuple(sorted({channel.role for channel in airframe.channels}, key=lambda role: role.command))


def _sign(value: float) -> int:
    return 1 if value > 0.0 else -1
