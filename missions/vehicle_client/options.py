"""What users set of the connection to a vehicle."""

from dataclasses import dataclass

from flightsim.foundation.options import option
from missions.base.options import PlanOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class ConnectionOptions(PlanOptions):
    """How a vehicle is found on a link.

    Attributes:
        system_id: system id of the vehicle; None: the first vehicle received.
        timeout_s: time limit for receiving a heartbeat of an autopilot.
    """

    system_id: int | None = option(
        None, least=1, most=255, help="System id of the vehicle, where several are on the link."
    )
    timeout_s: float = option(10.0, least=0.5, most=600.0, help="Time for the vehicle's heartbeat.")
