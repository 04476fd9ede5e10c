# SPDX-License-Identifier: Apache-2.0
"""Whether denoising makes images of many samples worse: display errors (denoise.py) of path tracing as rendered, after the network alone, and with
what is clean kept (`dapple denoise` uses AOV variance for that). The references' own noise is in all. DAPPLE_CLEAN_REFERENCE their samples,
DAPPLE_CLEAN_SCENES names of scenes, DAPPLE_CLEAN_SIZE that of the pictures. Then pictures without noise through `dapple denoise`, with AOV variance and as other renderers write them."""
import os
import tempfile
from pathlib import Path

import common

SAMPLES, REFERENCE_SAMPLES = 1024, 16384
STAGE = ("material_coateddiffuse", "material_coatedconductor", "material_conductor_brushed", "material_conductor_copper", "material_conductor_mirror",
         "material_dielectric", "material_dielectric_rough", "material_diffuse", "material_diffusetransmission", "material_mix", "material_openpbr",
         "noise_worley", "noise_marble")
BALLS = """Film "rgb" "integer xresolution" 90 "integer yresolution" 60
PixelFilter "box"
LookAt .14 -5 2  .24 0 .7  0 0 1
Camera "perspective" "float fov" 40
WorldBegin
AttributeBegin
Translate .5 -1 3
AreaLightSource "diffuse" "rgb L" [ 60 55 50 ]
Shape "sphere" "float radius" .15
AttributeEnd
LightSource "infinite" "rgb L" [ .1 .15 .25 ]
Texture "checks" "spectrum" "checkerboard" "float uscale" 10 "float vscale" 10 "rgb tex1" [ .8 .8 .7 ] "rgb tex2" [ .2 .1 .1 ]
Material "diffuse" "texture reflectance" "checks"
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
AttributeBegin
Translate -.24 .3 .5
Scale .5 .5 .5
Shape "sphere"
AttributeEnd
Material "diffuse" "rgb reflectance" [ .6 .6 .6 ]
Shape "bilinearmesh" "point3 P" [ -4 2 0  4 2 0  -4 2 4  4 2 4 ]
AttributeBegin
Translate 1.1 .2 .5
Material "conductor" "float roughness" .15
Shape "sphere" "float radius" .5
AttributeEnd
Translate .2 -.8 .3
Material "conductor" "float roughness" 0
Shape "sphere" "float radius" .3
"""


def without_variance(source, target):
    """A copy whose layer of variances has another name."""
    import OpenImageIO as oiio
    from reprojection import write_pixels

    image = oiio.ImageInput.open(str(source))
    spec, pixels = image.spec(), image.read_image("float")
    image.close()
    spec.channelnames = [name.replace("variance", "other") for name in spec.channelnames]
    write_pixels(target, spec, pixels)


LETTERS = {"E": "###,#..,##.,#..,###", "F": "###,#..,##.,#..,#..", "H": "#.#,#.#,###,#.#,#.#", "I": "###,.#.,.#.,.#.,###", "L": "#..,#..,#..,#..,###",
           "T": "###,.#.,.#.,.#.,.#.", " ": "...,...,...,...,..."}


def noise_free_pictures(size=128):
    """Name and picture: octaves of value noise, text, a checker, a gradient, one colour."""
    import numpy as np

    y, x = np.mgrid[0:size, 0:size]

    def octave(scale):
        values = np.random.default_rng(scale).random((size // scale + 2, size // scale + 2, 3))
        i, j, u, v = x // scale, y // scale, (x % scale / scale)[..., None], (y % scale / scale)[..., None]
        return (values[j, i] * (1 - u) + values[j, i + 1] * u) * (1 - v) + (values[j + 1, i] * (1 - u) + values[j + 1, i + 1] * u) * v

    text = np.full((size, size, 3), .8)
    for row in range(10):
        for column, letter in enumerate("THE FIFTH LEFT HILL"[row % 3:]):
            glyph = np.array([[c == "#" for c in line] for line in LETTERS[letter].split(",")]).repeat(1 + row % 2, 0).repeat(1 + row % 2, 1)
            part = text[3 + 12 * row:, 3 + (4 + 3 * (row % 2)) * column:][:glyph.shape[0], :glyph.shape[1]]
            part[glyph[:part.shape[0], :part.shape[1]]] = .05
    yield "texture", sum(octave(scale) * amplitude for scale, amplitude in ((32, .4), (16, .25), (8, .2), (4, .1), (2, .1))) ** 2
    yield "text", text
    yield "checker", np.where(((x // 3 + y // 3) % 2)[..., None] > 0, np.array([.7, .65, .6]), np.array([.1, .12, .2]))
    yield "gradient", np.stack([x / size, y / size, (x + y) / 2 / size], -1) * .9 + .02
    yield "constant", np.full((size, size, 3), 1.0) * np.array([.3, .2, .5])


def noise_free_error(context, folder, picture, layers):
    """Display error that `dapple denoise` adds to a picture: with features of a flat wall, and with variance 0, if layers has them."""
    import numpy as np
    import OpenImageIO as oiio
    from denoise import display_error
    from reprojection import read_channels, write_pixels

    height, width, _ = picture.shape
    names, parts = ["R", "G", "B"], [picture]
    if "albedo" in layers:
        names += ["albedo.R", "albedo.G", "albedo.B", "normal.X", "normal.Y", "normal.Z"]
        parts += [np.full_like(picture, .5), np.zeros_like(picture) + np.array([0, 0, 1])]
    spec = oiio.ImageSpec(width, height, len(names) + 3 * ("variance" in layers), "float")
    if "variance" in layers:
        names += ["variance.R", "variance.G", "variance.B"]
        parts.append(np.zeros_like(picture))
        for name, value in (("Software", "Dapple 0.1.0"), ("dapple/independentSamples", 1), ("dapple/samples", 1024)):
            spec.attribute(name, value)
    spec.channelnames = names
    write_pixels(folder / "clean.exr", spec, np.ascontiguousarray(np.concatenate(parts, -1).astype(np.float32)))
    common.run([context.program("dapple"), "denoise", folder / "clean.exr", "-o", folder / "denoised.exr", "-q"])
    return display_error(read_channels(folder / "denoised.exr", "R", "G", "B"), picture.astype(np.float32).astype(float))[0]


def scenes(folder):
    (folder / "balls.pbrt").write_text(BALLS)
    size = os.environ.get("DAPPLE_CLEAN_SIZE", "32x24")
    all_scenes = {"cornell": (common.ROOT / "scenes/cornell-box/cornell.pbrt", size), "balls": (folder / "balls.pbrt", size)}
    all_scenes |= {name: (common.ROOT / "scenes/stage" / (name + ".pbrt"), size) for name in STAGE}
    chosen = os.environ.get("DAPPLE_CLEAN_SCENES", " ".join(all_scenes)).split()
    return {name: all_scenes[name] for name in chosen}


def bench(context):
    try:
        from denoise import display_error
        from reprojection import read_channels
    except ImportError as error:
        raise common.Skip(f"{error} (packages python3-numpy and python3-openimageio)")
    rows, result = [], {}
    reference_samples = int(os.environ.get("DAPPLE_CLEAN_REFERENCE", REFERENCE_SAMPLES))
    percent = lambda e: f"{100 * e:.2f} %"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for scene, (path, size) in scenes(folder).items():
            options, image = ["--integrator", "path", "--resolution", size, "--float"], folder / "image.exr"
            reference = common.kept_render(context, f"clean_{scene}", path, "--pixel-samples", reference_samples, "--seed", 5, *options)
            wanted = read_channels(reference, "R", "G", "B")
            common.render(context, path, image, "--pixel-samples", SAMPLES, "--denoise", "on", "--aov", "albedo,normal,variance", *options,
                          "--threads", context.threads, "--quiet")
            without_variance(image, folder / "other.exr")
            common.run([context.program("dapple"), "denoise", folder / "other.exr", "-o", folder / "network.exr", "-q"])
            error = lambda path, prefix="": display_error(read_channels(path, *(prefix + c for c in "RGB")), wanted)[0]
            found = {"noisy": error(image, "noisy."), "network": error(folder / "network.exr"), "kept": error(image)}
            rows.append([scene, *map(percent, found.values()), f"{100 * (found['kept'] - found['noisy']):+.2f} %"])
            result[scene] = found
        clean_rows = []
        for title, picture in noise_free_pictures():
            found = {layers: noise_free_error(context, folder, picture, layers) for layers in ("albedo variance", "albedo", "")}
            clean_rows.append([title, *map(percent, found.values())])
            result["without noise, " + title] = found
    text = f"{SAMPLES} samples, against {reference_samples}.\n\n" + common.table(["scene", "as rendered", "network alone", "with what is clean kept", "added"], rows)
    text += "\n\nPictures without noise: display error after `dapple denoise`, all of it added.\n\n"
    text += common.table(["picture", "with AOV variance", "of another renderer, flat albedo", "colour alone"], clean_rows)
    return {"cases": result}, text
