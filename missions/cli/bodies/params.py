"""`--params`: a parameter file for simulated vehicles, which may have fewer parameters than a real one."""

from collections.abc import Mapping

import click

from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.parameter_files import known_parameters
from autopilot_bridge.parameters import ParameterError
from flightsim.airframe import load_airframe
from flightsim.world_spec import WorldSpec


def known_to_all(
    values: Mapping[str, float], world: WorldSpec, *, strict: bool
) -> tuple[dict[str, float], tuple[str, ...]]:
    """The values of parameters that all emulated vehicles of a world have, and the other names.

    Args:
        values: values of a parameter file.
        world: the world.
        strict: all values are kept; the vehicle refuses the first that it does not have.

    Raises:
        click.UsageError: a vehicle does not accept some values, or a model does not exist.
    """
    known = dict(values)
    if strict:
        return known, ()
    kinds = dict.fromkeys((vehicle.autopilot, vehicle.model) for vehicle in world.vehicles)
    try:
        for autopilot, model in kinds:
            definitions = get_flavour(autopilot, load_airframe(model).kind).parameter_definitions()
            known, _ = known_parameters(known, definitions)
    except ParameterError as error:
        raise click.UsageError(f"--params: {error}") from error
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    return known, tuple(name for name in values if name not in known)
