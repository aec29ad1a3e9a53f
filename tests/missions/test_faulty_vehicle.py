"""Vehicles that misbehave: a fault ends the flight in time and with its reason, or it is harmless."""

import re
from dataclasses import replace

import pytest

from autopilot_bridge.clock import TelemetryClock
from missions.base.options import FlightOptions, Via
from missions.library import find_mission
from missions.runs import session
from missions.runs.session import RunRequest
from missions.runs.vehicle_opening import VehicleOpener, embedded_stage
from tests.missions.faulty_vehicle import FAULTS, inject

SMALL = FlightOptions(width_m=40.0, height_m=30.0, pattern="L2")


class FaultyVehicles(VehicleOpener):
    """Opens a scripted autopilot with a fault in place of a link; its time is that of its messages."""

    def __init__(self, sitl):
        self.sitl = sitl

    def open_vehicles(self, request):
        clock = TelemetryClock(lambda: self.sitl.time_us * 1e-6)
        return replace(embedded_stage(self.sitl), clocks=[clock], epoch_us=None, parameters=None, home=None)


CASES = [(name, via) for name, fault in FAULTS.items() for via in Via if fault.via in ("", via)]


@pytest.mark.sampled(14)
@pytest.mark.parametrize(("name", "via"), CASES)
def test_a_fault_ends_the_flight_in_time_with_its_reason(make_sitl, tmp_path, name, via):
    sitl = make_sitl("px4", truth=False)
    autopilot, fault = sitl.autopilots[0], FAULTS[name]
    inject(autopilot, name)
    request = RunRequest(
        options=replace(SMALL, via=via), connect=["udpin:127.0.0.1:9"], out=tmp_path / "run", picture=False
    )
    result = session.fly(find_mission("lissajous"), request, opener=FaultyVehicles(sitl))
    assert result.outcome == ("failed" if fault.reason else "completed"), result.reason
    assert re.search(fault.reason, result.reason), result.reason
    assert sitl.time_us * 1e-6 < fault.within_s
    if fault.left:
        assert autopilot.armed == (fault.left != "landed")
    if fault.left == "returning":
        assert autopilot.kind == "return"
