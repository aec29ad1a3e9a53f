"""Writers of small ArduPilot .bin and PX4 .ulg files, after the formats' own descriptions."""

import struct

_DATAFLASH_FMT = 128
_DATAFLASH_CODES = {"Q": "Q", "I": "I", "i": "i", "B": "B", "h": "h", "H": "H", "f": "f", "d": "d"}
_DATAFLASH_CODES |= {
    "L": "i",
    "c": "h",
    "C": "H",
    "e": "i",
    "E": "I",
    "M": "B",
    "n": "4s",
    "N": "16s",
    "Z": "64s",
}
_SCALED = {"c": 100.0, "C": 100.0, "e": 100.0, "E": 100.0, "L": 1e7}


class DataflashWriter:
    """Formats come first; `add` writes values as the log would give them back."""

    def __init__(self, **formats):
        """formats: name=(codes, "Column,Column")."""
        self.data = bytearray()
        self.formats = {}
        self._format(_DATAFLASH_FMT, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
        for number, (name, (codes, columns)) in enumerate(formats.items(), start=1):
            self.formats[name] = (number, codes)
            self._format(number, name, codes, columns)

    def _format(self, number, name, codes, columns):
        size = 3 + struct.calcsize("<" + "".join(_DATAFLASH_CODES[code] for code in codes))
        values = (number, size, name.encode(), codes.encode(), columns.encode())
        self.data += bytes((0xA3, 0x95, _DATAFLASH_FMT)) + struct.pack("<BB4s16s64s", *values)

    def add(self, name, *values):
        number, codes = self.formats[name]
        raw = [
            round(value * _SCALED[code])
            if code in _SCALED
            else value.encode()
            if isinstance(value, str)
            else value
            for code, value in zip(codes, values, strict=True)
        ]
        layout = "<" + "".join(_DATAFLASH_CODES[code] for code in codes)
        self.data += bytes((0xA3, 0x95, number)) + struct.pack(layout, *raw)

    def save(self, path):
        path.write_bytes(self.data)
        return path


class UlogWriter:
    """Definitions come first, then `subscribe` and `add`."""

    def __init__(self, **formats):
        """formats: topic="uint64_t timestamp;float[3] gyro_rad;"."""
        self.data = bytearray(bytes.fromhex("554c6f67011235") + b"\x01" + struct.pack("<Q", 1000))
        self._message("B", bytes(40))
        self._header_end = len(self.data)
        self.topics = {}
        for name, fields in formats.items():
            self._message("F", f"{name}:{fields}".encode())

    def _message(self, kind, body):
        self.data += struct.pack("<HB", len(body), ord(kind)) + body

    def subscribe(self, name, instance=0):
        number = len(self.topics)
        self.topics[name, instance] = number
        self._message("A", struct.pack("<BH", instance, number) + name.encode())

    def add(self, name, layout, *values, instance=0):
        number = self.topics[name, instance]
        self._message("D", struct.pack("<H", number) + struct.pack(f"<{layout}", *values))

    def parameter(self, name, value):
        kind, layout = ("int32_t", "<i") if isinstance(value, int) else ("float", "<f")
        key = f"{kind} {name}".encode()
        body = bytes([len(key)]) + key + struct.pack(layout, value)
        # Parameters stand among the definitions, before the first subscription.
        self.data[self._header_end : self._header_end] = struct.pack("<HB", len(body), ord("P")) + body

    def text(self, level, time_us, message):
        self._message("L", struct.pack("<BQ", level + ord("0"), time_us) + message.encode())

    def save(self, path):
        path.write_bytes(self.data)
        return path
