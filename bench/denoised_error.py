# SPDX-License-Identifier: Apache-2.0
"""How well AOV error tells what error denoising leaves: root mean squares of both, each relative to the light around, over the whole picture and in
squares of 16 x 16 pixels. The true error is (x - a)(x - b) with two independent references a and b, whose noise then does not count.
DAPPLE_ERROR_SCENES, names with spaces between, chooses scenes, DAPPLE_ERROR_INTEGRATORS integrators; DAPPLE_ERROR_REFERENCE is the references'
samples. The factor of docs/design/041 was fitted to FITTED alone."""
import math
import os
import re
import tempfile
from pathlib import Path

import common
from clean import BALLS

SHARED = common.ROOT.parent / "shared/scenes"
SAMPLES, REFERENCE_SAMPLES, SQUARE = (8, 32, 128), 1024, 16
CORNELL, STAGE = common.ROOT / "scenes/cornell-box/cornell.pbrt", common.ROOT / "scenes/stage"
FITTED = {
    "cornell": (CORNELL, "96x96"), "bedroom": (SHARED / "bedroom/scene-v4.pbrt", "112x64"), "staircase2": (SHARED / "staircase2/scene-v4.pbrt", "64x112"),
    "kitchen": (SHARED / "kitchen/scene-v4.pbrt", "112x64")}
SCENES = FITTED | {
    "balls": (None, "96x64"), "copper": (STAGE / "material_conductor_copper.pbrt", "96x64"), "varnish": (STAGE / "material_coateddiffuse.pbrt", "96x64"),
    "lamps": (common.ROOT / "scenes/lamps/lamps.pbrt", "96x64"), "bust": (common.ROOT / "scenes/bust/bust.pbrt", "80x96"),
    "veach-mis": (SHARED / "veach-mis/scene-v4.pbrt", "112x64"), "living-room": (SHARED / "living-room/scene-v4.pbrt", "112x64"),
    "classroom": (SHARED / "classroom/scene-v4.pbrt", "112x64")}
FILTERS = ("triangle", "gaussian", "mitchell", "sinc")  # of two scenes, as SCENE-FILTER
SCENES |= {f"{scene}-{name}": SCENES[scene] for scene in ("cornell", "balls") for name in FILTERS}


def with_filter(text, name):
    return f'PixelFilter "{name}"\n' + re.sub(r'^PixelFilter.*\n', "", text, flags=re.M)


def file_of(scene, folder):
    """The file of one of SCENES, some of which are written here."""
    file, base, pixel_filter = SCENES[scene][0], *scene.partition("-")[::2]
    text = BALLS if base == "balls" else None
    if pixel_filter in FILTERS:
        text = with_filter(text or file.read_text(), pixel_filter)
    if text is None:
        return file
    file = folder / f"{scene}.pbrt"
    file.write_text(text)
    return file


def in_squares(values):
    """Means over squares that lie wholly in the picture."""
    h, w = (n // SQUARE for n in values.shape[:2])
    return values[:h * SQUARE, :w * SQUARE].reshape(h, SQUARE, w, SQUARE, -1).mean((1, 3, 4))


def calibration(told, true):
    """Ratios of root mean squares: of the whole; of squares the median, and the range of two thirds of them."""
    import numpy as np

    told_there, true_there = in_squares(told), in_squares(true)
    known = true_there > .02 * true_there.mean()  # elsewhere the references' noise decides
    ratios = np.sqrt(told_there[known] / true_there[known])
    return math.sqrt(told.mean() / max(true.mean(), 1e-30)), *np.quantile(ratios, (.5, 1 / 6, 5 / 6))


def bench(context):
    try:
        import numpy as np
        from reprojection import read_channels
    except ImportError as error:
        raise common.Skip(f"{error} (packages python3-numpy and python3-openimageio)")
    chosen = os.environ.get("DAPPLE_ERROR_SCENES", " ".join(SCENES)).split()
    reference_samples = int(os.environ.get("DAPPLE_ERROR_REFERENCE", REFERENCE_SAMPLES))
    integrators = os.environ.get("DAPPLE_ERROR_INTEGRATORS", "path distribution").split()
    rows, result = [], {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for scene in chosen:
            file, size = file_of(scene, folder), SCENES[scene][1]
            if not file.exists():
                continue
            options = ["--resolution", size, "--float"]
            references = [read_channels(common.kept_render(context, f"error_{scene}", file, "--integrator", "path", "--pixel-samples", reference_samples,
                                                           "--seed", seed, *options), "R", "G", "B") for seed in (1001, 1002)]
            for integrator in integrators:
                for samples in SAMPLES:
                    image = folder / "image.exr"
                    common.render(context, file, image, "--integrator", integrator, "--pixel-samples", samples, "--denoise", "on", "--aov", "error",
                                  *options, "--threads", context.threads, "--quiet")
                    x, told = read_channels(image, "R", "G", "B"), read_channels(image, "error")
                    noisy = read_channels(image, "noisy.R", "noisy.G", "noisy.B")
                    mean = np.mean(references, axis=(0, -1), keepdims=False)[..., None]
                    weight = 1 / (mean + .1 * np.median(mean)) ** 2
                    true = lambda y: weight * (y - references[0]) * (y - references[1])
                    ratio, median, low, high = calibration(weight * told ** 2, true(x))
                    rms = lambda y: math.sqrt(max(0, true(y).mean()))
                    rows.append([scene, integrator, str(samples), f"{100 * rms(noisy):.1f} %", f"{100 * rms(x):.1f} %", f"{ratio:.2f}",
                                 f"{median:.2f} ({low:.2f} to {high:.2f})"])
                    result[f"{scene}, {integrator}, {samples}"] = {"noisy": rms(noisy), "denoised": rms(x), "ratio": ratio, "median": median,
                                                                   "low": low, "high": high}
    header = ["scene", "integrator", "samples", "noise", "after denoising", "told / true", "in squares, and of two thirds of them"]
    return {"cases": result}, common.table(header, rows)
