"""The worlds of the study `magnetic-identification`: the nominal one, and those that the identification does
not know.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from missions.embedded.magnetic_encounters import EncounterConditions
from missions.embedded.magnetic_sources import FalseSources
from missions.studies.worlds import World

__all__ = ["WORLDS"]


_FARTHER: Final = "passes up to 104 m off instead of 80 m"
_NOISIER: Final = "white noise of 0.39 nT, 0.3 nT stated"
_DEEPER: Final = "targets at 1.3 times the distance of their class: wider by 1.3, weaker by its cube"
_OWN: Final = "a deviation of 30 %, chosen here"
_SURVEYED: Final = "Reeves 2005, Aeromagnetic Surveys: geological and cultural anomalies of low surveys"

WORLDS: Final[Mapping[str, World[EncounterConditions]]] = MappingProxyType(
    {
        "nominal": World(setting=EncounterConditions()),
        "wide": World(
            setting=EncounterConditions(false_sources=FalseSources.WIDE),
            differs="false anomalies are wrecks with debris, 80 to 180 m by 40 to 110 m, 15 to 45 nT",
            source="wreck sites: some ship's lengths; widths as of Gaussians of 45 to 65 m by 40 to 50 m",
        ),
        "ridge": World(
            setting=EncounterConditions(false_sources=FalseSources.RIDGE),
            differs="false anomalies are dikes or pipelines 400 m long, 10 to 140 m wide, 15 to 45 nT",
            source=_SURVEYED,
        ),
        "deep": World(
            setting=EncounterConditions(false_sources=FalseSources.DEEP),
            differs="false anomalies are dipoles 160 to 280 m below the sensor, classes: 50 to 150 m",
            source="wrecks on the continental shelf, at up to 200 m of depth",
        ),
        "dipoles": World(
            setting=EncounterConditions(false_sources=FalseSources.PAIR),
            differs="false anomalies are two boats 60 to 160 m apart",
            source="boats at anchor swing clear of each other by some of their lengths",
        ),
        "manoeuvre": World(
            setting=EncounterConditions(manoeuvre_nt=2.0),
            differs="2 nT of noise by the aircraft's motion, 2.5 and 5 s long; none stated",
            source="Leliak 1961: an uncompensated aircraft's manoeuvre noise is 1 to 10 nT",
        ),
        "half-moment": World(
            setting=EncounterConditions(moment_factor=0.5),
            differs="targets of half the moment of their class",
            source="Holmes 2008, Reduction of a Ship's Magnetic Field Signatures: degaussing, heading",
        ),
        "no-target": World(
            setting=EncounterConditions(false_sources=FalseSources.ANY, with_target=False),
            differs="there is no target; false anomalies are of the classes and of all kinds above",
            source="a search of a place where the target is not",
        ),
        "offset": World(setting=EncounterConditions(offset_m=104.0), differs=_FARTHER, source=_OWN),
        "noise": World(setting=EncounterConditions(noise_factor=1.3), differs=_NOISIER, source=_OWN),
        "depth": World(setting=EncounterConditions(depth_factor=1.3), differs=_DEEPER, source=_OWN),
        "all": World(
            setting=EncounterConditions(offset_m=104.0, noise_factor=1.3, depth_factor=1.3),
            differs=f"{_FARTHER}; {_NOISIER}; {_DEEPER}",
            source=_OWN,
        ),
        "far": World(
            setting=EncounterConditions(offset_m=150.0), differs="passes up to 150 m off", source=_OWN
        ),
        "noisy": World(
            setting=EncounterConditions(noise_nt=1.0), differs="noise of 1 nT, as stated", source=_OWN
        ),
    }
)
"""By name. The identification has the parameters of the nominal one in all of them, but for the stated noise
of `noisy`.
"""
