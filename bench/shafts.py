# SPDX-License-Identifier: Apache-2.0
"""Light that haze scatters from the sun to the camera in a forest, by scan planes and by random flights with shadow rays: processor time to one error."""
import re

import common

SAMPLES = {"planes, 4 samples": ("scan-planes", 4), "planes, 16 samples": ("scan-planes", 16), "rays, 64 samples": ("rays", 64)}
REFERENCE = 256  # samples by planes; by rays 4 million would be as good
HAZE = ('MakeNamedMedium "haze" "string type" "exponential" "float scaleheight" 12 "rgb sigma_a" [ .001 .001 .001 ] '
        '"rgb sigma_s" [ .012 .012 .012 ] "float g" .5\nMediumInterface "" "haze"\n')


def air_alone(source):
    """The scene with haze, black surfaces and no sky: all that is left is sunlight in the air."""
    source = re.sub(r'LightSource "infinite".*\n', "", source)
    source = re.sub(r'"rgb (reflectance|transmittance)" \[[^\]]*\]', r'"rgb \1" [ 0 0 0 ]', source)
    return HAZE + source


def bench(context):
    forest = common.ROOT.parent / "shared/scenes/forest/forest-inside.pbrt"
    if not forest.exists():
        raise common.Skip(f"{forest} is absent")
    scene = context.out / "shafts.pbrt"
    scene.write_text(re.sub(r'"string filename" \[ "(\w+\.ply)" \]', lambda m: f'"string filename" [ "{forest.parent / m[1]}" ]',
                            air_alone(forest.read_text())))
    size = "192x108" if getattr(context, "quick", False) else "960x540"
    options = ["--integrator", "path", "--resolution", size, "--float", "--threads", 1, "--light-learning", "off", "--bounces", 0, "--specular-depth", 0]

    def render(name, shafts, samples):
        image = context.out / f"shafts_{name.replace(', ', '_').replace(' ', '_')}.exr"
        more = ["--shaft-scattering", "single"] if shafts == "scan-planes" else []
        seconds = []
        for _ in range(context.repeats):
            found = common.render(context, scene, image, *options, *more, "--light-shafts", shafts, "--pixel-samples", samples)
            seconds.append((found["render_cpu_seconds"], found["cpu_seconds"] - found["render_cpu_seconds"]))
        # Of the process: what it does before it renders, planes' tables among it.
        return image, common.median([r for r, _ in seconds]), common.median([b for _, b in seconds])

    reference, _, _ = render("reference", "scan-planes", REFERENCE)
    result, rows = {}, []
    runs = {name: render(name, *how) for name, how in SAMPLES.items()}
    loading = min(before for name, (_, _, before) in runs.items() if SAMPLES[name][0] == "rays")
    for name, (shafts, samples) in SAMPLES.items():
        image, seconds, before = runs[name]
        tables = max(before - loading, 0) if shafts == "scan-planes" else 0
        seconds += tables
        error, blocks, mean = common.compare(context, image, reference)
        # Errors of random flights fall with the root of their number; those of planes are of their width as well.
        to_one = seconds * (error / 0.01) ** 2 if shafts == "rays" else None
        result[name] = {"cpu_seconds": seconds, "of_tables": tables, "rmse": error, "blocks": blocks, "mean": mean, "seconds_to_1_percent": to_one}
        rows.append([name, f"{seconds:.2f} s", f"{100 * error:.2f} %", f"{100 * blocks:.2f} %", f"{100 * mean:+.2f} %",
                     f"{to_one:.0f} s" if to_one else ""])
    return result, (f"forest-inside in haze, {size}, black surfaces, single scattering, one thread, tables included where planes are filled.\n\n"
                    + common.table(["light in the air", "processor time", "RMSE", "8 x 8 blocks", "mean", "time to 1 % RMSE"], rows))
