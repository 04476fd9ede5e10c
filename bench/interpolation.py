# SPDX-License-Identifier: Apache-2.0
"""The diffuse rays that irradiance interpolation saves in preset final, at what error: the Cornell box, and a room whose surfaces all have textures and bumps."""
import tempfile
from pathlib import Path

import common

CORNELL = common.ROOT / "scenes/cornell-box/cornell.pbrt"
BOUNCES, REFERENCE_SAMPLES = 2, 256
# Name, scene (None: the bumpy room), size, crop: by pixels; that is the foot of the tall box and the corner beside it.
CASES = [("Cornell box, 256x256", CORNELL, "256x256", None), ("Cornell box, crop of 512x512", CORNELL, "512x512", "96,376,224,504"),
         ("bumpy room, 256x192", None, "256x192", None)]


def bumpy_room(folder):
    """Plaster, boards and a carpet with reliefs of 5 to 40 mm, and three balls with reliefs of their own."""
    def surface(name, low, high, scale, height):
        return (f'Texture "{name} relief" "float" "perlin" "float scale" {scale} "float amplitude" {height}\n'
                f'Texture "{name} mix" "float" "perlin" "float scale" {scale * 0.7} "float amplitude" .5 "float pivot" .5\n'
                f'Texture "{name} colour" "spectrum" "mix" "rgb tex1" [ {low} ] "rgb tex2" [ {high} ] "texture amount" "{name} mix"\n'
                f'MakeNamedMaterial "{name}" "string type" "diffuse" "texture reflectance" "{name} colour" "texture displacement" "{name} relief"\n')

    def quad(name, *corners):
        return f'NamedMaterial "{name}"\nShape "bilinearmesh" "point3 P" [ {"  ".join(corners)} ]\n'

    def ball(name, x, y, radius):
        return f'AttributeBegin\nNamedMaterial "{name}"\nTranslate {x} {y} {radius}\nShape "sphere" "float radius" {radius}\nAttributeEnd\n'

    path = folder / "bumpy_room.pbrt"
    path.write_text(f"""Film "rgb" "integer xresolution" 256 "integer yresolution" 192
PixelFilter "box"
LookAt 0 -4.4 1.5  0 0 1.2  0 0 1
Camera "perspective" "float fov" 45
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 24 22 19 ]
  Shape "bilinearmesh" "point3 P" [ -.4 .4 2.95  .4 .4 2.95  -.4 -.4 2.95  .4 -.4 2.95 ]
AttributeEnd
""" + surface("plaster", ".45 .42 .38", ".85 .82 .75", 6, .03) + surface("boards", ".25 .1 .03", ".6 .35 .15", 4, .05)
        + surface("carpet", ".1 .12 .3", ".5 .45 .7", 14, .012)
        + quad("carpet", "-2 -2 0", "2 -2 0", "-2 2 0", "2 2 0") + quad("plaster", "-2 2 3", "2 2 3", "-2 -2 3", "2 -2 3")
        + quad("plaster", "-2 2 0", "2 2 0", "-2 2 3", "2 2 3") + quad("boards", "-2 -2 0", "-2 2 0", "-2 -2 3", "-2 2 3")
        + quad("boards", "2 2 0", "2 -2 0", "2 2 3", "2 -2 3")
        + ball("plaster", -.9, .6, .7) + ball("boards", .8, .2, .5) + ball("carpet", .1, -.9, .3))
    return path


def references(context, scene, name, frame):
    return common.path_traced(context, f"interpolation_{name}_path", scene, "--pixel-samples", REFERENCE_SAMPLES, *frame)


def bench(context):
    rows, result = [], []
    with tempfile.TemporaryDirectory() as folder:
        room = bumpy_room(Path(folder))
        for number, (name, scene, size, crop) in enumerate(CASES):
            frame = ["--resolution", size, *(["--crop", crop] if crop else []), "--bounces", BOUNCES, "--threads", context.threads, "--float"]
            pair = references(context, scene or room, number, frame)
            runs, errors = {}, {}
            for on in ("off", "on"):
                image = context.out / f"interpolation_{number}_{on}.exr"
                runs[on] = common.render(context, scene or room, image, "--integrator", "distribution", "--preset", "final", "--irradiance-interpolation", on, *frame)
                errors[on] = common.compare_without_noise(context, image, pair)
                rows.append([name, on, f"{runs[on]['render_cpu_seconds']:.1f} s", f"{runs[on]['rays']['diffuse'] / 1e6:.2f} million"]
                            + [f"{100 * e:.2f} %" for e in errors[on]] + ["" if on == "off" else f"{runs['off']['rays']['diffuse'] / runs['on']['rays']['diffuse']:.2f}"])
            result.append({"name": name, "runs": runs, "errors": errors})
    text = (f"Preset final, {BOUNCES} bounces, processor time of all threads, single runs; against twice {REFERENCE_SAMPLES} samples of the path integrator, whose own noise is "
            "taken off, without what is 8 times as bright as the median.\n\n"
            + common.table(["scene", "interpolation", "processor time", "diffuse rays", "RMSE of pixels", "of 8x8 blocks", "of means", "times fewer rays"], rows))
    return {"cases": result}, text
