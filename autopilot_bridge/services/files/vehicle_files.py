"""The microservices of a vehicle that use files, built for one autopilot."""

from autopilot_bridge.firmware.ardupilot import packed_parameters
from autopilot_bridge.firmware.ardupilot.counter_parameters import Counters
from autopilot_bridge.firmware.ardupilot.mission_files import plan_files
from autopilot_bridge.firmware.card_layout import CARD_LAYOUTS
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.commands.power import POWER_POLICIES, PowerService
from autopilot_bridge.services.events import EventService
from autopilot_bridge.services.files.component_metadata import MOUNT, ComponentMetadataService
from autopilot_bridge.services.files.file_transfer import FileTransferService
from autopilot_bridge.services.files.log_book import LogBook
from autopilot_bridge.services.files.log_transfer import LogTransferService
from autopilot_bridge.services.files.onboard_log import OnboardLog
from autopilot_bridge.services.microservice import AutopilotParts, Microservice
from autopilot_bridge.services.parameters.storage import STORAGE_POLICIES, ParameterStorageService
from autopilot_bridge.services.plans.stored_plans import StoredPlans
from autopilot_bridge.storage import FileStore, MountTable, VehiclePath
from autopilot_bridge.storage.generated import GeneratedStore


def vehicle_files(parts: AutopilotParts) -> tuple[Microservice, ...]:
    """File transfer, logs, stored parameters and power of one autopilot."""
    memory, name = parts.memory, parts.flavour.name
    layout, card = CARD_LAYOUTS[name], memory.card.files
    book = LogBook(card, layout)
    recorder = (
        OnboardLog(
            book,
            layout,
            parts.parameters,
            parts.announce,
            system_id=parts.system_id,
            unix_us=memory.unix_us,
            add_channel=memory.add_channel,
            remove_channel=memory.remove_channel,
        )
        if memory.card.logs
        else None
    )
    places: dict[VehiclePath, FileStore] = {layout.mount: card}
    told: tuple[Microservice, ...] = ()
    if name == "px4":
        metadata = ComponentMetadataService(parts.parameters.definitions, memory.time_us)
        places[MOUNT] = metadata.store()
        told = (metadata, EventService(parts.commander, parts.broadcast, parts.flavour.notices))
    else:
        places["@PARAM",] = _packed_parameters(parts.parameters)
        places["@MISSION",] = plan_files(parts.stores)
        told = (Counters(parts),)
    files = FileTransferService(MountTable(places))
    logs = LogTransferService(
        book,
        lambda: None if recorder is None else recorder.path,
        lambda: parts.commander.armed,
        layout.armed_refusal,
    )
    storage = ParameterStorageService(
        memory.stored, parts.parameters, parts.commander, STORAGE_POLICIES[name], layout, parts.announce
    )
    power = PowerService(POWER_POLICIES[name], parts.commander, memory.power)
    plans = StoredPlans(parts.stores, card, layout.plans, parts.missions, parts.announce)
    return (files, logs, storage, power, plans, *told, *(() if recorder is None else (recorder,)))


def _packed_parameters(store: ParameterStore) -> FileStore:
    """ArduPilot's `@PARAM`."""
    return GeneratedStore(
        {"param.pck": lambda query: packed_parameters.pack(store, query)},
        {"param.pck": lambda data: packed_parameters.apply(store, data)},
    )
