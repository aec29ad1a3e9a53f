"""How GPS is switched off, found out on the ground; and the verdict on an orbit."""

import pytest

from autopilot_bridge.mavlink import dialect
from missions.errors import MissionError
from missions.gps_off import GpsOff
from missions.orbit.mission import orbit_verdict
from missions.orbit.options import OrbitOptions
from missions.orbit.score import ORBIT
from missions.vehicle.gps_switch import GpsSwitch
from missions.vehicle.notes import FlightNotes

INJECT = dialect.MAV_CMD_INJECT_FAILURE
REAL = 9  # MAV_PARAM_TYPE


def find(flown, flavour, way, *, parameters=(), answer=None, act=None):
    """The switch that is found, and what `act` makes of it: parameters, and failures that were injected."""

    async def script(vehicle, autopilot):
        injected = []
        command = autopilot._command

        def answering(number, values):
            if number == INJECT and answer is not None:
                injected.append(values[1])
                return autopilot.ack(number, answer)
            return command(number, values)

        autopilot._command = answering
        if answer is None:
            autopilot.mute_commands.add(INJECT)
        autopilot.parameters.update({name: (value, REAL) for name, value in dict(parameters).items()})
        switch = await GpsSwitch.find(vehicle, way)
        if act is not None:
            await act(switch, autopilot)
        return {name: value for name, (value, _) in autopilot.parameters.items()}, injected, vehicle.notes

    return flown(script, flavour)


async def off_and_on(switch, autopilot):
    await switch.off()
    await switch.on()


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_a_vehicle_that_injects_failures_gets_the_command(flown, flavour) -> None:
    _, injected, _ = find(flown, flavour, GpsOff.AUTO, answer=0, act=off_and_on)
    assert injected == [dialect.FAILURE_TYPE_OK, dialect.FAILURE_TYPE_OFF, dialect.FAILURE_TYPE_OK]


def test_a_simulated_ardupilot_that_does_not_know_the_command_gets_its_parameter(flown) -> None:
    """ArduPilot 4.6.3: UNSUPPORTED."""
    seen = []

    async def act(switch, autopilot):
        await switch.off()
        seen.append(autopilot.parameters["SIM_GPS_DISABLE"][0])
        await switch.on()

    parameters, _, notes = find(
        flown, "ardupilot", GpsOff.AUTO, parameters={"SIM_GPS_DISABLE": 0.0}, answer=3, act=act
    )
    assert seen == [1.0]
    assert parameters["SIM_GPS_DISABLE"] == 0.0
    assert notes.warnings == []


@pytest.mark.parametrize(
    ("flavour", "values"),
    [("px4", {"EKF2_GPS_CTRL": 7.0}), ("ardupilot", {"EK3_SRC1_POSXY": 3.0, "EK3_SRC1_VELXY": 3.0})],
)
def test_a_filter_that_leaves_gps_out_is_requested_and_restored(flown, flavour, values) -> None:
    seen = []

    async def act(switch, autopilot):
        await switch.off()
        seen.extend(autopilot.parameters[name][0] for name in values)
        await switch.on()

    parameters, _, _ = find(flown, flavour, GpsOff.PARAMETER, parameters=values, act=act)
    assert seen == [0.0] * len(values)
    assert values.items() <= parameters.items()


@pytest.mark.parametrize(
    ("flavour", "answer", "said"),
    [
        ("px4", None, "no answer.*`gps_fault=False`.*`gps_off=parameter` .EKF2_GPS_CTRL"),
        ("px4", 2, "DENIED.*SYS_FAILURE_EN 1"),
        ("ardupilot", 3, "UNSUPPORTED.*`gps_fault=False`.*EK3_SRC1_POSXY, EK3_SRC1_VELXY"),
    ],
)
def test_where_there_is_no_way_the_ground_says_what_to_ask_for(flown, flavour, answer, said) -> None:
    with pytest.raises(MissionError, match=said):
        find(flown, flavour, GpsOff.AUTO, answer=answer)


def test_a_parameter_that_is_not_restored_is_reported(flown) -> None:
    async def act(switch, autopilot):
        await switch.off()
        autopilot.on_param_set = lambda message: None
        with pytest.raises(MissionError):
            await switch.on()

    *_, notes = find(flown, "px4", GpsOff.PARAMETER, parameters={"EKF2_GPS_CTRL": 7.0}, act=act)
    assert notes.warnings == ["parameter EKF2_GPS_CTRL was not restored to 7; set it before the next flight"]


def orbited(*, mean_m=150.0, std_m=3.0, height_m=2.0, flown_s=60.0) -> FlightNotes:
    notes = FlightNotes()
    notes.marks |= {
        "radius_estimate_mean_m": mean_m,
        "radius_estimate_std_m": std_m,
        "altitude_estimate_error_m": height_m,
    }
    notes.begin(ORBIT, 0)
    notes.end(round(flown_s * 1e6))
    return notes


@pytest.mark.parametrize(
    ("figures", "said"),
    [
        ({}, ""),
        ({"mean_m": 170.0}, "not orbited at 150 m: by the camera the radius was 170 m"),
        ({"std_m": 40.0}, "standard deviation of 40.0 m; accepted: 15 m of each"),
        ({"height_m": 30.0}, "30.0 m from its altitude by pressure; accepted: 20 m"),
        ({"flown_s": 30.0}, "orbited for 30 s of 60 s"),
    ],
)
def test_an_orbit_is_judged_by_what_was_measured_in_flight(figures, said) -> None:
    verdict = orbit_verdict(orbited(**figures), OrbitOptions(duration_s=60.0))
    assert said in verdict and bool(said) == bool(verdict)
    assert "never reached" in orbit_verdict(FlightNotes(), OrbitOptions())
