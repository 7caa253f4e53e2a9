"""Writes glTF 2.0: a .gltf file, and a .bin file beside it."""
import array
import json
import math
import pathlib
import sys

from materials import check_medium, convert, split_brightness
from problems import ConversionError

FLOAT, UNSIGNED = 5126, 5125
EXTENSIONS = ("KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_specular",
              "KHR_materials_transmission", "KHR_materials_volume", "KHR_lights_punctual")


def turned(v):
    """From z up to y up, so that smallupbp's map of the environment keeps its columns."""
    return (-v[1], v[2], -v[0])


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def difference(a, b):
    return tuple(x - y for x, y in zip(a, b))


def unit(v, what):
    length = math.sqrt(dot(v, v))
    if not length > 0.0:
        raise ConversionError(f"{what} is zero")
    return tuple(x / length for x in v)


def _columns(x, y, z, origin):
    return [*x, 0.0, *y, 0.0, *z, 0.0, *origin, 1.0]


class GltfWriter:
    """Collects the parts of a file. `warnings` gets what could not be converted exactly."""

    def __init__(self, warnings):
        self.warnings = warnings
        self.buffer = bytearray()
        self.file = {"asset": {"version": "2.0", "generator": "upbp_scenes of wfpg"}, "scene": 0,
                     "scenes": [{"nodes": [], "extras": {}}], "nodes": [], "buffers": [], "bufferViews": [],
                     "accessors": [], "materials": [], "meshes": [], "cameras": []}

    def _add(self, values, type_code, components, kind):
        if sys.byteorder == "big":
            values.byteswap()
        view = {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": 4 * len(values)}
        self.buffer += values.tobytes()
        self.file["bufferViews"].append(view)
        accessor = {"bufferView": len(self.file["bufferViews"]) - 1, "componentType": type_code,
                    "count": len(values) // components, "type": kind}
        self.file["accessors"].append(accessor)
        return len(self.file["accessors"]) - 1

    def _add_node(self, node):
        self.file["nodes"].append(node)
        self.file["scenes"][0]["nodes"].append(len(self.file["nodes"]) - 1)

    def add_materials(self, scene, mesh):
        """All materials that triangles have, and their triangles."""
        for name, medium in scene.media.items():
            check_medium(name, medium)
        for name, triangles in mesh.triangles.items():
            if name not in scene.materials:
                raise ConversionError(f"the OBJ file uses material {name}, which the MTL file has not")
            if not triangles:
                continue
            material = scene.materials[name]
            self.file["materials"].append(convert(material, scene.media, self.warnings))
            self._add_triangles(mesh, name, triangles, material.emits())
        if not self.file["meshes"]:
            raise ConversionError("the OBJ file has no triangles of any area")

    def _add_triangles(self, mesh, name, triangles, emits):
        corners, flat_corners, indices, flat = {}, {}, array.array("I"), array.array("I")
        dropped = 0
        for triangle in triangles:
            a, b, c = (mesh.vertices[v] for v, _ in triangle)
            face = cross(difference(b, a), difference(c, a))
            if not dot(face, face) > 0.0:
                dropped += 1
                continue
            normals = [n for _, n in triangle]
            if emits or None in normals:
                # smallupbp's lights emit to the side that the order of corners tells, whatever their normals.
                flat.extend(flat_corners.setdefault((v, None), len(flat_corners)) for v, _ in triangle)
                continue
            mean = [sum(channel) for channel in zip(*(mesh.normals[n] for n in normals))]
            order = triangle if dot(face, mean) >= 0.0 else (triangle[0], triangle[2], triangle[1])
            indices.extend(corners.setdefault(corner, len(corners)) for corner in order)
        if dropped:
            self.warnings.add(f"material {name}: {dropped} triangles without area are left out")
        primitives = [self._primitive(mesh, table, list_of) for table, list_of in
                      ((corners, indices), (flat_corners, flat)) if list_of]
        if not primitives:
            return
        self.file["meshes"].append({"name": name, "primitives": primitives})
        self._add_node({"mesh": len(self.file["meshes"]) - 1, "name": name})

    def _primitive(self, mesh, corners, indices):
        positions, normals = array.array("f"), array.array("f")
        for vertex, normal in corners:
            positions.extend(turned(mesh.vertices[vertex]))
            if normal is not None:
                normals.extend(turned(mesh.normals[normal]))
        attributes = {"POSITION": self._add(positions, FLOAT, 3, "VEC3")}
        extent = self.file["accessors"][-1]
        extent["min"] = [min(positions[i::3]) for i in range(3)]
        extent["max"] = [max(positions[i::3]) for i in range(3)]
        if normals:
            attributes["NORMAL"] = self._add(normals, FLOAT, 3, "VEC3")
        return {"attributes": attributes, "indices": self._add(indices, UNSIGNED, 1, "SCALAR"),
                "material": len(self.file["materials"]) - 1}

    def add_camera(self, scene, width, height):
        """smallupbp's camera looks along -z of its rows, and its field of view is horizontal."""
        rows, fov = scene.camera_rows, scene.horizontal_fov
        if set(rows) != {0, 1, 2, 3} or fov is None:
            raise ConversionError("the AUX file has not all of TM_ROW0 to TM_ROW3 and CAMERA_FOV")
        if not 0.0 < fov < math.pi:
            raise ConversionError("CAMERA_FOV is not in (0, pi)")
        back = unit(turned(rows[2]), "TM_ROW2")
        right = unit(cross(turned(rows[1]), back), "the camera's right")
        yfov = 2.0 * math.atan(math.tan(0.5 * fov) * height / width)
        self.file["cameras"].append({"type": "perspective", "perspective": {
            "yfov": yfov, "aspectRatio": width / height, "znear": 0.1}})
        self._add_node({"camera": 0, "matrix": _columns(right, cross(back, right), back, turned(rows[3]))})
        self.file["scenes"][0]["extras"]["resolution"] = [width, height]

    def add_lights(self, scene):
        """Point and directional lights, and a constant background."""
        lights = []
        for kind, (place, brightness) in ([("point", light) for light in scene.points] +
                                          [("directional", light) for light in scene.directions]):
            if any(channel < 0.0 for channel in brightness):
                raise ConversionError(f"a {kind} light is negative")
            colour, intensity = split_brightness(brightness)
            lights.append({"type": kind, "color": colour, "intensity": intensity})
            node = {"extensions": {"KHR_lights_punctual": {"light": len(lights) - 1}}}
            if kind == "point":
                node["translation"] = list(turned(place))
            else:
                back = unit(tuple(-x for x in turned(place)), "a light's direction")
                aside = (1.0, 0.0, 0.0) if abs(back[0]) < 0.7 else (0.0, 1.0, 0.0)
                right = unit(cross(aside, back), "")
                node["matrix"] = _columns(right, cross(back, right), back, (0.0, 0.0, 0.0))
            self._add_node(node)
        if lights:
            self.file["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
        if scene.background is not None and scene.background[0] == "constant":
            self.file["scenes"][0]["extras"]["environment"] = {"radiance": scene.background[1]}

    def add_fog(self, medium):
        """The medium around all solids."""
        if any(medium.absorption) or any(medium.scattering):
            self.file["scenes"][0]["extras"]["fog"] = {"absorption": medium.absorption,
                                                       "scattering": medium.scattering, "g": medium.g}

    def write(self, path):
        """Writes `path`, and a .bin file of the same name."""
        path = pathlib.Path(path)
        binary = path.with_suffix(".bin")
        text = json.dumps(self.file)
        used = [name for name in EXTENSIONS if f'"{name}"' in text]
        self.file["extensionsUsed"] = used
        self.file["buffers"] = [{"uri": binary.name.replace("%", "%25").replace(" ", "%20"),
                                 "byteLength": len(self.buffer)}]
        self.file["scenes"][0]["extras"]["conversionNotes"] = self.warnings.lines
        if not used:
            del self.file["extensionsUsed"]
        binary.write_bytes(self.buffer)
        path.write_text(json.dumps(self.file, indent=1) + "\n", encoding="utf-8")
