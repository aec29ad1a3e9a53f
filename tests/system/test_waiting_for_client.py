"""ArduPilot's SITL waits for a client on its first port, whatever the vehicle carries."""

import pytest

from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.links import open_link, parse_address
from autopilot_bridge.sitl import Port, Sitl, SitlServer
from flightsim.payload import CameraParameters, PayloadParameters
from flightsim.world_spec import VehicleSpec, WorldSpec

PORTS = [Port(parse_address("tcpin:127.0.0.1:0"), "gcs"), Port(parse_address("tcpin:127.0.0.1:0"), "gcs")]


@pytest.mark.parametrize("payload", [PayloadParameters(), PayloadParameters(camera=CameraParameters())])
def test_it_goes_on_when_a_client_comes(payload: PayloadParameters) -> None:
    vehicle = VehicleSpec(autopilot="ardupilot", payload=payload)
    sitl = Sitl(WorldSpec(vehicles=(vehicle,)))
    server = SitlServer(sitl, speedup=None, monotonic=wall_time_s)
    with pytest.raises(ValueError, match="no link is open"):
        server.wait_for_client(lambda: True)
    first, second = (address.replace("tcpin", "tcp") for _, _, address in server.open([PORTS]))
    elsewhere = open_link(second)
    assert not server.wait_for_client(lambda: True)  # no client is there, so it asks whether to stop
    client = open_link(first)
    assert server.wait_for_client(lambda: False)
    for link in (client, elsewhere):
        link.close()
    sitl.close()
