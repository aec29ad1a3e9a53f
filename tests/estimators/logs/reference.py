"""Frames and logs for tests, and a reader of them that is slow, plain and exact."""

from dataclasses import dataclass, field

from pymavlink.dialects.v20 import all as dialect
from pymavlink.generator.mavcrc import x25crc

EPOCH_US = 1_700_000_000_000_000


def checksum(data):
    crc = x25crc()
    crc.accumulate(data)
    return crc.crc


def build(
    message_id,
    payload,
    *,
    system=1,
    component=1,
    sequence=0,
    version=2,
    signed=False,
    flags=0,
    crc_extra=None,
):
    """A frame from its parts, whatever they are."""
    if version == 1:
        head = bytes([0xFE, len(payload), sequence, system, component, message_id])
    else:
        flags |= signed
        head = bytes([0xFD, len(payload), flags, 0, sequence, system, component])
        head += message_id.to_bytes(3, "little")
    if crc_extra is None:
        known = dialect.mavlink_map.get(message_id)
        crc_extra = known.crc_extra if known else 0
    crc = checksum(head[1:] + payload + bytes([crc_extra]))
    return head + payload + crc.to_bytes(2, "little") + (bytes(range(13)) if signed else b"")


def pack(message, *, system=1, component=1, sequence=0, version=2):
    """A frame of one of pymavlink's messages."""
    mav = dialect.MAVLink(None, srcSystem=system, srcComponent=component)
    mav.seq = sequence
    return bytes(message.pack(mav, force_mavlink1=version == 1))


def record(frame, time_us=EPOCH_US):
    return time_us.to_bytes(8, "big") + frame


def tlog(frames, step_us=20_000):
    return b"".join(record(frame, EPOCH_US + index * step_us) for index, frame in enumerate(frames))


@dataclass
class Reading:
    """What a log holds: spans of valid frames, and the bytes between them by kind."""

    spans: list = field(default_factory=list)
    bytes_by_kind: dict = field(
        default_factory=lambda: dict.fromkeys(
            (
                *("frames", "timestamps", "unknown_messages", "bad_crc"),
                *("unsupported_flags", "junk", "torn_tail"),
            ),
            0,
        )
    )
    unknown: list = field(default_factory=list)


def shape(data, at):
    """(end, kind) of what has the shape of a frame; end None: no shape, -1: the file ends before it does."""
    rest = data[at:]
    if not rest:
        return -1, ""
    if rest[0] == 0xFD:
        if len(rest) < 3:
            return -1, ""
        size = 12 + rest[1] + (13 if rest[2] & 1 else 0)
        if size > len(rest):
            return -1, ""
        if rest[2] > 1:
            return at + size, "unsupported_flags"
        message_id = int.from_bytes(rest[7:10], "little")
        covered = rest[1 : 10 + rest[1]]
        crc = rest[10 + rest[1] : 12 + rest[1]]
    elif rest[0] == 0xFE:
        if len(rest) < 2:
            return -1, ""
        size = 8 + rest[1]
        if size > len(rest):
            return -1, ""
        message_id = rest[5]
        covered = rest[1 : 6 + rest[1]]
        crc = rest[6 + rest[1] : 8 + rest[1]]
    else:
        return None, ""
    known = dialect.mavlink_map.get(message_id)
    if known is None:
        return at + size, "unknown_messages"
    right = checksum(covered + bytes([known.crc_extra])) == int.from_bytes(crc, "little")
    return at + size, "frames" if right else "bad_crc"


def read(data, lead):
    """All that is in the bytes of a log with `lead` bytes of time stamp before each frame."""
    found = Reading()
    at = 0
    while at < len(data):
        candidates = [at + lead, *range(at, len(data))] if at + lead < len(data) else range(at, len(data))
        start = next((start for start in candidates if shape(data, start)[1] == "frames"), None)
        if start is None:
            sort_gap(data, at, len(data), lead, True, found)
            break
        stamped = start - at >= lead
        found.bytes_by_kind["timestamps"] += lead if stamped else 0
        sort_gap(data, at, start - lead if stamped else start, lead, stamped, found)
        end = shape(data, start)[0]
        found.bytes_by_kind["frames"] += end - start
        found.spans.append((start, end))
        at = end
    return found


def sort_gap(data, at, limit, lead, may_hold_records, found):
    if not may_hold_records:
        found.bytes_by_kind["junk"] += limit - at
        return
    whole_before = True
    while at < limit:
        end, kind = shape(data, at + lead)
        is_whole = end is not None and 0 <= end <= limit
        followed = end == limit or (is_whole and end + lead < limit and data[end + lead] in (0xFD, 0xFE))
        if is_whole and followed:
            found.bytes_by_kind["timestamps"] += lead
            found.bytes_by_kind[kind] += end - at - lead
            if kind == "unknown_messages":
                found.unknown.append((at + lead, end))
            at, whole_before = end, True
        elif end == -1 and whole_before and limit == len(data):
            found.bytes_by_kind["torn_tail"] += limit - at
            at = limit
        else:
            found.bytes_by_kind["junk"] += 1
            at, whole_before = at + 1, False
