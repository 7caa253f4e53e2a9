"""Reads smallupbp's descriptions of materials: an MTL file, and the AUX file with media, camera and lights."""
import dataclasses
import pathlib

from obj_file import numbers, read_lines
from problems import ConversionError

MTL_SKIPPED = {"Ni", "d", "Tr", "Tf", "illum", "Ka"}  # smallupbp reads none of these, or does not use it
BLACK = [0.0, 0.0, 0.0]


@dataclasses.dataclass
class Medium:
    """Coefficients per scene unit. Their defaults are smallupbp's."""
    absorption: list = dataclasses.field(default_factory=lambda: BLACK)
    scattering: list = dataclasses.field(default_factory=lambda: [0.5, 0.5, 0.5])
    g: float = 0.0


@dataclasses.dataclass
class Material:
    """What smallupbp knows of a surface. Reflectances add up."""
    name: str
    diffuse: list = dataclasses.field(default_factory=lambda: BLACK)
    phong: list = dataclasses.field(default_factory=lambda: BLACK)
    exponent: float = 0.0  # of Phong's lobe; 0: it has none
    mirror: list = dataclasses.field(default_factory=lambda: BLACK)
    emission: list = dataclasses.field(default_factory=lambda: BLACK)
    ior: float = -1.0  # negative: opaque
    medium: str = None
    priority: int = -1
    imaginary: bool = False  # bounds a medium, and is no surface

    def emits(self):
        return max(self.emission) > 0.0


@dataclasses.dataclass
class Scene:
    """All of an MTL file and its AUX file."""
    materials: dict = dataclasses.field(default_factory=dict)
    media: dict = dataclasses.field(default_factory=dict)
    global_medium: str = None
    camera_rows: dict = dataclasses.field(default_factory=dict)
    horizontal_fov: float = None  # radians
    resolution: dict = dataclasses.field(default_factory=dict)
    points: list = dataclasses.field(default_factory=list)  # (position, intensity)
    directions: list = dataclasses.field(default_factory=list)  # (direction, irradiance)
    background: tuple = None  # ("constant", radiance) or ("map", scale, rotation, path)


def read_mtl(path, scene, warnings):
    """Adds the materials of an MTL file. Throws ConversionError."""
    material = None
    for number, words in read_lines(path):
        key, place = words[0], f"{path}:{number}"
        if key == "newmtl":
            material = _named(scene.materials, words, place, Material)
            continue
        if material is None:
            raise ConversionError(f"{place}: {key} before the first newmtl")
        if key == "Kd":
            material.diffuse = numbers(words, 3, place)
        elif key == "Ks":
            material.phong = numbers(words, 3, place)
        elif key == "Ke":
            material.emission = numbers(words, 3, place)
        elif key == "Ns":
            material.exponent = numbers(words, 1, place)[0]
        elif key.startswith("map_"):
            warnings.add(f"{place}: {key} is left out, as in smallupbp")
        elif key not in MTL_SKIPPED:
            raise ConversionError(f"{place}: unknown key '{key}'")


def read_aux(path, scene, warnings):
    """Adds the camera, media, lights and properties of materials of an AUX file. Throws ConversionError."""
    _AuxReader(path, scene, warnings).read()


def _named(table, words, place, make):
    if len(words) < 2:
        raise ConversionError(f"{place}: {words[0]} needs a name")
    return table.setdefault(words[1], make(words[1]))


def _whole(words, place):
    value = numbers(words, 1, place)[0]
    if value != int(value):
        raise ConversionError(f"{place}: {words[0]} needs a whole number")
    return int(value)


class _AuxReader:
    def __init__(self, path, scene, warnings):
        self.path, self.scene, self.warnings = path, scene, warnings
        self.material = self.medium = None

    def read(self):
        for number, words in read_lines(self.path):
            place = f"{self.path}:{number}"
            words = [self._key(words[0], place)] + words[1:]
            if not (self._reads_camera(words, place) or self._reads_light(words, place) or
                    self._reads_medium(words, place) or self._reads_material(words, place)):
                raise ConversionError(f"{place}: unknown key '{words[0]}'")

    def _key(self, key, place):
        """smallupbp looks at the first letters of a key alone. Two misspellings occur in its scenes."""
        for meant, is_meant in (("scattering", key.startswith("scat")), ("Ke", key in ("Ka", "Kd", "Ks"))):
            if is_meant and key != meant:
                self.warnings.add(f"{place}: '{key}' is read as {meant}, as smallupbp does")
                return meant
        return key

    def _reads_camera(self, words, place):
        key = words[0]
        if key in ("TM_ROW0", "TM_ROW1", "TM_ROW2", "TM_ROW3"):
            self.scene.camera_rows[int(key[-1])] = numbers(words, 3, place)
        elif key == "CAMERA_FOV":
            self.scene.horizontal_fov = numbers(words, 1, place)[0]
        elif key in ("CAMERA_RESOLUTION_X", "CAMERA_RESOLUTION_Y"):
            self.scene.resolution[key[-1]] = _whole(words, place)
        else:
            # The renderer finds the solids around the camera itself. Pinholes have no focal distance.
            return key in ("CAMERA_TDIST", "CAMERA_MATERIAL")
        return True

    def _reads_light(self, words, place):
        key = words[0]
        if key in ("light_point", "light_directional"):
            values = numbers(words, 6, place)
            lights = self.scene.points if key == "light_point" else self.scene.directions
            lights.append((values[:3], values[3:]))
        elif key in ("light_background_constant", "light_background_em"):
            if self.scene.background is not None:
                self.warnings.add(f"{place}: {key} is left out, since the first background counts")
            elif key == "light_background_constant":
                self.scene.background = ("constant", numbers(words, 3, place))
            else:
                scale, rotation = numbers(words, 2, place)
                if len(words) < 4:
                    raise ConversionError(f"{place}: {key} needs a file")
                self.scene.background = ("map", scale, rotation, pathlib.Path(self.path).parent / words[3])
        else:
            return False
        return True

    def _reads_medium(self, words, place):
        key = words[0]
        if key == "medium":
            self.medium = _named(self.scene.media, words, place, lambda _: Medium())
        elif key == "globalMediumId":
            _named(self.scene.media, words, place, lambda _: Medium())
            self.scene.global_medium = words[1]
        elif key in ("absorption", "emission", "scattering", "g", "continuation_probability"):
            if self.medium is None:
                raise ConversionError(f"{place}: {key} before the first medium")
            if key == "g":
                self.medium.g = numbers(words, 1, place)[0]
            elif key == "emission":
                if any(numbers(words, 3, place)):
                    raise ConversionError(f"{place}: media that emit light cannot be converted")
            elif key != "continuation_probability":  # that of Russian roulette changes no mean
                setattr(self.medium, key, numbers(words, 3, place))
        else:
            return False
        return True

    def _reads_material(self, words, place):
        key = words[0]
        if key == "material":
            if len(words) < 2 or words[1] not in self.scene.materials:
                raise ConversionError(f"{place}: the MTL file has no such material: {' '.join(words[1:2])}")
            self.material = self.scene.materials[words[1]]
            return True
        if key not in ("mirror", "ior", "priority", "mediumId", "geometryType", "Ke", "enclosingMatId"):
            return False
        if self.material is None:
            raise ConversionError(f"{place}: {key} before the first material")
        if key == "mirror":
            self.material.mirror = numbers(words, 3, place)
        elif key == "Ke":
            self.material.emission = numbers(words, 3, place)
        elif key == "ior":
            self.material.ior = numbers(words, 1, place)[0]
        elif key == "priority":
            self.material.priority = _whole(words, place)
        elif key == "mediumId":
            _named(self.scene.media, words, place, lambda _: Medium())
            self.material.medium = words[1]
        elif key == "geometryType":
            if words[1:2] not in (["real"], ["imaginary"]):
                raise ConversionError(f"{place}: geometryType is neither real nor imaginary")
            self.material.imaginary = words[1] == "imaginary"
        return True  # enclosingMatId: the renderer finds the solids around a light itself
