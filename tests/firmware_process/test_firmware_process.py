"""Real firmware as a backend, with stand-ins for its programs: lockstep, links, failures, start files."""

import json
import os
import signal
import sys
import threading
from pathlib import Path

import pytest

from autopilot_bridge.firmware_process import FirmwareBuild, FirmwareError, ardupilot, firmware_backend, px4
from autopilot_bridge.firmware_process.ardupilot import ArduPilotBackend
from autopilot_bridge.firmware_process.ardupilot_faults import parameter_changes
from autopilot_bridge.links import MemoryLink
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, dialect
from autopilot_bridge.sitl import AutopilotBackend, BackendSetup, Sitl, VehicleFailure
from autopilot_bridge.sitl.backend import Boot
from flightsim.airframe import AirframeKind
from flightsim.hover_figures import hover_figures
from flightsim.interface import MAX_ACTUATORS
from flightsim.sensors.fault_kinds import FaultType
from flightsim.world_spec import FaultSpec, FaultUnit, VehicleSpec, WorldSpec

STAND_INS = Path(__file__).with_name("stand_ins.py")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the firmwares' SITLs run on POSIX systems")


@pytest.fixture
def px4_build(tmp_path: Path) -> FirmwareBuild:
    """A folder as PX4's build folder, with a stand-in for its program."""
    build = tmp_path / "px4"
    scripts = build / "etc" / "init.d-posix"
    (scripts / "airframes").mkdir(parents=True)
    (build / "etc" / "init.d").mkdir()
    for name in ("rcS", "px4-rc.mavlink", "px4-rc.mavlinksim"):
        (scripts / name).write_text("# of the build\n")
    program = build / "bin" / "px4"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec {sys.executable} {STAND_INS} px4 "$@"\n')
    program.chmod(0o755)
    return FirmwareBuild("px4", build)


@pytest.fixture
def ardupilot_build(tmp_path: Path) -> FirmwareBuild:
    """A stand-in for ArduPilot's program."""
    program = tmp_path / "arducopter"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} {STAND_INS} ardupilot "$@"\n')
    program.chmod(0o755)
    return FirmwareBuild("ardupilot", program)


def sitl_of(
    build: FirmwareBuild,
    count: int = 1,
    logs_to: Path | None = None,
    physics_rate_hz: int = 250,
    **vehicle: object,
) -> Sitl:
    world = WorldSpec(
        physics_rate_hz=physics_rate_hz,
        vehicles=tuple(
            VehicleSpec(
                system_id=number,
                autopilot=build.firmware,
                offset_ne_m=(0.0, 5.0 * number),
                **vehicle,  # type: ignore[arg-type]
            )
            for number in range(1, count + 1)
        ),
    )
    return Sitl(world, backend=firmware_backend(build, logs_to=logs_to))


def start(sitl: Sitl) -> None:
    """Let the programs start, which takes real time."""
    for _ in range(5000):
        sitl.advance()
        if all(vehicle.backend.armed for vehicle in sitl.vehicles):
            return
    pytest.fail("a program did not start")


def climb_m(sitl: Sitl, steps: int, index: int = 0) -> float:
    truth = sitl.vehicles[index].vehicle.truth
    before_m = float(truth[2])
    for _ in range(steps):
        sitl.advance()
    return float(truth[2]) - before_m


def received(link: MemoryLink) -> list[tuple[int, int, str]]:
    """(system, component, message) of what a client has received."""
    parser = FrameParser()
    frames = [frame for _, data in link.receive() for frame in parser.feed(data)]
    return [(f.system_id, f.component_id, f.definition.name) for f in frames]


@pytest.mark.parametrize("firmware", ["px4", "ardupilot"])
def test_a_firmware_flies_the_vehicle_in_lockstep(firmware: str, request: pytest.FixtureRequest) -> None:
    sitl = sitl_of(request.getfixturevalue(f"{firmware}_build"), count=2)
    link = sitl.connect(1)
    try:
        start(sitl)
        assert climb_m(sitl, 200, index=0) > 0.1
        assert set(received(link)) == {(2, 1, "HEARTBEAT")}  # of the autopilot alone
    finally:
        sitl.close()


@pytest.mark.parametrize("physics_rate_hz", [500, 1000])
def test_px4_flies_in_a_world_that_is_faster_than_its_rate_loop(
    px4_build: FirmwareBuild, physics_rate_hz: int
) -> None:
    sitl = sitl_of(px4_build, physics_rate_hz=physics_rate_hz)
    try:
        start(sitl)
        assert climb_m(sitl, physics_rate_hz) > 0.1
    finally:
        sitl.close()


def test_a_message_of_a_client_reaches_px4_and_is_answered(px4_build: FirmwareBuild) -> None:
    sitl = sitl_of(px4_build)
    link = sitl.connect(0)
    try:
        link.send(FrameEncoder(255, 190).encode(dialect.MAVLink_ping_message(0, 5, 0, 0)))
        for _ in range(100):
            sitl.advance()
            if (1, 1, "PING") in received(link):
                break
        else:
            pytest.fail("no answer to PING")
    finally:
        sitl.close()


@pytest.mark.parametrize("firmware", ["px4", "ardupilot"])
def test_a_paused_firmware_changes_nothing(firmware: str, request: pytest.FixtureRequest) -> None:
    climbs = []
    for pause in (False, True):
        sitl = sitl_of(request.getfixturevalue(f"{firmware}_build"))
        try:
            start(sitl)
            climbs.append(climb_m(sitl, 100))
            if pause:
                pid = sitl.vehicles[0].backend._process.pid  # type: ignore[attr-defined]
                os.kill(pid, signal.SIGSTOP)
                threading.Timer(0.6, os.kill, (pid, signal.SIGCONT)).start()
            climbs[-1] += climb_m(sitl, 100)
        finally:
            sitl.close()
    assert climbs[0] == pytest.approx(climbs[1], rel=0.02)


@pytest.mark.parametrize(
    ("firmware", "named"),
    [
        ("px4", "PX4 ended with exit code 3; its last output: .*end of its life"),
        ("ardupilot", "ArduPilot ended"),
    ],
)
def test_a_firmware_that_ends_in_flight_is_one_clear_error(
    firmware: str, named: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STAND_IN", "end:50")
    sitl = sitl_of(request.getfixturevalue(f"{firmware}_build"))
    try:
        with pytest.raises(FirmwareError, match=named):
            climb_m(sitl, 5000)
    finally:
        sitl.close()


def test_a_firmware_that_ends_is_started_again_by_a_sitl_that_contains_failures(
    px4_build: FirmwareBuild, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STAND_IN", "end:50")
    sitl = sitl_of(px4_build)
    failures: list[VehicleFailure] = []
    sitl.contain(failures.append)
    try:
        start(sitl)
        first = sitl.vehicles[0].backend
        climb_m(sitl, 100)
        assert [failure.system_id for failure in failures] == [1]
        assert "end of its life" in failures[0].reason
        monkeypatch.delenv("STAND_IN")
        while sitl.vehicles[0].backend is first:  # the time of a reboot
            assert sitl.time_us < 10_000_000
            sitl.advance()
        start(sitl)
        assert climb_m(sitl, 150) > 0.1
    finally:
        sitl.close()


@pytest.mark.parametrize(
    ("firmware", "module", "limit", "named"),
    [
        ("px4", px4, "_CONNECTING_S", "PX4 did not connect to the simulator's port 4[0-9]+ within 0.6 s"),
        ("ardupilot", ardupilot, "_STARTING_S", "ArduPilot sent no servo outputs within 0.6 s"),
    ],
)
def test_a_program_that_does_not_answer_is_ended(
    firmware: str,
    module: object,
    limit: str,
    named: str,
    request: pytest.FixtureRequest,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, limit, 0.6)
    monkeypatch.setenv("STAND_IN", "deaf")
    with pytest.raises(FirmwareError, match=named):
        sitl_of(request.getfixturevalue(f"{firmware}_build"))


def test_a_team_of_which_one_does_not_start_leaves_no_process(ardupilot_build: FirmwareBuild) -> None:
    started: list[ArduPilotBackend] = []

    def make(setup: BackendSetup) -> Boot:
        maker = firmware_backend(
            ardupilot_build if not started else FirmwareBuild("ardupilot", Path("/bin/false"))
        )

        def boot(unix_epoch_us: int) -> AutopilotBackend:
            backend = maker(setup)(unix_epoch_us)
            assert isinstance(backend, ArduPilotBackend)
            started.append(backend)
            return backend

        return boot

    vehicles = tuple(VehicleSpec(system_id=number, autopilot="ardupilot") for number in (1, 2))
    with pytest.raises(FirmwareError):
        Sitl(WorldSpec(vehicles=vehicles), backend=make)
    with pytest.raises(FirmwareError, match="ended"):
        started[0]._process.require_running()


def test_a_program_for_another_class_of_vehicle_is_refused(
    ardupilot_build: FirmwareBuild, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STAND_IN", "plane")
    sitl = sitl_of(ardupilot_build)
    try:
        with pytest.raises(FirmwareError, match="give arducopter for multicopters"):
            climb_m(sitl, 200)
    finally:
        sitl.close()


def test_a_wrong_program_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(FirmwareError, match="ArduPilot ended with exit code 1"):
        sitl_of(FirmwareBuild("ardupilot", Path("/bin/false")))
    with pytest.raises(ValueError, match="is not a program; give ArduPilot's SITL binary"):
        sitl_of(FirmwareBuild("ardupilot", tmp_path / "none"))
    with pytest.raises(ValueError, match="has no bin/px4 and no etc; it must be PX4's build folder"):
        sitl_of(FirmwareBuild("px4", tmp_path))


@pytest.mark.parametrize("text", ["", "px5", "px4=", "=x", "PX4"])
def test_a_firmware_that_is_none_of_the_forms_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=f"firmware '{text}' is not accepted; give px4=FOLDER"):
        FirmwareBuild.parse(text)


def test_a_build_is_taken_from_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FLIGHTSTACK_ARDUPLANE", raising=False)
    with pytest.raises(ValueError, match="or set FLIGHTSTACK_ARDUPLANE"):
        FirmwareBuild.parse("ardupilot").located(AirframeKind.FIXED_WING)
    monkeypatch.setenv("FLIGHTSTACK_ARDUPLANE", "/bin/true")
    assert FirmwareBuild.parse("ardupilot").located(AirframeKind.FIXED_WING).name
    assert str(FirmwareBuild.parse("px4=a/b")) == "px4=a/b"


def test_vehicles_of_another_firmware_are_refused(px4_build: FirmwareBuild) -> None:
    world = WorldSpec(vehicles=(VehicleSpec(autopilot="ardupilot"),))
    with pytest.raises(ValueError, match="vehicle 1 has the autopilot ardupilot, and the firmware is px4"):
        Sitl(world, backend=firmware_backend(px4_build))


def test_what_px4_starts_with(px4_build: FirmwareBuild, tmp_path: Path) -> None:
    """The airframe of the emulated autopilot, the rotors of the model, the user's values, the links."""
    logs = tmp_path / "logs"
    logs.mkdir()
    sitl = sitl_of(px4_build, logs_to=logs, parameters={"MPC_XY_P": 0.9, "NAV_ACC_RAD": 3.0})
    etc = sitl.vehicles[0].backend._folder.path / "px4" / "etc"  # type: ignore[attr-defined]
    start = (etc / "init.d-posix" / "px4-rc.mavlinksim").read_text()
    values = dict(
        (line.split()[2], float(line.split()[3])) for line in start.splitlines() if "set-default" in line
    )
    sitl.close()
    assert start.splitlines()[1] == f". '{px4_build.path}/etc/init.d-posix/px4-rc.mavlinksim'"
    assert values["MPC_XY_P"] == 0.9 and values["NAV_ACC_RAD"] == 3
    assert values["MC_YAWRATE_P"] == 0.45  # of the emulated airframe
    assert values["CA_ROTOR_COUNT"] == 4 and values["PWM_MAIN_FUNC4"] == 104
    assert values["CA_ROTOR0_PX"] > 0.0 < values["CA_ROTOR0_PY"]
    assert (etc / "init.d-posix" / "rcS").read_text() == "# of the build\n"
    assert (etc / "init.d").is_symlink()
    assert "stand-in for PX4" in (logs / "vehicle1-console.txt").read_text()


def test_what_ardupilot_is_answered(ardupilot_build: FirmwareBuild) -> None:
    sitl = sitl_of(ardupilot_build)
    folder = sitl.vehicles[0].backend._folder.path  # type: ignore[attr-defined]
    climb_m(sitl, 60)
    sitl.close()
    states = [json.loads(line) for line in (folder / "received.jsonl").read_text().splitlines()]
    times_us = [round(state["timestamp"] * 1e6) for state in states]
    assert times_us == [2000 * (number + 1) for number in range(len(states))]  # two in a step of 4 ms
    assert abs(states[-1]["quaternion"][1]) < 0.01 > abs(states[-1]["quaternion"][2])  # level
    assert states[-1]["position"][2] < 0.0 < states[-1]["battery"]["voltage"]


def test_the_rotors_of_the_quadrotor_are_measured() -> None:
    figures = hover_figures("iris")
    assert figures is not None
    # flightsim/models/iris/iris.xml: 0.1768 m; the battery's sag makes them a tenth longer
    arms = [(rotor.forward_m / 0.1768, rotor.right_m / 0.1768) for rotor in figures.rotors]
    assert arms == [pytest.approx(signs, rel=0.15) for signs in ((1, 1), (-1, -1), (1, -1), (-1, 1))]
    assert [rotor.moment_ratio_m > 0 for rotor in figures.rotors] == [True, True, False, False]
    assert figures.thrust_fraction == pytest.approx(0.45, abs=0.03)
    assert len(figures.rotors) <= MAX_ACTUATORS


def test_faults_of_sensors_are_parameters_of_ardupilots_simulator() -> None:
    faults = [
        FaultSpec(unit=FaultUnit.GPS, start_s=20.0, duration_s=5.0),
        FaultSpec(unit=FaultUnit.MAG, start_s=10.0),
        FaultSpec(unit=FaultUnit.MOTOR, start_s=1.0, instance=1),  # the vehicle's
        FaultSpec(unit=FaultUnit.BARO, start_s=1.0, vehicle=2),
    ]
    assert parameter_changes(faults, 1) == [
        (10_000_000, "SIM_MAG1_FAIL", 1.0),
        (20_000_000, "SIM_GPS_DISABLE", 1.0),
        (25_000_000, "SIM_GPS_DISABLE", 0.0),
    ]
    with pytest.raises(ValueError, match="fault AIRSPEED STUCK: ArduPilot makes its sensors itself"):
        parameter_changes([FaultSpec(unit=FaultUnit.AIRSPEED, failure=FaultType.STUCK, start_s=1.0)], 1)
