"""Scans from messages that are lost, repeated, late or out of order."""

import random
from collections import Counter

import numpy as np
import pytest

from autopilot_bridge.mavlink.target_scan import read_scan_payload, scan_messages
from estimators.interface import Outcome
from estimators.multi_target.scans import ScanAssembler

SECOND = 1_000_000


def parts(number, detections, time_us=None):
    return [
        read_scan_payload(m.payload_type, m.payload_length, m.payload)
        for m in scan_messages(number, (number + 1) * SECOND if time_us is None else time_us, detections)
    ]


def fed(assembler, messages):
    outcomes, scans = [], []
    for message in messages:
        scan, outcome = assembler.add(message)
        outcomes.append(outcome)
        scans += [scan] if scan is not None else []
    return outcomes, scans


def test_an_empty_scan_is_complete_with_its_end():
    outcomes, scans = fed(ScanAssembler(), parts(0, []))
    assert outcomes == [Outcome.UPDATED]
    assert scans[0].detections.shape == (0, 2)


def test_the_order_of_a_scans_messages_has_no_effect():
    detections = [(float(k), 0.1 * k) for k in range(6)]
    for seed in range(10):
        messages = parts(3, detections)
        random.Random(seed).shuffle(messages)
        outcomes, (scan,) = fed(ScanAssembler(), messages)
        assert outcomes == [Outcome.USED] * 6 + [Outcome.UPDATED]
        assert scan.detections == pytest.approx(np.array(detections))
        assert (scan.number, scan.time_us) == (3, 4 * SECOND)


def test_repeated_messages_are_counted_once_each():
    assembler = ScanAssembler()
    first, second, end = parts(0, [(1.0, 0.0), (2.0, 0.0)])
    outcomes, scans = fed(assembler, [first, first, end, end, second, second, end])
    assert outcomes[1] is outcomes[3] is Outcome.REPEATED
    assert outcomes[-2:] == [Outcome.LATE, Outcome.LATE]
    assert len(scans) == 1
    assert assembler.counts == Counter(repeated=2, late=2, complete=1)


def test_a_scan_without_one_of_its_messages_is_dropped():
    assembler = ScanAssembler()
    for lost in (0, 1, 2):  # a detection, a detection, the end
        messages = parts(lost, [(1.0, 0.0), (2.0, 0.0)])
        del messages[lost]
        _, scans = fed(assembler, messages)
        assert scans == []
    _, scans = fed(assembler, parts(3, [(5.0, 0.0)]))
    assert len(scans) == 1
    assert assembler.counts["incomplete"] == 3
    assert assembler.counts["missed"] == 0


def test_scans_that_overlap_are_told_apart():
    one, two = parts(0, [(1.0, 0.0), (2.0, 0.0)]), parts(1, [(3.0, 0.0)])
    _, scans = fed(ScanAssembler(), [one[0], two[0], one[1], one[2], two[1]])
    assert [scan.detections[:, 0].tolist() for scan in scans] == [[1.0, 2.0], [3.0]]


def test_missing_numbers_are_counted_and_a_restart_is_not():
    assembler = ScanAssembler()
    for number, second in ((0, 1), (4, 5), (0, 9), (1, 10)):
        fed(assembler, parts(number, [], time_us=second * SECOND))
    assert assembler.counts["missed"] == 3
    assert assembler.counts["complete"] == 4


def test_open_scans_are_limited():
    assembler = ScanAssembler()
    for number in range(1000):
        assembler.add(parts(number, [(1.0, 0.0)])[0])
    assert assembler.counts["incomplete"] >= 995
