"""Which vehicles prove to be simulations, and what is asked of the others, on a link of this machine."""

import pytest

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.simulation_marks import FLIGHTSTACK_UID2, PX4_SITL_UID
from missions.cli.main import run_command_line
from missions.preflight.simulation import OUTPUTS, SPEEDUP, simulation_proof

NO_UID2 = [0] * 18
BOARD = (0x3035_5105_3433_3438, [6, *range(17)])  # as of a flight controller
PROVEN = {
    "PX4 SITL": ("px4", {"version": (PX4_SITL_UID, NO_UID2)}, {}),
    "its fourth instance": ("px4", {"version": (PX4_SITL_UID + 3, NO_UID2)}, {}),
    "hardware in the loop": ("px4", {"version": BOARD, "base_mode": dialect.MAV_MODE_FLAG_HIL_ENABLED}, {}),
    "flightstack sitl": ("ardupilot", {"version": (0, list(FLIGHTSTACK_UID2))}, {}),
    "ArduPilot SITL": ("ardupilot", {"version": (0, [9] * 18)}, {SPEEDUP: 1.0, OUTPUTS: 0.0}),
}
NOT_PROVEN = {
    "a PX4 board": ("px4", {"version": BOARD}, {}),
    "no answer of PX4": ("px4", {"version": None}, {}),
    "the next board's id": ("px4", {"version": (PX4_SITL_UID + 255, NO_UID2)}, {}),
    "PX4 with parameters of its simulator": ("px4", {"version": BOARD}, {SPEEDUP: 1.0, OUTPUTS: 0.0}),
    "an ArduPilot board": ("ardupilot", {"version": (0, [9] * 18)}, {}),
    "no answer of ArduPilot": ("ardupilot", {"version": None}, {}),
    "ArduPilot that drives motors": ("ardupilot", {"version": None}, {SPEEDUP: 1.0, OUTPUTS: 15.0}),
    "ArduPilot that does not say which outputs": ("ardupilot", {"version": None}, {SPEEDUP: 1.0}),
}  # fmt: skip


def prepare(autopilot, attributes, parameters):
    for name, value in attributes.items():
        setattr(autopilot, name, value)
    autopilot.parameters |= {name: (value, 9) for name, value in parameters.items()}


@pytest.mark.parametrize(("flavour", "attributes", "parameters"), PROVEN.values(), ids=PROVEN)
def test_what_proves_a_simulation(flown, flavour, attributes, parameters):
    async def script(vehicle, _autopilot):
        return await simulation_proof(vehicle)

    assert flown(script, flavour, setup=lambda a: prepare(a, attributes, parameters))


@pytest.mark.parametrize(("flavour", "attributes", "parameters"), NOT_PROVEN.values(), ids=NOT_PROVEN)
def test_what_proves_nothing_ends_within_seconds(flown, flavour, attributes, parameters):
    async def script(vehicle, _autopilot):
        begun_us = vehicle.clock.time_us
        proof = await simulation_proof(vehicle)
        return proof, (vehicle.clock.time_us - begun_us) * 1e-6

    proof, took_s = flown(script, flavour, setup=lambda a: prepare(a, attributes, parameters))
    assert proof == "" and took_s < 10.0


@pytest.fixture
def fly_on_loopback(elsewhere, tmp_path, capsys):
    """Flies the scripted vehicle by the command line; gives the exit code and all that was printed."""

    def fly(*options):
        link = ["--connect", "udpin:127.0.0.1:14550"]
        out = ["--out", str(tmp_path / "run"), "--no-picture"]
        code = run_command_line(["fly", "sector", "--size", "30", *link, *out, *options])
        return code, "".join(capsys.readouterr())

    return fly


def test_a_simulation_on_loopback_flies_without_a_question(elsewhere, fly_on_loopback):
    code, printed = fly_on_loopback()
    assert code == 0, printed
    assert "remote control" not in printed


def test_a_vehicle_on_loopback_without_proof_is_not_flown_without_a_terminal(elsewhere, fly_on_loopback):
    elsewhere.version = None
    code, printed = fly_on_loopback()
    assert code == 1
    assert "nothing proves that it is simulated" in printed
    assert "there is no terminal to confirm the flight; give --yes" in printed
    assert not elsewhere.armed and not elsewhere.items


@pytest.mark.parametrize("answer", ["no", "yes"])
def test_a_vehicle_on_loopback_without_proof_is_checked_and_asked_for(
    elsewhere, fly_on_loopback, monkeypatch, answer
):
    asked = []

    async def typed(question):
        asked.append(question)
        return answer

    monkeypatch.setattr("missions.cli.bodies.confirm.ask", typed)
    monkeypatch.setattr("missions.cli.bodies.confirm.can_ask", lambda: True)
    elsewhere.version = BOARD
    code, printed = fly_on_loopback()
    assert len(asked) == 1 and "Fly?" in asked[0]
    assert code == (0 if answer == "yes" else 1), printed
    assert bool(elsewhere.items) == (answer == "yes")


def test_yes_flies_no_unproven_vehicle_against_a_problem(elsewhere, fly_on_loopback):
    elsewhere.version = BOARD
    elsewhere.parameters["SYS_AUTOSTART"] = (0, 6)
    code, printed = fly_on_loopback("--yes")
    assert code == 1 and "not flown: vehicle 1: " in printed
    assert not elsewhere.items


def test_check_asks_for_a_simulation_too(elsewhere, fly_on_loopback):
    _, printed = fly_on_loopback("--check", "--yes")
    assert "simulated: it identifies itself as a SITL" in printed
