#!/usr/bin/env python3
"""Converts a scene of smallupbp to glTF 2.0 for wfpg-render.

Reads SCENE.obj, the MTL file that it names, and SCENE.obj.aux. Writes OUT.gltf and OUT.bin, and OUT.exr where the scene
has a map of its environment. README.md beside this script has what becomes of materials, media and lights.
"""
import argparse
import pathlib
import sys

sys.dont_write_bytecode = True  # the sources' folder stays as it is

from exr_file import read_exr, write_exr  # noqa: E402
from gltf_file import GltfWriter  # noqa: E402
from obj_file import read_obj  # noqa: E402
from problems import ConversionError, Warnings  # noqa: E402
from scene_files import Scene, read_aux, read_mtl  # noqa: E402

LARGEST_SIDE = 1 << 15


def size(text):
    """WIDTHxHEIGHT as two numbers."""
    try:
        width, height = (int(part) for part in text.split("x"))
    except ValueError as reason:
        raise argparse.ArgumentTypeError("is not WIDTHxHEIGHT") from reason
    if not (1 <= width <= LARGEST_SIDE and 1 <= height <= LARGEST_SIDE):
        raise argparse.ArgumentTypeError(f"has a side that is not in 1 to {LARGEST_SIDE}")
    return width, height


def resolution_of(scene, given):
    if given is not None:
        return given
    if set(scene.resolution) != {"X", "Y"}:
        raise ConversionError("the AUX file has no CAMERA_RESOLUTION: give --size")
    sides = scene.resolution["X"], scene.resolution["Y"]
    if not all(1 <= side <= LARGEST_SIDE for side in sides):
        raise ConversionError("CAMERA_RESOLUTION is not usable: give --size")
    return sides


def write_environment(scene, path):
    """smallupbp moves its map to the right by a fraction of the width, and scales it."""
    _, scale, rotation, source = scene.background
    if not 0.0 <= scale or not 0.0 <= rotation < 1.0:
        raise ConversionError("light_background_em: a scale below 0, or a rotation that is not in [0, 1)")
    picture = read_exr(source)
    if picture.width != 2 * len(picture.rows):
        raise ConversionError(f"{source}: is not twice as wide as high")
    write_exr(path, picture.changed(scale, int(rotation * picture.width)))


def convert(source, out, given_size, warnings):
    """Converts the OBJ file `source`. Returns the paths of the glTF file and of the environment, or None."""
    mesh, scene = read_obj(source), Scene()
    read_mtl(mesh.library, scene, warnings)
    read_aux(f"{source}.aux", scene, warnings)
    writer = GltfWriter(warnings)
    writer.add_materials(scene, mesh)
    writer.add_camera(scene, *resolution_of(scene, given_size))
    writer.add_lights(scene)
    if scene.global_medium is not None:
        writer.add_fog(scene.media[scene.global_medium])
    environment = None
    if scene.background is not None and scene.background[0] == "map":
        environment = out.with_suffix(".exr")
        write_environment(scene, environment)
    writer.write(out)
    return environment


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0], epilog=__doc__.partition("\n\n")[2])
    parser.add_argument("scene", metavar="SCENE.obj")
    parser.add_argument("-o", "--output", metavar="OUT.gltf", required=True, type=pathlib.Path)
    parser.add_argument("--size", metavar="WxH", type=size, help="of the picture, which smallupbp is told by -r; "
                        "default: CAMERA_RESOLUTION of the AUX file")
    given = parser.parse_args()
    if given.output.suffix != ".gltf":
        parser.error("--output does not end in .gltf")
    try:
        environment = convert(given.scene, given.output, given.size, Warnings())
    except ConversionError as reason:
        sys.exit(f"error: {reason}")
    except OSError as reason:
        sys.exit(f"error: {reason.filename}: {reason.strerror}")
    with_map = f" --environment {environment}" if environment is not None else ""
    print(f"wfpg-render {given.output}{with_map} --method upbp")


if __name__ == "__main__":
    main()
