# SPDX-License-Identifier: Apache-2.0
"""How much the light of surface points changes from frame to frame of a moving camera: points of one frame are found again in the next by
their position. NumPy arrays, images as (height, width, channels); world positions, normals and albedos from the AOVs of `dapple render`."""
from types import SimpleNamespace

import numpy as np


class Camera:
    """A perspective camera of pbrt: LookAt, after a Scale -1 1 1 where mirrored; fov in degrees over the shorter side."""

    def __init__(self, eye, look, up, fov, width, height, mirrored=False):
        self.eye = np.asarray(eye, float)
        self.forward = unit(np.asarray(look, float) - self.eye)
        self.right = unit(np.cross(up, self.forward))
        self.up = np.cross(self.forward, self.right)
        if mirrored:
            self.right = -self.right
        self.width, self.height = width, height
        self.pixel = 2 * np.tan(np.radians(fov) / 2) / min(width, height)  # width of a pixel at depth 1

    def project(self, points):
        """World points (..., 3) -> x and y in pixels, (0.5, 0.5) in the middle of the first, and depth along the axis."""
        d = points - self.eye
        depth = d @ self.forward
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = (d @ self.right) / (depth * self.pixel), (d @ self.up) / (depth * self.pixel)
        return self.width / 2 + x, self.height / 2 - y, depth


def write_pixels(path, spec, pixels):
    import OpenImageIO as oiio

    out = oiio.ImageOutput.create(str(path))
    if not out or not out.open(str(path), spec) or not out.write_image(pixels):
        raise RuntimeError(f"{path} could not be written")
    out.close()


def read_channels(path, *names):
    """Channels of an image as an array of doubles."""
    import OpenImageIO as oiio

    image = oiio.ImageInput.open(str(path))
    if not image:
        raise RuntimeError(oiio.geterror())
    spec, pixels = image.spec(), image.read_image("float")
    image.close()
    return pixels.reshape(spec.height, spec.width, -1)[..., [spec.channelnames.index(n) for n in names]].astype(float)


def unit(v):
    return v / np.linalg.norm(v)


def corners(x, y, width, height):
    """The four pixels around places in an image: (rows, columns, weights) of each, and whether all four lie in it."""
    x, y = np.nan_to_num(x, nan=-9) - 0.5, np.nan_to_num(y, nan=-9) - 0.5
    inside = (x >= 0) & (y >= 0) & (x <= width - 1) & (y <= height - 1)
    i, j = np.clip(x.astype(int), 0, width - 2), np.clip(y.astype(int), 0, height - 2)
    u, v = x - i, y - j
    return [(j + b, i + a, (u if a else 1 - u) * (v if b else 1 - v)) for b in (0, 1) for a in (0, 1)], inside


def found_again(seen, frame, tolerance=0.25):
    """The light that `frame` (camera, position, normal, albedo, light) shows at the points that the frame `seen` shows, bilinear, and where it
    does: where the four pixels around lie within `tolerance` pixels of the point's tangent plane and have its albedo. So nothing is compared
    across the edge of an object or a material, nor what is hidden."""
    x, y, depth = frame.camera.project(seen.position)
    around, there = corners(x, y, frame.camera.width, frame.camera.height)
    there = there & (depth > 0) & (np.linalg.norm(seen.normal, axis=-1) > 0.9)
    value = np.zeros_like(seen.light)
    for row, column, weight in around:
        off = np.abs(np.sum((frame.position[row, column] - seen.position) * seen.normal, axis=-1))
        there &= off < tolerance * frame.camera.pixel * depth
        there &= np.abs(frame.albedo[row, column] - seen.albedo).max(axis=-1) < 0.01
        value += weight[..., None] * frame.light[row, column]
    return value, there


def temporal_variation(frames):
    """Of frames (camera, position, normal, albedo, light): the noise that changes from frame to frame, relative to the mean light.

    The second difference v(k-1) - 2 v(k) + v(k+1) of a point's light leaves out what changes slowly, as a view's level of detail may, and
    keeps boiling and popping; it is divided by sqrt(6), so that noise independent from frame to frame is given as its own standard deviation.
    `pairs` are the RMS of the differences of frames that follow each other, over sqrt(2), `points` the share of pixels that could be compared.
    `maps`, of the first pair, is that difference in place."""
    mean = np.mean([f.light.mean() for f in frames])
    squares = count = asked = 0
    pairs, first = [], None
    for k, frame in enumerate(frames[:-1]):
        after, there = found_again(frame, frames[k + 1])
        change = np.where(there[..., None], after - frame.light, 0)
        first = change if first is None else first
        pairs.append(float(np.sqrt(np.mean(change[there] ** 2) / 2) / mean))
        if k == 0:
            continue
        before, also = found_again(frame, frames[k - 1])
        there &= also
        second = (before - 2 * frame.light + after)[there]
        squares += np.sum(second**2)
        count += second.size
        asked += there.size * second.shape[-1]
    return SimpleNamespace(noise=float(np.sqrt(squares / count / 6) / mean), pairs=pairs, points=count / asked, map=first / mean)
