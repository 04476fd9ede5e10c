#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Rooms and places that no constant was fitted to: the default, denoised, against path tracing, denoised.

Scenes are made by script, of any variant, so that unseen ones can be made at any time. Each is rendered by default and by `path` at S and 4 S
samples, all with 4 diffuse bounces. Errors are those of equal_time.py, against two path-traced halves: without the references' own noise. Of dark
rooms halves are grainy: display is expanded about `path` at 4 S samples, denoised, where the halves say how far that is off. Sooner:
processor seconds that `path` would take to the default's denoised display error, on the line in log-log through its S and 4 S samples, over the
default's. A mean's standard error is the larger one of two, over seeds: of whole pictures (which alone sees what errs alike everywhere, but of two
seeds knows little) and of squares of SQUARE x SQUARE pixels; that of the halves is added.
"""
import argparse
import sys
import tempfile
from pathlib import Path

import common
import rooms_at_home
import rooms_in_public
import rooms_outside

KINDS = {**rooms_at_home.KINDS, **rooms_in_public.KINDS, **rooms_outside.KINDS}
SQUARE = 15
LOST = 1e-4  # a mean of products that is not positive counts as next to nothing


def write(folder, kind, variant):
    """Writes a scene, unless it is there as it would be written, and returns its path."""
    path = Path(folder) / f"{kind}-{variant}.pbrt"
    text = KINDS[kind](variant).text()
    if not path.exists() or path.read_text() != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return path


def mean_error(images, truth):
    """Of the mean of pictures, relative to the halves' where the reference counts, and its standard error."""
    import numpy as np

    def squares(x):
        counted = np.where(truth.counts[..., None], x, 0).mean(-1)
        for axis in (0, 1):  # the last ones may be smaller
            counted = np.add.reduceat(counted, range(0, counted.shape[axis], SQUARE), axis)
        return counted.ravel()

    def variance(pictures):
        """Of the sum over all squares of the mean picture."""
        sums = np.array([squares(p) for p in pictures])
        return max(np.var(sums, axis=0, ddof=1).sum(), np.var(sums.sum(1), ddof=1)) / len(pictures)
    total = truth.level * truth.counts.sum()
    error = np.mean([truth.errors(x)["mean"] for x in images])
    return float(error), float(np.sqrt(variance(images) + variance(truth.halves)) / total)


def summary(frames, truth):
    """Of frames of several seeds, each (denoised, raw, processor seconds)."""
    from equal_time import geometric

    denoised, raw, seconds = zip(*frames)
    mean, deviation = mean_error(raw, truth)
    return {"denoised": geometric(truth.errors(x)["display"] for x in denoised), "raw": geometric(truth.errors(x)["display"] for x in raw),
            "mean": mean, "mean_standard_error": deviation, "denoised_mean": mean_error(denoised, truth)[0], "seconds": geometric(seconds)}


def times_sooner(ours, path, longer):
    """At equal denoised display error; None where four times the samples leave path tracing as it was, or an error is lost in the halves' noise."""
    from denoise import time_at

    if longer["denoised"] > .97 * path["denoised"] or min(r["denoised"] for r in (ours, path, longer)) < LOST:
        return None
    return time_at(ours["denoised"], [(p["seconds"], p["denoised"]) for p in (path, longer)]) / ours["seconds"]


def measure(o, scene):
    from equal_time import BOUNCES, REFERENCE_SEEDS, Reference, read, render
    from reprojection import read_channels

    def frames(name, *options):
        found = []
        for seed in o.seeds:
            image = o.images / f"{scene.stem}-{name}-{seed}.exr"
            stats = render(o.program, scene, image, ["--bounces", BOUNCES, "--resolution", o.size, "--seed", seed, "--threads", o.threads, "--denoise", "on", *options])
            found.append((read(image), read_channels(image, "noisy.R", "noisy.G", "noisy.B"), stats["render_cpu_seconds"]))
        return found
    found = {"path": frames("path", "--integrator", "path", "--pixel-samples", o.samples),
             "longer": frames("longer", "--integrator", "path", "--pixel-samples", 4 * o.samples),
             "default": frames("default", "--integrator", "distribution", "--pixel-samples", o.samples, *o.options)}
    guide = sum(denoised for denoised, _, _ in found["longer"]) / len(o.seeds)
    halves = common.path_traced(o.context, f"made_rooms_{scene.stem}_reference", scene, "--bounces", BOUNCES, "--resolution", o.size, "--pixel-samples",
                                o.reference_samples, seeds=REFERENCE_SEEDS)
    truth = Reference(*map(read, halves), guide)
    found = {name: summary(made, truth) for name, made in found.items()}
    return found | {"sooner": times_sooner(found["default"], found["path"], found["longer"])}


def row(name, found):
    ours, path, longer = (found[k] for k in ("default", "path", "longer"))
    percent = lambda r, key: f"{100 * r[key]:.2f}" if r[key] > LOST else "lost in noise"
    as_path = ours["raw"] == path["raw"]  # the default found that its cache would not pay
    return [name + " (as path)" * as_path, *(percent(r, "denoised") for r in (ours, path, longer)), *(percent(r, "raw") for r in (ours, path)),
            *(f"{100 * r['mean']:+.1f} ± {100 * r['mean_standard_error']:.1f}" for r in (ours, path)),
            *(f"{r['seconds']:.1f}" for r in (ours, path, longer)), f"{found['sooner']:.2f}" if found["sooner"] else "-"]


def parser():
    p = argparse.ArgumentParser(prog="made_rooms", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commas = lambda kind: lambda text: [kind(part) for part in text.split(",")]
    p.add_argument("--scenes", type=commas(str), default=list(KINDS), help=f"kinds, with commas between, of {', '.join(KINDS)} [all]")
    p.add_argument("--variant", type=int, default=1, help="any number: moves furniture, lamps, sizes, colours, patterns [1]")
    p.add_argument("--size", default="240x135")
    p.add_argument("--samples", type=int, default=16, help="S, a pixel")
    p.add_argument("--seeds", type=commas(int), default=[1, 2], help="two and more")
    p.add_argument("--reference-samples", type=int, default=256, help="of each half")
    p.add_argument("--write", metavar="FOLDER", help="only write the scenes there")
    p.add_argument("--keep", metavar="FOLDER", help="keep the pictures there")
    p.add_argument("--options", nargs=argparse.REMAINDER, default=[], help="last: more for the default, such as --radiosity-cache on")
    return p


def parsed(arguments):
    p = parser()
    o = p.parse_args(arguments)
    for kind in o.scenes:
        if kind not in KINDS:
            p.error(f"no kind {kind}; there are {', '.join(KINDS)}")
    if len(o.seeds) < 2:
        p.error("standard errors need two seeds")
    return o


def bench(context, arguments=()):
    try:
        from equal_time import BOUNCES, geometric
        import reprojection
    except ImportError as error:
        raise common.Skip(f"{error} (packages python3-numpy and python3-openimageio)")
    o = parsed(arguments)
    o.context, o.program, o.threads = context, context.program("dapple"), context.threads
    rows, result = [], {}
    with tempfile.TemporaryDirectory() as folder:
        o.images = Path(o.keep or folder)
        o.images.mkdir(parents=True, exist_ok=True)
        for kind in o.scenes:
            scene = write(context.out / "made_rooms", kind, o.variant)
            result[kind] = measure(o, scene)
            rows.append(row(kind, result[kind]))
            print(*rows[-1], sep=" | ", flush=True)
    sooner = [r["sooner"] for r in result.values() if r["sooner"]]
    beyond = [k for k, r in result.items() if abs(r["default"]["mean"]) > .015 + r["default"]["mean_standard_error"]]
    header = ["scene", "denoised: default", "path", f"path, {4 * o.samples}", "raw: default", "path", "mean: default", "path", "seconds: default", "path", f"path, {4 * o.samples}", "times sooner"]
    text = (f"Variant {o.variant}, {o.size}, {o.samples} samples, {BOUNCES} bounces, seeds {', '.join(map(str, o.seeds))}, against halves of {o.reference_samples} samples. Display errors and "
            "means in %, seconds of processors.\n\n" + common.table(header, rows))
    if sooner:
        text += f"\n\nGeometric mean: **{geometric(sooner):.2f}** times sooner; the least {min(sooner):.2f}."
    text += f" Means off by more than 1.5 % and their standard error: {', '.join(beyond) or 'none'}."
    return {"variant": o.variant, "size": o.size, "samples": o.samples, "seeds": o.seeds, "reference_samples": o.reference_samples, "scenes": result}, text


def main():
    o = parsed(sys.argv[1:])
    if not o.write:
        parser().error("bench/run.py made_rooms measures; this writes scenes: --write FOLDER")
    for kind in o.scenes:
        print(write(o.write, kind, o.variant))


if __name__ == "__main__":
    sys.exit(main())
