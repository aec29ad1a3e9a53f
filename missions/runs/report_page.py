"""`report.html`: one page of a run, a log or several of them, which needs no network."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from estimators.html_table import html_page, html_picture, html_table
from estimators.logs import Log, open_log, report_of
from estimators.reports.interactive import interactive_plots, script_tag
from estimators.scene.scene import Scene
from estimators.scene_items import Text
from missions.flown.run_folder import LOG_NAME
from missions.runs.run import open_run

__all__ = ["REPORT_NAME", "Reported", "add_page", "report_page", "write_report"]

REPORT_NAME: Final = "report.html"
_HIDDEN: Final = ("options", "parameters", "versions", "message_counts", "vehicles", "estimator", "command")
_SETTINGS: Final = ("options", "parameters", "versions", "estimator", "command")
_MOST_EVENTS: Final = 400
_MOST_PICTURE_BYTES: Final = 4 << 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Reported:
    """A run or a log for a page.

    Attributes:
        name: of the run.
        log: its log.
        summary: contents of `summary.json`; empty: a log alone.
        folder: of its pictures; None: a log alone.
    """

    name: str
    log: Log
    summary: Mapping[str, Any]
    folder: Path | None

    @classmethod
    def of(cls, path: Path) -> "Reported":
        """A run folder, or a log.

        Raises:
            PlanError: the folder is none of a run.
            LogError: the log can't be read.
        """
        if not path.is_dir():
            return cls(name=path.name, log=open_log(path), summary={}, folder=None)
        run = open_run(path)
        return cls(name=path.name, log=open_log(path / LOG_NAME), summary=run.summary, folder=path)


def write_report(path: Path, runs: Sequence[Reported]) -> None:
    """Write the page. An earlier page at the path is replaced.

    Raises:
        EstimatorError: Bokeh is not installed.
        OSError: it can't be written.
    """
    text = report_page(path, runs)
    part = path.with_name(f".{path.name}.part")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def add_page(folder: Path) -> str:
    """Write the page of a run into its folder, where Bokeh is installed. It raises no error: the run is over,
    and its other results are written.

    Returns:
        Why there is none; "" if there is, or Bokeh is not installed.
    """
    if find_spec("bokeh") is None:
        return ""
    path = folder / REPORT_NAME
    try:
        write_report(path, [Reported.of(folder)])
    except KeyboardInterrupt:
        return f"{path} is left out: interrupted; `flightstack report {folder}` writes it"
    except Exception as error:  # noqa: BLE001 - whatever it is, the results of the run stand
        return f"{path} is left out: {error}; `flightstack report {folder}` writes it"
    return ""


def report_page(path: Path, runs: Sequence[Reported]) -> str:
    """The page as HTML: of one run, or a comparison of several.

    Args:
        path: where it is going to be.
        runs: at least one.

    Raises:
        EstimatorError: Bokeh is not installed.
    """
    names = _different([run.name for run in runs])
    scenes = {name: Scene.of_log(run.log) for name, run in zip(names, runs, strict=True)}
    plots = interactive_plots(path, scenes)
    title = " and ".join(names) if len(names) < 4 else f"{len(names)} runs"
    body = [_header(run, name) for name, run in zip(names, runs, strict=True)]
    body += [f"<h2>{escape(heading)}</h2>{div}" for heading, div in plots.parts]
    if len(runs) > 1:
        body.append(_comparison(names, runs))
    body += [_events(name, scene, len(runs) > 1) for name, scene in scenes.items()]
    body += [_details(name, run) for name, run in zip(names, runs, strict=True)]
    return html_page(title, "".join(body) + plots.script, head=script_tag(path))


def _different(names: Sequence[str]) -> list[str]:
    """The names, numbered where one comes again."""
    return [
        name if names.count(name) == 1 else f"{name} ({names[: number + 1].count(name)})"
        for number, name in enumerate(names)
    ]


def _header(run: Reported, name: str) -> str:
    summary = run.summary
    if not summary:
        report = report_of(run.log)
        vehicles = ", ".join(f"{v.system_id}: {v.firmware or v.autopilot} {v.type}" for v in report.vehicles)
        rows = [("log", str(run.log.path)), ("format", run.log.format), ("vehicles", vehicles),
                ("duration", f"{run.log.duration_s:.1f} s")]  # fmt: skip
        return f"<h1>{escape(name)}</h1>{html_table('', rows)}"
    outcome = str(summary["outcome"])
    reason = f": {summary['reason']}" if summary.get("reason") else ""
    by = ", ".join(str(summary[key]) for key in ("vehicle", "autopilot") if summary.get(key))
    warnings = [
        f"vehicle {block['system_id']}: {text}"
        for block in summary.get("vehicles", ())
        for text in block.get("warnings", ())
    ]
    lines = "".join(f'<p class="warning">{escape(text)}</p>' for text in warnings)
    what = summary.get("mission") or summary.get("estimator") or ""
    return (
        f"<h1>{escape(name)}: {escape(str(what if isinstance(what, str) else ''))} "
        f'<span class="{escape(outcome)}">{escape(outcome)}{escape(reason)}</span></h1>'
        f"<p>{escape(by)}</p>{lines}{html_table('', _figures(summary))}"
    )


def _figures(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The single figures of a summary."""
    return [
        (key, _written(value))
        for key, value in summary.items()
        if key not in _HIDDEN and isinstance(value, (str, int, float)) and value not in ("",)
    ]


def _written(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _flat(value: Any, name: str = "") -> dict[str, Any]:
    """Nested tables as one, with dots in the names."""
    if not isinstance(value, Mapping):
        return {name: value}
    found: dict[str, Any] = {}
    for key, entry in value.items():
        found |= _flat(entry, f"{name}.{key}" if name else str(key))
    return found


def _comparison(names: Sequence[str], runs: Sequence[Reported]) -> str:
    """What differs side by side: figures first, then options, parameters and versions."""
    flat = [_flat(run.summary) for run in runs]
    rows = []
    for key in dict.fromkeys(key for one in flat for key in one):
        values = [one.get(key) for one in flat]
        if key.startswith("message_counts") or any(isinstance(value, (list, tuple)) for value in values):
            continue
        if len(set(map(_written, values))) > 1:
            rows.append((key, *("-" if value is None else _written(value) for value in values)))
    rows.sort(key=lambda row: row[0].startswith(_SETTINGS))
    if not rows:
        return "<h2>What differs</h2><p>The summaries don't.</p>" if any(flat) else ""
    return f"<h2>What differs</h2>{html_table('', rows, ('', *names))}"


def _events(name: str, scene: Scene, several: bool) -> str:
    found = [
        (entry.time_us, path.replace("vehicles/", "vehicle "), entry.item)
        for path in scene.paths
        for entry in scene[path]
        if isinstance(entry.item, Text)
    ]
    found.sort(key=lambda event: event[0])
    rows = "".join(
        f"<tr><td>{at * 1e-6:.1f}</td><td>{escape(path)}</td>"
        f"<td{' class=warning' if item.warning else ''}>{escape(item.text)}</td></tr>"
        for at, path, item in found[:_MOST_EVENTS]
    )
    more = f"<p>{len(found) - _MOST_EVENTS} more are in the log.</p>" if len(found) > _MOST_EVENTS else ""
    of = f" of {escape(name)}" if several else ""
    head = "<tr><th>time, s</th><th>source</th><th>text</th></tr>"
    return f"<h2>Events and texts{of}</h2><table>{head}{rows}</table>{more}"


def _details(name: str, run: Reported) -> str:
    summary = run.summary
    parts = []
    if summary.get("command"):
        parts.append(f"<h2>{escape(name)}: repeat it</h2><pre>{escape(str(summary['command']))}</pre>")
    for key in ("options", "parameters", "versions", "vehicles", "estimator"):
        if summary.get(key):
            text = json.dumps(summary[key], indent=1)
            parts.append(
                f"<details><summary>{escape(name)}: {key}</summary><pre>{escape(text)}</pre></details>"
            )
    if run.folder is not None:
        for picture in sorted(run.folder.glob("*.png")):
            if picture.stat().st_size <= _MOST_PICTURE_BYTES:
                parts.append(html_picture(picture.name, picture.read_bytes()))
    return "".join(parts)
