"""Numbers of MAVLink events."""


def event_sub_id(name: str) -> int:
    """Lower 24 bits of an event's number: FNV-1a of its name, as PX4 numbers its events."""
    number = 0x811C9DC5
    for byte in name.encode():
        number = (number ^ byte) * 0x01000193 & 0xFFFFFFFF
    return number & 0xFFFFFF
