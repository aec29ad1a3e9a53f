"""Devices that a mission needs on its embedded vehicles."""

from dataclasses import replace
from typing import Final

from flightsim.payload import (
    CameraParameters,
    GimbalParameters,
    PayloadParameters,
    SurveyMagnetometerParameters,
)
from flightsim.world_spec import WorldSpec

CAMERA: Final = PayloadParameters(gimbal=GimbalParameters(), camera=CameraParameters())
MAGNETOMETER: Final = PayloadParameters(magnetometer=SurveyMagnetometerParameters())


def carrying(world: WorldSpec, payload: PayloadParameters) -> WorldSpec:
    """The world, with devices of a payload on every vehicle that does not have its own of that kind."""
    return replace(
        world,
        vehicles=tuple(
            replace(vehicle, payload=vehicle.payload.with_added(payload)) for vehicle in world.vehicles
        ),
    )
