"""Reads glTF 2.0: a .glb file, or a .gltf file with its buffers and images.

Source: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
"""
import array
import base64
import binascii
import json
import pathlib
import struct
import sys
import urllib.parse
from typing import Any, Dict, Iterator, List, NamedTuple, Tuple

from comparison_error import ComparisonError

Json = Dict[str, Any]
Matrix = Tuple[Tuple[float, ...], ...]  # rows

MAGIC, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942
TYPE_CODES = {5121: "B", 5123: "H", 5125: "I", 5126: "f"}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}
TRIANGLES = 4
IDENTITY: Matrix = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))


class PlacedPrimitive(NamedTuple):
    """A primitive of a mesh with its node's transform."""
    primitive: Json
    to_world: Matrix


class GltfScene:
    """The JSON part of a file, and the bytes of its buffers."""

    def __init__(self, file: Json, buffers: List[bytes], path: pathlib.Path) -> None:
        self.file, self.buffers, self.path = file, buffers, path

    def view(self, index: int) -> bytes:
        """The bytes of a buffer view."""
        view = self.file["bufferViews"][index]
        begin = view.get("byteOffset", 0)
        found: bytes = self.buffers[view["buffer"]][begin:begin + view["byteLength"]]
        if len(found) != view["byteLength"]:
            raise ComparisonError(f"{self.path}: buffer view {index} ends after its buffer")
        return found

    def values(self, index: int, kind: str) -> "array.array[Any]":
        """The numbers of an accessor, whose type must be `kind`. Floats, or unsigned integers."""
        accessor = self.file["accessors"][index]
        code, components = TYPE_CODES.get(accessor["componentType"]), COMPONENTS[kind]
        if accessor["type"] != kind or code is None or (kind != "SCALAR") != (code == "f"):
            raise ComparisonError(f"{self.path}: accessor {index} is not {kind} of a type that can be read")
        if "sparse" in accessor or "bufferView" not in accessor:
            raise ComparisonError(f"{self.path}: accessor {index} is sparse, which cannot be read")
        view = self.file["bufferViews"][accessor["bufferView"]]
        element = components * array.array(code).itemsize
        stride, begin, count = view.get("byteStride", element), accessor.get("byteOffset", 0), accessor["count"]
        data = self.view(accessor["bufferView"])
        if count and begin + (count - 1) * stride + element > len(data):
            raise ComparisonError(f"{self.path}: accessor {index} ends after its buffer view")
        if stride == element:
            data = data[begin:begin + count * element]
        else:
            data = b"".join(data[at:at + element] for at in range(begin, begin + count * stride, stride))
        result = array.array(code, data)
        if sys.byteorder == "big":
            result.byteswap()
        return result

    def image(self, index: int) -> bytes:
        """The encoded bytes of an image, a PNG or a JPEG."""
        image = self.file["images"][index]
        return self.view(image["bufferView"]) if "bufferView" in image else _of_uri(image["uri"], self.path)

    def chosen_scene(self) -> Json:
        """The scene that a viewer shows."""
        scenes = self.file.get("scenes", [])
        if not scenes:
            raise ComparisonError(f"{self.path}: has no scene")
        found: Json = scenes[self.file.get("scene", 0)]
        return found

    def placed_nodes(self) -> Iterator[Tuple[Json, Matrix]]:
        """Each node of the scene with its transform to the world, depth first."""
        nodes = self.file.get("nodes", [])
        stack = [(index, IDENTITY) for index in reversed(self.chosen_scene().get("nodes", []))]
        seen = set()
        while stack:
            index, parent = stack.pop()
            if index in seen:
                raise ComparisonError(f"{self.path}: node {index} is reached twice")
            seen.add(index)
            to_world = product(parent, _local(nodes[index]))
            yield nodes[index], to_world
            stack.extend((child, to_world) for child in reversed(nodes[index].get("children", [])))

    def primitives(self) -> Iterator[PlacedPrimitive]:
        """All primitives of the scene. They must be triangles."""
        for node, to_world in self.placed_nodes():
            if "mesh" not in node:
                continue
            for primitive in self.file["meshes"][node["mesh"]]["primitives"]:
                if primitive.get("mode", TRIANGLES) != TRIANGLES:
                    raise ComparisonError(f"{self.path}: mesh {node['mesh']} has points, lines, strips or fans")
                yield PlacedPrimitive(primitive, to_world)


def product(a: Matrix, b: Matrix) -> Matrix:
    """The matrix that applies b, then a."""
    return tuple(tuple(sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)) for i in range(4))


def determinant(m: Matrix) -> float:
    """That of the upper left 3x3 part. Below 0, the transform mirrors."""
    (a, b, c), (d, e, f), (g, h, i) = (row[:3] for row in m[:3])
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def _local(node: Json) -> Matrix:
    """A node's transform to its parent."""
    if "matrix" in node:
        m = node["matrix"]
        return tuple(tuple(m[row + 4 * column] for column in range(4)) for row in range(4))
    (x, y, z, w), s, t = node.get("rotation", (0, 0, 0, 1)), node.get("scale", (1, 1, 1)), node.get("translation", (0, 0, 0))
    rotation = ((1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
                (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
                (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)))
    return (*((*(float(rotation[i][j] * s[j]) for j in range(3)), float(t[i])) for i in range(3)), (0.0, 0.0, 0.0, 1.0))


def _of_uri(uri: str, path: pathlib.Path) -> bytes:
    """The bytes of a data URI, or of a file beside `path`."""
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition(",")[2])
    return (path.parent / urllib.parse.unquote(uri)).read_bytes()


def _chunks(data: bytes) -> Dict[int, bytes]:
    """The chunks of a .glb file by type."""
    found: Dict[int, bytes] = {}
    at = 12
    while at + 8 <= len(data):
        size, kind = struct.unpack_from("<II", data, at)
        found.setdefault(kind, data[at + 8:at + 8 + size])
        at += 8 + size
    return found


def read_gltf(path: pathlib.Path) -> GltfScene:
    """Reads a file. Throws ComparisonError where it is missing, damaged, or no glTF 2.0."""
    try:
        data = path.read_bytes()
        chunks = _chunks(data) if data[:4] == struct.pack("<I", MAGIC) else {JSON_CHUNK: data}
        file = json.loads(chunks[JSON_CHUNK])
        if not str(file["asset"]["version"]).startswith("2."):
            raise ComparisonError(f"{path}: is glTF {file['asset']['version']}; version 2.0 can be read")
        buffers = [_of_uri(b["uri"], path) if "uri" in b else chunks[BINARY_CHUNK] for b in file.get("buffers", [])]
    except OSError as reason:
        raise ComparisonError(f"{reason.filename or path}: {reason.strerror}") from reason
    except (ValueError, KeyError, TypeError, struct.error, binascii.Error) as reason:
        raise ComparisonError(f"{path}: is no glTF file, or damaged ({reason})") from reason
    return GltfScene(file, buffers, path)


def write_glb(file: Json, buffer: bytes, path: pathlib.Path) -> None:
    """Writes a .glb file with one buffer."""
    text = json.dumps(file, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    buffer += b"\0" * (-len(buffer) % 4)
    with open(path, "wb") as out:
        out.write(struct.pack("<III", MAGIC, 2, 12 + 8 + len(text) + 8 + len(buffer)))
        out.write(struct.pack("<II", len(text), JSON_CHUNK) + text)
        out.write(struct.pack("<II", len(buffer), BINARY_CHUNK) + buffer)
