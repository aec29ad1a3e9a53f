"""Compiling the flight code, for every kind of vehicle: the first minute of a fresh clone."""

import pytest

from tests.compiled import compile_in_turn


@pytest.mark.timeout(1200)  # half a minute of processor time, of which a busy machine gives little
def test_flight_code_is_compiled_for_the_kinds_that_fly() -> None:
    compile_in_turn()
