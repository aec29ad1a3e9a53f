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
            replace(
                vehicle,
                payload=PayloadParameters(
                    gimbal=vehicle.payload.gimbal or payload.gimbal,
                    camera=vehicle.payload.camera or payload.camera,
                    magnetometer=vehicle.payload.magnetometer or payload.magnetometer,
                    target_sensor=vehicle.payload.target_sensor or payload.target_sensor,
                    range_radio=vehicle.payload.range_radio or payload.range_radio,
                    moving_points=vehicle.payload.moving_points or payload.moving_points,
                ),
            )
            for vehicle in world.vehicles
        ),
    )
