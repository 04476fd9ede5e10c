#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A light mixer: renders a scene once, with each group of lights as a layer, and makes a strip of pictures by weights.

    light_mixer.py scenes/lamps/lamps.pbrt -o strip.png
"""
import argparse
import os

import numpy as np

import dapple

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("scene", nargs="?", default=os.path.join(os.path.dirname(__file__), "../../scenes/lamps/lamps.pbrt"))
parser.add_argument("-o", "--output", default="strip.png")
parser.add_argument("--resolution", default="240x180")
parser.add_argument("--samples", type=int, default=16)
options = parser.parse_args()

scene = dapple.load(options.scene)
lights = list(scene.lights.values())
if len(scene.lights) > 1 and not any(hasattr(light, "group") for light in lights):
    for k, light in enumerate(lights):  # the scene has no groups: its lights in up to four
        light["string group"] = f"part{k * min(len(lights), 4) // len(lights) + 1}"
session = dapple.Session(scene, preset="preview", pixel_samples=options.samples, light_groups=True, denoise=True,
                         resolution=tuple(int(n) for n in options.resolution.split("x")))
whole = session.render()
groups = {name: layer for name, layer in session.aovs.items() if name.startswith("light.") and layer.any()}
np.testing.assert_allclose(sum(groups.values()), whole, rtol=1e-3, atol=1e-4)  # light is linear

# The picture, then each group alone with the rest at a tenth.
strip = [whole] + [layer + 0.1 * (whole - layer) for layer in groups.values()]
dapple.write(options.output, np.concatenate(strip, axis=1))
print(f"{options.output}: as it is, then " + ", ".join(name.removeprefix("light.") for name in groups))
