"""The picture of a coverage: probability of detection, the track and the area."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from estimators.coverage.coverage import Coverage
from estimators.flown_track import FlownTrack
from estimators.reports.figure import INK, blank_figure, save_figure, tidy

__all__ = ["draw_coverage"]

_TRACKS: Final = ("#c2410c", "#7c3aed", "#b91c1c", "#0e7490")


def draw_coverage(path: Path, title: str, coverage: Coverage, tracks: Sequence[FlownTrack]) -> None:
    """Draw the picture.

    Args:
        path: the file; it must not exist.
        title: above the picture; the figures stand below it.
        coverage: of the tracks.
        tracks: a line each.
    """
    layout, figures = coverage.area.layout, coverage.figures
    ratio = layout.rows / layout.columns
    figure = blank_figure(9.0, float(np.clip(7.0 * ratio + 1.6, 4.0, 11.0)), dpi=130)
    axes = figure.add_subplot()
    shown = np.where(coverage.area.inside, coverage.pod, np.nan)
    extent = (layout.west_m, layout.east_m, layout.south_m, layout.north_m)
    image = axes.imshow(shown, origin="lower", extent=extent, vmin=0.0, vmax=1.0, cmap="viridis")
    bar = figure.colorbar(image, ax=axes, shrink=0.8)
    bar.set_label("probability that a target here has been detected", fontsize=9, color=INK)
    for number, track in enumerate(tracks):
        ned_m = track.pos_ned_m(coverage.origin)
        colour = _TRACKS[number % len(_TRACKS)]
        for rows in track.parts:
            label = f"vehicle {track.system_id}, flown ({track.source})" if rows[0] == 0 else None
            axes.plot(ned_m[rows, 1], ned_m[rows, 0], color=colour, linewidth=1.2, label=label)
    words = (
        f"{figures['swept_share']:.0%} of {figures['area_m2']:,.0f} m\u00b2 swept, POD {figures['pod']:.0%}"
    )
    if figures["coverage"] is not None:
        words += f", coverage {figures['coverage']:.2f} (sweep width {figures['sweep_width_m']:g} m)"
    figure.suptitle(f"{title}\n{words}", fontsize=12, fontweight="bold", color=INK)
    axes.set_xlabel("east of home, m", fontsize=9, color=INK)
    axes.set_ylabel("north of home, m", fontsize=9, color=INK)
    axes.legend(loc="upper left", fontsize=8, framealpha=0.9)
    axes.set_aspect("equal")
    tidy(axes)
    axes.grid(False)
    save_figure(figure, path)
