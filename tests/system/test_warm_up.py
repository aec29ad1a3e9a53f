"""Compiling the flight code, for every kind of vehicle: the first minute of a fresh clone."""

from autopilot_bridge.sitl import VehicleSpecification, compile_flight_code


def test_flight_code_is_compiled_for_the_kinds_that_fly() -> None:
    compile_flight_code((VehicleSpecification(model="aerosonde"), VehicleSpecification(model="iris")))
