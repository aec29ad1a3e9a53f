"""The coverage of flights from their logs, and its folder."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from estimators.coverage.coverage import Coverage, coverage_of
from estimators.coverage.files import read_area, write_coverage_geotiff
from estimators.coverage.picture import draw_coverage
from estimators.errors import EstimatorError
from estimators.flown_track import flown_tracks, has_truth
from estimators.logs import Log
from estimators.logs.new_file import new_file
from estimators.references import AUTOPILOT, TRUTH
from estimators.vision.camera_file import load_camera
from missions.estimation.log_options import CoverageOptions, TrackBy
from missions.flown.run_folder import create_run_folder, finite

__all__ = ["AssessedCoverage", "assess_coverage"]


@dataclass(frozen=True, slots=True, kw_only=True)
class AssessedCoverage:
    """A coverage and its files.

    Attributes:
        coverage: the coverage.
        folder: of the files.
        written: their names.
        remarks: why a file was not written.
    """

    coverage: Coverage
    folder: Path
    written: tuple[str, ...]
    remarks: tuple[str, ...]


def assess_coverage(
    logs: Sequence[Log],
    options: CoverageOptions,
    *,
    camera: Path | None = None,
    area: Path | None = None,
    out: Path | None = None,
) -> AssessedCoverage:
    """The coverage of the flights in logs together, written to a new folder.

    Args:
        logs: open logs.
        options: sensor, grid and whose tracks.
        camera: file of the camera; None: the sensor has a sweep width.
        area: GeoJSON file with the searched area; None: the rectangle that was seen.
        out: the folder; None: the next `runs/coverage-<n>`.

    Raises:
        EstimatorError, PlanError: a value or file is not accepted.
        LogError: a log has no track, or a file can't be written.
    """
    tracks = []
    for log in logs:
        best = TRUTH if options.track_by is TrackBy.BEST and has_truth(log) else AUTOPILOT
        source = best if options.track_by is TrackBy.BEST else str(options.track_by)
        tracks += flown_tracks(log, options.system_id, source=source)
    description = None if camera is None else load_camera(camera)
    corners = None if area is None else read_area(area, tracks[0].home)
    coverage = coverage_of(tracks, options, description, corners)
    folder = create_run_folder(out, "coverage")
    written, remarks = ["coverage.json"], []
    with new_file(folder / "coverage.json") as part:
        part.write_text(json.dumps(finite(coverage.figures), indent=2) + "\n", encoding="utf-8")
    title = ", ".join(log.path.name for log in logs)
    with new_file(folder / "coverage.png") as part:
        draw_coverage(part, title, coverage, tracks)
    written.append("coverage.png")
    try:
        with new_file(folder / "coverage.tif") as part:
            write_coverage_geotiff(folder / "coverage.tif", part, coverage)
        written.append("coverage.tif")
    except EstimatorError as error:
        remarks.append(str(error))
    return AssessedCoverage(coverage=coverage, folder=folder, written=tuple(written), remarks=tuple(remarks))
