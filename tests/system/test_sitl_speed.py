"""The speed benchmark gets its vehicles of both flavours into the air; their speed is not tested."""

import pytest

from autopilot_bridge.commander.verdict import Reason, Result, Verdict
from benchmarks.sitl_speed import Flight, required
from tests.slow import slow_after

FLOWN = (("iris", "ardupilot"), ("aerosonde", "ardupilot"), ("iris", "px4"), ("aerosonde", "px4"))


@pytest.mark.parametrize("flown", slow_after(2, FLOWN))
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_the_vehicles_of_the_benchmark_fly_their_mission(flown, tmp_path):
    model, flavour = flown
    flight = Flight(1, model, flavour, tmp_path / "flight.tlog")
    try:
        flight.take_off()
        assert flight.sitl.vehicles[0].autopilot.commander.armed
    finally:
        flight.close()


def test_a_refusal_of_the_autopilot_is_an_error_with_its_reasons():
    refusal = Verdict(result=Result.FAILED, reasons=(Reason.MODE_NOT_ARMABLE,))
    with pytest.raises(RuntimeError, match="refused arming: MODE_NOT_ARMABLE"):
        required(refusal, "arming")
