"""The microservices of a vehicle that have to do with files, put together for one autopilot."""


from autopilot_bridge.flavours.card_layout import CARD_LAYOUTS, CardLayout
from autopilot_bridge.services import packed_parameters
from autopilot_bridge.services.file_transfer import FileTransferService
from autopilot_bridge.services.log_book import LogBook
from autopilot_bridge.services.log_transfer import LogTransferService
from autopilot_bridge.services.microservice import AutopilotParts, Microservice
from autopilot_bridge.services.onboard_log import OnboardLog
from autopilot_bridge.services.parameter_storage import STORAGE_POLICIES, ParameterStorageService
from autopilot_bridge.services.power import POWER_POLICIES, PowerService
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
    files = FileTransferService(_tree(parts, layout))
    logs = LogTransferService(book, lambda: None if recorder is None else recorder.path)
    storage = ParameterStorageService(
        memory.stored, parts.parameters, parts.commander, STORAGE_POLICIES[name], layout, parts.announce
    )
    power = PowerService(POWER_POLICIES[name], parts.commander, memory.power)
    return (files, logs, storage, power, *(() if recorder is None else (recorder,)))


def _tree(parts: AutopilotParts, layout: CardLayout) -> FileStore:
    """What clients see."""
    places: dict[VehiclePath, FileStore] = {layout.mount: parts.memory.card.files}
    if parts.flavour.name == "ardupilot":
        store = parts.parameters
        places["@PARAM",] = GeneratedStore(
            {"param.pck": lambda query: packed_parameters.pack(store, query)},
            {"param.pck": lambda data: packed_parameters.apply(store, data)},
        )
    return MountTable(places)
