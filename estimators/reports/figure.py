"""Figures for the files of a run. matplotlib is imported when the first is made: most runs need none."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["INK", "blank_figure", "label_of", "save_figure", "tidy", "vector_figures"]

INK: Final = "#1f2937"
"""Colour of texts."""


def blank_figure(width_in: float, height_in: float, *, dpi: int = 120) -> "Figure":
    """An empty white figure that needs no display.

    Args:
        width_in, height_in: its size, inches.
        dpi: pixels per inch.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, height_in), dpi=dpi, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


_DATES: Final = {"svg": "Date", "pdf": "CreationDate"}
_vector_formats: ContextVar[tuple[str, ...]] = ContextVar("vector_formats", default=())


@contextmanager
def vector_figures(*, wanted: bool = True) -> Iterator[None]:
    """Context in which figures are written as SVG and PDF beside each PNG, for papers.

    Args:
        wanted: False: nothing changes.
    """
    token = _vector_formats.set(tuple(_DATES) if wanted else ())
    try:
        yield
    finally:
        _vector_formats.reset(token)


def save_figure(figure: "Figure", path: Path) -> None:
    """Write a figure as PNG, which is the same for the same figure; also as `vector_figures` says.

    Raises:
        FileExistsError: a file exists.
    """
    with path.open("xb") as file:
        figure.savefig(file, format="png", metadata={"Software": None})
    for form in _vector_formats.get():
        with path.with_suffix(f".{form}").open("xb") as file:
            figure.savefig(file, format=form, metadata={_DATES[form]: None})


_UNITS: Final = {
    "m_s2": "m/s\u00b2", "m2_s2": "m\u00b2/s\u00b2", "rad_s2": "rad/s\u00b2", "m_s": "m/s", "rad_s": "rad/s",
    "deg_s": "deg/s", "deg2": "deg\u00b2", "rad2": "rad\u00b2", "m2": "m\u00b2", "deg": "deg", "rad": "rad",
    "m": "m", "s": "s", "us": "\u00b5s", "hz": "Hz", "px": "pixels", "nt": "nT", "pa": "Pa", "v": "V",
    "nats": "nats",
}  # fmt: skip
"""Units as the ends of names have them, the longest first where one ends another."""
_WORDS: Final = {
    "rms": "RMS",
    "gps": "GPS",
    "ospa": "OSPA",
    "gospa": "GOSPA",
    "pod": "POD",
    "ne": "north east",
}


def label_of(name: str) -> str:
    """The name of a quantity in words, with its unit: "path RMS error, m" of `path_rms_error_m`."""
    end = next((end for end in _UNITS if name.endswith(f"_{end}")), "")
    words = re.split(r"[_.\s-]+", name.removesuffix(f"_{end}") if end else name)
    text = " ".join(_WORDS.get(word, word) for word in words)
    return f"{text}, {_UNITS[end]}" if end else text


def tidy(axes: Any) -> None:
    """Simple axes: thin grid, two spines."""
    axes.tick_params(colors=INK, labelsize=8)
    axes.grid(True, color="#e5e7eb", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color("#9ca3af")
