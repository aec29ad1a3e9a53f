"""An embedded SITL for missions: the simulated world in this process, on virtual time."""

from missions.embedded.sitl import (
    MAX_FLIGHT_S,
    EmbeddedConfiguration,
    EmbeddedSitl,
    model_kind,
    open_embedded,
)

__all__ = ["MAX_FLIGHT_S", "EmbeddedConfiguration", "EmbeddedSitl", "model_kind", "open_embedded"]
