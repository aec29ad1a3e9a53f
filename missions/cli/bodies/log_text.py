"""The text that `flightstack log info` prints for a log's report."""

from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Final

from estimators.logs import LogReport
from estimators.logs.vehicles import VehicleReport

_MODES_SHOWN: Final = 40
_GAPS_SHOWN: Final = 20


def report_lines(report: LogReport) -> Iterator[str]:
    """The report as lines of text."""
    yield f"{report.path}: {report.format}, {report.size_bytes / 1e6:.2f} MB, {report.messages} messages"
    started = "" if report.start_unix_us is None else f", from {_date(report.start_unix_us)}"
    dialect = (
        "" if report.dialect == report.format else f"; dialect {report.dialect}"
    )  # onboard logs have no such entry
    yield f"duration {report.duration_s:.1f} s{started}{dialect}"
    yield "bytes: " + _counts(report.bytes_by_kind)
    if any(report.drops.values()):
        yield "dropped: " + _counts(report.drops)
    yield "remarks: " + ", ".join(f"{_words(name)} {value}" for name, value in report.remarks.items())
    yield f"times: {report.clock}; --from and --to count the same"
    several = any(span.boot for vehicle in report.vehicles for span in vehicle.modes)
    for vehicle in report.vehicles:
        yield ""
        yield from _vehicle(vehicle, several)
    boots = [boot for boot in report.boots if boot.end_us > boot.start_us]
    if len({boot.system_id for boot in boots}) < len(boots):
        yield ""
        for item in boots:
            yield (
                f"boot {item.number} of system {item.system_id}: "
                f"{_span(item.start_us, item.end_us)}, time of that system"
            )
    if report.gaps:
        yield ""
        yield f"gaps: {len(report.gaps)}"
        for gap in report.gaps[:_GAPS_SHOWN]:
            boot = f"boot {gap.boot}, " if several else ""
            yield f"  system {gap.system_id}: nothing received {boot}{_span(gap.start_us, gap.end_us)}"
    if report.left_out:
        yield ""
    for left in report.left_out:
        sender = f"{left.system_id}/{left.component_id}"
        counts = _counts(left.count_by_reason)
        yield f"{left.name} of {sender}: places and times that no vehicle can have: {counts}"
    if report.losses:
        yield ""
        yield f"{'component':>9} {'frames':>9} {'lost':>8} {'loss %':>7} {'late':>6}"
        for loss in report.losses:
            share = 100.0 * loss.lost / max(1, loss.frames + loss.lost)
            who = f"{loss.system_id}/{loss.component_id}"
            yield f"{who:>9} {loss.frames:>9} {loss.lost:>8} {share:>7.2f} {loss.late:>6}"
    for unknown in report.unknown:
        yield (
            f"unknown message {unknown.message_id} from {unknown.system_id}/{unknown.component_id}: "
            f"{unknown.count} frames, {unknown.frame_bytes} bytes"
        )
    yield ""
    yield f"{'component':>9} {'message':<32} {'count':>8} {'Hz':>8} {'gap s':>8}  instances"
    for stream in report.streams:
        who = f"{stream.system_id}/{stream.component_id}"
        instances = ",".join(str(item) for item in stream.instances[:8])
        yield (
            f"{who:>9} {stream.name:<32} {stream.count:>8} {_rate(stream.rate_hz):>8} "
            f"{stream.longest_gap_s:>8.2f}  {instances}"
        ).rstrip()


def _vehicle(vehicle: VehicleReport, several: bool) -> Iterator[str]:
    def span(boot: int, start_us: int, end_us: int) -> str:
        return (f"boot {boot}, " if several else "") + _span(start_us, end_us)

    boots = "" if vehicle.boots == 1 else f", {vehicle.boots} boots"
    firmware = f", {vehicle.firmware}" if vehicle.firmware else ""
    yield f"vehicle {vehicle.system_id}: {vehicle.autopilot} {vehicle.type}{firmware}{boots}"
    for flight in vehicle.flights:
        yield f"  armed {span(flight.boot, flight.start_us, flight.end_us)}"
    for mode in vehicle.modes[:_MODES_SHOWN]:
        yield f"  {mode.mode:<16} {span(mode.boot, mode.start_us, mode.end_us)}"
    if len(vehicle.modes) > _MODES_SHOWN:
        yield f"  ... and {len(vehicle.modes) - _MODES_SHOWN} more modes"


def _span(start_us: int, end_us: int) -> str:
    return f"{start_us * 1e-6:.2f} to {end_us * 1e-6:.2f} s ({(end_us - start_us) * 1e-6:.1f} s)"


def _rate(rate_hz: float) -> str:
    # no rate is known for one message, or for messages at the same time
    return f"{rate_hz:.2f}" if rate_hz else "-"


def _date(unix_us: int) -> str:
    try:
        return datetime.fromtimestamp(unix_us * 1e-6, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    except (ValueError, OverflowError, OSError):
        return f"{unix_us} us"


def _counts(figures: dict[str, int]) -> str:
    return ", ".join(f"{_words(name)} {value}" for name, value in figures.items() if value)


def _words(name: str) -> str:
    return name.replace("_", " ")
