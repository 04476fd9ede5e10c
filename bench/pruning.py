# SPDX-License-Identifier: Apache-2.0
"""Pruned leaves (Cook, Halstead, Planck and Ryu 2007) in far trees: fewer leaves, in a random order, each so much larger that their area stays. Processor
time, noise and bias of forest-above path traced where trees are some 25 pixels high."""
import argparse
import json
import re

import common

SHARES = 1, 4, 8, 16, 32
SIZE, SAMPLES, FINE = "160x90", 16, 96
HEAD = b"end_header\n"


def read_leaves(path):
    """Vertices of eight floats, triangles, and of each vertex the number of its leaf."""
    import numpy as np

    data = path.read_bytes()
    begin = data.index(HEAD) + len(HEAD)
    vertices, faces = (int(re.search(rb"%s (\d+)" % what, data)[1]) for what in (b"vertex", b"face"))
    v = np.frombuffer(data, "<f4", 8 * vertices, begin).reshape(vertices, 8)
    f = np.frombuffer(data, np.dtype([("corners", "u1"), ("vertex", "<i4", 3)]), faces, begin + 32 * vertices)["vertex"]
    leaf = np.arange(vertices)
    while True:  # what shares a vertex is one leaf
        least = leaf.copy()
        for k in range(3):
            np.minimum.at(least, f[:, k], leaf[f].min(axis=1))
        least = least[least]
        if (least == leaf).all():
            return v, f, np.unique(leaf, return_inverse=True)[1]
        leaf = least


def prune(v, f, leaf, share):
    import numpy as np

    count = leaf.max() + 1
    middles = np.stack([np.bincount(leaf, v[:, k]) for k in range(3)], axis=1) / np.bincount(leaf)[:, None]
    larger = v.copy()
    larger[:, :3] = middles[leaf] + (v[:, :3] - middles[leaf]) * share**0.5
    kept = np.random.default_rng(5).permutation(count) < round(count / share)
    triangles = f[kept[leaf[f[:, 0]]]]
    used, corners = np.unique(triangles, return_inverse=True)
    return larger[used], corners.reshape(-1, 3)


def write_ply(path, v, f):
    import numpy as np

    faces = np.zeros(len(f), np.dtype([("corners", "u1"), ("vertex", "<i4", 3)]))
    faces["corners"], faces["vertex"] = 3, f
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(v)}\n" + "".join(f"property float {n}\n" for n in ("x", "y", "z", "nx", "ny", "nz", "u", "v"))
    head += f"element face {len(f)}\nproperty list uchar int vertex_indices\n"
    path.write_bytes(head.encode() + HEAD + v.astype("<f4").tobytes() + faces.tobytes())


def bench(context):
    folder = common.ROOT.parent / "shared/scenes/forest"
    if not folder.exists():
        raise common.Skip(f"{folder} is absent")
    text = (folder / "forest-above.pbrt").read_text()
    leaves = {name: read_leaves(folder / f"{name}.ply") for name in re.findall(r'"(\w+_leaf)\.ply"', text)}
    options = ["--integrator", "path", "--resolution", SIZE, "--float", "--threads", 1, "--light-learning", "off", "--bounces", 3]

    def picture(share, samples, seed):
        image = context.out / f"pruned_{share}_{samples}_{seed}.exr"
        found = common.render(context, context.out / f"pruned_{share}.pbrt", image, *options, "--pixel-samples", samples, "--seed", seed)
        return image, found["render_cpu_seconds"]

    def compare(image, reference):
        found = json.loads(common.run([context.program("image_diff"), image, reference, "--block", 8, "--json"]))
        return f"{100 * found['relative_rmse']:.1f} %, {100 * found['block_rmse']:.2f} %", f"{100 * found['mean_error'][1]:+.2f} %"

    result, rows, reference = {}, [], None
    for share in SHARES:
        for name, mesh in leaves.items():
            write_ply(context.out / f"{name}_{share}.ply", *prune(*mesh, share))
        pruned = re.sub(r'"(\w+_leaf)\.ply"', lambda m: f'"{context.out.resolve() / m[1]}_{share}.ply"', text)
        (context.out / f"pruned_{share}.pbrt").write_text(re.sub(r'"(\w+_bark)\.ply"', lambda m: f'"{folder / m[1]}.ply"', pruned))
        reference = reference or picture(share, FINE, 21)[0]
        one, seconds = picture(share, SAMPLES, 1)
        two, more = picture(share, SAMPLES, 2)
        noise, bias = compare(one, two), compare(picture(share, FINE, 20)[0], reference)
        result[share] = {"seconds": (seconds + more) / 2, "noise": noise[0], "bias": bias}
        rows.append([f"1/{share}", f"{result[share]['seconds']:.2f} s", noise[0], bias[0], bias[1]])
    return result, common.table(["leaves", "processor time", f"two of {SAMPLES} samples: pixels, blocks", f"of {FINE} samples from all leaves: pixels, blocks", "mean of green"], rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default=common.ROOT / "build/release")
    parser.add_argument("--out", default=common.ROOT / "out/bench")
    o = parser.parse_args()
    print(bench(common.Context(o.build, o.out, 1, 1))[1])


if __name__ == "__main__":
    main()
