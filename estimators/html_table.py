"""HTML of results: tables, which notebooks show (`_repr_html_`), and pages that need no network."""

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from typing import Final

__all__ = ["html_page", "html_picture", "html_table"]

_STYLE: Final = """
body { font: 14px/1.45 system-ui, sans-serif; color: #1f2937 }
body { max-width: 1100px; margin: 24px auto; padding: 0 16px }
h1 { font-size: 22px; margin-bottom: 4px } h2 { font-size: 17px; margin: 28px 0 6px }
table { border-collapse: collapse } th, td { text-align: left; padding: 2px 12px 2px 0; vertical-align: top }
th { font-weight: 600 } tr { border-bottom: 1px solid #e5e7eb } img { max-width: 100% }
pre { white-space: pre-wrap; background: #f3f4f6; padding: 8px }
.completed { color: #15803d } .failed, .interrupted, .warning { color: #b91c1c }
details { margin: 8px 0 } summary { cursor: pointer; font-weight: 600 }
.moments { display: flex; flex-wrap: wrap; gap: 12px }
"""


def html_table(title: str, rows: Iterable[Sequence[object]], headings: Sequence[str] = ()) -> str:
    """A table with a title. All texts are escaped.

    Args:
        title: above the table; "": none.
        rows: cells of each row.
        headings: of the columns; empty: the first cell of each row is its heading.
    """
    caption = f"<p><b>{escape(title)}</b></p>" if title else ""
    head = f"<tr>{''.join(f'<th>{escape(text)}</th>' for text in headings)}</tr>" if headings else ""
    lines = []
    for row in rows:
        first, *others = (escape(str(cell)) for cell in row)
        tag = "td" if headings else "th"
        lines.append(f"<tr><{tag}>{first}</{tag}>{''.join(f'<td>{cell}</td>' for cell in others)}</tr>")
    return f"<div>{caption}<table>{head}{''.join(lines)}</table></div>"


def html_picture(name: str, png: bytes) -> str:
    """A picture with its name above it, in the page itself."""
    data = b64encode(png).decode()
    return f'<h2>{escape(name)}</h2><img alt="{escape(name)}" src="data:image/png;base64,{data}">'


_POLICY: Final = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
    "font-src data:"
)
"""The browser refuses every request of the page (Content Security Policy)."""


def html_page(title: str, body: str, *, head: str = "") -> str:
    """A page, whose scripts can't make requests.

    Args:
        title: plain text.
        body, head: HTML.
    """
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
        f"<style>{_STYLE}</style>{head}</head><body>{body}</body></html>\n"
    )
