"""How a vehicle was left at the end of a flight: what was commanded, what it answered, and its state then.

The run writes one `HowLeft` per vehicle into its notes; the terminal, `summary.json` and studies render it by
`HowLeft.text` and `HowLeft.record`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Final

_TEXTS_SHOWN: Final = 2


class Answer(StrEnum):
    """A vehicle's answer to a command that leaves it safe."""

    DONE = "done"
    """It reported that it does so: its heartbeat has the mode, or says that it is disarmed."""
    ACCEPTED = "accepted"
    """It acknowledged the command, and its heartbeats did not report the mode."""
    REFUSED = "refused"
    NONE = "no answer"


@dataclass(frozen=True, slots=True, kw_only=True)
class SafetyCommand:
    """One command that was sent to leave a vehicle safe.

    Attributes:
        action: "disarm", "return", "land" or "hold".
        answer: what the vehicle answered.
    """

    action: str
    answer: Answer


@dataclass(slots=True, kw_only=True)
class TakeOver:
    """A mode that this program did not command, or an arming: a pilot, another ground station or a failsafe
    has the vehicle.

    Attributes:
        system_id: system id of the vehicle.
        time_us: vehicle time of the first heartbeat with the mode.
        before, mode: names of the modes before and after.
        armed: another one armed the vehicle before the program commanded it.
        failsafe: the heartbeat reports a failsafe (MAV_STATE_CRITICAL or EMERGENCY).
        texts: warnings and errors that the autopilot sent around that time; those that follow shortly after
            are added.
    """

    system_id: int
    time_us: int
    before: str
    mode: str
    failsafe: bool
    armed: bool = False
    texts: list[str] = field(default_factory=list)

    @property
    def holder(self) -> str:
        """Who has the vehicle, as far as it was reported."""
        if self.armed:
            return "the pilot (or another ground station)"
        if self.texts:
            return f"the pilot (or failsafe: {' / '.join(map(repr, self.texts[:_TEXTS_SHOWN]))})"
        return "a failsafe" if self.failsafe else "the pilot (or a failsafe)"

    @property
    def sentence(self) -> str:
        """The reason why a mission ended, for an error."""
        has = "armed the vehicle and has it" if self.armed else "has the vehicle"
        return f"{self.holder} {has}, mode {self.mode}; nothing was commanded"


@dataclass(frozen=True, slots=True, kw_only=True)
class HowLeft:
    """How one vehicle was left.

    Attributes:
        system_id: its system id.
        commands: what was commanded to leave it safe, in order.
        withheld: why nothing (more) was commanded, though it was armed; "": it was, or it was disarmed.
        mode: name of its mode; "": not known.
        armed: whether it is armed.
        on_ground: whether it reports that it stands on the ground; None: not reported.
        height_m: height above home; None: not reported.
        height_older_s: how much older the height is than the newest heartbeat, when that is long; 0: it was
            received with it.
        silent_s: time since its newest heartbeat, when that is long; 0: it was received just now.
    """

    system_id: int
    commands: tuple[SafetyCommand, ...] = ()
    withheld: str = ""
    mode: str = ""
    armed: bool = False
    on_ground: bool | None = None
    height_m: float | None = None
    height_older_s: float = 0.0
    silent_s: float = 0.0

    @property
    def text(self) -> str:
        """In words: "refused to return, to land and to hold; it is in Hold at 12.0 m, armed"."""
        return "; ".join(filter(None, (self._commanded, self._state)))

    @property
    def _commanded(self) -> str:
        if self.withheld:
            actions = [f"to {c.action}" for c in self.commands]
            before = f"was commanded {_listed(actions)}, and then nothing more" if actions else ""
            return f"{before or 'nothing was commanded'}: {self.withheld}"
        parts = []
        for answer, words in _WORDS.items():
            actions = [f"to {c.action}" for c in self.commands if c.answer is answer]
            if actions:
                parts.append(words.format(_listed(actions)))
        return ", ".join(parts)

    @property
    def _state(self) -> str:
        if not self.mode:
            return "its state is not known"
        where = f"in {self.mode}"
        if self.on_ground:
            where += " on the ground"
        elif self.height_m is not None:
            where += f" at {height_text(self.height_m, self.height_older_s)}"
        state = f"{where}, {'armed' if self.armed else 'disarmed'}"
        if self.silent_s:
            return f"last received {self.silent_s:.0f} s ago: {state}"
        return f"it is {state}"

    def record(self) -> Mapping[str, Any]:
        """For `summary.json`."""
        return {
            "text": self.text,
            "commanded": [{"action": c.action, "answer": c.answer.value} for c in self.commands],
            "withheld": self.withheld,
            "mode": self.mode or None,
            "armed": self.armed if self.mode else None,
            "on_ground": self.on_ground,
            "height_m": None if self.height_m is None else round(self.height_m, 2),
            "height_older_s": round(self.height_older_s, 1),
            "silent_s": round(self.silent_s, 1),
        }


_WORDS: Final = {
    Answer.REFUSED: "refused {}",
    Answer.NONE: "did not answer the command {}",
    Answer.ACCEPTED: "accepted the command {} and did not report that it does",
    Answer.DONE: "was commanded {} and does",
}


def height_text(height_m: float, older_s: float, reference: str = "") -> str:
    """A height with its age, when that is known to be long: "12.0 m (8 s before)"."""
    age = f" ({older_s:.0f} s before)" if older_s else ""
    return f"{height_m:.1f} m{reference}{age}"


def _listed(parts: Sequence[str]) -> str:
    """ "to return, to land and to hold"."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"


def lines(left: Sequence[HowLeft]) -> list[str]:
    """One line for each vehicle of a flight."""
    return [f"vehicle {one.system_id}: {one.text}" for one in left]
