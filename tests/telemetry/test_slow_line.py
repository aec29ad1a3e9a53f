"""Lines that carry less than there is to say: streams are thinned, answers go first, nothing piles up."""

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot_bridge.firmware.ardupilot import services as ardupilot_services
from autopilot_bridge.firmware.px4 import services as px4_services
from autopilot_bridge.mavlink import DEFINITIONS, FrameEncoder, FrameParser, MAVLinkMessage, dialect
from autopilot_bridge.sitl import Sitl
from autopilot_bridge.telemetry.line import LATEST_S, SLOW_US, LineBudget, RadioFlow, fit, thinned_us
from flightsim.world_spec import VehicleSpec, WorldSpec

BAUD_57600 = 5760.0
FLAVOURS = ("px4", "ardupilot")


class Client:
    """The far end of a line, and what came over it."""

    def __init__(self, flavour: str, bytes_per_s: float | None) -> None:
        self.sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(autopilot=flavour),)))
        self.link = self.sitl.connect(0, bytes_per_s=bytes_per_s)
        self.link.on_receive = self._take
        self.counts: Counter[str] = Counter()
        self.bytes = 0
        self.longest_backlog_s = 0.0
        self._parser, self._encoder = FrameParser(), FrameEncoder(255, 190)
        if flavour == "ardupilot":
            self.send(dialect.MAVLink_request_data_stream_message(1, 1, 0, 10, 1))

    def _take(self, data: bytes) -> None:
        self.bytes += len(data)
        self.counts.update(DEFINITIONS[frame.message_id].name for frame in self._parser.feed(data))

    def send(self, message: MAVLinkMessage) -> None:
        self.link.send(self._encoder.encode(message))

    def run(self, seconds: float) -> Counter[str]:
        """What comes in so many seconds of vehicle time."""
        self.counts.clear()
        self.bytes = 0
        line = self.sitl.vehicles[0].channels[0].line
        for _ in range(round(250 * seconds)):
            self.sitl.advance()
            if line is not None:
                backlog_s = line.backlog_bytes / line.bytes_per_s
                self.longest_backlog_s = max(self.longest_backlog_s, backlog_s)
        return Counter(self.counts)


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
def test_streams_fit_a_line_of_57600_baud(flavour: str) -> None:
    """Every stream runs, the fast ones in proportion, the slow ones and the heartbeat whole."""
    free, slow = Client(flavour, None), Client(flavour, BAUD_57600)
    for client in (free, slow):
        client.run(15.0)
    fast, thinned = free.run(20.0), slow.run(20.0)
    assert free.bytes > 20.0 * BAUD_57600  # else there were nothing to thin
    assert 0.7 * 20.0 * BAUD_57600 < slow.bytes < 20.0 * BAUD_57600
    assert slow.longest_backlog_s < LATEST_S
    assert set(thinned) == set(fast)
    for name, count in fast.items():
        if count <= 20:
            assert abs(thinned[name] - count) <= 1, name
        else:
            assert thinned[name] >= 19, name
    if flavour == "px4":  # ATTITUDE at 100 Hz, LOCAL_POSITION_NED at 30 Hz
        assert thinned["ATTITUDE"] / thinned["LOCAL_POSITION_NED"] == pytest.approx(100 / 30, rel=0.1)


@pytest.mark.slow
def test_streams_leave_room_for_a_gimbal() -> None:
    """What other components of the vehicle say is not thinned; the autopilot's streams get the rest."""
    client = Client("px4", BAUD_57600)
    client.run(15.0)
    (channel,) = client.sitl.vehicles[0].channels
    frame = FrameEncoder(1, 154).encode(
        dialect.MAVLink_gimbal_device_attitude_status_message(
            0, 0, 1, 0, (1.0, 0.1, 0.1, 0.1), 1.0, 1.0, 1.0, 1
        )
    )
    for step in range(round(250 * 20.0)):
        if step == 250 * 5:
            client.counts.clear()
            client.bytes, client.longest_backlog_s = 0, 0.0
        if step % 10 == 0:
            channel.send_own_frame(frame)
        client.sitl.advance()
        client.longest_backlog_s = max(client.longest_backlog_s, channel.line.backlog_bytes / BAUD_57600)
    assert client.counts["GIMBAL_DEVICE_ATTITUDE_STATUS"] == 25 * 15
    assert client.counts["SYS_STATUS"] >= 14  # what comes once a second keeps its rate
    assert 0.7 * 15.0 * BAUD_57600 < client.bytes < 0.95 * 15.0 * BAUD_57600
    assert client.longest_backlog_s < 0.2


@pytest.mark.slow
def test_a_wide_line_changes_nothing() -> None:
    wide, free = Client("px4", 92160.0), Client("px4", None)
    for client in (wide, free):
        client.run(8.0)
    thinned, whole = wide.run(10.0), free.run(10.0)
    assert set(thinned) == set(whole)
    assert all(abs(thinned[name] - count) <= 1 for name, count in whole.items())


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_the_same_bytes_again(flavour: str) -> None:
    first, second = Client(flavour, BAUD_57600), Client(flavour, BAUD_57600)
    assert first.run(12.0) == second.run(12.0)
    assert first.bytes == second.bytes


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_a_list_of_parameters_goes_first_and_does_not_silence_the_vehicle(flavour: str) -> None:
    client = Client(flavour, BAUD_57600)
    client.run(12.0)
    count = client.sitl.vehicles[0].autopilot.parameters.count
    client.send(dialect.MAVLink_param_request_list_message(1, 1))
    during = client.run(1.25 * count * 37 / BAUD_57600)
    assert during["PARAM_VALUE"] >= count
    assert during["HEARTBEAT"] >= 2
    assert during["ATTITUDE"] >= 2
    assert client.longest_backlog_s < LATEST_S


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_a_command_is_answered_at_once_on_a_full_line(flavour: str) -> None:
    client = Client(flavour, BAUD_57600)
    client.run(12.0)
    client.send(dialect.MAVLink_param_request_list_message(1, 1))
    client.run(1.0)
    command = dialect.MAVLink_command_long_message(1, 1, dialect.MAV_CMD_REQUEST_MESSAGE, 0, 148, *[0] * 6)
    client.send(command)
    assert client.counts["COMMAND_ACK"] == 1  # on its way, behind the little that the line has still to carry
    assert client.run(0.06)["AUTOPILOT_VERSION"] == 1
    assert client.longest_backlog_s < LATEST_S


def test_a_line_of_1200_baud_still_has_heartbeats() -> None:
    client = Client("px4", 120.0)
    client.run(5.0)
    assert client.run(20.0)["HEARTBEAT"] == 20


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
def test_a_radio_with_a_full_buffer_slows_the_streams_down(flavour: str) -> None:
    """RADIO_STATUS, on a link that has no limit of its own; and fast again when the buffer is empty."""
    client = Client(flavour, None)
    client.run(15.0)
    before = client.run(4.0)
    for _ in range(30):
        client.send(dialect.MAVLink_radio_status_message(200, 200, 10, 30, 30, 0, 0))
    client.run(1.0)
    during = client.run(4.0)
    assert during["ATTITUDE"] < 0.3 * before["ATTITUDE"]
    assert during["HEARTBEAT"] == 4
    for _ in range(400):
        client.send(dialect.MAVLink_radio_status_message(200, 200, 99, 30, 30, 0, 0))
    client.run(3.0)
    assert client.run(4.0)["ATTITUDE"] == pytest.approx(before["ATTITUDE"], abs=2)


def test_px4_forgets_a_radio_that_is_gone() -> None:
    flow = RadioFlow(px4_services.FLOW_CONTROL)
    flow.on_radio_status(5, 1_000_000)
    flow.advance(3_000_000)
    assert flow.multiplier == 0.8
    flow.advance(6_100_000)
    assert flow.multiplier == 1.0


def test_ardupilot_slows_down_to_two_seconds() -> None:
    flow = RadioFlow(ardupilot_services.FLOW_CONTROL)
    for _ in range(100):
        flow.on_radio_status(0, 0)
    assert flow.slowdown_us == 2_040_000
    flow.on_radio_status(96, 0)
    assert flow.slowdown_us == 2_000_000
    flow.on_radio_status(91, 0)
    assert flow.slowdown_us == 1_980_000
    flow.on_radio_status(70, 0)
    assert flow.slowdown_us == 1_980_000


@given(
    st.lists(st.tuples(st.integers(4000, 20_000_000), st.floats(0.0, 280.0)), max_size=40),
    st.floats(50.0, 100_000.0),
)
def test_what_is_fitted_fits(streams: list[tuple[int, float]], bytes_per_s: float) -> None:
    multiplier, stretch = fit(streams, bytes_per_s)
    assert 0.0 < multiplier <= 1.0 <= stretch
    taken = sum(size * 1e6 / thinned_us(interval, multiplier, stretch, 0) for interval, size in streams)
    assert taken <= 1.02 * bytes_per_s
    if stretch == 1.0:
        assert all(thinned_us(i, multiplier, 1.0, 0) <= max(i, SLOW_US) for i, _ in streams)


@pytest.mark.parametrize("bytes_per_s", [0.0, -1.0, float("inf"), float("nan")])
def test_a_line_carries_something(bytes_per_s: float) -> None:
    with pytest.raises(ValueError, match="is not above 0"):
        LineBudget(bytes_per_s)
