"""Reads and writes the simplest OpenEXR files: one part, scanlines, R, G and B of one resolution.

Source: https://openexr.com/en/latest/OpenEXRFileLayout.html
"""
import array
import pathlib
import struct
import sys
import zlib

from problems import ConversionError

MAGIC = 20000630
LINES_PER_BLOCK = {0: 1, 2: 1, 3: 16}  # by compression: none, ZIPS, ZIP
HALF, FLOAT = 1, 2
SIZES = {HALF: 2, FLOAT: 4}


class Picture:
    """Rows from the top, each three arrays of floats: red, green, blue."""

    def __init__(self, width, rows):
        self.width = width
        self.rows = rows

    def changed(self, scale, shift):
        """A copy with all values times `scale`, and with columns moved to the right by `shift`, around the edge."""
        shift %= self.width
        return Picture(self.width, [[array.array("f", [scale * value for value in channel[-shift:] + channel[:-shift]])
                                     for channel in row] for row in self.rows])


def _text(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode("ascii"), end + 1


def _header(data, path):
    magic, version = struct.unpack_from("<II", data)
    if magic != MAGIC:
        raise ConversionError(f"{path}: is no OpenEXR file")
    if version & 0x1E00:
        raise ConversionError(f"{path}: has tiles, deep data or several parts; only scanlines can be read")
    attributes, at = {}, 8
    while data[at] != 0:
        name, at = _text(data, at)
        _, at = _text(data, at)
        size, = struct.unpack_from("<I", data, at)
        attributes[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    return attributes, at + 1


def _channels(value, path):
    """(name, type) of each channel, in the file's order."""
    channels, at = [], 0
    while value[at] != 0:
        name, at = _text(value, at)
        kind, _, x, y = struct.unpack_from("<iiii", value, at)
        if kind not in SIZES or (x, y) != (1, 1):
            raise ConversionError(f"{path}: channel {name} is of whole numbers, or has another resolution")
        channels.append((name, kind))
        at += 16
    if not {"R", "G", "B"} <= {name for name, _ in channels}:
        raise ConversionError(f"{path}: has not R, G and B")
    return channels


def _unpacked(block, size):
    """Undoes ZIP: zlib, then differences of bytes, then bytes in two halves."""
    if len(block) == size:
        return block
    data = bytearray(zlib.decompress(block))
    for i in range(1, len(data)):
        data[i] = (data[i - 1] + data[i] - 128) & 255
    result, half = bytearray(len(data)), (len(data) + 1) // 2
    result[0::2], result[1::2] = data[:half], data[half:]
    return bytes(result)


def read_exr(path):
    """Throws ConversionError."""
    try:
        data = pathlib.Path(path).read_bytes()
    except OSError as reason:
        raise ConversionError(f"{path}: {reason.strerror}") from reason
    try:
        return _read(data, path)
    except (struct.error, ValueError, IndexError, KeyError, zlib.error) as reason:
        raise ConversionError(f"{path}: is damaged ({reason})") from reason


def _read(data, path):
    attributes, at = _header(data, path)
    channels = _channels(attributes["channels"], path)
    compression = attributes["compression"][0]
    if compression not in LINES_PER_BLOCK:
        raise ConversionError(f"{path}: its compression cannot be read; save it without, or as ZIP")
    left, top, right, bottom = struct.unpack("<iiii", attributes["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    lines = LINES_PER_BLOCK[compression]
    blocks = (height + lines - 1) // lines
    line_size = width * sum(SIZES[kind] for _, kind in channels)
    rows = [None] * height
    for offset in struct.unpack_from(f"<{blocks}Q", data, at):
        first, size = struct.unpack_from("<iI", data, offset)
        first -= top
        count = min(lines, height - first)
        block = _unpacked(data[offset + 8:offset + 8 + size], count * line_size)
        for i in range(count):
            rows[first + i] = _row(block, i * line_size, channels, width)
    return Picture(width, rows)


def _row(block, at, channels, width):
    values = {}
    for name, kind in channels:
        values[name] = array.array("f", struct.unpack_from(f"<{width}{'e' if kind == HALF else 'f'}", block, at))
        at += width * SIZES[kind]
    return [values["R"], values["G"], values["B"]]


def _attribute(name, kind, value):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(value)) + value


def write_exr(path, picture):
    """Writes floats without compression."""
    height = len(picture.rows)
    window = struct.pack("<iiii", 0, 0, picture.width - 1, height - 1)
    channels = b"".join(name + b"\0" + struct.pack("<iiii", FLOAT, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    head = struct.pack("<II", MAGIC, 2) + b"".join((
        _attribute("channels", "chlist", channels), _attribute("compression", "compression", b"\0"),
        _attribute("dataWindow", "box2i", window), _attribute("displayWindow", "box2i", window),
        _attribute("lineOrder", "lineOrder", b"\0"), _attribute("pixelAspectRatio", "float", struct.pack("<f", 1.0)),
        _attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0.0, 0.0)),
        _attribute("screenWindowWidth", "float", struct.pack("<f", 1.0)))) + b"\0"
    line = 12 * picture.width
    first = len(head) + 8 * height
    with open(path, "wb") as out:
        out.write(head)
        out.write(struct.pack(f"<{height}Q", *(first + y * (line + 8) for y in range(height))))
        for y, (red, green, blue) in enumerate(picture.rows):
            out.write(struct.pack("<iI", y, line))
            for channel in (blue, green, red):
                out.write(_little_endian(channel))


def _little_endian(values):
    copy = array.array("f", values)
    if sys.byteorder == "big":
        copy.byteswap()
    return copy.tobytes()
