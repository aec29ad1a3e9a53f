"""The operator of the tracking aircraft: when the target is confirmed, and how the message arrives."""

import asyncio
from types import SimpleNamespace

import numpy as np
import pytest

from autopilot_bridge.mavlink.handoff_messages import TrackDesignation, read_designation
from estimators.handoff import Designation
from missions.handoff.operator import TrackOperator
from missions.handoff.options import HandoffOptions
from missions.handoff.team import settings_of
from missions.handoff.watch import HandoffWatch, RadioLink

STEP_US = 100_000


def met(operator, sent, *, seconds, apart_m=20.0):
    """Two tracks meet within 2 m and are `apart_m` apart after 2 s; returns the times of the designations."""
    designation = Designation()
    designation.designate(0, 1, (0.0, 0.0))
    times = []
    for k in range(round(10 * seconds)):
        off_m = 20.0 if k < 10 else 2.0 if k < 30 else apart_m
        places = {1: (0.0, 0.0), 2: (off_m, 0.0)}
        designation.update(k * STEP_US, places)
        operator.look(k * STEP_US, designation, places)
        if sent:
            times.append(0.1 * k)
            designation.designate(k * STEP_US, sent.pop(), (0.0, 0.0))
    return times, designation.probability


def test_a_target_that_was_doubtful_is_confirmed_once_when_no_other_is_near():
    """Without it the identity stays at 0.7, and no probability reaches that of a decision."""
    sent = []
    times, probability = met(TrackOperator(5.0, 0.99, sent.append), sent, seconds=20.0)
    assert times == [pytest.approx(6.0, abs=0.2)] and probability == pytest.approx(1.0, abs=1e-6)
    times, probability = met(TrackOperator(0.0, 0.99, sent.append), sent, seconds=20.0)
    assert times == [] and probability == pytest.approx(0.697, abs=0.001)


def test_targets_side_by_side_are_not_confirmed():
    sent = []
    times, probability = met(TrackOperator(5.0, 0.99, sent.append), sent, seconds=30.0, apart_m=6.0)
    assert times == [] and probability < 0.75


def test_a_designation_reaches_the_estimator_of_the_tracker_and_its_log():
    sent = {1: [], 2: []}
    vehicles = [
        SimpleNamespace(
            system_id=system, clock=SimpleNamespace(time_us=0), link=SimpleNamespace(send=sent[system].append)
        )
        for system in (1, 2)
    ]
    options = HandoffOptions(vehicles=2)
    settings = [settings_of(options, role, 1, 2) for role in ("handoff", "tracker")]
    watch = HandoffWatch(vehicles, settings, RadioLink(1.0, 0.0, np.random.default_rng(1)))

    async def designate():
        watch.designate(7)
        await asyncio.sleep(0)

    asyncio.run(designate())
    handoff, tracker = watch.estimators
    assert tracker.counts == {"designations_of_no_track": 1} and not handoff.counts
    (message,) = sent[2]
    wire = (message.payload_type, message.payload_length, message.payload)
    assert read_designation(*wire) == TrackDesignation(system=2, track=7) and not sent[1]
