"""The bridge's errors. Bytes from a link or a log never raise; what a person or a program asks for may."""


class BridgeError(Exception):
    """Base of every error the bridge raises."""


class AddressError(BridgeError, ValueError):
    """A connection string is not one of the accepted forms; the message names the text and the forms."""


class LinkError(BridgeError, OSError):
    """A link could not be opened (busy port, no such device); the message names the address and what to
    do.
    """


class MessageError(BridgeError, ValueError):
    """A MAVLink message is unknown to the dialect, or a field of it can't be put on the wire."""


class ClockError(BridgeError, RuntimeError):
    """A clock can't do what was asked of it (time limit of a virtual run reached, loop of the wrong kind)."""


class TlogError(BridgeError, OSError):
    """A telemetry log could not be created or read; the message names the path and what to do."""


class SigningKeyError(BridgeError, ValueError):
    """A signing key is not one of the accepted forms; the message never holds the key."""
