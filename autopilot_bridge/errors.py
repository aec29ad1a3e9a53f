"""The bridge's errors. Bytes from a link or a log never raise; requests of a user or a program may."""


class BridgeError(Exception):
    """Base of every error the bridge raises."""


class AddressError(BridgeError, ValueError):
    """A connection string is not one of the accepted forms; the message names the text and the forms."""


class LinkError(BridgeError, OSError):
    """A link could not be opened (busy port, no such device); the message contains the address and the
    solution.
    """


class MessageError(BridgeError, ValueError):
    """A MAVLink message is unknown to the dialect, or a field of it can't be put on the wire."""


class ClockError(BridgeError, RuntimeError):
    """A clock can't execute a request (time limit of a virtual run reached, loop of the wrong kind)."""


class TlogError(BridgeError, OSError):
    """A telemetry log could not be created or read; the message contains the path and the solution."""


class SigningKeyError(BridgeError, ValueError):
    """A signing key is not one of the accepted forms; the message never holds the key."""
