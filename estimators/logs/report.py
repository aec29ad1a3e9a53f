"""What a log holds and what it lacks, in figures."""

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from estimators.logs.log import Log


@dataclass(frozen=True, slots=True, kw_only=True)
class LogReport:
    """Figures of a log.

    Attributes:
        path, format, size_bytes: the file.
        messages: valid frames.
        duration_s, start_unix_us: as in `Log`.
        bytes_by_kind: where every byte went.
        drops: how often something was dropped, by reason.
    """

    path: str
    format: str
    size_bytes: int
    messages: int
    duration_s: float
    start_unix_us: int | None
    bytes_by_kind: dict[str, int]
    drops: dict[str, int]

    def to_dict(self) -> dict[str, Any]:
        """The same for JSON."""
        return asdict(self)


def make_report(log: "Log") -> LogReport:
    """Figures of a log."""
    source = log.source
    return LogReport(
        path=str(log.path),
        format=log.format,
        size_bytes=log.size_bytes,
        messages=len(log),
        duration_s=log.duration_s,
        start_unix_us=log.start_unix_us,
        bytes_by_kind=dict(source.bytes_by_kind),
        drops=dict(source.drops),
    )
