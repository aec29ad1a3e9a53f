"""What is known about a flight when it is over, and what its mission reports about it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

from missions.base.options import MissionOptions
from missions.flown.camera_picture import PicturesOf
from missions.flown.records import FlightRecords
from missions.flown.score import FlightScore
from missions.flown.verdict import path_verdict
from missions.vehicle.notes import FlightNotes

__all__ = ["Debriefing", "Report", "path_verdict_of_all", "verdict_of_all"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Debriefing:
    """What is known about a flight when it is over.

    Attributes:
        records: recorded messages of all vehicles and, embedded, of the truth.
        flights: notes and scores, one per vehicle.
        options: options of the first vehicle.
        completed: the flight came to its end; False: it failed or was interrupted.
        max_error_m: the user's own bound for the path error; None: there is none.
        target_ne_m: true place of the first magnetic target of an embedded world, north and east of the map's
            home; None: not known.
        targets_ne_m: the same of all magnetic targets; None: not known, () if the world has none.
        pictures_of: the pictures of a vehicle's camera, by system id.
    """

    records: FlightRecords
    flights: Sequence[tuple[FlightNotes, FlightScore]]
    options: MissionOptions
    completed: bool = True
    max_error_m: float | None = None
    target_ne_m: tuple[float, float] | None = None
    targets_ne_m: tuple[tuple[float, float], ...] | None = None
    pictures_of: PicturesOf = lambda _system_id: ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """What a mission reports about a flight.

    Attributes:
        verdict: why a flight that came to its end has not flown what was commanded, by the messages of the
            vehicles alone; "" if it has.
        figures: what `summary.json` has beside the figures of every flight.
        lines: what the command line prints after a completed flight, besides the lines of every flight.
        title: first words of the picture's title; "": the mission's name.
        draw: draws `track.png` (path, title); None: the picture of every flight.
        overlay: draws more on the axes of the track from above in the picture of every flight.
        files: further files of the run folder: contents by name.
        pictures: makes further pictures and videos, by name; they are left out where the run draws none.
    """

    verdict: str = ""
    figures: Mapping[str, Any] = field(default_factory=dict)
    lines: Sequence[str] = ()
    title: str = ""
    draw: Callable[[Path, str], None] | None = None
    overlay: Callable[[Any], object] | None = None
    files: Mapping[str, bytes] = field(default_factory=dict)
    pictures: Callable[[], Mapping[str, bytes]] = dict

    @classmethod
    def of(
        cls,
        debriefing: Debriefing,
        *,
        verdict: Callable[[], str] | None = None,
        lines: Callable[[], Sequence[str]] = tuple,
        figures: Mapping[str, Any] = MappingProxyType({}),
        title: str = "",
        draw: Callable[[Path, str], None] | None = None,
        overlay: Callable[[Any], object] | None = None,
        files: Mapping[str, bytes] = MappingProxyType({}),
        pictures: Callable[[], Mapping[str, bytes]] = dict,
    ) -> Self:
        """A report whose verdict is asked for after a flight that came to its end, and whose lines after one
        that has flown what was commanded.

        Args:
            debriefing: of the flight.
            verdict: None: by the commanded paths, where there are any.
            lines, figures, title, draw, overlay, files, pictures: the other attributes.
        """
        text = ""
        if debriefing.completed:
            text = path_verdict_of_all(debriefing) if verdict is None else verdict()
        return cls(
            verdict=text,
            figures=figures,
            lines=lines() if debriefing.completed and not text else (),
            title=title,
            draw=draw,
            overlay=overlay,
            files=files,
            pictures=pictures,
        )


def verdict_of_all(debriefing: Debriefing, verdict: Callable[[FlightNotes, FlightScore], str]) -> str:
    """The verdicts on all vehicles of a flight in one sentence; "" if all have flown the commanded paths."""
    verdicts = {notes.system_id: verdict(notes, score) for notes, score in debriefing.flights}
    if len(verdicts) == 1:
        return next(iter(verdicts.values()))
    return "; ".join(f"vehicle {system_id}: {text}" for system_id, text in verdicts.items() if text)


def path_verdict_of_all(debriefing: Debriefing) -> str:
    """The verdict by the commanded paths, where there are any."""
    return verdict_of_all(debriefing, lambda notes, score: path_verdict(notes, score, debriefing.max_error_m))
