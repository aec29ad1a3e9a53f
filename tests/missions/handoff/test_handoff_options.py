"""Options of the handoff: what is refused; its world; the link between the aircraft."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import dialect
from flightsim.payload import TargetShape
from flightsim.world_spec import WorldSpec
from missions.errors import PlanError
from missions.handoff.checks import check_vehicle
from missions.handoff.options import HandoffOptions
from missions.handoff.walking_targets import PointSource, WalkingTargets
from missions.handoff.watch import RadioLink
from missions.handoff.world import handoff_world
from missions.vehicle.limits import FixedWingLimits, MulticopterLimits
from tests.missions.held_options import with_fields


@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        ({"radius_m": 0.0}, "`radius_m` 0"),
        ({"decision": 1.0}, "decision 1 is not possible; ask for more than 0.5, less than 1"),
        ({"link_loss": 1.0}, "`link_loss` 1 is not possible; ask for 0 or more, less than 1"),
        ({"link_delay_s": 9.0}, "`link_delay_s` 9 s is not in 0..5 s"),
        ({"target_ne_m": (math.nan, 0.0)}, "`target_ne_m` nan is not a finite number"),
        ({"confirm_after_s": -1.0}, "`confirm_after_s` -1"),
        ({"timeout_s": -1.0}, "`timeout_s` -1"),
        ({"seed": -1}, "seed -1"),
    ],
)
def test_impossible_values_are_named(changes, reported):
    with pytest.raises(ValueError, match=reported):
        with_fields(HandoffOptions(), **changes)


@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        ({"vehicles": 3}, "`vehicles` 3: a handoff is flown by 2 aircraft"),
        ({"radius_m": 20.0}, "can't be held at .* ask for `radius_m`"),
        ({"target_ne_m": (40e3, 0.0)}, "from home, more than"),
        ({"radius_m": 900.0}, "targets are seen too flat"),
    ],
)
def test_what_an_aircraft_cannot_fly_is_refused(changes, reported):
    check_vehicle(HandoffOptions(vehicles=2), FixedWingLimits())
    with pytest.raises(PlanError, match=reported):
        check_vehicle(HandoffOptions(**{"vehicles": 2, **changes}), FixedWingLimits())


def test_a_multicopter_is_refused():
    with pytest.raises(PlanError, match="aircraft with wings"):
        check_vehicle(HandoffOptions(vehicles=2), MulticopterLimits())


def test_the_world_has_walking_targets_and_what_both_aircraft_need():
    options = HandoffOptions(vehicles=2)
    world = handoff_world(WorldSpec.of_team(2, seed=4, model="aerosonde"), options, WalkingTargets(count=7))
    assert len(world.targets) == 7
    for vehicle in world.vehicles:
        payload = vehicle.payload
        assert payload.gimbal and payload.moving_points and payload.range_radio and not payload.camera
    for target in world.targets:
        walk = target.motion
        assert (walk.north_m - walk.south_m, walk.east_m - walk.west_m) == pytest.approx((140.0, 270.0))  # type: ignore[attr-defined]
        assert 0.8 <= walk.speed_m_s <= 2.0  # type: ignore[attr-defined]
    assert handoff_world(world, options).targets == world.targets
    with pytest.raises(PlanError, match="`count` 0"):
        WalkingTargets(count=0)


def test_with_pixels_the_targets_are_persons_and_the_cameras_search_pictures():
    world = WorldSpec.of_team(2, seed=4, model="aerosonde")
    plain = handoff_world(world, HandoffOptions(vehicles=2))
    seen = handoff_world(
        world, HandoffOptions(vehicles=2), WalkingTargets(camera=PointSource.PIXELS, film=True)
    )
    assert [target.motion for target in seen.targets] == [target.motion for target in plain.targets]
    assert {target.shape for target in seen.targets} == {TargetShape.PERSON}
    for one, other in zip(plain.vehicles, seen.vehicles, strict=True):
        assert one.payload.moving_points.reader is None
        points = other.payload.moving_points
        assert points.reader.film and points.rate_hz == one.payload.moving_points.rate_hz
        assert points.pixel_rad == pytest.approx(1.0 / 554.26, rel=1e-4)
    with pytest.raises(PlanError, match="`film` keeps pictures, and the cameras take none"):
        WalkingTargets(film=True)


def test_the_link_loses_and_delays_messages_as_it_is_given():
    link = RadioLink(0.3, 0.2, np.random.default_rng(1))
    message = dialect.MAVLink_ping_message(0, 0, 0, 0)
    for now_us in range(0, 2_000_000, 1000):
        link.send(now_us, 1, message)
    arrived = {now_us: len(link.due(now_us)) for now_us in range(0, 6_000_000, 50_000)}
    assert link.counts["sent"] == 2000 and link.counts["lost"] / 2000 == pytest.approx(0.3, abs=0.04)
    assert sum(arrived.values()) == link.counts["delivered"] == 2000 - link.counts["lost"]
    behind = 1e-6 * sum(now_us * count for now_us, count in arrived.items()) / sum(arrived.values()) - 1.0
    assert behind == pytest.approx(0.2 + 0.025, abs=0.06)  # found out every 50 ms
