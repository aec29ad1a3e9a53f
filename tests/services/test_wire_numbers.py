"""Numbers that other programs send: those of the MAVLink specification."""

import pytest
from pymavlink import mavftp
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.services.channel import NO_CLIENT
from autopilot_bridge.services.files.ftp_protocol import FtpError, Opcode
from autopilot_bridge.services.inputs import setpoints as frames
from autopilot_bridge.services.inputs.transmitter import CHANNELS, Radio

OPCODES = {
    "NONE": mavftp.OP_None,
    "TERMINATE_SESSION": mavftp.OP_TerminateSession,
    "RESET_SESSIONS": mavftp.OP_ResetSessions,
    "LIST_DIRECTORY": mavftp.OP_ListDirectory,
    "OPEN_FILE_RO": mavftp.OP_OpenFileRO,
    "READ_FILE": mavftp.OP_ReadFile,
    "CREATE_FILE": mavftp.OP_CreateFile,
    "WRITE_FILE": mavftp.OP_WriteFile,
    "REMOVE_FILE": mavftp.OP_RemoveFile,
    "CREATE_DIRECTORY": mavftp.OP_CreateDirectory,
    "REMOVE_DIRECTORY": mavftp.OP_RemoveDirectory,
    "OPEN_FILE_WO": mavftp.OP_OpenFileWO,
    "TRUNCATE_FILE": mavftp.OP_TruncateFile,
    "RENAME": mavftp.OP_Rename,
    "CALC_FILE_CRC32": mavftp.OP_CalcFileCRC32,
    "BURST_READ_FILE": mavftp.OP_BurstReadFile,
    "ACK": mavftp.OP_Ack,
    "NAK": mavftp.OP_Nack,
}
ERRORS = {
    "FAIL": mavftp.FtpError.Fail,
    "FAIL_ERRNO": mavftp.FtpError.FailErrno,
    "INVALID_DATA_SIZE": mavftp.FtpError.InvalidDataSize,
    "INVALID_SESSION": mavftp.FtpError.InvalidSession,
    "NO_SESSIONS_AVAILABLE": mavftp.FtpError.NoSessionsAvailable,
    "END_OF_FILE": mavftp.FtpError.EndOfFile,
    "UNKNOWN_COMMAND": mavftp.FtpError.UnknownCommand,
    "FILE_EXISTS": mavftp.FtpError.FileExists,
    "FILE_PROTECTED": mavftp.FtpError.FileProtected,
    "FILE_NOT_FOUND": mavftp.FtpError.FileNotFound,
}


def test_numbers_of_file_transfers_are_those_of_pymavlinks_client() -> None:
    assert {opcode.name: int(opcode) for opcode in Opcode} == OPCODES
    assert {error.name: int(error) for error in FtpError} == {name: int(at) for name, at in ERRORS.items()}


def test_every_channel_of_a_radio_can_be_overridden() -> None:
    assert CHANNELS == 18  # RC_CHANNELS
    fields = mavlink.MAVLink_rc_channels_message.fieldnames
    assert sum(name.endswith("_raw") for name in fields) == CHANNELS
    assert len(Radio().pulses_us) == CHANNELS


@pytest.mark.parametrize("timeout_s", [0.0, 0.5, 3.0, -1.0])
def test_an_override_ends_by_its_timeout(timeout_s: float) -> None:
    radio = Radio()
    radio.override(4, 1700, 1_000_000)
    radio.expire(1_000_000 + round(max(0.0, timeout_s) * 1e6), timeout_s)
    assert radio.overridden
    radio.expire(1_000_001 + round(max(0.0, timeout_s) * 1e6), timeout_s)
    assert radio.overridden is (timeout_s < 0.0)  # negative: never


def test_no_client_has_no_address() -> None:
    assert (NO_CLIENT.system_id, NO_CLIENT.component_id) == (0, 0)


def test_bits_of_setpoints_are_mavlinks() -> None:
    def bits(*names: str) -> tuple[int, ...]:
        return tuple(getattr(mavlink, f"POSITION_TARGET_TYPEMASK_{name}") for name in names)

    assert bits("X_IGNORE", "Y_IGNORE", "Z_IGNORE") == frames.POSITION_BITS
    assert bits("VX_IGNORE", "VY_IGNORE", "VZ_IGNORE") == frames.VELOCITY_BITS
    assert bits("AX_IGNORE", "AY_IGNORE", "AZ_IGNORE") == frames.ACCELERATION_BITS
    assert bits("FORCE_SET", "YAW_IGNORE", "YAW_RATE_IGNORE") == (
        frames.FORCE_BIT,
        frames.YAW_BIT,
        frames.YAW_RATE_BIT,
    )
    assert mavlink.ATTITUDE_TARGET_TYPEMASK_THROTTLE_IGNORE == frames.THROTTLE_BIT
    assert mavlink.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE == frames.ATTITUDE_BIT
