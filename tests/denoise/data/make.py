#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""make.py NUMPY_TOOL: makes noisy.exr (a pattern with noise, 77 x 45 pixels, no multiple of 16) and expected.exr, what the weights
data/denoise/rt_hdr_alb_nrm.tza make of it in NUMPY_TOOL, an implementation of the network in numpy (WEIGHTS IN OUT)."""
import pathlib, subprocess, sys
import numpy as np, OpenImageIO as oiio
here = pathlib.Path(__file__).resolve().parent
w, h, r = 77, 45, np.random.default_rng(1)
y, x = np.mgrid[:h, :w]
albedo = np.stack([.2 + .6*((x//11 + y//9) % 2), .5 + 0*x, .3 + .4*((x//20) % 2)], -1)
z = np.clip(1 - ((x - 38)**2 + (y - 22)**2)/900, .05, 1)
normal = np.stack([(x - 38)/40*(1 - z), (y - 22)/40*(1 - z), z], -1)
colour = albedo*(.2 + 2*z[..., None])*r.gamma(2, .5, (h, w, 1))
colour[5, 7] = 500
names = ("R", "G", "B", "albedo.R", "albedo.G", "albedo.B", "normal.X", "normal.Y", "normal.Z")
spec = oiio.ImageSpec(w, h, 9, oiio.FLOAT); spec.channelnames = names
image = oiio.ImageBuf(spec)
image.set_pixels(oiio.ROI(), np.concatenate([colour, albedo, normal], -1).astype(np.float32)); image.write(str(here/"noisy.exr"))
subprocess.run([sys.executable, sys.argv[1], here/"../../../data/denoise/rt_hdr_alb_nrm.tza", here/"noisy.exr", here/"expected.exr"], check=True)
