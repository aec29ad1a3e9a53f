"""The parts of an autopilot around a commander rig, and its microservices as the firmware builds them."""

from typing import Any, TypeVar

from autopilot_bridge.firmware.ardupilot import services as ardupilot_services
from autopilot_bridge.firmware.px4 import services as px4_services
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parameters.parameter_file import StoredParameters
from autopilot_bridge.services.parts import AutopilotParts
from autopilot_bridge.services.plans.protocol import new_stores
from autopilot_bridge.services.vehicle_memory import VehicleMemory
from autopilot_bridge.storage.memory import MemoryCard
from autopilot_bridge.telemetry.view import TelemetryView
from tests.services.command_rig import ServiceRig

DATA = {"px4": px4_services, "ardupilot": ardupilot_services}
"""The module with the services' data, by firmware."""
ServiceT = TypeVar("ServiceT", bound=Microservice)


def parts_of(rig: ServiceRig, **more: Any) -> AutopilotParts:
    """The rig's parts, with an empty card without logs; `more` replaces some of them."""
    services, card = rig.flavour.services, MemoryCard(logs=False)
    memory = VehicleMemory(
        card=card,
        stored=StoredParameters(rig.store, card.files, services.card, system_id=1),
        time_us=lambda: rig.time_us,
        unix_epoch_us=0,
        add_channel=lambda channel, role: None,
        remove_channel=lambda channel: None,
        power=None,
    )
    chosen: dict[str, Any] = {
        "kind": rig.flavour.kind,
        "system_id": 1,
        "commander": rig.commander,
        "navigation": None,
        "parameters": rig.store,
        "readings": rig.readings,
        "stores": new_stores(),
        "missions": services.missions,
        "broadcast": rig,
        "announce": rig.status.announce,
        "memory": memory,
        "controller": None,
        "banner": rig.status.banner,
        "view": TelemetryView(rig.context, rig.context.nav, rig.readings),
        "status": None,
        "intervals": rig.intervals,
        "set_current_item": rig._set_current,
    }
    return AutopilotParts(**{**chosen, **more})


def service_of(rig: ServiceRig, wanted: type[ServiceT], **more: Any) -> ServiceT:
    """The microservice of this type, from the firmware's own list."""
    services = rig.flavour.services.make(parts_of(rig, **more))
    return next(service for service in services if isinstance(service, wanted))
