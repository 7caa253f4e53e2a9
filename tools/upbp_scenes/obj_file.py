"""Reads Wavefront OBJ files as smallupbp does: triangles, and fans of them, grouped by material."""
import pathlib

from problems import ConversionError

SKIPPED = {"g", "o", "s", "vp", "l", "p"}  # smallupbp reads none of these


class Mesh:
    """Vertices and normals as tuples, and per material the corners of its triangles.

    A corner is a pair of indices, of a vertex and a normal. The normal's is None without one.
    """

    def __init__(self):
        self.vertices = []
        self.normals = []
        self.triangles = {}  # material name -> list of three corners
        self.library = None  # path of the MTL file


def read_lines(path):
    """Yields (number, words) of each line that is not empty and no comment."""
    try:
        text = pathlib.Path(path).read_text(encoding="utf-8", errors="replace")
    except OSError as reason:
        raise ConversionError(f"{path}: {reason.strerror}") from reason
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if words and not words[0].startswith("#"):
            yield number, words


def numbers(words, count, place):
    """The first `count` numbers after a key."""
    try:
        values = [float(word) for word in words[1:1 + count]]
    except ValueError as reason:
        raise ConversionError(f"{place}: '{' '.join(words)}' has a word that is no number") from reason
    if len(values) < count:
        raise ConversionError(f"{place}: {words[0]} needs {count} numbers")
    if any(value != value or abs(value) == float("inf") for value in values):
        raise ConversionError(f"{place}: {words[0]} has a number that is not finite")
    return values


def _index(text, count, place):
    try:
        index = int(text)
    except ValueError as reason:
        raise ConversionError(f"{place}: '{text}' is no index") from reason
    if not 1 <= index <= count:
        raise ConversionError(f"{place}: index {index} is not in 1 to {count}")
    return index - 1


def _corner(word, mesh, place):
    parts = word.split("/")
    normal = parts[2] if len(parts) == 3 else ""
    return (_index(parts[0], len(mesh.vertices), place),
            _index(normal, len(mesh.normals), place) if normal else None)


def read_obj(path):
    """Reads an OBJ file. Throws ConversionError."""
    mesh, current = Mesh(), None
    for number, words in read_lines(path):
        key, place = words[0], f"{path}:{number}"
        if key == "v":
            mesh.vertices.append(tuple(numbers(words, 3, place)))
        elif key == "vn":
            mesh.normals.append(tuple(numbers(words, 3, place)))
        elif key == "f":
            if current is None:
                raise ConversionError(f"{place}: a face before the first usemtl")
            if len(words) < 4:
                raise ConversionError(f"{place}: a face needs three corners")
            corners = [_corner(word, mesh, place) for word in words[1:]]
            current.extend((corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1))
        elif key in ("usemtl", "mtllib"):
            if len(words) < 2:
                raise ConversionError(f"{place}: {key} needs a name")
            if key == "usemtl":
                current = mesh.triangles.setdefault(words[1], [])
            else:
                mesh.library = pathlib.Path(path).parent / words[1]
        elif key != "vt" and key not in SKIPPED:
            raise ConversionError(f"{place}: unknown key '{key}'")
    if mesh.library is None:
        raise ConversionError(f"{path}: has no mtllib")
    return mesh
