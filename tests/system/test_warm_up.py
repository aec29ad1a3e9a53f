"""Compiling the flight code, for every kind of vehicle: the first minute of a fresh clone."""

from tests.compiled import compile_in_turn


def test_flight_code_is_compiled_for_the_kinds_that_fly() -> None:
    compile_in_turn()
