"""The page `report.html` of a study: its table, its pictures, what failed, and how to repeat it."""

import json
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any, Final

from estimators.html_table import html_page, html_picture, html_table
from missions.studies.results import Results

__all__ = ["REPORT", "study_page"]

REPORT: Final = "report.html"
_MOST_FAILURES: Final = 100


def study_page(
    results: Results,
    summary: Mapping[str, Any],
    table: Sequence[str],
    pictures: Mapping[str, bytes],
    *,
    outcome: str,
    reason: str,
) -> str:
    """The page, which needs no network.

    Args:
        results: the rows.
        summary: contents of `summary.json`.
        table: lines of `table.txt`.
        pictures: PNG files by name; others are left out.
        outcome, reason: as of `StudyResult`.
    """
    status = (
        f'<span class="{escape(outcome)}">{escape(outcome)}{": " if reason else ""}{escape(reason)}</span>'
    )
    parts = [f"<h1>study {escape(results.name)} {status}</h1><p>{escape(results.description)}</p>"]
    trials = f"{results.table.num_rows} of {results.runs * len(results.cells)}"
    parts.append(
        html_table("", [("trials", trials), ("runs per cell", results.runs), ("seed", results.seed)])
    )
    parts.append(f"<h2>Results</h2><pre>{escape(chr(10).join(table))}</pre>")
    parts += [html_picture(name, data) for name, data in pictures.items() if name.endswith(".png")]
    failed = results.without_row()
    if failed:
        rows = [
            (row["trial"], row["outcome"], row["error"], row["command"]) for row in failed[:_MOST_FAILURES]
        ]
        headings = ("trial", "outcome", "error", "repeat it")
        parts.append(f"<h2>{len(failed)} trials without a row</h2>{html_table('', rows, headings)}")
    if summary.get("command"):
        parts.append(f"<h2>Repeat it</h2><pre>{escape(str(summary['command']))}</pre>")
    for name, found in (("options", results.options), ("versions", summary.get("versions"))):
        if found:
            text = escape(json.dumps(found, indent=1, default=str))
            parts.append(f"<details><summary>{name}</summary><pre>{text}</pre></details>")
    return html_page(f"study {results.name}", "".join(parts))
