"""The microservices of a vehicle that use files, built for one autopilot."""

from collections.abc import Mapping

from autopilot_bridge.services.commands.power import PowerPolicy, PowerService
from autopilot_bridge.services.files.card_layout import CardLayout
from autopilot_bridge.services.files.file_transfer import FileTransferService
from autopilot_bridge.services.files.log_book import LogBook
from autopilot_bridge.services.files.log_transfer import LogTransferService
from autopilot_bridge.services.files.onboard_log import OnboardLog
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parameters.storage import ParameterStorageService, StoragePolicy
from autopilot_bridge.services.parts import AutopilotParts
from autopilot_bridge.services.plans.stored_plans import StoredPlans
from autopilot_bridge.storage import FileStore, MountTable, VehiclePath


def vehicle_files(
    parts: AutopilotParts,
    *,
    layout: CardLayout,
    storage: StoragePolicy,
    power: PowerPolicy,
    folders: Mapping[VehiclePath, FileStore],
    more: tuple[Microservice, ...],
) -> tuple[Microservice, ...]:
    """File transfer, logs, stored parameters and power of one autopilot.

    Args:
        layout: of the memory card.
        storage, power: the firmware's answers.
        folders: generated files that clients see besides the card.
        more: the firmware's own services, which come before the onboard log.
    """
    memory, card = parts.memory, parts.memory.card.files
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
    logs = LogTransferService(
        book,
        lambda: None if recorder is None else recorder.path,
        lambda: parts.commander.armed,
        layout.armed_refusal,
    )
    return (
        FileTransferService(MountTable({layout.mount: card, **folders})),
        logs,
        ParameterStorageService(
            memory.stored, parts.parameters, parts.commander, storage, layout, parts.announce
        ),
        PowerService(power, parts.commander, memory.power),
        StoredPlans(parts.stores, card, layout.plans, parts.missions, parts.announce),
        *more,
        *(() if recorder is None else (recorder,)),
    )
