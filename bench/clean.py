# SPDX-License-Identifier: Apache-2.0
"""Whether denoising makes images of many samples worse: display errors (denoise.py) of path tracing as rendered, after the network alone, and with
what is clean kept (`dapple denoise` uses AOV variance for that). The references' own noise is in all. DAPPLE_CLEAN_REFERENCE their samples."""
import os
import tempfile
from pathlib import Path

import common

SAMPLES, REFERENCE_SAMPLES = (16, 64, 256, 1024), 8192
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


def bench(context):
    try:
        from denoise import display_error
        from reprojection import read_channels
    except ImportError as error:
        raise common.Skip(f"{error} (packages python3-numpy and python3-openimageio)")
    rows, result = [], {}
    reference_samples = int(os.environ.get("DAPPLE_CLEAN_REFERENCE", REFERENCE_SAMPLES))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "balls.pbrt").write_text(BALLS)
        for scene, size in ((common.ROOT / "scenes/cornell-box/cornell.pbrt", "64x64"), (folder / "balls.pbrt", "90x60")):
            common_options = ["--integrator", "path", "--resolution", size, "--float", "--threads", context.threads, "--quiet"]
            common.render(context, scene, folder / "reference.exr", "--pixel-samples", reference_samples, "--seed", 5, *common_options)
            wanted = read_channels(folder / "reference.exr", "R", "G", "B")
            for samples in [n for n in SAMPLES if n < reference_samples]:
                image = folder / "image.exr"
                common.render(context, scene, image, "--pixel-samples", samples, "--denoise", "on", "--aov", "albedo,normal,variance", *common_options)
                without_variance(image, folder / "other.exr")
                common.run([context.program("dapple"), "denoise", folder / "other.exr", "-o", folder / "network.exr", "-q"])
                error = lambda path, prefix="": display_error(read_channels(path, *(prefix + c for c in "RGB")), wanted)[0]
                found = {"noisy": error(image, "noisy."), "network": error(folder / "network.exr"), "kept": error(image)}
                rows.append([scene.stem, str(samples), *(f"{100 * e:.2f} %" for e in found.values())])
                result[f"{scene.stem}, {samples}"] = found
    return {"cases": result}, common.table(["scene", "samples", "as rendered", "network alone", "with what is clean kept"], rows)
