"""Vehicle time of messages, determined only from the messages and their order.

The messages of a vehicle are identified by their system id; its clock is that of its autopilot, component 1.
A message that carries a time of that clock gets this time; any other message gets the newest time received
before. The time depends on the messages before it and not on the time of arrival, so a live link and its log
agree to the microsecond.

In full, for each system:

* The *own stamp* of a message is `time_boot_ms`, or else `time_usec` below 10^15 (a larger value is a Unix
  time). A value of 0 is not a stamp, and neither is SERVO_OUTPUT_RAW's, whose 32 bits wrap after 71 minutes.
* The autopilot leads. Until a stamp of the autopilot was received, any component leads.
* A leader's stamp that is at most a second older than the newest time is the message's time; if it is greater
  than the newest time, it becomes the newest time.
* An older stamp that is also more than a second older than the newest of the same message means a new boot if
  it is less than half of the newest time, or 30 s older, or if the stamps have stayed behind while they
  advanced by 3 s. Otherwise it is late: a radio or a serial line can deliver old frames in a burst. An old
  stamp that is not older than the newest of the same message is stale (a receiver without a fix repeats the
  time of its last fix). Late and stale messages get the newest time.
* A stamp of another component is used for its message when it is within a second of the newest time (the
  component may have booted with the vehicle); otherwise the message gets the newest time.
* Before the first stamp the time is 0.
"""

from collections.abc import Container
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators import wire
from estimators.messages import Message
from flightsim.foundation.kernels import kernel

LATE_US: Final = 1_000_000
"""A stamp that is farther behind is late, or begins a new boot."""
FAR_BACK_US: Final = 30_000_000
"""Late frames are never this old: a larger step back means a new boot."""
SETTLED_US: Final = 3_000_000
"""Stamps that advance by this much while they are behind the newest time belong to a new boot."""

UNIX_TIME_US: Final = 1_000_000_000_000_000
"""A `time_usec` from this value on is a Unix time (this one is in September 2001)."""

_WITHOUT: Final = frozenset({"SERVO_OUTPUT_RAW"})
_STAMPS: Final = (("time_boot_ms", 1000), ("time_usec", 1))

_LEAST_UNIX_US: Final = 946_684_800_000_000
"""2000-01-01. An autopilot that does not know the date sends 0, or counts from 1970 or 1980."""
_TOGETHER_US: Final = 2_000
"""SYSTEM_TIME counts milliseconds: boots that are closer together are treated as simultaneous."""
_STEP_US: Final = 500_000
"""If a boot differs from the known one by more than this, the clock was set."""
_STEADY_US: Final = 20_000
_STEADY_RATE: Final = 1e-3  # Unix time and vehicle time drift by less: quartzes, and NTP's 500 ppm
_CHANGES_MAX: Final = 3


@dataclass(slots=True)
class _UnixBoot:
    """Unix time at which a vehicle booted, while its Unix time advances with its vehicle time.

    Attributes:
        boot_us: Unix time of the boot; None: the two times have different rates, so there is no such time.
        since_us: vehicle time at which it was learnt.
        newest_us: newest vehicle time.
        other: vehicle time and boot of the newest message that differs; None: none since one that agrees.
        differing: number of messages in a row that differ.
        changes: how often the boot was another one.
    """

    boot_us: int | None
    since_us: int
    newest_us: int
    other: tuple[int, int] | None = None
    differing: int = 0
    changes: int = 0

    @classmethod
    def first(cls, time_us: int, boot_us: int) -> "_UnixBoot":
        return cls(boot_us, time_us, time_us)

    def learn(self, time_us: int, boot_us: int) -> None:
        self.newest_us = max(self.newest_us, time_us)
        if self.boot_us is None:
            return
        if _steady(time_us - self.since_us, boot_us - self.boot_us):
            self.other, self.differing = None, 0
            return
        before, self.other = self.other, (time_us, boot_us)
        self.differing += 1
        if before is not None and _steady(time_us - before[0], boot_us - before[1]):
            self.changes += 1
            self.other, self.differing = None, 0
            if abs(boot_us - self.boot_us) > _STEP_US:
                self.boot_us, self.since_us = boot_us, time_us
        if max(self.differing, self.changes) > _CHANGES_MAX:
            self.boot_us = None

    def rebooted(self, time_us: int) -> bool:
        """Whether a time is of a later boot of the vehicle."""
        return time_us < self.newest_us - FAR_BACK_US or 2 * time_us < self.newest_us - LATE_US


def _steady(elapsed_us: int, change_us: int) -> bool:
    return abs(change_us) <= _STEADY_US + _STEADY_RATE * abs(elapsed_us)


class TeamTime:
    """Converts the times of each vehicle to the time of the vehicle whose date was known first.

    The Unix time of a vehicle's boot is taken from its first SYSTEM_TIME and then kept, because the message
    has a resolution of milliseconds and its jitter must not affect the estimates. As long as a vehicle's boot
    isn't known (embedded SITL boots all vehicles together; a GPS receiver may not know the time yet), its
    time is not converted. Neither is that of a vehicle whose Unix time does not advance with its vehicle
    time: in a simulation in lockstep PX4 sends the computer's time of day, which runs slower or faster.
    """

    def __init__(self) -> None:
        self._boots: dict[int, _UnixBoot] = {}
        self._reference_us: int | None = None

    def learn(self, time_us: int, message: wire.SYSTEM_TIME) -> None:
        """Process a SYSTEM_TIME of an autopilot, at its vehicle time."""
        if message.time_unix_usec < _LEAST_UNIX_US:
            return
        boot_us = message.time_unix_usec - time_us
        if self._reference_us is None:
            self._reference_us = boot_us
        if abs(boot_us - self._reference_us) <= _TOGETHER_US:
            boot_us = self._reference_us
        known = self._boots.get(message.src_system)
        if known is None or known.rebooted(time_us):
            self._boots[message.src_system] = _UnixBoot.first(time_us, boot_us)
        else:
            known.learn(time_us, boot_us)

    def common_us(self, time_us: int, system_id: int) -> int:
        """The common time for a vehicle's time."""
        known = self._boots.get(system_id)
        if known is None or known.boot_us is None or self._reference_us is None:
            return time_us
        return time_us + known.boot_us - self._reference_us


def stamp_field(name: str, fields: Container[str]) -> tuple[str, int] | None:
    """The field that holds a message's own stamp, and its unit in microseconds; None: it has none.

    Args:
        name: name of the message.
        fields: names of its fields.
    """
    if name in _WITHOUT:
        return None
    return next(((stamp, unit) for stamp, unit in _STAMPS if stamp in fields), None)


@dataclass(slots=True)
class _SystemTime:
    newest_us: int = 0
    boot: int = 0
    led: bool = False
    behind_us: int = -1  # the stamp at which the time stepped back, until it has returned
    by_message: dict[tuple[int, int], int] = field(default_factory=dict)


class VehicleTime:
    """Determines the vehicle time of messages, one after the other, in the order of their arrival."""

    def __init__(self) -> None:
        self._fields: dict[type[Message], tuple[str, int] | None] = {}
        self._systems: dict[int, _SystemTime] = {}

    def stamp(self, message: Message) -> int:
        """Microseconds since the boot of the message's system.

        Args:
            message: from `estimators.messages`.
        """
        made = type(message)
        try:
            found = self._fields[made]
        except KeyError:
            found = self._fields[made] = stamp_field(made.name, made._fields)
        system = self._systems.get(message.src_system)
        if system is None:
            system = self._systems[message.src_system] = _SystemTime()
        if found is None:
            return system.newest_us
        own = getattr(message, found[0]) * found[1]
        if not 0 < own < UNIX_TIME_US:
            return system.newest_us
        autopilot = message.src_component == AUTOPILOT_COMPONENT
        if autopilot and not system.led:
            system.led = True
            system.newest_us = 0
            system.by_message.clear()
        if system.led and not autopilot:
            return own if abs(own - system.newest_us) <= LATE_US else system.newest_us
        key = message.src_component, made.message_id
        last = system.by_message.get(key, 0)
        if own >= system.newest_us - LATE_US:
            if own > last:
                system.by_message[key] = own
            if own > system.newest_us:
                system.newest_us = own
            system.behind_us = -1
            return own
        if own < last - LATE_US and system.behind_us < 0:
            system.behind_us = own
        if own < last - LATE_US and (
            2 * own < system.newest_us
            or own < system.newest_us - FAR_BACK_US
            or own >= system.behind_us + SETTLED_US
        ):
            system.behind_us = -1
            system.boot += 1
            system.newest_us = own
            system.by_message.clear()
            system.by_message[key] = own
            return own
        if own > last:
            system.by_message[key] = own
        return system.newest_us

    def newest_us(self, system_id: int) -> int:
        """Newest time of a system; 0 before one was received."""
        found = self._systems.get(system_id)
        return 0 if found is None else found.newest_us

    def boot(self, system_id: int) -> int:
        """How often the time of a system has restarted."""
        found = self._systems.get(system_id)
        return 0 if found is None else found.boot


def vehicle_times(
    own_us: NDArray[np.int64],
    streams: NDArray[np.int32],
    systems: NDArray[np.int64],
    components: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Vehicle times of a whole log; the same as `VehicleTime.stamp` returns for them one after the other.

    Args:
        own_us: own stamps in the order of the file, 0 for none; overwritten with the vehicle times.
        streams: number of each message's stream (message, system and component).
        systems, components: ids of each stream.

    Returns:
        Positions of the messages that begin a new boot of their system, ascending.
    """
    begins = np.zeros(len(own_us), dtype=np.uint8)
    _vehicle_times(own_us, streams, systems, components, begins)
    return np.flatnonzero(begins)


@kernel
def _vehicle_times(
    times: NDArray[np.int64],
    streams: NDArray[np.int32],
    systems: NDArray[np.int64],
    components: NDArray[np.int64],
    begins: NDArray[np.uint8],
) -> None:
    newest = np.zeros(256, dtype=np.int64)
    # epoch of the values stored by stream; values of an older epoch are invalid
    epoch = np.zeros(256, dtype=np.int64)
    led = np.zeros(256, dtype=np.bool_)
    behind = np.full(256, -1, dtype=np.int64)
    last_of = np.zeros(len(systems), dtype=np.int64)
    epoch_of = np.zeros(len(systems), dtype=np.int64)
    for index in range(len(times)):
        stream = streams[index]
        system = systems[stream]
        own = times[index]
        if own <= 0 or own >= UNIX_TIME_US:
            times[index] = newest[system]
            continue
        autopilot = components[stream] == AUTOPILOT_COMPONENT
        if autopilot and not led[system]:
            led[system] = True
            newest[system] = 0
            epoch[system] += 1
        if led[system] and not autopilot:
            if abs(own - newest[system]) > LATE_US:
                times[index] = newest[system]
            continue
        if epoch_of[stream] != epoch[system]:
            epoch_of[stream] = epoch[system]
            last_of[stream] = 0
        last = last_of[stream]
        if own < last - LATE_US and own < newest[system] - LATE_US and behind[system] < 0:
            behind[system] = own
        if own >= newest[system] - LATE_US:
            newest[system] = max(newest[system], own)
            behind[system] = -1
        elif own < last - LATE_US and (
            2 * own < newest[system]
            or own < newest[system] - FAR_BACK_US
            or own >= behind[system] + SETTLED_US
        ):
            behind[system] = -1
            begins[index] = 1
            newest[system] = own
            epoch[system] += 1
            epoch_of[stream] = epoch[system]
            last = 0
        else:
            times[index] = newest[system]
        last_of[stream] = max(last, own)
