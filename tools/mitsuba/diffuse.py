"""The diffuse variant of a glTF scene, which wfpg-render and Mitsuba render alike.

All materials reflect their base colour diffusely, on both sides. Emission, textures of base colours, the camera and a constant
environment stay. Vertex normals go, since programs differ in what they do with interpolated normals.
"""
import pathlib
import sys
from typing import Any, Dict, List, Optional

from gltf_scene import GltfScene, Json, write_glb
from comparison_error import ComparisonError

STRENGTH, SPECULAR, TRANSFORM = "KHR_materials_emissive_strength", "KHR_materials_specular", "KHR_texture_transform"
READABLE = (STRENGTH, SPECULAR, TRANSFORM, "KHR_materials_ior", "KHR_materials_transmission", "KHR_materials_volume",
            "KHR_materials_diffuse_transmission")
DEFAULT_COLOUR = [0.8, 0.8, 0.8, 1.0]  # of triangles without a material


class Warnings:
    """Prints each approximation once."""

    def __init__(self) -> None:
        self.lines: List[str] = []

    def add(self, text: str) -> None:
        """Prints a line, and keeps it."""
        if text not in self.lines:
            self.lines.append(text)
            print(f"warning: {text}", file=sys.stderr)


def emission(material: Json) -> List[float]:
    """Radiance of a material's front, linear RGB."""
    strength = material.get("extensions", {}).get(STRENGTH, {}).get("emissiveStrength", 1.0)
    return [strength * channel for channel in material.get("emissiveFactor", [0.0, 0.0, 0.0])]


def _material(source: Json, place: str, warnings: Warnings) -> Json:
    """A diffuse material."""
    pbr = source.get("pbrMetallicRoughness", {})
    colour = [*pbr.get("baseColorFactor", [1.0, 1.0, 1.0, 1.0])[:3], 1.0]
    made: Json = {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0},
                  "extensions": {SPECULAR: {"specularFactor": 0.0}}}
    if "baseColorTexture" in pbr:
        if pbr["baseColorTexture"].get("texCoord", 0) != 0:
            raise ComparisonError(f"{place}: its texture is on other coordinates than TEXCOORD_0")
        if colour != [1.0] * 4:
            warnings.add(f"{place}: its texture counts without the factor {colour[:3]}")
        made["pbrMetallicRoughness"]["baseColorTexture"] = pbr["baseColorTexture"]
        colour = [1.0] * 4
    made["pbrMetallicRoughness"]["baseColorFactor"] = colour
    if source.get("alphaMode", "OPAQUE") != "OPAQUE":
        warnings.add(f"{place}: is opaque in the diffuse variant")
    if any(emission(source)):
        made["emissiveFactor"] = source["emissiveFactor"]
        made["extensions"].update({k: v for k, v in source.get("extensions", {}).items() if k == STRENGTH})
        if "emissiveTexture" in source:
            warnings.add(f"{place}: emits without its texture")
    return {**({"name": source["name"]} if "name" in source else {}), **made}


def _buffer(scene: GltfScene) -> bytes:
    """All buffers and images with files of their own, one after the other. Changes offsets of the scene's views."""
    starts, whole = [], bytearray()

    def append(data: bytes) -> int:
        whole.extend(b"\0" * (-len(whole) % 4))
        whole.extend(data)
        return len(whole) - len(data)
    starts = [append(data) for data in scene.buffers]
    for view in scene.file.get("bufferViews", []):
        view["byteOffset"] = view.get("byteOffset", 0) + starts[view["buffer"]]
        view["buffer"] = 0
    for index, image in enumerate(scene.file.get("images", [])):
        if "bufferView" in image:
            continue
        data = scene.image(index)
        scene.file["bufferViews"].append({"buffer": 0, "byteOffset": append(data), "byteLength": len(data)})
        scene.file["images"][index] = {"mimeType": "image/png" if data[:4] == b"\x89PNG" else "image/jpeg",
                                       "bufferView": len(scene.file["bufferViews"]) - 1}
    return bytes(whole)


def _check(scene: GltfScene) -> None:
    """Throws ComparisonError where Mitsuba's scene would not be this one."""
    for name in scene.file.get("extensionsRequired", []):
        if name not in READABLE:
            raise ComparisonError(f"{scene.path}: requires {name}, which cannot be converted")
    if scene.file.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights"):
        raise ComparisonError(f"{scene.path}: has lights without extent, which are not converted")


def _scene_extras(scene: GltfScene, warnings: Warnings) -> Dict[str, Any]:
    """What of the scene's extras stays."""
    extras = scene.chosen_scene().get("extras", {})
    if "fog" in extras:
        warnings.add("the fog is left out")
    return {key: extras[key] for key in ("resolution", "environment") if key in extras}


def write_diffuse(scene: GltfScene, path: pathlib.Path, warnings: Optional[Warnings] = None) -> None:
    """Writes the diffuse variant of a scene as .glb. The scene must not be used afterwards."""
    warnings = warnings or Warnings()
    _check(scene)
    file = scene.file
    materials = [_material(m, f"material {i}", warnings) for i, m in enumerate(file.get("materials", []))]
    for placed in scene.primitives():
        primitive, kept = placed.primitive, ("POSITION", "TEXCOORD_0")
        primitive["attributes"] = {k: v for k, v in primitive["attributes"].items() if k in kept}
        primitive.pop("targets", None)
        if "material" not in primitive:
            primitive["material"] = len(file.get("materials", []))
    materials.append(_material({"pbrMetallicRoughness": {"baseColorFactor": DEFAULT_COLOUR}}, "the default material", warnings))
    buffer = _buffer(scene)
    made: Json = {key: file[key] for key in ("scene", "scenes", "nodes", "meshes", "accessors", "bufferViews", "cameras", "textures",
                                       "images", "samplers") if key in file}
    extras = _scene_extras(scene, warnings)
    scene.chosen_scene()["extras"] = extras
    used = [name for name in (SPECULAR, STRENGTH, TRANSFORM) if name in str(materials)]
    write_glb({"asset": {"version": "2.0", "generator": "tools/mitsuba of wfpg"}, **made, "materials": materials,
               "extensionsUsed": used, "buffers": [{"byteLength": len(buffer)}]}, buffer, path)
