"""A log takes packets of whole frames, which become records."""

import pytest
from pymavlink.dialects.v20 import all as dialect

from autopilot_bridge.errors import TlogError
from autopilot_bridge.tlog import TlogReader, TlogWriter
from tests.bridge.test_tlog import EPOCH_US, records


def test_forwarded_frames_of_others_are_records_too(tmp_path):
    """MAVLink 1 and signed frames go through links as they came, and so into the log."""
    mav = dialect.MAVLink(None, srcSystem=200, srcComponent=191)
    heartbeat = dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)
    first = heartbeat.pack(mav, force_mavlink1=True)
    mav.signing.secret_key, mav.signing.sign_outgoing, mav.signing.link_id = b"k" * 32, True, 1
    signed = heartbeat.pack(mav)
    ours = records(1)[0][1]
    assert first[0] == 0xFE
    assert signed[2] & 1
    path = tmp_path / "a.tlog"
    with TlogWriter(path) as log:
        log.write(EPOCH_US, first)
        log.write(EPOCH_US, ours + signed + first)
    assert [frame.raw for _, frame in TlogReader(path)] == [first, ours, signed, first]


def test_packets_are_split_into_records(tmp_path):
    frames = [frame for _, frame in records(5)]
    with TlogWriter(tmp_path / "a.tlog") as log:
        log.write(EPOCH_US, b"".join(frames[:3]))
        log.write(EPOCH_US + 5, b"".join(frames[3:]))
    read = [(time_us, frame.raw) for time_us, frame in TlogReader(tmp_path / "a.tlog")]
    assert read == [(EPOCH_US + (0 if k < 3 else 5), frame) for k, frame in enumerate(frames)]


@pytest.mark.parametrize("packet", [b"\xfd", b"\xfd\x09", b"abc", records(1)[0][1] + b"\xfe\x01"])
def test_packets_that_are_no_frames_are_refused(tmp_path, packet):
    good = records(1)[0][1]
    log = TlogWriter(tmp_path / "a.tlog")
    log.write(EPOCH_US, good)
    log.write(EPOCH_US, packet)
    log.write(EPOCH_US, good)
    at = len(good) if len(packet) > 3 else 0
    with pytest.raises(TlogError, match=f"packet of {len(packet)} bytes has no whole frame at byte {at}"):
        log.close()
    assert [frame.raw for _, frame in TlogReader(tmp_path / "a.tlog")] == [good] * (3 if at else 2)


def test_single_frames_keep_their_order(tmp_path):
    items = records(40)
    with TlogWriter(tmp_path / "a.tlog") as log:
        for time_us, frame in items:
            log.write(time_us, frame)
    assert [(time_us, frame.raw) for time_us, frame in TlogReader(tmp_path / "a.tlog")] == items
    assert log.records == len(items)
