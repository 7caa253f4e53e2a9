"""Turns smallupbp's materials into those of glTF that wfpg's renderer reads."""
import math

from problems import ConversionError

LARGEST_COEFFICIENT = 1e6
LARGEST_G = 0.999
LARGEST_PRIORITY = 1000


def luminance(rgb):
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]


def split_brightness(rgb):
    """A colour whose largest channel is 1, and the factor that makes `rgb` from it."""
    largest = max(rgb)
    return ([channel / largest for channel in rgb], largest) if largest > 0.0 else ([1.0, 1.0, 1.0], 0.0)


def check_reflectance(place, what, rgb):
    if any(not 0.0 <= channel <= 1.0 for channel in rgb):
        raise ConversionError(f"{place}: {what} {rgb} is not in [0, 1]")


def check_medium(name, medium):
    for what in ("absorption", "scattering"):
        if any(not 0.0 <= value <= LARGEST_COEFFICIENT for value in getattr(medium, what)):
            raise ConversionError(f"medium {name}: {what} is not in [0, {LARGEST_COEFFICIENT:g}]")
    if not -LARGEST_G <= medium.g <= LARGEST_G:
        raise ConversionError(f"medium {name}: g is not in [-{LARGEST_G}, {LARGEST_G}]")


def phong_roughness(exponent):
    """glTF's roughness of the GGX facets that are about as wide as Phong's lobe."""
    return (2.0 / (exponent + 2.0)) ** 0.25


def _opaque(colour, metallic, roughness):
    return {"pbrMetallicRoughness": {"baseColorFactor": colour + [1.0], "metallicFactor": metallic,
                                     "roughnessFactor": roughness},
            "extensions": {"KHR_materials_specular": {"specularFactor": 0.0}}}


def _emitter(material, place, warnings):
    if any(channel < 0.0 for channel in material.emission):
        raise ConversionError(f"{place}: Ke is negative")
    if material.ior >= 0.0 or any(material.diffuse + material.mirror + material.phong):
        warnings.add(f"{place}: emits, so it reflects and transmits nothing here; smallupbp ends only the camera's "
                     "paths at lights")
    colour, strength = split_brightness(material.emission)
    result = _opaque([0.0, 0.0, 0.0], 0.0, 1.0)
    result["emissiveFactor"] = colour
    result["extensions"]["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
    return result


def _solid(material, ior, medium, priority):
    extensions = {"KHR_materials_transmission": {"transmissionFactor": 1.0}, "KHR_materials_ior": {"ior": ior},
                  "KHR_materials_volume": {"thicknessFactor": 1.0}}
    if medium is not None and any(medium.absorption):
        distance = 1.0 / max(medium.absorption)
        extensions["KHR_materials_volume"].update(
            attenuationDistance=distance,
            attenuationColor=[math.exp(-channel * distance) for channel in medium.absorption])
    inside = {"priority": priority}
    if medium is not None and any(medium.scattering):
        inside.update(scattering=medium.scattering, g=medium.g)
    return {"pbrMetallicRoughness": {"baseColorFactor": [1.0, 1.0, 1.0, 1.0], "metallicFactor": 0.0,
                                     "roughnessFactor": 0.0},
            "extensions": extensions, "extras": {"medium": inside}}


def _dielectric(material, medium, place, warnings):
    if material.ior < 1.0:
        raise ConversionError(f"{place}: ior {material.ior:g} is below 1")
    if any(material.diffuse):
        warnings.add(f"{place}: transmits, so its diffuse reflectance {material.diffuse} is left out")
    if any(material.phong):
        warnings.add(f"{place}: transmits, so its Phong lobe is left out")
    if material.mirror != [1.0, 1.0, 1.0] and material.ior != 1.0:
        warnings.add(f"{place}: its boundary reflects all of Fresnel's reflectance, not {material.mirror} of it")
    if medium is None:
        warnings.add(f"{place}: its inside is clear; in smallupbp it has the medium that a path came from")
    if abs(material.priority) > LARGEST_PRIORITY:
        raise ConversionError(f"{place}: priority is not in [-{LARGEST_PRIORITY}, {LARGEST_PRIORITY}]")
    return _solid(material, material.ior, medium, material.priority)


def _reflector(material, place, warnings):
    mirrors, glossy, diffuse = any(material.mirror), any(material.phong), any(material.diffuse)
    if mirrors and glossy:
        raise ConversionError(f"{place}: a mirror and a Phong lobe together cannot be converted")
    if not (mirrors or glossy):
        return _opaque(material.diffuse, 0.0, 1.0)
    facets = material.mirror if mirrors else material.phong
    if glossy:
        warnings.add(f"{place}: Phong's lobe of exponent {material.exponent:g} becomes GGX facets of roughness "
                     f"{phong_roughness(material.exponent):.3f}, which reflect more towards grazing angles")
    roughness = phong_roughness(material.exponent) if glossy else 0.0
    if not diffuse:
        return _opaque(facets, 1.0, roughness)
    if mirrors:
        warnings.add(f"{place}: its mirror becomes GGX facets of the least roughness, which reflect more towards "
                     "grazing angles")
    colour = [a + b for a, b in zip(material.diffuse, facets)]
    check_reflectance(place, "the sum of its reflectances", colour)
    metallic = luminance(facets) / luminance(colour)
    if any(abs(channel * metallic - facet) > 0.001 for channel, facet in zip(colour, facets)):
        warnings.add(f"{place}: its diffuse and mirrored light become one colour, since glTF has one for both")
    return _opaque(colour, metallic, roughness)


def convert(material, media, warnings):
    """The glTF material of a smallupbp material. Throws ConversionError for what it cannot represent."""
    place = f"material {material.name}"
    if material.exponent == 0.0:
        material.phong = [0.0, 0.0, 0.0]
    medium = media[material.medium] if material.medium is not None else None
    if material.imaginary:
        if material.emits():
            raise ConversionError(f"{place}: imaginary, and emits")
        if medium is None:
            raise ConversionError(f"{place}: imaginary, and has no mediumId")
        result = _solid(material, 1.0, medium, material.priority)
    elif material.emits():
        result = _emitter(material, place, warnings)
    else:
        for what in ("diffuse", "phong", "mirror"):
            check_reflectance(place, what, getattr(material, what))
        if material.ior >= 0.0:
            result = _dielectric(material, medium, place, warnings)
        else:
            result = _reflector(material, place, warnings)
    result["name"] = material.name
    return result
