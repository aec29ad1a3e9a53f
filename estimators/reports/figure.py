"""Figures for the files of a run. matplotlib is imported when the first is made: most runs need none."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["INK", "blank_figure", "save_figure", "tidy"]

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


def save_figure(figure: "Figure", path: Path) -> None:
    """Write a figure as PNG, which is the same for the same figure.

    Raises:
        FileExistsError: the file exists.
    """
    with path.open("xb") as file:
        figure.savefig(file, format="png", metadata={"Software": None})


def tidy(axes: Any) -> None:
    """Simple axes: thin grid, two spines."""
    axes.tick_params(colors=INK, labelsize=8)
    axes.grid(True, color="#e5e7eb", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color("#9ca3af")
