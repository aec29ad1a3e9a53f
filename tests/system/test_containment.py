"""A vehicle that fails in a server ends alone: it is stopped, reported, started again, or left."""

from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.autopilot import Autopilot
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode
from autopilot_bridge.mavlink.components import SIMULATOR_COMPONENT
from autopilot_bridge.sitl import Sitl, VehicleFailure
from autopilot_bridge.sitl.containment import Aftermath, Probation
from autopilot_bridge.storage import MemoryStore
from autopilot_bridge.storage.files import exists, replace_whole
from autopilot_bridge.storage.memory import MemoryCard
from flightsim.vehicle import VehicleDivergedError
from flightsim.world_spec import VehicleSpec, WorldSpec, team


class Server:
    """Two vehicles whose failures are contained, with a client of the first one."""

    def __init__(self, cards: list[MemoryCard] | None = None) -> None:
        self.sitl = Sitl(WorldSpec(vehicles=team(2, model="iris", autopilot="ardupilot")), cards=cards)
        self.failures: list[VehicleFailure] = []
        self.sitl.contain(self.failures.append)
        self.parser, self.encoder = FrameParser(), FrameEncoder(255, 190)
        self.link = self.sitl.connect(0)
        self.received: list[tuple[int, Any]] = []

    def run(self, seconds: float) -> None:
        for step in range(round(seconds * 250)):
            if step % 125 == 0:
                self.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
            self.sitl.advance()
        for _, data in self.link.receive():
            self.received += [(frame.component_id, decode(frame)) for frame in self.parser.feed(data)]

    def send(self, message: Any) -> None:
        self.link.send(self.encoder.encode(message))

    def of_simulator(self) -> list[str]:
        return [
            message.text
            for component, message in self.received
            if component == SIMULATOR_COMPONENT and message.get_type() == "STATUSTEXT"
        ]

    def heartbeats(self) -> int:
        return sum(
            component == 1 and message.get_type() == "HEARTBEAT" for component, message in self.received
        )


def diverge(actuators: object) -> None:
    raise VehicleDivergedError("vehicle 'iris' diverged")


def test_a_vehicle_that_diverges_starts_again_and_the_others_fly_on(monkeypatch: pytest.MonkeyPatch) -> None:
    server = Server()
    server.run(3.0)
    failing, other = server.sitl.vehicles
    with monkeypatch.context() as patch:
        patch.setattr(failing.vehicle, "step", diverge)
        server.run(0.004)
    assert [(failure.system_id, failure.aftermath) for failure in server.failures] == [
        (1, Aftermath.STARTS_AGAIN)
    ]
    assert str(server.failures[0]).startswith("vehicle 1 failed at 3.0 s: vehicle 'iris' diverged; it starts")
    server.run(0.5)
    assert server.of_simulator() == ["Simulator: failed, starts again"]
    server.received.clear()
    server.run(4.0)
    assert server.heartbeats() >= 2
    assert not failing.stopped
    alone = Server()
    alone.run(7.504)
    assert other.vehicle.truth.tobytes() == alone.sitl.vehicles[1].vehicle.truth.tobytes()


def test_a_frame_that_makes_a_vehicle_fail_is_contained(monkeypatch: pytest.MonkeyPatch) -> None:
    server = Server()
    server.run(1.0)

    def refuse(frame: object, channel: object) -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(server.sitl.vehicles[0].backend, "receive", refuse, raising=False)
    server.sitl.vehicles[0].links.restart(None)
    server.sitl.vehicles[0].links._autopilot = server.sitl.vehicles[0].backend  # type: ignore[assignment]
    server.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    server.run(3.0)
    assert len(server.failures) == 1
    assert server.failures[0].reason.startswith("ZeroDivisionError: division by zero (test_containment.py")
    assert server.heartbeats() >= 1


def test_stored_parameters_with_which_it_fails_again_are_set_aside(monkeypatch: pytest.MonkeyPatch) -> None:
    cards = [MemoryCard(), MemoryCard()]
    server = Server(cards)
    server.run(1.0)
    server.send(mavlink.MAVLink_param_set_message(1, 1, b"WPNAV_SPEED", 1234.0, 9))
    server.run(1.0)
    failing = server.sitl.vehicles[0]
    step = Autopilot.step

    def fail_with_the_value(autopilot: Autopilot, time_us: int) -> None:
        if autopilot.parameters.get("WPNAV_SPEED") == 1234.0:
            raise ValueError("too fast")
        step(autopilot, time_us)

    monkeypatch.setattr(Autopilot, "step", fail_with_the_value)
    failing.backend = failing._boot(0)
    failing.links.restart(failing.backend.links)
    server.run(5.0)
    assert [failure.aftermath for failure in server.failures] == [
        Aftermath.STARTS_AGAIN,
        Aftermath.STARTS_WITHOUT_STORED,
    ]
    assert failing.parameter_values(["WPNAV_SPEED"])["WPNAV_SPEED"] != 1234.0
    assert exists(cards[0].files, ("parameters.parm.damaged",))
    assert server.of_simulator()[-1] == "Simulator: failed, starts without stored values"


def test_a_vehicle_that_fails_without_them_too_stays_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    server = Server()
    server.run(1.0)
    monkeypatch.setattr(server.sitl.vehicles[0].vehicle, "step", diverge)
    server.run(5.0)
    assert [failure.aftermath for failure in server.failures][-1] is Aftermath.LEFT_STOPPED
    assert len(server.failures) == 3
    assert server.sitl.vehicles[0].stopped and not server.sitl.vehicles[1].stopped
    assert server.of_simulator()[-1] == "Simulator: failed, stays stopped"


def test_a_failure_long_after_the_last_one_has_another_cause() -> None:
    probation = Probation()
    assert probation.judge(1_000_000) is Aftermath.STARTS_AGAIN
    assert probation.judge(30_000_000) is Aftermath.STARTS_WITHOUT_STORED
    assert probation.judge(300_000_000) is Aftermath.STARTS_AGAIN


def test_an_embedded_simulation_ends_with_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    sitl = Sitl(WorldSpec())
    monkeypatch.setattr(sitl.vehicles[0].vehicle, "step", diverge)
    with pytest.raises(VehicleDivergedError):
        sitl.advance()


def test_stored_parameters_of_which_no_vehicle_can_be_made_are_set_aside(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    typed = Autopilot._typed_parameters

    def refuse(autopilot: Autopilot) -> object:
        if autopilot.parameters.get("MPC_XY_CRUISE") == 7.0:
            raise ValueError("no vehicle cruises so fast")
        return typed(autopilot)

    monkeypatch.setattr(Autopilot, "_typed_parameters", refuse)
    card = MemoryCard(files=MemoryStore())
    replace_whole(card.files, ("parameters.params",), b"1\t1\tMPC_XY_CRUISE\t7.0\t9\n")
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(),)), cards=[card])
    assert sitl.vehicles[0].parameter_values(["MPC_XY_CRUISE"]) == {"MPC_XY_CRUISE": 5.0}
    assert exists(card.files, ("parameters.params.damaged",))


@pytest.mark.parametrize("value", [-3.4e38, -102_000.0, 3.4e38])
def test_no_bias_takes_a_sensor_beyond_what_it_can_put_out(value: float) -> None:
    """A negative pressure has no altitude."""
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(autopilot="ardupilot"),)))
    link = sitl.connect(0)
    encoder = FrameEncoder(255, 190)
    link.send(encoder.encode(mavlink.MAVLink_request_data_stream_message(1, 1, 0, 50, 1)))
    for name in (
        b"SIM_BARO_OFF_P",
        b"SIM_BARO_GLITCH",
        b"SIM_GPS_VERR_X",
        b"SIM_ACC1_BIAS_X",
        b"SIM_BATT_VOLTAGE",
    ):
        link.send(encoder.encode(mavlink.MAVLink_param_set_message(1, 1, name, value, 9)))
    for _ in range(250):
        sitl.advance()
    readings = sitl.vehicles[0].sensors.readings
    assert 0.0 < readings.barometer.values[0] <= 120_000.0
