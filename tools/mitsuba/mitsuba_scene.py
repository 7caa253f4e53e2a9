"""Writes a diffuse glTF scene as a scene of Mitsuba 3: scene.xml, meshes as PLY, and textures.

The XML file has the parameters width, height and depth. `depth` counts segments of a path, as --max-depth of wfpg-render does.
Source: https://mitsuba.readthedocs.io/en/stable/src/key_topics/scene_format.html
"""
import array
import math
import pathlib
import sys
from typing import List, Tuple

from diffuse import TRANSFORM, emission
from gltf_scene import IDENTITY, GltfScene, Json, Matrix, PlacedPrimitive, determinant, product
from comparison_error import ComparisonError

WRAP_MODES = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
TURN: Matrix = ((-1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, -1.0, 0.0), (0.0, 0.0, 0.0, 1.0))  # looks along +z there
LARGEST_DEPTH = 1 << 30  # of roulette, which ends no path


class Bounds:
    """The box around points."""

    def __init__(self) -> None:
        self.lower, self.upper = [math.inf] * 3, [-math.inf] * 3

    def add(self, positions: "array.array[float]") -> None:
        """Makes the box larger. Three numbers are a point."""
        for axis in range(3):
            if len(positions):
                self.lower[axis] = min(self.lower[axis], min(positions[axis::3]))
                self.upper[axis] = max(self.upper[axis], max(positions[axis::3]))

    def farthest(self, point: Tuple[float, ...]) -> float:
        """The distance from a point to the box's farthest corner."""
        return math.dist([max(abs(low - p), abs(high - p)) for low, high, p in zip(self.lower, self.upper, point)], (0.0, 0.0, 0.0))


def _numbers(values: List[float]) -> str:
    return ", ".join(repr(float(v)) for v in values)


def _transformed(positions: "array.array[float]", m: Matrix) -> "array.array[float]":
    if m == IDENTITY:
        return positions
    (a, b, c, d), (e, f, g, h), (i, j, k, l) = m[:3]
    result = array.array("f", bytes(4 * len(positions)))
    for at in range(0, len(positions), 3):
        x, y, z = positions[at:at + 3]
        result[at:at + 3] = array.array("f", (a * x + b * y + c * z + d, e * x + f * y + g * z + h, i * x + j * y + k * z + l))
    return result


def _moved(uvs: "array.array[float]", reference: Json) -> "array.array[float]":
    """Texture coordinates after KHR_texture_transform."""
    transform = reference.get("extensions", {}).get(TRANSFORM)
    if transform is None:
        return uvs
    (su, sv), (u0, v0), angle = transform.get("scale", (1, 1)), transform.get("offset", (0, 0)), transform.get("rotation", 0.0)
    c, s = math.cos(angle), math.sin(angle)
    result = array.array("f", bytes(4 * len(uvs)))
    for at in range(0, len(uvs), 2):
        u, v = uvs[at] * su, uvs[at + 1] * sv
        result[at], result[at + 1] = c * u + s * v + u0, -s * u + c * v + v0
    return result


def write_ply(path: pathlib.Path, positions: "array.array[float]", uvs: "array.array[float]", corners: "array.array[int]") -> None:
    """Writes triangles as binary PLY. `uvs` may be empty."""
    vertices = len(positions) // 3
    rows = array.array("f")
    if len(uvs):
        rows = array.array("f", bytes(4 * 5 * vertices))
        for k in range(3):
            rows[k::5] = positions[k::3]
        for k in range(2):
            rows[3 + k::5] = uvs[k::2]
    else:
        rows = positions[:]
    faces = array.array("I", corners)
    if sys.byteorder == "big":
        rows.byteswap()
        faces.byteswap()
    names = ("x", "y", "z", "u", "v")[:5 if len(uvs) else 3]
    head = "\n".join(["ply", "format binary_little_endian 1.0", f"element vertex {vertices}", *(f"property float {n}" for n in names),
                      f"element face {len(corners) // 3}", "property list uchar int vertex_indices", "end_header\n"])
    packed = faces.tobytes()
    with open(path, "wb") as out:
        out.write(head.encode() + rows.tobytes())
        out.write(b"".join(b"\3" + packed[at:at + 12] for at in range(0, len(packed), 12)))


class MitsubaWriter:
    """Writes a scene's files to a folder."""

    def __init__(self, scene: GltfScene, folder: pathlib.Path) -> None:
        self.scene, self.folder = scene, folder
        self.bounds, self.triangles = Bounds(), 0
        self._lines: List[str] = []

    def write(self) -> pathlib.Path:
        """Writes all files, and returns the path of scene.xml."""
        for name in ("meshes", "textures"):
            (self.folder / name).mkdir(parents=True, exist_ok=True)
        for index, material in enumerate(self.scene.file["materials"]):
            self._add_material(index, material)
        for index, placed in enumerate(self.scene.primitives()):
            self._add_shape(index, placed)
        if self.triangles == 0:
            raise ComparisonError(f"{self.scene.path}: has no triangles")
        self._add_environment()
        defaults = (f'<default name="{n}" value="{v}"/>' for n, v in (("width", 256), ("height", 256), ("depth", 8)))
        lines = ['<scene version="3.0.0">', *defaults,
                 '<integrator type="path"><integer name="max_depth" value="$depth"/>'
                 f'<integer name="rr_depth" value="{LARGEST_DEPTH}"/></integrator>', self._camera(), *self._lines, "</scene>\n"]
        path = self.folder / "scene.xml"
        path.write_text("\n".join(lines), encoding="utf-8")
        return path

    def _add_material(self, index: int, material: Json) -> None:
        pbr = material["pbrMetallicRoughness"]
        if "baseColorTexture" in pbr:
            reflectance = self._texture(pbr["baseColorTexture"]["index"])
        else:
            reflectance = f'<rgb name="reflectance" value="{_numbers(pbr["baseColorFactor"][:3])}"/>'
        self._lines.append(f'<bsdf type="twosided" id="material{index}"><bsdf type="diffuse">{reflectance}</bsdf></bsdf>')

    def _texture(self, index: int) -> str:
        texture = self.scene.file["textures"][index]
        sampler = self.scene.file["samplers"][texture["sampler"]] if "sampler" in texture else {}
        modes = {WRAP_MODES[sampler.get(key, 10497)] for key in ("wrapS", "wrapT")}
        if len(modes) != 1:
            raise ComparisonError(f"{self.scene.path}: texture {index} wraps differently along its axes")
        data = self.scene.image(texture["source"])
        name = f"textures/{texture['source']}.{'png' if data[:4] == bytes.fromhex('89504e47') else 'jpg'}"
        (self.folder / name).write_bytes(data)
        return (f'<texture type="bitmap" name="reflectance"><string name="filename" value="{name}"/><string name="format" value="variant"/>'
                f'<string name="filter_type" value="bilinear"/><string name="wrap_mode" value="{modes.pop()}"/></texture>')

    def _add_shape(self, index: int, placed: PlacedPrimitive) -> None:
        primitive, attributes = placed.primitive, placed.primitive["attributes"]
        material = self.scene.file["materials"][primitive["material"]]
        positions = _transformed(self.scene.values(attributes["POSITION"], "VEC3"), placed.to_world)
        corners = (self.scene.values(primitive["indices"], "SCALAR") if "indices" in primitive
                   else array.array("I", range(len(positions) // 3)))
        if determinant(placed.to_world) < 0.0:
            corners[1::3], corners[2::3] = corners[2::3], corners[1::3]
        uvs = array.array("f")
        reference = material["pbrMetallicRoughness"].get("baseColorTexture")
        if reference is not None:
            if "TEXCOORD_0" not in attributes:
                raise ComparisonError(f"{self.scene.path}: a mesh has a texture and no texture coordinates")
            uvs = _moved(self.scene.values(attributes["TEXCOORD_0"], "VEC2"), reference)
        write_ply(self.folder / "meshes" / f"{index}.ply", positions, uvs, corners)
        self.bounds.add(positions)
        self.triangles += len(corners) // 3
        light = emission(material)
        emitter = f'<emitter type="area"><rgb name="radiance" value="{_numbers(light)}"/></emitter>' if any(light) else ""
        self._lines.append(f'<shape type="ply"><string name="filename" value="meshes/{index}.ply"/>'
                           f'<boolean name="face_normals" value="true"/><ref id="material{primitive["material"]}"/>{emitter}</shape>')

    def _add_environment(self) -> None:
        radiance = self.scene.chosen_scene().get("extras", {}).get("environment", {}).get("radiance", 0.0)
        channels = [radiance] * 3 if isinstance(radiance, (int, float)) else radiance
        if any(channels):
            self._lines.append(f'<emitter type="constant"><rgb name="radiance" value="{_numbers(channels)}"/></emitter>')

    def _camera(self) -> str:
        for node, to_world in self.scene.placed_nodes():
            if "camera" not in node:
                continue
            camera = self.scene.file["cameras"][node["camera"]]
            if camera["type"] != "perspective":
                raise ComparisonError(f"{self.scene.path}: its camera is no perspective one")
            matrix = product(to_world, TURN)
            far = 2.0 * self.bounds.farthest(tuple(row[3] for row in matrix[:3]))
            return (f'<sensor type="perspective"><string name="fov_axis" value="y"/>'
                    f'<float name="fov" value="{math.degrees(camera["perspective"]["yfov"])!r}"/>'
                    f'<float name="near_clip" value="{1e-6 * far!r}"/><float name="far_clip" value="{far!r}"/>'
                    f'<transform name="to_world"><matrix value="{" ".join(repr(v) for row in matrix for v in row)}"/></transform>'
                    '<sampler type="independent"/><film type="hdrfilm"><integer name="width" value="$width"/>'
                    '<integer name="height" value="$height"/><string name="pixel_format" value="rgb"/>'
                    '<string name="component_format" value="float32"/><rfilter type="box"/></film></sensor>')
        raise ComparisonError(f"{self.scene.path}: has no camera")
