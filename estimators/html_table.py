"""Tables as HTML, which a notebook shows for an object that has `_repr_html_`."""

from collections.abc import Iterable, Sequence
from html import escape

__all__ = ["html_table"]


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
