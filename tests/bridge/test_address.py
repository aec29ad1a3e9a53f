"""Connection strings."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot_bridge.errors import AddressError
from autopilot_bridge.links import (
    ReplayLog,
    SerialPort,
    TcpClient,
    TcpServer,
    UdpClient,
    UdpPeer,
    UdpServer,
    parse_address,
)

FORMS = [
    ("udpin:0.0.0.0:14550", UdpServer("0.0.0.0", 14550), "udpin:0.0.0.0:14550"),
    ("udp:127.0.0.1:14550", UdpServer("127.0.0.1", 14550), "udpin:127.0.0.1:14550"),
    ("udpin://0.0.0.0:14540", UdpServer("0.0.0.0", 14540), "udpin:0.0.0.0:14540"),
    ("udp://:14540", UdpServer("127.0.0.1", 14540), "udpin:127.0.0.1:14540"),
    ("udpin:14550", UdpServer("127.0.0.1", 14550), "udpin:127.0.0.1:14550"),
    ("udpin:[::1]:14550", UdpServer("::1", 14550), "udpin:[::1]:14550"),
    ("udpout:10.0.0.2:14550", UdpClient("10.0.0.2", 14550), "udpout:10.0.0.2:14550"),
    ("udpout://drone.local:14550/", UdpClient("drone.local", 14550), "udpout:drone.local:14550"),
    (
        "udppeer:0.0.0.0:14580,127.0.0.1:14540",
        UdpPeer("0.0.0.0", 14580, "127.0.0.1", 14540),
        "udppeer:0.0.0.0:14580,127.0.0.1:14540",
    ),
    ("tcp:127.0.0.1:5760", TcpClient("127.0.0.1", 5760), "tcp:127.0.0.1:5760"),
    ("tcpout://127.0.0.1:5760", TcpClient("127.0.0.1", 5760), "tcp:127.0.0.1:5760"),
    ("TCP://127.0.0.1:5760", TcpClient("127.0.0.1", 5760), "tcp:127.0.0.1:5760"),
    ("tcpin:127.0.0.1:5760", TcpServer("127.0.0.1", 5760), "tcpin:127.0.0.1:5760"),
    ("tcpin://0.0.0.0:0", TcpServer("0.0.0.0", 0), "tcpin:0.0.0.0:0"),
    ("serial:/dev/ttyACM0:115200", SerialPort("/dev/ttyACM0", 115200), "serial:/dev/ttyACM0:115200"),
    ("serial:///dev/ttyACM0:57600", SerialPort("/dev/ttyACM0", 57600), "serial:/dev/ttyACM0:57600"),
    ("serial:/dev/ttyUSB1", SerialPort("/dev/ttyUSB1", 115200), "serial:/dev/ttyUSB1:115200"),
    (
        "serial:/dev/serial/by-path/pci-0:14.0:57600",
        SerialPort("/dev/serial/by-path/pci-0:14.0", 57600),
        "serial:/dev/serial/by-path/pci-0:14.0:57600",
    ),
    ("/dev/ttyACM0,115200", SerialPort("/dev/ttyACM0", 115200), "serial:/dev/ttyACM0:115200"),
    ("./ttyV0,57600", SerialPort("./ttyV0", 57600), "serial:./ttyV0:57600"),
    ("/tmp/pty/rover,9600", SerialPort("/tmp/pty/rover", 9600), "serial:/tmp/pty/rover:9600"),
    ("ttyV0,57600", SerialPort("ttyV0", 57600), "serial:ttyV0:57600"),
    ("serial:./ttyV0,57600", SerialPort("./ttyV0", 57600), "serial:./ttyV0:57600"),
    (" /dev/ttyACM0 ", SerialPort("/dev/ttyACM0", 115200), "serial:/dev/ttyACM0:115200"),
    ("logs/flight.tlog", ReplayLog(Path("logs/flight.tlog")), "logs/flight.tlog"),
]


@pytest.mark.parametrize(("text", "address", "canonical"), FORMS)
def test_forms(text, address, canonical):
    parsed = parse_address(text)
    assert parsed == address and type(parsed) is type(address)
    assert str(parsed) == canonical
    assert parse_address(canonical) == parsed


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no such form"),
        ("14550", "no such form"),
        ("flight.bin", "no such form"),
        ("127.0.0.1:14550", "no such form"),
        ("udpbcast:10.0.0.255:14550", "unknown kind 'udpbcast:'"),
        ("udpout::14550", "host is missing"),
        ("tcp:5760", "host is missing"),
        ("udp:localhost", "port is missing"),
        ("udp:localhost:mavlink", "port 'mavlink' is not in 0..65535"),
        ("udpin:", "port is missing"),
        ("udpin:0.0.0.0:65536", "port '65536'"),
        ("udpout:h:0", "port '0' is not in 1..65535"),
        ("udpout:h:²", "port '²'"),
        ("udpin:0.0.0.0:", "port is missing"),
        ("udpout:127.0.0.1", "port is missing"),
        ("udpin:[::1]", "port is missing"),
        ("tcp:localhost", "port is missing"),
        ("udpout:", "host and port are missing"),
        ("udp:a b:1", "host 'a b'"),
        ("udppeer:127.0.0.1:14580", "partner"),
        ("serial:", "device ''"),
        ("serial:/dev/ttyACM0,fast", "baud rate 'fast'"),
        ("./ttyV0,", "baud rate 'none'"),
        ("./ttyV0,fast", "baud rate 'fast'"),
        ("./ttyV0", "no such form"),
        ("/dev/ttyACM0,0", "baud rate '0'"),
    ],
)
def test_refusals_name_the_text_and_the_forms(text, reason):
    with pytest.raises(AddressError) as caught:
        parse_address(text)
    message = str(caught.value)
    assert repr(text) in message and reason in message and "accepted: udpin:HOST:PORT" in message


@given(st.one_of(st.text(), st.text(alphabet="udptcpinser:/0123456789,.[]lo")))
def test_any_text_is_an_address_or_an_address_error(text):
    try:
        address = parse_address(text)
    except AddressError:
        return
    assert parse_address(str(address)) == address
