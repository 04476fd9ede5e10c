# SPDX-License-Identifier: Apache-2.0
"""Models of other programs beside Blender's picture of the same file: both read it, and render it from the same place, by Cycles and `path`,
in an even sky with a sun. Which pixels are covered, and the means, are compared; the pairs (OUT/models/*.png) are to be looked at, Blender's
left. Needs Blender and the models of Debian's package assimp-testmodels (DAPPLE_MODELS: another folder; DAPPLE_MODEL: a part of the names)."""
import json
import os
import re
import subprocess
from pathlib import Path

import common

FOLDER = Path(os.environ.get("DAPPLE_MODELS", "/usr/share/assimp/models"))
SIZE, SAMPLES, BOUNCES = (240, 180), 64, 3
SKY, SUN = (0.55, 0.6, 0.7), {"to": (0.45, 0.75, 0.5), "irradiance": 2.0}
MODELS = ["glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb", "glTF2/BoxTextured-glTF-Binary/BoxTextured.glb",
          "glTF2/BoxTextured-glTF-pbrSpecularGlossiness/BoxTextured.gltf", "glTF2/ClearCoat-glTF/ClearCoatTest.gltf",
          "glTF2/textureTransform/TextureTransformTest.gltf", "glTF2/glTF-Sample-Models/AnimatedMorphCube-glTF/AnimatedMorphCube.gltf",
          "glTF2/simple_skin/simple_skin.gltf", "OBJ/spider.obj", "OBJ/WusonOBJ.obj", "OBJ/cube_with_vertexcolors.obj",
          "OBJ/box_mat_with_spaces.obj", "FBX/huesitos.fbx", "FBX/phong_cube.fbx", "FBX/box.fbx", "FBX/maxPbrMaterial_metalRough.fbx",
          "FBX/cubes_with_mirroring_and_pivot.fbx", "FBX/animation_with_skeleton.fbx", "FBX/transparentTest.fbx", "Collada/duck.dae",
          "Collada/Cinema4D.dae", "Collada/cube_with_2UVs.DAE", "Collada/COLLADA.dae", "Collada/teapots.DAE", "STL/Spider_binary.stl",
          "STL/sphereWithHole.stl", "PLY/Wuson.ply", "PLY/cube_uv.ply", "BLEND/HUMAN.blend", "BLEND/BlenderMaterial_269.blend"]


def numbers(text, directive):
    found = re.search(directive + r" \[([^\]]*)\]", text)
    return [float(x) for x in found.group(1).split()] if found else None


def camera_of(scene):
    """Eye, direction and so on of the camera of a converted model; its transform has columns, and mirrors."""
    m = numbers(scene, "Transform") or [float(i % 5 == 0) for i in range(16)]
    row = [[m[4 * c + r] for c in range(4)] for r in range(3)]
    eye = [-sum(row[r][c] * row[r][3] for r in range(3)) for c in range(3)]
    return {"eye": eye, "look": [eye[c] + row[2][c] for c in range(3)], "up": row[1][:3],
            "fov": numbers(scene, r'"float fov"')[0]}


def turned(v, z_up):
    """From axes whose y is up to the model's."""
    return (v[0], -v[2], v[1]) if z_up else v


def with_lights(scene, z_up):
    to = turned(SUN["to"], z_up)
    length = sum(x * x for x in to) ** 0.5
    text = f'\nLightSource "infinite" "rgb L" [ {SKY[0]} {SKY[1]} {SKY[2]} ]\n'
    irradiance = SUN["irradiance"]
    text += f'LightSource "distant" "point3 from" [ {to[0]} {to[1]} {to[2]} ] "point3 to" [ 0 0 0 ] "rgb L" [ {irradiance} {irradiance} {irradiance} ]\n'
    return scene.replace("\nWorldBegin\n", "\nWorldBegin\n" + text, 1), [x / length for x in to]


def render_pair(context, model, out):
    scene = out.with_suffix(".pbrt")
    done = subprocess.run([context.program("dapple"), "convert", str(model), "-o", str(scene), "--sky", "none", "--camera", "default",
                           "--resolution", f"{SIZE[0]}x{SIZE[1]}"], capture_output=True, text=True, errors="replace")
    if done.returncode != 0:
        return None, done.stderr.strip().splitlines()[-1]
    up = re.search(r"(-?[xyz]) is up", done.stderr).group(1)
    text, sun = with_lights(scene.read_text(), up == "z")
    scene.write_text(text)
    ours, theirs = out.with_name(out.name + "_dapple.exr"), out.with_name(out.name + "_blender.exr")
    common.render(context, scene, ours, "--integrator", "path", "--pixel-samples", SAMPLES, "--bounces", BOUNCES, "--float", "--threads",
                  context.threads, "-q")
    job = {"model": str(model), "out": str(theirs), "size": SIZE, "samples": SAMPLES, "bounces": BOUNCES, "threads": context.threads,
           "camera": camera_of(text), "z_up": up == "z", "sky": SKY, "sun": {"to": sun, "irradiance": SUN["irradiance"]}}
    job_file = out.with_suffix(".json")
    job_file.write_text(json.dumps(job))
    try:
        common.blender("blender_model.py", job_file)
    except RuntimeError as error:
        return None, "Blender: " + str(error).strip().splitlines()[-1]
    return (ours, theirs), ""


def pixels(image):
    import OpenImageIO as oiio
    return oiio.ImageBuf(str(image)).get_pixels(oiio.FLOAT)[:, :, :3]


def measure(ours, theirs):
    """Share of pixels that one covers and the other does not, and the relative difference of the means where both do."""
    import numpy as np
    a, b = pixels(ours), pixels(theirs)
    covered = [np.abs(x - np.array(SKY)).max(axis=2) > 1e-3 for x in (a, b)]
    both = covered[0] & covered[1]
    apart = float((covered[0] != covered[1]).mean())
    if not both.any():
        return apart, float("nan")
    return apart, float(a[both].mean() / b[both].mean() - 1)


def bench(context):
    if not FOLDER.is_dir():
        raise common.Skip(f"there are no models in {FOLDER}")
    folder = context.out / "models"
    folder.mkdir(parents=True, exist_ok=True)
    rows, results = [], {}
    for name in MODELS:
        if os.environ.get("DAPPLE_MODEL", "") not in name or not (FOLDER / name).exists():
            continue
        out = folder / re.sub(r"[^A-Za-z0-9_]+", "_", name)
        pair, reason = render_pair(context, FOLDER / name, out)
        if not pair:
            rows.append([name, "-", reason.replace("|", "/")[:120]])
            continue
        apart, mean = measure(*pair)
        views = []
        for image in reversed(pair):
            views.append(image.with_suffix(".png"))
            common.run(["oiiotool", image, "--ch", "R,G,B", "--clamp:max=1,1,1", "--tocolorspace", "sRGB", "-d", "uint8", "-o", views[-1]])
        common.run(["oiiotool", *views, "--mosaic:pad=4", "2x1", "-o", out.with_name(out.name + "_pair.png")])
        rows.append([name, f"{100 * apart:.2f} %", f"{100 * mean:+.1f} %"])
        results[name] = {"covered_apart": apart, "mean": mean}
    text = f"{len(results)} models, {SIZE[0]} x {SIZE[1]}, {SAMPLES} samples, {BOUNCES} bounces.\n\n"
    return {"models": results}, text + common.table(["model", "covered by one alone", "mean, Dapple's over Blender's"], rows)
