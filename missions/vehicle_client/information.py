"""Information about the connected vehicle."""

from typing import Any, Final

from mavsdk.asyncio.plugins.info import InfoAsync
from mavsdk.plugins.info import InfoError

from autopilot_bridge.mavlink import dialect, enum_name
from autopilot_bridge.mavlink.wire_units import degrees, metres
from flightsim.foundation.plain_text import plain_text
from missions.vehicle_client.client import WANTED, VehicleClient

_WAIT_S: Final = 4.0
_ARMED: Final = dialect.MAV_MODE_FLAG_SAFETY_ARMED


async def information(client: VehicleClient) -> dict[str, Any]:
    """Everything that `flightstack vehicle info` prints, as plain values; None for unknown values."""
    wanted = WANTED.get(client.flavour, WANTED["px4"])
    await client.ask_for(wanted)
    version = float(dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    answer = await client.command(dialect.MAV_CMD_REQUEST_MESSAGE, version)
    await client.wait_for("AUTOPILOT_VERSION", *wanted, timeout_s=_WAIT_S)
    heartbeat = client.messages["HEARTBEAT"]
    snapshot = client.snapshot()
    return {
        "autopilot": client.flavour or _name("MAV_AUTOPILOT", int(heartbeat["autopilot"])),
        "type": _name("MAV_TYPE", int(heartbeat["type"])),
        "kind": None if client.kind is None else str(client.kind),
        "system_id": client.system_id,
        "answers": answer is not None,
        "components": [
            {"id": component, "name": _component(component)}
            for component in await client.system.component_ids()
        ],
        **await _versions(client),
        "capabilities": _capabilities(snapshot.whole("AUTOPILOT_VERSION", "capabilities")),
        "mode": client.mode,
        "armed": bool(int(heartbeat["base_mode"]) & _ARMED),
        "system_status": _name("MAV_STATE", int(heartbeat["system_status"])),
        "landed_state": _landed(snapshot.whole("EXTENDED_SYS_STATE", "landed_state")),
        "position": _position(client),
        "home": _home(client),
        "gps": _gps(client),
        "battery": _battery(client),
    }


def _name(enum: str, value: int) -> str:
    return (enum_name(enum, value) or str(value)).lower()


def _component(component: int) -> str:
    return (enum_name("MAV_COMPONENT", component, prefix="MAV_COMP_ID_") or f"component {component}").lower()


def _landed(state: int | None) -> str | None:
    return None if state is None else _name("MAV_LANDED_STATE", state)


async def _versions(client: VehicleClient) -> dict[str, Any]:
    """Versions, from MAVSDK's info plugin."""
    info = InfoAsync(client.system)
    found: dict[str, Any] = dict.fromkeys(("firmware", "firmware_git", "os", "vendor", "product", "uid"))
    try:
        version = await info.get_version()
        product = await info.get_product()
        identity = await info.get_identification()
    except InfoError:
        return found
    numbers = (version.flight_sw_major, version.flight_sw_minor, version.flight_sw_patch)
    found["firmware"] = f"{'.'.join(map(str, numbers))} {version.flight_sw_version_type.name.lower()}"
    found["firmware_git"] = _git_hash(client) or None
    os_numbers = (version.os_sw_major, version.os_sw_minor, version.os_sw_patch)
    found["os"] = ".".join(map(str, os_numbers)) if any(os_numbers) else None
    found["vendor"] = product.vendor_name if product.vendor_id else None
    found["product"] = product.product_name if product.product_id else None
    uid = identity.hardware_uid.strip("0")
    found["uid"] = identity.hardware_uid if uid else str(identity.legacy_uid) if identity.legacy_uid else None
    return found


def _git_hash(client: VehicleClient) -> str:
    """Git hash from AUTOPILOT_VERSION.flight_custom_version: PX4 sends its bytes reversed, ArduPilot sends
    text.

    MAVSDK's `flight_sw_git_hash` assumes PX4's order for every autopilot.
    """
    raw = client.messages.get("AUTOPILOT_VERSION", {}).get("flight_custom_version")
    if not isinstance(raw, list):
        return ""
    data = bytes(value & 0xFF for value in raw)
    if client.flavour == "px4":
        return data[::-1].hex().rstrip("0")
    return plain_text(data.rstrip(b"\0").decode("ascii", "replace"))


def _capabilities(bits: int | None) -> list[str] | None:
    if bits is None:
        return None
    return [
        (enum_name("MAV_PROTOCOL_CAPABILITY", 1 << k) or f"bit {k}").lower()
        for k in range(32)
        if bits & 1 << k
    ]


def _position(client: VehicleClient) -> dict[str, float] | None:
    m = client.messages.get("GLOBAL_POSITION_INT")
    if m is None:
        return None
    return {
        "lat_deg": degrees(m["lat"]),
        "lon_deg": degrees(m["lon"]),
        "alt_m": metres(m["alt"]),
        "height_m": metres(m["relative_alt"]),
    }


def _home(client: VehicleClient) -> dict[str, float] | None:
    m = client.messages.get("HOME_POSITION")
    if m is None:
        return None
    return {
        "lat_deg": degrees(m["latitude"]),
        "lon_deg": degrees(m["longitude"]),
        "alt_m": metres(m["altitude"]),
    }


def _gps(client: VehicleClient) -> dict[str, Any] | None:
    m = client.messages.get("GPS_RAW_INT")
    if m is None:
        return None
    return {
        "fix": _name("GPS_FIX_TYPE", int(m["fix_type"])),
        "satellites": m["satellites_visible"],
        "hdop": None if m["eph"] == 65535 else m["eph"] / 100.0,
    }


def _battery(client: VehicleClient) -> dict[str, float | None] | None:
    m = client.messages.get("SYS_STATUS")
    if m is None:
        return None
    return {
        "voltage_v": None if m["voltage_battery"] in (0, 65535) else m["voltage_battery"] * 1e-3,
        "current_a": None if m["current_battery"] < 0 else m["current_battery"] * 1e-2,
        "remaining_percent": None if m["battery_remaining"] < 0 else m["battery_remaining"],
    }
