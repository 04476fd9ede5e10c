# SPDX-License-Identifier: Apache-2.0
"""Pruned leaves and twigs (--lod) in a wood of distinct trees, each a mesh of its own: memory, time of loading, and error against the whole trees, path
traced. docs/design/measurements/033-pruned-leaves.md"""
import argparse
import json
import math
import re

import common

LEVELS = "0.5", "1", "2"
SIZE, SAMPLES = "120x68", 128
SPACING = 6  # metres
HEAD = b"end_header\n"
FLOATS = "x", "y", "z", "nx", "ny", "nz", "u", "v"
SCENE = """Integrator "path" "integer maxdepth" [ 7 ]
PixelFilter "box"
Film "rgb" "string filename" "wood.exr"
LookAt 0 {y:.6g} {z:.6g}  0 0 3  0 0 1
Camera "perspective" "float fov" 40
WorldBegin
LightSource "distant" "rgb L" [ 3.0 2.8 2.5 ] "point3 from" [ -0.53 -0.37 0.77 ] "point3 to" [ 0 0 0 ]
LightSource "infinite" "rgb L" [ 0.25 0.35 0.55 ]
MakeNamedMaterial "bark" "string type" "diffuse" "rgb reflectance" {bark}
MakeNamedMaterial "leaf" "string type" "diffusetransmission" "rgb reflectance" {reflectance} "rgb transmittance" {transmittance}
{trees}
Material "diffuse" "rgb reflectance" [ 0.13 0.1 0.07 ]
Shape "disk" "float radius" {radius}
"""
VISIBLE = {"bark": "[ 0.15 0.12 0.09 ]", "reflectance": "[ 0.05 0.11 0.04 ]", "transmittance": "[ 0.04 0.1 0.02 ]"}
INFRARED = {"bark": "[ 0.4 0.4 0.4 ]", "reflectance": "[ 0.46 0.46 0.46 ]", "transmittance": "[ 0.44 0.44 0.44 ]"}


def read_mesh(path):
    """Vertices of eight floats, and triangles."""
    import numpy as np

    data = path.read_bytes()
    begin = data.index(HEAD) + len(HEAD)
    vertices, faces = (int(re.search(rb"%s (\d+)" % what, data)[1]) for what in (b"vertex", b"face"))
    v = np.frombuffer(data, "<f4", 8 * vertices, begin).reshape(vertices, 8)
    return v, np.frombuffer(data, np.dtype([("corners", "u1"), ("vertex", "<i4", 3)]), faces, begin + 32 * vertices)["vertex"]


def write_ply(path, v, f):
    import numpy as np

    faces = np.zeros(len(f), np.dtype([("corners", "u1"), ("vertex", "<i4", 3)]))
    faces["corners"], faces["vertex"] = 3, f
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(v)}\n" + "".join(f"property float {n}\n" for n in FLOATS)
    head += f"element face {len(f)}\nproperty list uchar int vertex_indices\n"
    path.write_bytes(head.encode() + HEAD + v.astype("<f4").tobytes() + faces.tobytes())


def bent(v, scale, turn, twist, bend, place):
    """A tree of other size that is turned, more so with its height, and leans."""
    import numpy as np

    w, p, n = v.copy(), v[:, :3] * scale, v[:, 3:6] / scale
    c, s = np.cos(turn + twist * p[:, 2]), np.sin(turn + twist * p[:, 2])
    for at, q in ((0, p), (3, n)):
        w[:, at], w[:, at + 1], w[:, at + 2] = c * q[:, 0] - s * q[:, 1], s * q[:, 0] + c * q[:, 1], q[:, 2]
    w[:, :2] += p[:, 2:] ** 2 * bend + place
    return w


def write_wood(folder, count):
    import numpy as np

    models = common.ROOT.parent / "shared/scenes/forest"
    if not models.exists():
        raise common.Skip(f"{models} is absent")
    folder.mkdir(parents=True, exist_ok=True)
    species = [{part: read_mesh(models / f"{name}_{part}.ply") for part in ("bark", "leaf")} for name in ("quaking_aspen", "small_maple")]
    rng, columns, trees = np.random.default_rng(1), math.ceil(count**0.5), []
    for i in range(count):
        parts, wide = species[rng.integers(2)], rng.uniform(0.75, 1.15)
        shape = np.array([wide, wide, rng.uniform(0.75, 1.15)]), rng.uniform(0, 2 * math.pi), rng.normal(0, 0.05), rng.normal(0, 0.004, 2)
        place = (np.array([i % columns, i // columns]) + rng.uniform(0.15, 0.85, 2) - columns / 2) * SPACING
        for part, (v, f) in parts.items():
            write_ply(folder / f"{part}{i}.ply", bent(v, *shape, place), f)
            trees.append(f'NamedMaterial "{part}"\nShape "plymesh" "string filename" "{part}{i}.ply"\n')
    side = columns * SPACING
    for name, colours in (("visible", VISIBLE), ("infrared", INFRARED)):
        text = SCENE.format(y=-1.1 * side, z=0.45 * side, trees="".join(trees), radius=8 * side, **colours)
        (folder / f"{name}.pbrt").write_text(text)


def bench(context, trees=60, size=SIZE):
    folder = context.out / f"wood_{trees}"
    if not (folder / "infrared.pbrt").exists():
        write_wood(folder, trees)
    options = ["--integrator", "path", "--resolution", size, "--float", "--light-learning", "off", "--pixel-samples", SAMPLES, "--threads", context.threads]

    def picture(scene, lod, seed):
        image = folder / f"{scene}_{lod}_{seed}.exr"
        return image, common.render(context, folder / f"{scene}.pbrt", image, *options, "--lod", lod, "--seed", seed)

    def error(image, reference):
        found = json.loads(common.run([context.program("image_diff"), image, reference, "--block", 8, "--json"]))
        return [100 * e for e in found["mean_error"]], 100 * found["block_rmse"]

    result, rows = {}, []
    references = {scene: picture(scene, "off", 1)[0] for scene in ("visible", "infrared")}
    for lod in ("off", *LEVELS):
        image, s = picture("visible", lod, 2)
        means, blocks = error(image, references["visible"])
        infrared = error(picture("infrared", lod, 2)[0], references["infrared"])
        memory, pruned = s["memory_bytes"], s.get("pruned", {"components": 1, "components_kept": 1, "faces": 1, "faces_kept": 1})
        result[lod] = {"pruned": pruned, "memory": memory, "peak": s["peak_rss_bytes"], "load": s["load_seconds"], "render_cpu": s["render_cpu_seconds"], "means": means,
                       "blocks": blocks, "infrared": infrared}
        rows.append([lod, f"{100 * pruned['components_kept'] / pruned['components']:.1f} %", f"{100 * pruned['faces_kept'] / pruned['faces']:.1f} %",
                     f"{memory['shapes'] / 1e6:.0f} + {memory['acceleration'] / 1e6:.0f}", f"{s['peak_rss_bytes'] / 1e6:.0f}",
                     f"{s['load_seconds']['shapes']:.1f} + {s['load_seconds']['acceleration']:.1f}", f"{s['render_cpu_seconds']:.1f}",
                     ", ".join(f"{m:+.2f}" for m in means) + " %", f"{blocks:.2f} %", f"{infrared[0][0]:+.2f}; {infrared[1]:.2f} %"])
    return result, common.table(["--lod", "parts", "faces", "MB: meshes + Embree", "peak, MB", "s: meshes + Embree", "s of processor time, rendering", "means", "8 x 8 blocks",
                                 "near infrared: mean; blocks"], rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default=common.ROOT / "build/release")
    parser.add_argument("--out", default=common.ROOT / "out/bench")
    parser.add_argument("--trees", type=int, default=60, help="a maple has 240,000 faces, 20 MB with what Embree builds; an aspen 69,000")
    parser.add_argument("--size", default=SIZE, help="of pictures; trees of the default are some 20 pixels high")
    o = parser.parse_args()
    print(bench(common.Context(o.build, o.out, 1, 2), o.trees, o.size)[1])


if __name__ == "__main__":
    main()
