# SPDX-License-Identifier: Apache-2.0
"""What the benchmarks share: running programs, medians, tables."""
import hashlib
import json
import math
import os
import platform
import re
import resource
import shutil
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
REFERENCE_VERSION = 1  # to be raised where path tracing gives other means than before: kept pictures are then made again


class Skip(Exception):
    """A benchmark that cannot run here, and why."""


class Context:
    """Where the programs and results are."""

    def __init__(self, build, out, repeats, threads):
        self.build, self.out, self.repeats, self.threads = Path(build), Path(out), repeats, threads
        self.out.mkdir(parents=True, exist_ok=True)

    def program(self, name):
        path = self.build / name
        if not path.exists():
            raise Skip(f"{path} is not built")
        return str(path)


def run(arguments, **options):
    """Runs a program and returns what it printed; shows that if it fails."""
    done = subprocess.run([str(a) for a in arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, arguments))}\nexit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def blender(script, *arguments):
    """Runs a script in Blender, which ends well whatever becomes of the script."""
    if not shutil.which("blender"):
        raise Skip("Blender is not installed (scripts/packages.sh lists it)")
    # It takes the libraries of the first Python that it finds, which should be the system's.
    found = run(["blender", "-b", "--factory-startup", "-P", ROOT / "bench" / script, "--", *arguments], env={**os.environ, "PATH": os.defpath})
    if "Error: Python" in found:
        raise RuntimeError(f"{script} in Blender:\n" + found[found.index("Error: Python"):][:4000])
    return found


def render(context, scene, image, *options):
    """Renders with dapple, as it is rendered unless --denoise is among the options, and returns its statistics."""
    if "--denoise" not in options:
        options += ("--denoise", "off")
    with tempfile.TemporaryDirectory() as folder:
        stats = Path(folder) / "stats.json"
        run([context.program("dapple"), "render", scene, "-o", image, "--stats", stats, *options])
        return json.loads(stats.read_text())


def timed(call):
    """What a call returns, and the wall seconds and processor seconds (user and system) that it and the programs it ran took."""
    def processor():
        return sum(u.ru_utime + u.ru_stime for u in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))

    wall, cpu = time.perf_counter(), processor()
    result = call()
    return result, time.perf_counter() - wall, processor() - cpu


def compare(context, image, reference):
    """(relative RMSE of pixels, of 8x8 blocks, largest error of a mean), the light and its edge left out."""
    found = json.loads(run([context.program("image_diff"), image, reference, "--times-median", 8, "--dilate", 2, "--block", 8, "--json"]))
    return found["relative_rmse"], found["block_rmse"], max(map(abs, found["mean_error"]))


def scene_digest(scene, base=None, seen=None):
    """Of the text of a scene and of all files that it names between quotes, relative to its folder; of those that end in .pbrt, of what they name
    too. What other files name (a glTF file its buffers and images, say) is not seen."""
    scene, seen = Path(scene), set() if seen is None else seen
    base, digest = base or scene.parent, hashlib.sha256()
    text = scene.read_bytes()
    digest.update(text)
    for name in sorted(set(re.findall(rb'"([^"\n]{1,255})"', text))):
        path = base / os.fsdecode(name)
        if not path.is_file() or path in seen:
            continue
        seen.add(path)
        digest.update(name + (scene_digest(path, base, seen).encode() if path.suffix == ".pbrt" else hashlib.sha256(path.read_bytes()).digest()))
    return digest.hexdigest()


def kept_render(context, stem, scene, *options, threads=None):
    """A picture of a scene by such options, rendered unless there is one of the same scene, options and REFERENCE_VERSION from an earlier time."""
    key = hashlib.sha256("\n".join([str(REFERENCE_VERSION), scene_digest(scene), *map(str, options)]).encode()).hexdigest()[:16]
    image = context.out / f"{stem}_{key}.exr"
    if not image.exists():
        under_way = context.out / f"{stem}_{key}_{os.getpid()}.exr"
        render(context, scene, under_way, "--threads", threads or context.threads, "--quiet", *options)
        under_way.rename(image)
    return image


def path_traced(context, name, scene, *options, seeds=(1, 2), threads=None):
    """Independent path-traced pictures, in floats; kept for the next time."""
    options = ("--integrator", "path", *options, *(() if "--float" in options else ("--float",)))
    return [kept_render(context, name, scene, *options, "--seed", seed, threads=threads) for seed in seeds]


def path_traced_pair(context, scene, size, bounces, samples):
    return path_traced(context, f"{scene.stem}_path", scene, "--resolution", f"{size}x{size}", "--bounces", bounces, "--pixel-samples", samples)


def compare_without_noise(context, image, pair):
    """The same as compare() against what two noisy pictures a and b are of: (x - a)(x - b) = ((x - a)^2 + (x - b)^2 - (a - b)^2) / 2."""
    a, b, between = compare(context, image, pair[0]), compare(context, image, pair[1]), compare(context, *pair)
    rmse, block = (max(0, (a[i] ** 2 + b[i] ** 2 - between[i] ** 2) / 2) ** 0.5 for i in (0, 1))
    return rmse, block, (a[2] + b[2]) / 2


def best(settings):
    """Of (error, seconds) of settings those that no other beats in both, by falling error."""
    kept = []
    for error, seconds in sorted(settings):
        if not kept or seconds < kept[-1][1]:
            kept.append((error, seconds))
    return kept[::-1]


def seconds_to(error, settings):
    """Time to an error by settings of (error, seconds): between the best of them, on straight lines in log-log; None outside them."""
    curve = best(settings)
    for (e0, t0), (e1, t1) in zip(curve, curve[1:]):
        if e1 <= error <= e0:
            return t0 * (t1 / t0) ** (math.log(e0 / error) / math.log(e0 / e1))
    return curve[0][1] if curve and curve[0][0] == error else None


def median(values):
    return statistics.median(values)


def spread(values):
    """Half the range relative to the median: how far to trust it."""
    return (max(values) - min(values)) / 2 / statistics.median(values)


def machine():
    model = platform.processor() or platform.machine()
    try:
        for line in open("/proc/cpuinfo"):
            if line.startswith("model name"):
                model = line.split(":", 1)[1].strip()
                break
    except OSError:
        pass
    return f"{model}, {os.cpu_count()} processors"


def table(header, rows):
    """A Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    lines += ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines)
