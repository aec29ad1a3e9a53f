"""PX4's parameters of a fixed wing (`parameters.toml` and what the multicopter's table shares)."""

from importlib.resources import files
from typing import Final

from autopilot_bridge.firmware.px4.copter.parameters import PX4_PARAMETERS
from autopilot_bridge.parameter_tables import combined, load_table
from autopilot_bridge.parameters import ParameterDefinition

_MULTICOPTER_ONLY: Final = (
    *(f"CA_ROTOR{rotor}_" for rotor in (1, 2, 3)),
    *(f"CA_ROTOR0_A{axis}" for axis in "XYZ"),
    "CP_",
    "FLW_",
    "HTE_",
    "LNDMC_",
    "MC_",
    "MPC_",
    "SYS_VEHICLE_RESP",
)

PX4_PLANE_PARAMETERS: Final[tuple[ParameterDefinition, ...]] = tuple(
    sorted(
        combined(
            PX4_PARAMETERS,
            load_table(files("autopilot_bridge.firmware.px4.plane").joinpath("parameters.toml")),
            without=_MULTICOPTER_ONLY,
        ),
        key=lambda definition: definition.name,
    )
)
"""What a user of PX4 1.16 touches on an aircraft, sorted by name as in PX4."""
