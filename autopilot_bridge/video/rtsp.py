"""RTSP 1.0 on the wire (RFC 2326): requests in, responses out, interleaved media. No I/O."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

_MAX_HEAD: Final = 8192
_MAX_BODY: Final = 8192
_REASONS: Final[Mapping[int, str]] = {
    200: "OK",
    400: "Bad Request",
    404: "Not Found",
    405: "Method Not Allowed",
    454: "Session Not Found",
    455: "Method Not Valid in This State",
    461: "Unsupported Transport",
    503: "Service Unavailable",
}


class RtspError(ValueError):
    """The received data are no RTSP; the connection can't be used any more."""


@dataclass(frozen=True, slots=True)
class Request:
    """One request; header names in lower case."""

    method: str
    uri: str
    headers: Mapping[str, str]

    @property
    def path(self) -> str:
        """The address without scheme, host and query, and without slashes at its ends."""
        _, scheme, rest = self.uri.partition("://")
        path = rest.partition("/")[2] if scheme else self.uri
        return path.partition("?")[0].strip("/")


class RequestReader:
    """Accepts bytes in any pieces; returns whole requests. Media data from players (RTCP) are skipped."""

    def __init__(self) -> None:
        self._buffer = b""

    def feed(self, data: bytes) -> list[Request]:
        """The requests that are complete now.

        Raises:
            RtspError: the data are no RTSP, or too long.
        """
        self._buffer += data
        found = []
        while (taken := self._take()) is not None:
            request, length = taken
            self._buffer = self._buffer[length:]
            if request is not None:
                found.append(request)
        return found

    def _take(self) -> tuple[Request | None, int] | None:
        """The first element in the buffer and its length; None: not complete."""
        buffer = self._buffer
        if buffer[:1] == b"$":  # interleaved media (RFC 2326, section 10.12)
            length = 4 + int.from_bytes(buffer[2:4], "big")
            return (None, length) if len(buffer) >= max(4, length) else None
        if buffer[:2] == b"\r\n":
            return None, 2
        end = buffer.find(b"\r\n\r\n")
        if end < 0:
            if len(buffer) > _MAX_HEAD:
                raise RtspError(f"a request without end, {len(buffer)} bytes")
            return None
        lines = buffer[:end].decode("utf-8", "replace").split("\r\n")
        words = lines[0].split()
        if len(words) != 3 or not words[2].startswith("RTSP/"):
            raise RtspError(f"{lines[0][:80]!r} is no RTSP request")
        headers = {}
        for line in lines[1:]:
            name, colon, value = line.partition(":")
            if colon:
                headers[name.strip().lower()] = value.strip()
        body = headers.get("content-length", "0")
        if not (body.isascii() and body.isdigit() and len(body) < 6 and int(body) <= _MAX_BODY):
            raise RtspError(f"a body of {body[:20]!r} bytes")
        length = end + 4 + int(body)
        return (Request(words[0], words[1], headers), length) if len(buffer) >= length else None


def response(
    status: int, request: Request, headers: Mapping[str, str] | None = None, body: str = ""
) -> bytes:
    """The answer to a request."""
    lines = [f"RTSP/1.0 {status} {_REASONS[status]}"]
    sequence = request.headers.get("cseq", "")
    if sequence.isascii() and sequence.isdigit():
        lines.append(f"CSeq: {sequence}")
    lines += [f"{name}: {value}" for name, value in (headers or {}).items()]
    if body:
        lines.append(f"Content-Length: {len(body.encode())}")
    return ("\r\n".join(lines) + "\r\n\r\n" + body).encode()


@dataclass(frozen=True, slots=True)
class Transport:
    """The transport that a player requests: within the connection (channels), or by UDP (its ports)."""

    interleaved: bool
    first: int
    second: int

    @property
    def header(self) -> str:
        """The header of the response; for UDP without the server's ports."""
        if self.interleaved:
            return f"RTP/AVP/TCP;unicast;interleaved={self.first}-{self.second}"
        return f"RTP/AVP;unicast;client_port={self.first}-{self.second}"


def parse_transport(header: str) -> Transport | None:
    """The first supported proposal of a player; None: there is none (RFC 2326, section 12.39)."""
    for proposal in header.split(","):
        profile, *options = (part.strip() for part in proposal.split(";"))
        values = dict(option.partition("=")[::2] for option in options)
        if "multicast" in values:
            continue
        if profile == "RTP/AVP/TCP":
            channels = _pair(values.get("interleaved", "0-1"), 0, 255)
            if channels:
                return Transport(True, *channels)
        elif profile in ("RTP/AVP", "RTP/AVP/UDP"):
            ports = _pair(values.get("client_port", ""), 1024, 65535)
            if ports:
                return Transport(False, *ports)
    return None


def _pair(text: str, low: int, high: int) -> tuple[int, int] | None:
    first, dash, second = text.partition("-")
    if not (first.isascii() and first.isdigit() and len(first) < 6):
        return None
    if dash and not (second.isascii() and second.isdigit() and len(second) < 6):
        return None
    pair = int(first), int(second) if dash else int(first) + 1
    return pair if all(low <= value <= high for value in pair) else None


def session_description(name: str, address: str, payload_type: int, clock_hz: int) -> str:
    """SDP of an H.264 stream (RFC 4566, RFC 6184 section 8.2); parameter sets come with each key picture."""
    return (
        "v=0\r\n"
        f"o=- 0 0 IN IP4 {address}\r\n"
        f"s={name}\r\n"
        "c=IN IP4 0.0.0.0\r\n"
        "t=0 0\r\n"
        "a=control:*\r\n"
        f"m=video 0 RTP/AVP {payload_type}\r\n"
        f"a=rtpmap:{payload_type} H264/{clock_hz}\r\n"
        f"a=fmtp:{payload_type} packetization-mode=1\r\n"
        "a=control:trackID=0\r\n"
    )
