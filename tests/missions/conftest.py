"""A scripted autopilot for mission tests: a point mass that speaks MAVLink as PX4 and ArduPilot do at the
points that matter to a mission. It shares no code with the emulated autopilot.
"""

import asyncio
import math
import resource
import struct
import sys
from contextlib import contextmanager
from dataclasses import replace

import pytest

from autopilot_bridge.clock import LoopClock, VirtualTimeLoop, run
from autopilot_bridge.links import memory_pair
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode, definition, dialect
from autopilot_bridge.mavlink.simulation_marks import PX4_SITL_UID
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.runs import session
from missions.runs.vehicle_opening import VehicleOpener, embedded_stage
from missions.vehicle import Vehicle
from missions.vehicle.connection import Connection

STEP_US = 20_000
HOME = GeodeticPosition(lat_deg=47.39774, lon_deg=8.54559, alt_m=489.4)
ORIGIN_OFFSET = (1.5, -2.0, 0.3)  # home lies here in the autopilot's local frame

PX4_HOLD, PX4_TAKEOFF, PX4_MISSION = 0x03040000, 0x02040000, 0x04040000
PX4_RTL, PX4_LAND, PX4_OFFBOARD, PX4_POSITION = 0x05040000, 0x06040000, 0x00060000, 0x00030000
KIND = {
    "px4": {PX4_HOLD: "hold", PX4_TAKEOFF: "takeoff", PX4_MISSION: "mission", PX4_RTL: "return",
            PX4_LAND: "land", PX4_OFFBOARD: "guided", PX4_POSITION: "position"},
    "ardupilot": {17: "hold", 3: "mission", 6: "return", 9: "land", 4: "guided", 5: "position", 0: "manual"},
}  # fmt: skip
DOWN = (0.0, 0.0, 1.5)  # velocity of a landing, NED
DEFAULT_STREAMS = {
    "px4": {"HEARTBEAT": 1.0, "SYS_STATUS": 5.0, "GLOBAL_POSITION_INT": 25.0, "LOCAL_POSITION_NED": 10.0,
            "ATTITUDE": 25.0, "EXTENDED_SYS_STATE": 5.0, "HOME_POSITION": 0.5, "MISSION_CURRENT": 1.0},
    "ardupilot": {"HEARTBEAT": 1.0},
}  # fmt: skip
DATA_STREAM = ("SYS_STATUS", "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "ATTITUDE", "EKF_STATUS_REPORT",
               "MISSION_CURRENT", "GPS_RAW_INT")  # fmt: skip


class FakeAutopilot:
    """One vehicle. Tests change its attributes to make it misbehave."""

    def __init__(self, link, flavour="px4", system_id=1, home=HOME):
        self.flavour, self.system_id, self.home = flavour, system_id, home
        self.link = link
        self.encoder = FrameEncoder(system_id, 1)
        self.truth_encoder = FrameEncoder(system_id, 240)
        self.parser = FrameParser()
        self.time_us = 0
        self.pos = [0.0, 0.0, 0.0]  # NED from home
        self.vel = [0.0, 0.0, 0.0]
        self.yaw = 0.0
        self.armed = False
        self.mode = PX4_HOLD if flavour == "px4" else 0
        self.ready_after_us = 3_000_000
        self.streams = dict(DEFAULT_STREAMS[flavour])
        self.due = {}
        self.target = None
        self.setpoint = None
        self.setpoint_us = -10_000_000
        self.setpoints = []
        self.items, self.current, self.speed = [], 0, 5.0
        self.parameters = {
            "MPC_XY_VEL_MAX": (12.0, 9),
            "MPC_ACC_HOR": (3.0, 9),
            "NAV_MC_ALT_RAD": (0.8, 9),
            "COM_RC_LOSS_T": (4, 6),
            "WPNAV_SPEED": (1000.0, 9),
            "WPNAV_ACCEL": (250.0, 9),
            "WPNAV_RADIUS": (200.0, 9),
            "MIS_TKO_LAND_REQ": (0, 6),
            "GF_MAX_HOR_DIST": (0.0, 9),
            "GF_MAX_VER_DIST": (0.0, 9),
            "ARMING_CHECK": (1, 6),
            "ARMING_MIS_ITEMS": (0, 6),
        }
        self.mute_commands = set()  # MAV_CMDs that are not answered
        self.refuse_modes = set()  # kinds of mode that are refused
        self.base_mode = 0  # further bits of the heartbeat
        self.version = (PX4_SITL_UID, [0] * 18)  # AUTOPILOT_VERSION: uid and uid2; None: it does not answer
        self.unready_modes = set()  # kinds of mode in which the pre-arm checks fail
        self.arm_refusals = 0
        self.mission_result = 0
        self.commands = []
        self.heartbeats_received = 0
        self.on_truth = None

    @property
    def kinds(self):
        return KIND[self.flavour]

    @property
    def kind(self):
        return KIND[self.flavour].get(self.mode, "other")

    # wire

    def receive(self, data):
        for frame in self.parser.feed(data):
            message = decode(frame)
            handler = getattr(self, "on_" + message.get_type().lower(), None)
            if handler is not None:
                handler(message)

    def send(self, message):
        self.link.send(self.encoder.encode(message))

    def text(self, text, severity=4):
        self.send(dialect.MAVLink_statustext_message(severity, text.encode()))

    def ack(self, command, result, sender=(255, 190)):
        self.send(dialect.MAVLink_command_ack_message(command, result, 0, 0, *sender))

    def on_heartbeat(self, m):
        self.heartbeats_received += 1

    # commands

    def on_command_long(self, m):
        self.commands.append((m.command, m.confirmation))
        if m.command in self.mute_commands:
            return
        p = [m.param1, m.param2, m.param3, m.param4, m.param5, m.param6, m.param7]
        self._command(m.command, p)

    def on_command_int(self, m):
        self.commands.append((m.command, 0))
        if m.command == dialect.MAV_CMD_DO_REPOSITION:
            self.target = LocalFrame(self.home).ned_from_geodetic(m.x * 1e-7, m.y * 1e-7, m.z)
            if self.flavour == "ardupilot":
                self.mode = 4
                self.setpoint = None
            self.ack(m.command, 0)

    def _command(self, command, p):
        d = dialect
        if command == d.MAV_CMD_DO_SET_MODE:
            self._set_mode(p)
        elif command == d.MAV_CMD_COMPONENT_ARM_DISARM:
            if p[0] > 0.5 and not self.armed:
                if self.arm_refusals or self.time_us < self.ready_after_us:
                    self.arm_refusals -= 1
                    self.text("Arming denied: Resolve system health failures first")
                    return self.ack(command, 1 if self.flavour == "px4" else 4)
                if self.flavour == "ardupilot" and self.kind == "mission":
                    return self.ack(command, 4)
                self.armed = True
                if self.flavour == "px4" and self.kind == "mission":
                    self.current = 0
            elif p[0] < 0.5:
                if self.pos[2] < -0.5:
                    return self.ack(command, 1)
                self.armed = False
            self.ack(command, 0)
        elif command == d.MAV_CMD_NAV_TAKEOFF:
            if not self.armed:
                return self.ack(command, 4)
            height = p[6] - self.home.alt_m if self.flavour == "px4" else p[6]
            self.target = (self.pos[0], self.pos[1], -height)
            if self.flavour == "px4":
                self.mode = PX4_TAKEOFF
            self.ack(command, 0)
        elif command == d.MAV_CMD_MISSION_START:
            self.current = 1
            self.ack(command, 0)
        elif command == d.MAV_CMD_SET_MESSAGE_INTERVAL:
            name = definition(int(p[0])).name
            self.streams[name] = 1e6 / p[1]
            self.ack(command, 0)
        elif command == d.MAV_CMD_REQUEST_MESSAGE:
            self.ack(command, 0)
            name = definition(int(p[0])).name
            if not (self.flavour == "px4" and name == "GPS_GLOBAL_ORIGIN"):
                self._send_stream(name)
        else:
            self.ack(command, 3)

    def _set_mode(self, p):
        command = dialect.MAV_CMD_DO_SET_MODE
        mode = int(p[1]) << 16 | int(p[2]) << 24 if self.flavour == "px4" else int(p[1])
        kind = KIND[self.flavour].get(mode)
        fresh = self.time_us - self.setpoint_us < 1_000_000
        no_setpoints = self.flavour == "px4" and kind == "guided" and not fresh
        if self.flavour == "px4":
            self.ack(command, 0)  # before it knows
        if kind is None or kind in self.refuse_modes or no_setpoints:
            return self.ack(command, 1 if self.flavour == "px4" else 4)
        if mode != self.mode:
            self.target = None
        self.mode = mode
        if kind == "hold":
            self.target = tuple(self.pos)
        self.ack(command, 0)
        if self.flavour == "ardupilot":
            self._send_stream("HEARTBEAT")

    def on_request_data_stream(self, m):
        for name in DATA_STREAM:
            self.streams.setdefault(name, float(m.req_message_rate))
        self._send_stream("HOME_POSITION")

    def on_set_position_target_local_ned(self, m):
        self.setpoint, self.setpoint_us = m, self.time_us
        self.setpoints.append((self.time_us, m))

    # parameters

    def _wire(self, value, kind):
        if self.flavour == "px4" and kind == 6:
            return struct.unpack("<f", struct.pack("<i", int(value)))[0]
        return float(value)

    def on_param_request_read(self, m):
        name = str(m.param_id)
        if name in self.parameters:
            value, kind = self.parameters[name]
            self.send(
                dialect.MAVLink_param_value_message(name.encode(), self._wire(value, kind), kind, 9, 65535)
            )

    def on_param_set(self, m):
        name = str(m.param_id)
        if name in self.parameters:
            kind = self.parameters[name][1]
            value = m.param_value
            if self.flavour == "px4" and kind == 6:
                value = struct.unpack("<i", struct.pack("<f", value))[0]
            if not (name == "MPC_ACC_HOR" and value > 15.0):
                self.parameters[name] = (value, kind)
            self.on_param_request_read(m)

    # missions

    def on_mission_count(self, m):
        self.items = [None] * m.count
        self.send(dialect.MAVLink_mission_request_message(255, 190, 0, 0))

    def on_mission_item_int(self, m):
        if m.seq >= len(self.items):
            return
        if self.mission_result and m.seq == 2:
            self.send(dialect.MAVLink_mission_ack_message(255, 190, self.mission_result, 0))
            return
        self.items[m.seq] = m
        if m.seq + 1 < len(self.items):
            request = dialect.MAVLink_mission_request_int_message
            if self.flavour == "ardupilot":
                request = dialect.MAVLink_mission_request_message
            self.send(request(255, 190, m.seq + 1, 0))
        else:
            self.send(dialect.MAVLink_mission_ack_message(255, 190, 0, 0))

    def on_mission_set_current(self, m):
        self.current = m.seq
        self._send_stream("MISSION_CURRENT")

    def on_mission_clear_all(self, m):
        self.items = []
        self.send(dialect.MAVLink_mission_ack_message(255, 190, 0, 0))

    def on_mission_request_list(self, m):
        self.send(dialect.MAVLink_mission_count_message(255, 190, len(self.items), 0))

    def on_mission_request_int(self, m):
        item = self.items[m.seq]
        self.send(
            dialect.MAVLink_mission_item_int_message(
                255, 190, m.seq, item.frame, item.command, 0, 1, item.param1, item.param2, item.param3,
                item.param4, item.x, item.y, item.z, 0,
            )
        )  # fmt: skip

    # telemetry

    def _send_stream(self, name):
        d, t = dialect, self.time_us // 1000
        n, e, down = self.pos
        if name == "HEARTBEAT":
            px4 = self.flavour == "px4"
            base = 1 | (128 if self.armed else 0) | self.base_mode
            self.send(
                d.MAVLink_heartbeat_message(2, 12 if px4 else 3, base, self.mode, 4 if self.armed else 3, 3)
            )
        elif name == "SYS_STATUS":
            unready = self.kind in self.unready_modes
            ready = 0x10000000 if self.time_us >= self.ready_after_us and not unready else 0
            self.send(d.MAVLink_sys_status_message(ready, ready, ready, 0, 16200, -1, 100, 0, 0, 0, 0, 0, 0))
        elif name == "GLOBAL_POSITION_INT":
            lat, lon, alt = LocalFrame(self.home).geodetic_from_ned(n, e, down)
            self.send(
                d.MAVLink_global_position_int_message(  # type: ignore[call-arg]
                    t, round(lat * 1e7), round(lon * 1e7), round(alt * 1e3), round(-down * 1e3),
                    *(round(v * 100) for v in self.vel), 0xFFFF,
                )
            )  # fmt: skip
        elif name == "LOCAL_POSITION_NED":
            local = [p + o for p, o in zip(self.pos, ORIGIN_OFFSET, strict=True)]
            self.send(d.MAVLink_local_position_ned_message(t, *local, *self.vel))
        elif name == "ATTITUDE":
            self.send(d.MAVLink_attitude_message(t, 0.0, 0.01, self.yaw, 0.0, 0.0, 0.0))
        elif name == "ATTITUDE_TARGET":
            q = [math.cos(0.5 * self.yaw), 0.0, 0.0, math.sin(0.5 * self.yaw)]
            self.send(d.MAVLink_attitude_target_message(t, 0, q, 0.0, 0.0, 0.0, 0.5))
        elif name == "EXTENDED_SYS_STATE":
            self.send(d.MAVLink_extended_sys_state_message(0, 1 if down > -0.1 else 2))
        elif name == "EKF_STATUS_REPORT":
            flags = 831 if self.time_us >= self.ready_after_us else 167
            self.send(d.MAVLink_ekf_status_report_message(flags, 0.0, 0.0, 0.0, 0.0, 0.0))
        elif name == "HOME_POSITION":
            h = self.home
            self.send(
                d.MAVLink_home_position_message(
                    round(h.lat_deg * 1e7), round(h.lon_deg * 1e7), round(h.alt_m * 1e3), *ORIGIN_OFFSET,
                    [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0,
                )
            )  # fmt: skip
        elif name == "GPS_GLOBAL_ORIGIN":
            lat, lon, alt = LocalFrame(self.home).geodetic_from_ned(*(-v for v in ORIGIN_OFFSET))
            self.send(
                d.MAVLink_gps_global_origin_message(round(lat * 1e7), round(lon * 1e7), round(alt * 1e3))
            )
        elif name == "MISSION_CURRENT":
            self.send(d.MAVLink_mission_current_message(self.current))
        elif name == "AUTOPILOT_VERSION" and self.version is not None:
            uid, uid2 = self.version
            self.send(
                d.MAVLink_autopilot_version_message(0, 0, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, uid, uid2)
            )

    # motion

    def step(self, time_us):
        self.time_us = time_us
        if self.armed:
            self._fly(STEP_US * 1e-6)
        for name, rate_hz in list(self.streams.items()):
            if time_us >= self.due.get(name, 0):
                self.due[name] = time_us + round(1e6 / rate_hz)
                self._send_stream(name)
        if self.on_truth is not None:
            lat, lon, alt = LocalFrame(self.home).geodetic_from_ned(*self.pos)
            q = [math.cos(0.5 * self.yaw), 0.0, 0.0, math.sin(0.5 * self.yaw)]
            message = dialect.MAVLink_hil_state_quaternion_message(  # type: ignore[call-arg]
                time_us, q, 0.0, 0.0, 0.0, round(lat * 1e7), round(lon * 1e7), round(alt * 1e3),
                *(round(v * 100) for v in self.vel), 0, 0, 0, 0, -1000,
            )  # fmt: skip
            self.on_truth(time_us, self.truth_encoder.encode(message))

    def _fly(self, dt):
        kind = self.kind
        wanted = (0.0, 0.0, 0.0)
        if kind == "guided" and self.setpoint is not None:
            if self.flavour == "px4" and self.time_us - self.setpoint_us > 1_000_000:
                self.text("Failsafe activated", 2)
                self.mode = PX4_POSITION
            s = self.setpoint
            p = [v - o for v, o in zip((s.x, s.y, s.z), ORIGIN_OFFSET, strict=True)]
            # the setpoint stands for the middle of its period: no lag for a perfect follower
            wanted = [v + 8.0 * (a - b) for v, a, b in zip((s.vx, s.vy, s.vz), p, self.pos, strict=True)]
            self.yaw = s.yaw
        elif kind == "mission":
            wanted = self._fly_mission()
        elif kind in ("return", "land"):
            wanted = self._return() if kind == "return" else DOWN
        elif self.target is not None:
            wanted = self._towards(self.target, 5.0)
        if kind == "takeoff" and self.target and abs(self.pos[2] - self.target[2]) < 0.1:
            self.mode = PX4_HOLD
        self.vel = [float(v) for v in wanted]
        self.pos = [p + v * dt for p, v in zip(self.pos, self.vel, strict=True)]
        if self.pos[2] > 0.0:
            self.pos[2], self.vel = 0.0, [0.0, 0.0, 0.0]
        landing = kind in ("return", "land") or (kind == "mission" and wanted is DOWN)
        if landing and self.pos[2] >= 0.0:
            self.armed = False

    def _return(self):
        away = math.hypot(self.pos[0], self.pos[1])
        return self._towards((0.0, 0.0, min(self.pos[2], -5.0)), 8.0) if away > 0.3 else DOWN

    def _towards(self, target, speed):
        delta = [a - b for a, b in zip(target, self.pos, strict=True)]
        distance = math.hypot(*delta)
        if distance < 1e-6:
            return (0.0, 0.0, 0.0)
        pace = min(speed, 2.0 * distance)
        return [pace * d / distance for d in delta]

    def _fly_mission(self):
        d = dialect
        if self.current >= len(self.items):
            return (0.0, 0.0, 0.0)
        item = self.items[self.current]
        done = False
        wanted = (0.0, 0.0, 0.0)
        if item.command == d.MAV_CMD_NAV_TAKEOFF:
            goal = (self.pos[0], self.pos[1], -item.z)
            wanted, done = self._towards(goal, 3.0), abs(self.pos[2] + item.z) < 0.3
        elif item.command == d.MAV_CMD_NAV_WAYPOINT:
            n, e, _ = LocalFrame(self.home).ned_from_geodetic(item.x * 1e-7, item.y * 1e-7, 0.0)
            goal = (n, e, -item.z)
            wanted, done = self._towards(goal, self.speed), math.dist(goal, self.pos) < 1.0
        elif item.command == d.MAV_CMD_DO_CHANGE_SPEED:
            self.speed, done = item.param2, True
        elif item.command == d.MAV_CMD_NAV_RETURN_TO_LAUNCH:
            if self.flavour == "px4":
                self.mode = PX4_RTL
            wanted = self._return()  # ArduCopter stays in Auto
        elif item.command == d.MAV_CMD_NAV_LAND:
            wanted = DOWN
        if done:
            # As both firmwares send it: a DO_ item's number takes the place of the one directly before it.
            following = self.items[self.current + 1 : self.current + 2]
            if not (following and following[0].command == d.MAV_CMD_DO_CHANGE_SPEED):
                self.send(d.MAVLink_mission_item_reached_message(self.current))
            self.current += 1
        return wanted


class FakeSitl:
    """Fake autopilots under a virtual-time loop; has the surface of an embedded SITL."""

    emulated = True

    def __init__(self, flavour="px4", vehicles=1, truth=True):
        self.time_us = 0
        self.home = HOME
        self.published_map = None
        self.autopilots, self.links, self._listeners = [], [], []
        for k in range(vehicles):
            theirs, ours = memory_pair(f"mission{k}", f"vehicle{k}")
            lat, lon, alt = LocalFrame(HOME).geodetic_from_ned(0.0, 5.0 * k, 0.0)
            home = GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt)
            autopilot = FakeAutopilot(ours, flavour, k + 1, home)
            ours.on_receive = autopilot.receive
            if truth:
                autopilot.on_truth = self._truth
            self.autopilots.append(autopilot)
            self.links.append(theirs)
        self.closed = False
        self.loop = VirtualTimeLoop(self.advance, lambda: self.time_us, max_time_us=4_000_000_000)

    def pictures(self):
        return {}

    def pictures_of(self, system_id):
        return ()

    def advance(self):
        self.time_us += STEP_US
        for autopilot in self.autopilots:
            autopilot.step(self.time_us)

    def endurance_s(self, index):
        return None

    def parameters(self, index, names):
        return {name: self.autopilots[index].parameters[name][0] for name in names}

    def on_truth(self, listener):
        self._listeners.append(listener)

    def _truth(self, time_us, frame):
        for listener in self._listeners:
            listener(time_us, frame)

    def close(self):
        self.closed = True
        for link in self.links:
            link.close()


@pytest.fixture
def make_sitl():
    """Factory of fake SITLs."""
    return FakeSitl


@pytest.fixture
def little_room(monkeypatch):
    """A context in which no file of this process may get longer than so many bytes, as on a full disk."""

    @contextmanager
    def room(most):
        monkeypatch.setattr(sys, "dont_write_bytecode", True)  # Python puts up with half a file of its own
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

    return room


class ScriptedWorlds(list, VehicleOpener):
    """Opens scripted autopilots in place of embedded worlds, and lists them.

    Attributes:
        make: creates one from flavour and number of vehicles.
    """

    make = FakeSitl

    def kind_of(self, model):
        if model != "iris":
            raise PlanError(f"vehicle model {model!r} is unknown")
        return VehicleKind.MULTICOPTER

    def open_world(self, request, folder):
        vehicles = request.embedded_world.vehicles
        self.append(self.make(vehicles[0].autopilot, len(vehicles)))
        return embedded_stage(self[-1])


@pytest.fixture
def fly_with(monkeypatch):
    """Makes flights open their vehicles with an opener, those of the command line too."""

    return lambda opener: monkeypatch.setattr(session, "VehicleOpener", lambda: opener)


@pytest.fixture
def scripted(fly_with):
    """Embedded worlds are scripted autopilots; gives the list of those that were opened."""
    worlds = ScriptedWorlds()
    fly_with(worlds)
    return worlds


@pytest.fixture
def elsewhere(fly_with):
    """What `--connect` leads to: a scripted autopilot; its time is a virtual loop's."""
    sitl = FakeSitl(truth=False)

    class Opener(VehicleOpener):
        def open_vehicles(self, request):
            return replace(embedded_stage(sitl), epoch_us=None, parameters=None, home=None)

    fly_with(Opener())
    return sitl.autopilots[0]


@pytest.fixture
def flown():
    """Runs `async def script(vehicle, autopilot)` against a fake autopilot; gives its result."""

    def fly(script, flavour="px4", ready=True, setup=None):
        sitl = FakeSitl(flavour)
        autopilot = sitl.autopilots[0]
        if setup is not None:
            setup(autopilot)

        async def main():
            async with Connection(sitl.links[0], LoopClock()) as connection:
                vehicle = Vehicle(connection)
                if ready:
                    await vehicle.wait_ready()
                else:
                    await asyncio.sleep(0)
                return await script(vehicle, autopilot)

        return run(main(), sitl.loop)

    return fly
