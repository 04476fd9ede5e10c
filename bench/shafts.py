# SPDX-License-Identifier: Apache-2.0
"""Light that haze scatters from sun and lamps to the camera, by scan planes and by random flights with shadow rays: time of a query and of the tables,
processor time to one error, the error of the air alone, what haze adds to a frame, how it grows with trees, flicker under a moving camera."""
import argparse
import itertools
import json
import math
import re

import common

HAZE = ('MakeNamedMedium "haze" "string type" "exponential" "float scaleheight" 12 "rgb sigma_a" [ .001 .001 .001 ] '
        '"rgb sigma_s" [ .012 .012 .012 ] "float g" .5\nMediumInterface "" "haze"\n')
PLANES, RAYS = (4, 16, 64), 64  # camera samples
REFERENCE = 128  # of the picture by fine planes, in each of two of other seeds, whose noise is taken off
FRAME, FRAME_REFERENCE = (4, 16), 64  # of a whole frame, and of the same by rays in each of two
FINE = 6, 4096  # planes for each, and bins, that stand for exact light
DEPTHS = .5, 2  # optical, from the eye to the far side of the stand, at the eye's height
REFERENCE_SIZE, REFERENCE_RAYS, REFERENCE_PLANES = "96x54", 2048, 64  # samples; of each of two references
STEPS, FRAMES = 0.06, 4  # m a frame of the move
STAND = 90  # m, the side of the stand
MOST_TEXT = 20000  # trees


def haze_of_depth(depth, length=63, height=1.7, scale=12):
    sigma = depth / length * math.exp(height / scale)
    a, b = f"{.1 * sigma:.6g}", f"{.9 * sigma:.6g}"
    return (f'MakeNamedMedium "haze" "string type" "exponential" "float scaleheight" {scale} "rgb sigma_a" [ {a} {a} {a} ] '
            f'"rgb sigma_s" [ {b} {b} {b} ] "float g" .5\nMediumInterface "" "haze"\n')


def forest_text(trees=None):
    folder = common.ROOT.parent / "shared/scenes/forest"
    forest = folder / "forest-inside.pbrt"
    if not forest.exists():
        raise common.Skip(f"{forest} is absent")
    text = re.sub(r'"string filename" \[ "(\w+\.ply)" \]', lambda m: f'"string filename" [ "{folder / m[1]}" ]', forest.read_text())
    return text if trees is None else with_trees(text, trees)  # and those that files place


def with_trees(text, count):
    """The same stand, continued all around by copies of its trees; more than are text by files of placements."""
    tree = r"AttributeBegin\n  Translate (\S+) (\S+) 0 (.*)\n(.*)\nAttributeEnd\n"
    found = re.findall(tree, text)
    rings = math.ceil(math.sqrt(count / len(found)) / 2)
    places = sorted(itertools.product(range(-rings, rings + 1), repeat=2), key=lambda p: max(map(abs, p)))
    if count > MOST_TEXT:
        return re.sub(tree, "", text), [(d, float(a) + STAND * x, float(b) + STAND * y, c) for x, y in places for a, b, c, d in found][:count]
    trees = [f"AttributeBegin\n  Translate {float(a) + STAND * x:g} {float(b) + STAND * y:g} 0 {c}\n{d}\nAttributeEnd\n" for x, y in places for a, b, c, d in found]
    return re.sub(tree, "", text) + "".join(trees[:count]), []


def placed(air, trees):
    """Directives that place these trees by files."""
    text = ""
    for k, kind in enumerate(sorted({d for d, *_ in trees})):
        lines, binary = air.context.out / f"shafts_{k}.txt", air.context.out / f"shafts_{k}.places"
        numbers = (re.findall(r"(?:Rotate|Scale) (\S+)", c) for d, *_, c in trees if d == kind)
        lines.write_text("".join(f"{x:.9g} {y:.9g} 0 {turn} {scale}\n" for (_, x, y, _), (turn, scale) in zip((t for t in trees if t[0] == kind), numbers)))
        common.run([air.context.program("dapple"), "places", "pack", lines, "-o", binary])
        text += kind.strip().replace("ObjectInstance ", "ObjectInstances ") + f' "string filename" "{binary}"\n'
    return text


def air_alone(source):
    """The scene with haze, black surfaces and no sky: all that is left is sunlight in the air."""
    source = re.sub(r'LightSource "infinite".*\n', "", source)
    source = re.sub(r'"rgb (reflectance|transmittance)" \[[^\]]*\]', r'"rgb \1" [ 0 0 0 ]', source)
    return HAZE + source


class Air:
    """Renders air alone."""

    def __init__(self, context):
        self.context, self.size = context, getattr(context, "size", "192x108")

    def scene(self, name, text):
        path = self.context.out / f"shafts_{name}.pbrt"
        path.write_text(text)
        return path

    def render(self, scene, name, shafts, samples, *more, repeats=None):
        """The picture, and the processor seconds of rendering and of what is before: tables among it."""
        image = self.context.out / f"shafts_{name}.exr"
        options = ["--integrator", "path", "--resolution", self.size, "--float", "--threads", 1, "--light-learning", "off", "--bounces", 0,
                   "--specular-depth", 0, "--light-shafts", shafts, "--pixel-samples", samples]
        options += ["--shaft-scattering", "single"] if shafts == "scan-planes" else []
        found = [common.render(self.context, scene, image, *options, *more) for _ in range(repeats or self.context.repeats)]
        return image, common.median([f["render_cpu_seconds"] for f in found]), common.median([f["cpu_seconds"] - f["render_cpu_seconds"] for f in found]), found[-1]

    def exact(self, scene):
        """The same camera rays as 4 samples have, with fine planes; and how many planes there are by default."""
        _, _, _, stats = self.render(scene, "coarse", "scan-planes", 4, repeats=1)
        planes = stats["shafts"]["planes"]
        image, *_ = self.render(scene, "fine", "scan-planes", 4, "--shaft-planes", FINE[0] * planes, "--shaft-bins", FINE[1], "--shaft-mb", 4096, repeats=1)
        return image, planes


def queries(context):
    text = common.run([context.program("bench_shafts"), f"--benchmark_repetitions={context.repeats}", "--benchmark_min_time=0.05", "--benchmark_format=json"])
    times = {}
    for run in json.loads(text)["benchmarks"]:
        if run["run_type"] == "iteration":
            times.setdefault(run["name"].split("/")[1], []).append(run["cpu_time"] / 1000)
    medians = {name: common.median(values) for name, values in times.items()}
    return medians, common.table(["query", "us"], [[name, f"{us:.2f}"] for name, us in medians.items()])


def to_one_percent(air):
    scene = air.scene("forest", air_alone(forest_text()))
    _, planes = air.exact(scene)
    pair = [air.render(scene, f"reference_{seed}", "scan-planes", REFERENCE, "--seed", seed, "--shaft-planes", FINE[0] * planes, "--shaft-bins", FINE[1], "--shaft-mb", 4096,
                       repeats=1)[0] for seed in (7, 8)]
    image, seconds, loading, _ = air.render(scene, "rays", "rays", RAYS)
    error, blocks, mean = common.compare_without_noise(air.context, image, pair)
    # Errors of random flights fall with the root of their number.
    result = {"rays": {"samples": RAYS, "seconds": seconds, "rmse": error, "blocks": blocks, "mean": mean, "to_1_percent": seconds * (error / 0.01) ** 2}}
    rows = [[f"rays, {RAYS}", f"{seconds:.2f} s", "", f"{100 * error:.2f} %", f"{100 * blocks:.2f} %", f"{100 * mean:+.2f} %", ""]]
    for samples in PLANES:
        image, seconds, before, stats = air.render(scene, f"planes_{samples}", "scan-planes", samples)
        tables = max(before - loading, 0)
        error, blocks, mean = common.compare_without_noise(air.context, image, pair)
        by_rays = result["rays"]["to_1_percent"] * (0.01 / error) ** 2
        shafts = stats["shafts"]
        result[f"planes {samples}"] = {"samples": samples, "seconds": seconds, "of_tables": tables, "rmse": error, "blocks": blocks, "mean": mean, "by_rays": by_rays,
                                       "query_us": 1e6 * shafts["query_seconds"] / shafts["queries"], "planes": shafts["planes"]}
        rows.append([f"planes, {samples}", f"{seconds + tables:.2f} s", f"{tables:.2f} s", f"{100 * error:.2f} %", f"{100 * blocks:.2f} %", f"{100 * mean:+.2f} %",
                     f"{by_rays / (seconds + tables):.0f}"])
    return result, common.table(["light in the air, samples", "processor time", "of tables", "RMSE", "8 x 8 blocks", "mean", "times sooner than rays"], rows)


def same_rays(air):
    """The error of planes and bins, for the same camera rays: without that of pixels sampled at the edges of leaves."""
    scene = air.scene("forest", air_alone(forest_text()))
    exact, planes = air.exact(scene)
    result, rows = {}, []
    for name, options in {"default": [], "half the planes": ["--shaft-planes", planes // 2], "half the bins": ["--shaft-bins", 512]}.items():
        image, *_ = air.render(scene, "coarse", "scan-planes", 4, *options, repeats=1)
        error, blocks, mean = common.compare(air.context, image, exact)
        result[name] = {"rmse": error, "blocks": blocks, "mean": mean}
        rows.append([name, f"{100 * error:.2f} %", f"{100 * blocks:.2f} %", f"{100 * mean:+.2f} %"])
    return result, common.table(["planes, 4 samples, same camera rays", "RMSE", "8 x 8 blocks", "mean"], rows)


def tables_and_trees(air):
    result, rows = {}, []
    for trees in (200, 20000, 1000000):
        text, by_files = forest_text(trees)
        scene = air.scene("trees", air_alone(text) + placed(air, by_files))
        _, seconds, before, stats = air.render(scene, "trees", "scan-planes", 4, "--shaft-planes", 3000, repeats=1)
        s = stats["shafts"]
        result[trees] = {"fill_seconds": s["fill_seconds"], "rays": stats["rays"]["shaft"], "render_seconds": seconds, "before": before, "query_us": 1e6 * s["query_seconds"] / s["queries"]}
        rows.append([trees, f"{s['planes']} x {s['bins']}", f"{s['fill_seconds']:.2f} s", f"{result[trees]['query_us']:.2f} us", f"{seconds:.2f} s",
                     f"{seconds + before:.2f} s"])
    return result, common.table(["trees", "planes x rays", "filled in", "a query", "4 samples", "whole command"], rows)


def frames(air):
    """A whole frame with haze against the frame without."""
    text = forest_text()
    options = ["--integrator", "path", "--resolution", air.size, "--threads", 1, "--pixel-samples", 16, "--light-learning", "off"]
    cases = {"no haze": (text, []), "single": (HAZE + text, ["--light-shafts", "scan-planes", "--shaft-scattering", "single"]),
             "all": (HAZE + text, ["--light-shafts", "scan-planes"]), "rays": (HAZE + text, ["--light-shafts", "rays"])}
    result, rows = {}, []
    for name, (source, more) in cases.items():
        scene = air.scene("frame", source)
        found = [common.render(air.context, scene, air.context.out / "shafts_frame.exr", *options, *more) for _ in range(air.context.repeats)]
        result[name] = common.median([f["cpu_seconds"] for f in found])
        rows.append([name, f"{result[name]:.2f} s", f"{result[name] / result['no haze']:.2f}"])
    return result, common.table(["frame, 16 samples", "processor time", "of that without haze"], rows)


def equal_time(air):
    """A whole frame in haze, all scatterings: errors by planes and by rays against two pictures by rays, and processor time to the same error."""
    scene = air.scene("frame", HAZE + forest_text())
    options = ["--resolution", air.size, "--light-learning", "off"]
    pair = common.path_traced(air.context, "shafts_frame_reference", scene, *options, "--light-shafts", "rays", "--pixel-samples", FRAME_REFERENCE, seeds=(7, 8))
    result, rows = {}, []
    for (name, shafts), samples in itertools.product((("rays", "rays"), ("planes", "scan-planes")), FRAME):
        image = air.context.out / f"shafts_frame_{name}_{samples}.exr"
        seconds = common.render(air.context, scene, image, "--integrator", "path", "--float", "--threads", 1, *options, "--light-shafts", shafts, "--pixel-samples", samples)["cpu_seconds"]
        error, blocks, mean = common.compare_without_noise(air.context, image, pair)
        result[f"{name} {samples}"] = {"seconds": seconds, "rmse": error, "blocks": blocks, "mean": mean}
        rows.append([f"{name}, {samples}", f"{seconds:.2f} s", f"{100 * error:.2f} %", f"{100 * blocks:.2f} %", f"{100 * mean:+.2f} %"])
    for samples in FRAME:
        r, p = result[f"rays {samples}"], result[f"planes {samples}"]
        result[f"sooner {samples}"] = r["seconds"] / p["seconds"] * (r["rmse"] / p["rmse"]) ** 2
    text = common.table(["frame in haze, samples", "processor time", "RMSE", "8 x 8 blocks", "mean"], rows)
    sooner = " and ".join(f"{result[f'sooner {samples}']:.1f}" for samples in FRAME)
    return result, f"{text}\n\nThe same error {sooner} times sooner (from {' and '.join(map(str, FRAME))} samples)."


def flicker(air):
    """How the error changes from frame to frame: by a reference of each frame, which moves as the picture does."""
    import numpy as np
    import OpenImageIO as oiio

    def pixels(path):
        return oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)[..., :3].mean(axis=-1)

    text, errors, mean = air_alone(forest_text()), [], 0
    for f in range(FRAMES):
        moved = re.sub(r"^LookAt .*$", f"LookAt {STEPS * f:g} -18 1.7  {3 + STEPS * f:g} 10 3.2  0 0 1", text, flags=re.M)
        scene = air.scene("move", moved)
        few, *_ = air.render(scene, "move_few", "scan-planes", 4, repeats=1)
        same, _ = air.exact(scene)
        a, b = pixels(few), pixels(same)
        errors.append(a - b)
        mean = b.mean()
    change = np.diff(np.stack(errors), axis=0)
    height, width = change.shape[1] // 8 * 8, change.shape[2] // 8 * 8
    blocks = change[:, :height, :width].reshape(len(change), height // 8, 8, width // 8, 8).mean(axis=(2, 4))
    result = {"pixels": float(np.sqrt((change**2).mean()) / mean), "blocks": float(np.sqrt((blocks**2).mean()) / mean)}
    return result, (f"Flicker of the air, 4 samples, {FRAMES} frames, against exact light along the same camera rays: pixels {100 * result['pixels']:.2f} %, "
                    f"8 x 8 blocks {100 * result['blocks']:.2f} % RMS from frame to frame.")


def marching(air):
    """By planes and by marching with 128 shadow rays a sample, along the same camera rays."""
    width, height = air.size.split("x")
    scene = air.scene("forest", air_alone(forest_text()))
    result, rows = {}, []
    for samples in (4, 16):
        found = json.loads(common.run([air.context.program("bench_shaft_marching"), scene, "--samples", samples, "--width", width, "--height", height]))
        result[samples] = found
        p, m = found["planes"], found["marching"]
        rows.append([samples, f"{p['seconds']:.2f} s", f"{100 * p['rmse']:.2f} %", f"{m['seconds']:.1f} s", f"{100 * m['rmse']:.2f} %", f"{found['times']:.0f}"])
    return result, common.table(["samples", "planes", "RMSE", "marching", "RMSE", "times the time"], rows)


def references(air):
    """Whole pictures by planes, all scatterings, against two by rays, which are kept: what differs beyond their noise."""
    import numpy as np
    import OpenImageIO as oiio

    def blocks(path):
        p = oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)[..., :3].astype(float)
        h, w = p.shape[0] // 16 * 16, p.shape[1] // 16 * 16
        return p.mean(axis=(0, 1)), p[:h, :w].reshape(h // 16, 16, w // 16, 16, 3).mean(axis=(1, 3))

    result, rows = {}, []
    for depth in DEPTHS:
        scene = air.scene(f"depth_{depth:g}", haze_of_depth(depth) + forest_text())
        frame = ["--resolution", REFERENCE_SIZE, "--light-learning", "off"]
        pair = common.path_traced(air.context, f"shafts_reference_{depth:g}", scene, *frame, "--light-shafts", "rays", "--pixel-samples", REFERENCE_RAYS)
        by_planes = [air.context.out / f"shafts_depth_{depth:g}_{seed}.exr" for seed in (3, 4)]
        for seed, image in enumerate(by_planes, 3):
            common.render(air.context, scene, image, "--integrator", "path", "--float", *frame, "--light-shafts", "scan-planes", "--pixel-samples", REFERENCE_PLANES, "--seed", seed)
        (a, a_blocks), (b, b_blocks), (x, x_blocks), (_, y_blocks) = map(blocks, pair + by_planes)
        mean, size = (a + b) / 2, np.sqrt(((a_blocks + b_blocks) ** 2 / 4).mean())
        noise = np.sqrt(((a_blocks - b_blocks) ** 2).mean() / 4) / size
        seen = np.sqrt(((x_blocks - (a_blocks + b_blocks) / 2) ** 2).mean()) / size
        error = math.sqrt(max(seen**2 - noise**2, 0))
        bias = math.sqrt(max(((x_blocks - a_blocks) * (y_blocks - b_blocks)).mean(), 0)) / size  # of pictures without noise
        result[depth] = {"bias_of_blocks": bias, "means": list((x - mean) / mean), "noise_of_means": list(abs(a - b) / 2 / mean), "blocks": error, "noise_of_blocks": noise}
        rows.append([f"{depth:g}", ", ".join(f"{100 * e:+.2f}" for e in (x - mean) / mean) + " %", ", ".join(f"{100 * e:.2f}" for e in abs(a - b) / 2 / mean) + " %",
                     f"{100 * error:.2f} %", f"{100 * bias:.2f} %", f"{100 * noise:.2f} %"])
    return result, common.table([f"optical depth, {REFERENCE_PLANES} samples by planes", f"means, of 2 x {REFERENCE_RAYS} by rays", "noise of these", "16 x 16 blocks", "without the planes' noise", "noise of the rays'"], rows)


PARTS = {"queries": queries, "to_one_percent": to_one_percent, "same_rays": same_rays, "trees": tables_and_trees, "frames": frames, "equal_time": equal_time, "flicker": flicker, "marching": marching, "references": references}


def bench(context, parts=tuple(PARTS)):
    air = Air(context)
    result, texts = {}, [f"forest-inside in haze, {air.size}; black surfaces and single scattering where the air is alone; one thread; tables included."]
    for name in parts:
        result[name], text = PARTS[name](context if name == "queries" else air)
        texts.append(text)
    return result, "\n\n".join(texts)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)} [all]")
    parser.add_argument("--size", default="192x108")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--build", default=common.ROOT / "build/release")
    parser.add_argument("--out", default=common.ROOT / "out/bench")
    o = parser.parse_args()
    context = common.Context(o.build, o.out, o.repeats, 1)
    context.size = o.size
    for part in o.parts or PARTS:
        print(bench(context, [part])[1], flush=True)


if __name__ == "__main__":
    main()
