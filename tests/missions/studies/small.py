"""A study whose trials are cheap, for tests of the engines."""

import math
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flightsim.foundation.random_streams import RandomStreams
from missions.studies import Study, grid, latin_hypercube


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A row with every kind of column."""

    error_m: float
    count: int
    found: bool
    text: str
    path: tuple[float, ...]
    figures: Mapping[str, float]
    maybe: float | None


def trial(parameters: Mapping[str, Any], seed: int) -> Row:
    """A draw that depends on everything a trial has."""
    draw = RandomStreams(seed).generator("small")
    wind_m_s, gust = parameters["wind_m_s"], parameters["gust"]
    time.sleep(0.02)
    if parameters["kind"] == "b" and draw.random() < 0.1:
        raise ValueError(f"no luck with seed {seed}")
    error_m = wind_m_s + gust + draw.standard_normal()
    return Row(
        error_m=error_m,
        count=int(draw.integers(10)),
        found=bool(error_m < 6.0),
        text=f"{parameters['kind']}{seed}",
        path=tuple(draw.standard_normal(seed % 4)),
        figures={"sine": math.sin(error_m), "cosine": math.cos(error_m)},
        maybe=None if draw.random() < 0.3 else error_m,
    )


STUDY = Study(
    name="small",
    trial=trial,
    row=Row,
    design=grid(wind_m_s=(0.0, 4.0), kind=("a", "b")) * latin_hypercube(gust=(0.0, 3.0)),
    runs=10,
    success="found",
    warm_up=os.getpid,
)
