"""One result of the checks before a flight."""

from dataclasses import dataclass
from enum import StrEnum


class Level(StrEnum):
    """Severity of a finding."""

    OK = "ok"
    WARNING = "warning"
    PROBLEM = "problem"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One result of a check, with advice.

    Attributes:
        level: severity. A problem prevents arming, or prevents the mission from being flown.
        subject: one or two words.
        text: what was found.
        advice: what to do; "" when no action is needed.
    """

    level: Level
    subject: str
    text: str
    advice: str = ""

    def __str__(self) -> str:
        line = f"{self.level:<8} {self.subject}: {self.text}"
        return f"{line}; {self.advice}" if self.advice else line


def ok(subject: str, text: str) -> Finding:
    """A finding that needs no action."""
    return Finding(level=Level.OK, subject=subject, text=text)


def warning(subject: str, text: str, advice: str) -> Finding:
    """A finding that the user should consider."""
    return Finding(level=Level.WARNING, subject=subject, text=text, advice=advice)


def problem(subject: str, text: str, advice: str) -> Finding:
    """A finding that prevents the flight."""
    return Finding(level=Level.PROBLEM, subject=subject, text=text, advice=advice)
