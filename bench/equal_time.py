#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How many times sooner a way to render reaches an error than path tracing by a baseline does, at the same processor time, in rooms and
forests of this repository and of ../shared/scenes (those that are there).

Times are of all processors, learning included; what the baseline takes to load the scene is taken off both. Errors fall with the square
root of time: the ratio is that of error^2 times seconds, a geometric mean over seeds and sample counts. Errors are against two independent
halves a and b of a path-traced reference, mean of (x - a)(x - b): without the reference's own noise. What is brighter than 8 times the
reference's median is left out, but for `display`: sRGB, clamped, where the 0.7 quantile of luminance is 0.5.

References are kept in OUT/references by a hash of what made them: program, scene files, options.
"""
import argparse
import hashlib
import json
import math
import os
import sys
import tempfile
from pathlib import Path

import common

SHARED = common.ROOT.parent / "shared/scenes"
ROOMS = ["staircase2", "classroom", "kitchen", "living-room", "bedroom"]
SCENES = {**{name: SHARED / name / "scene-v4.pbrt" for name in ROOMS},
          "lamps": common.ROOT / "scenes/lamps/lamps.pbrt",
          "veach-mis": SHARED / "veach-mis/scene-v4.pbrt",
          "cornell-box": common.ROOT / "scenes/cornell-box/cornell.pbrt",
          "forest-inside": SHARED / "forest/forest-inside.pbrt",
          "forest-above": SHARED / "forest/forest-above.pbrt"}
BOUNCES, MEDIANS, BLOCK = 4, 8, 8
REFERENCE_SEEDS = (101, 102)
METRICS = ("pixels", "blocks", "display")


def read(path):
    from reprojection import read_channels
    return read_channels(path, "R", "G", "B")


def display(x, scale):
    import numpy as np
    x = np.clip(x * scale, 0, 1)
    return np.where(x < .0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - .055)


def display_slope(x, scale):
    """Derivative of display() by x."""
    import numpy as np
    y = x * scale
    return scale * np.where(y < .0031308, 12.92, np.where(y < 1, 1.055 / 2.4 * np.maximum(y, .0031308) ** (1 / 2.4 - 1), 0))


def block_means(x):
    h, w = (n // BLOCK * BLOCK for n in x.shape[:2])
    return x[:h, :w].reshape(h // BLOCK, BLOCK, w // BLOCK, BLOCK, -1).mean((1, 3))


class Reference:
    """Two independent halves, and errors against them. Where halves are so noisy that their display is darker than that of what they are of (a
    curve's mean is not the curve of the mean), a `guide`, a picture with little noise, is what display is expanded about, to first order."""

    def __init__(self, a, b, guide=None):
        import numpy as np
        self.halves, mean, self.guide = (a, b), (a + b) / 2, guide
        luminance = (mean if guide is None else guide).mean(-1)
        self.counts = (luminance > 0) & (luminance < MEDIANS * np.median(luminance[luminance > 0]))
        self.level = mean[self.counts].mean()
        self.scale = .5 / max(np.quantile(luminance, .7), 1e-9)

    def shown(self, half):
        if self.guide is None:
            return display(half, self.scale)
        return display(self.guide, self.scale) + display_slope(self.guide, self.scale) * (half - self.guide)

    def errors(self, x):
        """By metric, and of the mean; relative, but for `display`."""
        import numpy as np
        d = [np.where(self.counts[..., None], x - half, 0) for half in self.halves]
        blocks = [block_means(e) for e in d]
        shown = [display(x, self.scale) - self.shown(half) for half in self.halves]

        def rmse(a, b, norm):
            return math.sqrt(max((a * b).mean(), 1e-20)) / norm
        return {"pixels": rmse(d[0][self.counts], d[1][self.counts], self.level), "blocks": rmse(*blocks, self.level),
                "display": rmse(*shown, 1), "mean": float((d[0] + d[1])[self.counts].mean() / 2 / self.level)}


def hash_of(*parts):
    digest = hashlib.sha256()
    for part in parts:
        digest.update(Path(part).read_bytes() if isinstance(part, Path) else str(part).encode())
        digest.update(b"\0")
    return digest.hexdigest()[:24]


def scene_hash(scene):
    """Of its text, and of the names and sizes of all that lies beside it."""
    files = sorted(p for p in scene.parent.rglob("*") if p.is_file() and p.suffix not in (".exr.json",))
    return hash_of(scene, *(f"{p.relative_to(scene.parent)} {p.stat().st_size}" for p in files))


def render(program, scene, image, options):
    with tempfile.TemporaryDirectory() as folder:
        stats = Path(folder) / "stats.json"
        common.run([program, "render", scene, "-o", image, "--stats", stats, "--float", "-q", *options])
        return json.loads(stats.read_text())


def reference(o, scene, size):
    """Two halves by the program o.baseline, kept in o.out for this program alone."""
    halves = []
    for seed in REFERENCE_SEEDS:
        options = ["--integrator", "path", "--bounces", BOUNCES, "--resolution", size, "--pixel-samples", o.reference_samples, "--seed", seed]
        name = hash_of(Path(o.baseline), scene_hash(scene), *options)
        image = Path(o.out) / "references" / f"{scene.parent.name}-{scene.stem}-{size}-{name}.exr"
        if not image.exists():
            image.parent.mkdir(parents=True, exist_ok=True)
            partial = image.with_name("making-" + image.name)
            render(o.baseline, scene, partial, options + ["--threads", o.threads])
            partial.rename(image)
            image.with_suffix(".txt").write_text(" ".join(map(str, [o.baseline, "render", scene, *options])) + "\n")
        halves.append(read(image))
    return Reference(*halves)


def frames(o, name, program, options, scene, size, truth):
    """Errors and processor seconds of renderings with each seed."""
    found = []
    for seed in range(1, o.seeds + 1):
        image = Path(o.out) / f"equal_time_{os.getpid()}.exr"
        s = render(program, scene, image, [*options, "--bounces", BOUNCES, "--resolution", size, "--seed", seed, "--threads", o.threads])
        found.append({"name": name, "seed": seed, "seconds": s["cpu_seconds"], "load": load_seconds(s), **truth.errors(read(image))})
        if not o.keep:
            image.unlink()
        else:
            image.rename(Path(o.out) / f"{scene.parent.name}-{scene.stem}-{size}-{name.replace(' ', '')}-{seed}.exr")
    return found


def load_seconds(s):
    """Processor seconds that are not of rendering."""
    return s["cpu_seconds"] - s["render_cpu_seconds"]


def geometric(values):
    values = list(values)
    return math.exp(sum(map(math.log, values)) / len(values))


def options_of(method):
    return ["--integrator", "path"] if method == "path" else ["--integrator", "distribution", "--preset", method]


def figures(o, scene, size):
    truth = reference(o, scene, size)
    if o.references_only:
        return None
    baseline, ours = {}, {}
    raw = ["--denoise", "off"] if o.denoises else []
    for n in o.samples:  # the same for all: display errors, which clamp, fall more slowly than noise does
        baseline[n] = frames(o, f"baseline {n}", o.baseline, ["--integrator", "path", "--pixel-samples", n], scene, size, truth)
        for method in o.methods:
            ours[f"{method} {n}"] = frames(o, f"{method} {n}", o.program, [*options_of(method), "--pixel-samples", n, *raw, *o.options], scene, size, truth)
    load = common.median([f["load"] for fs in baseline.values() for f in fs])

    def costs(found, metric):
        return geometric(f[metric] ** 2 * max(f["seconds"] - load, 1e-3) for f in found)
    groups = {method: [f for n in o.samples for f in ours[f"{method} {n}"]] for method in o.methods}
    everything = [f for fs in baseline.values() for f in fs]
    result = {}
    for method, found in groups.items():
        result[method] = {m: costs(everything, m) / costs(found, m) for m in METRICS}
        result[method]["mean"] = sum(f["mean"] for f in found) / len(found)
    return {"sooner": result, "load_seconds": load, "baseline": baseline, "ours": ours}


def rows_of(found):
    for scene, result in found.items():
        for method, r in result["sooner"].items():
            yield [scene, method, *(f"{r[m]:.2f}" for m in METRICS), f"{100 * r['mean']:+.1f} %"]


def measure(o):
    text, results = [], {}
    for size in o.sizes:
        found = {}
        for name in o.scenes:
            scene = SCENES[name]
            if not scene.exists():
                print(f"{name}: {scene} is not there", flush=True)
                continue
            result = figures(o, scene, size)
            if result is None:
                continue
            found[name] = result
            for row in rows_of({name: result}):
                print(size, *row, flush=True)
        rooms = [found[r] for r in ROOMS if r in found]
        rows = list(rows_of(found))
        for method in (rooms[0]["sooner"] if rooms else ()):
            rows.append([f"{len(rooms)} rooms", method, *(f"{geometric(r['sooner'][method][m] for r in rooms):.2f}" for m in METRICS), ""])
        text.append(f"{size}, {BOUNCES} bounces, {o.seeds} seeds, {', '.join(map(str, o.samples))} samples, against {o.baseline}\n\n"
                    + common.table(["scene", "method", *METRICS, "mean"], rows))
        results[size] = found
    return results, "\n\n".join(text)


def parser():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--baseline", required=True, help="program whose path tracing is the measure, and makes the references")
    p.add_argument("--program", default=common.ROOT / "build/release/dapple")
    p.add_argument("--out", default=common.ROOT / "out/bench")
    p.add_argument("--scenes", nargs="+", default=list(SCENES), choices=list(SCENES))
    p.add_argument("--methods", nargs="+", default=["path", "preview"], choices=["path", "draft", "preview", "final"])
    p.add_argument("--sizes", nargs="+", default=["160x90", "480x270"])
    p.add_argument("--samples", nargs="+", type=int, default=[16, 64], help="a pixel, of all")
    p.add_argument("--reference-samples", type=int, default=1024, help="of each half")
    p.add_argument("--seeds", type=int, default=3)
    p.add_argument("--threads", type=int, default=2)
    p.add_argument("--options", nargs=argparse.REMAINDER, default=[], help="last: more for the program, such as --light-learning off")
    p.add_argument("--keep", action="store_true", help="images, too")
    p.add_argument("--references-only", action="store_true")
    return p


def run(o):
    o.out = Path(o.out)
    o.out.mkdir(parents=True, exist_ok=True)
    o.denoises = "--denoise" in common.run([o.program, "render", "--help"])
    return measure(o)


def bench(context):
    """Of bench/run.py: the baseline is the program that the environment variable DAPPLE_BASELINE names."""
    if not os.environ.get("DAPPLE_BASELINE"):
        raise common.Skip("DAPPLE_BASELINE does not name a program to compare with")
    return run(parser().parse_args(["--baseline", os.environ["DAPPLE_BASELINE"], "--program", context.program("dapple"), "--out", str(context.out),
                                    "--threads", str(context.threads)]))


def main():
    o = parser().parse_args()
    results, text = run(o)
    if o.references_only:
        return
    print(text)
    (o.out / "equal_time.md").write_text(f"## equal_time\n\n{common.machine()}\n\n{text}\n")
    (o.out / "equal_time.json").write_text(json.dumps({"machine": common.machine(), "sizes": results}, indent=2) + "\n")


if __name__ == "__main__":
    sys.exit(main())
