"""The world's clock, its vehicles and its random streams."""

import math

import numpy as np
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.initial_state import InitialState
from flightsim.interface import MAX_ACTUATORS
from flightsim.world import World, WorldParameters
from tests.rotations import yaw_rad


def test_clock_counts_whole_microseconds() -> None:
    world = World(WorldParameters(physics_rate_hz=250))
    world.add_vehicle()
    for _ in range(3):
        world.vehicles[0].step(np.zeros(MAX_ACTUATORS))
        world.advance()
    assert (world.step_us, world.time_us) == (4000, 12000)


@pytest.mark.parametrize("rate_hz", [0, 50, 300, 3000])
def test_rates_that_do_not_divide_are_refused(rate_hz: int) -> None:
    with pytest.raises(ValueError, match=str(rate_hz)):
        WorldParameters(physics_rate_hz=rate_hz)


def test_vehicles_stand_at_their_offsets() -> None:
    home = Home(lat_deg=-35.363, lon_deg=149.165, alt_m=584.0, heading_deg=353.0)
    world = World(WorldParameters(home=home))
    for offset in ((0.0, 0.0), (30.0, -40.0)):
        truth = world.add_vehicle(offset_ne_m=offset).truth
        east, north, _ = pymap3d.geodetic2enu(
            math.degrees(truth[t.LAT_RAD]), math.degrees(truth[t.LON_RAD]), truth[t.ALT_M],
            home.lat_deg, home.lon_deg, home.alt_m,
        )  # fmt: skip
        assert (north, east) == pytest.approx(offset, abs=0.002)
        assert truth[t.ALT_M] - home.alt_m == pytest.approx(truth[t.HEIGHT_ABOVE_GROUND_M], abs=1e-4)
        yaw = math.degrees(yaw_rad(truth[t.Q_NED_FROM_FRD]))
        assert yaw % 360.0 == pytest.approx(353.0, abs=1e-3)


def test_vehicles_join_before_the_clock_starts() -> None:
    world = World()
    world.advance()
    with pytest.raises(ValueError, match="before the clock"):
        world.add_vehicle()
    with pytest.raises(ValueError, match="offset"):
        World().add_vehicle(offset_ne_m=(1.0, 0.0), initial=InitialState())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"lat_deg": 91.0}, "latitude 91"),
        ({"lon_deg": 181.0}, "longitude 181"),
        ({"alt_m": math.nan}, "altitude nan"),
        ({"heading_deg": 400.0}, "heading 400"),
    ],
)
def test_bad_homes_are_named(arguments: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Home(**arguments)


def draw(streams: RandomStreams, *key: str | int) -> float:
    return float(streams.generator(*key).standard_normal())


def test_streams_are_found_by_key() -> None:
    streams = RandomStreams(7)
    assert draw(streams, "vehicle", 0, "sensor", "imu") == draw(
        RandomStreams(7), "vehicle", 0, "sensor", "imu"
    )
    draws = {
        draw(streams, "vehicle", 0, "sensor", "imu"),
        draw(streams, "vehicle", 1, "sensor", "imu"),
        draw(streams, "vehicle", "0", "sensor", "imu"),
        draw(streams, "vehicle", 0, "sensorimu"),
        draw(streams, "vehicle", 0, "sensor", "gps"),
        draw(RandomStreams(8), "vehicle", 0, "sensor", "imu"),
    }
    assert len(draws) == 6


def test_stream_key_hash_is_stable() -> None:
    """A stored value: were the hashing to change, every seed would make another flight."""
    assert RandomStreams(7).child("vehicle", 0, "sensor", "imu").generate_state(2).tolist() == STORED


STORED = [229565269, 2302005900]


@given(st.lists(st.one_of(st.text(max_size=4), st.integers()), min_size=1, max_size=4, unique_by=repr))
def test_keys_do_not_join(key: list[str | int]) -> None:
    child = RandomStreams(1).child
    whole = child(*key).spawn_key
    assert whole == child(*key).spawn_key
    assert whole != child(*key, "").spawn_key
    assert whole != child("".join(map(str, key)), "x").spawn_key


@pytest.mark.parametrize("seed", [-1, 2**128, 1.5, True])
def test_bad_seeds_are_refused(seed: object) -> None:
    with pytest.raises(ValueError, match="seed"):
        RandomStreams(seed)  # type: ignore[arg-type]


@pytest.mark.parametrize("key", [(), (1.5,), (None,), (True,)])
def test_bad_keys_are_refused(key: tuple[object, ...]) -> None:
    with pytest.raises(ValueError, match="key"):
        RandomStreams(1).child(*key)  # type: ignore[arg-type]
