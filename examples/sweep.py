"""A sweep: one mission in several winds with several seeds, as a table and a picture.

    python examples/sweep.py

It flies what the command line flies with `--wind SPEED@270 --seed N`, for example

    flightstack fly lissajous --pattern L1 --size 60 --speed 4 --via setpoints --wind 6@270 --seed 1

The cells (`# %%`) run one by one in an editor or as a notebook.
"""

# %% What is flown
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from flightstack import Environment, FlightOptions, RunRequest, Via, WorldSpec, fly

MISSION = "lissajous"
OPTIONS = FlightOptions(pattern="L1", width_m=60.0, height_m=60.0, speed_m_s=4.0, via=Via.SETPOINTS)
WINDS_M_S = (0.0, 3.0, 6.0, 9.0)
SEEDS = (1, 2, 3)


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One flight; the errors are distances from the commanded path to the true position."""

    wind_m_s: float
    seed: int
    outcome: str
    rms_error_m: float
    max_error_m: float


def sweep(winds_m_s: Sequence[float], seeds: Sequence[int], folder: Path) -> Iterator[Row]:
    """Fly the mission once for each wind from west and seed, each with a run folder of its own."""
    for wind_m_s in winds_m_s:
        for seed in seeds:
            air = Environment.from_wind(speed_m_s=wind_m_s, from_deg=270.0, turbulence="light")
            request = RunRequest(
                options=OPTIONS,
                world=WorldSpec.of_team(air=air, seed=seed),
                out=folder / f"wind-{wind_m_s:g}-seed-{seed}",
                picture=False,
            )
            result = fly(MISSION, request)
            yield Row(
                wind_m_s=wind_m_s,
                seed=seed,
                outcome=result.outcome,
                rms_error_m=result.summary["path_rms_error_m"],
                max_error_m=result.summary["path_max_error_m"],
            )


def table(rows: Sequence[Row]) -> str:
    """The flights as lines of text."""
    lines = ["wind m/s  seed  outcome     RMS m  largest m"]
    for row in rows:
        errors = f"{row.rms_error_m:7.2f} {row.max_error_m:10.2f}"
        lines.append(f"{row.wind_m_s:8.1f} {row.seed:5d}  {row.outcome:10s}{errors}")
    return "\n".join(lines)


def draw(rows: Sequence[Row], path: Path) -> None:
    """The path errors over the wind: a mark for each flight."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0, 4.0), layout="constrained")
    axes = figure.subplots()
    winds = [row.wind_m_s for row in rows]
    axes.plot(winds, [row.rms_error_m for row in rows], "o", label="RMS")
    axes.plot(winds, [row.max_error_m for row in rows], "x", label="largest")
    axes.set(xlabel="wind, m/s", ylabel="path error, m", ylim=(0.0, None))
    axes.legend()
    figure.savefig(path)


# %% Fly, and look at the outcome
if __name__ == "__main__":
    FOLDER = Path("sweep")
    found = list(sweep(WINDS_M_S, SEEDS, FOLDER))
    print(table(found))
    draw(found, FOLDER / "sweep.png")
