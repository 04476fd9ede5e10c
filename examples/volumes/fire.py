#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes fire and smoke as a NanoVDB file, for the medium `nanovdb`: grids `density` and `temperature` from NumPy arrays.

Usage: fire.py OUT.nvdb
nvdb_grid() and nvdb_file() serve for other arrays as well. (scenes/stage/parts/fire.nvdb was made by this.)
"""
import struct
import sys
import zlib

import numpy as np


def nvdb_grid(name, values, voxel, origin):
    """A grid of format version 32: values[x, y, z], at most 4096 along an axis; voxels that are not 0 are active."""
    values = np.ascontiguousarray(values, np.float32)
    size = [-(-n // 8) for n in values.shape]
    values = np.pad(values, [(0, 8 * s - n) for s, n in zip(size, values.shape)])
    leaves = values.reshape(size[0], 8, size[1], 8, size[2], 8).transpose(0, 2, 4, 1, 3, 5).reshape(*size, 512)
    at = np.argwhere(leaves.any(axis=-1))  # blocks of 8^3
    lowers = np.unique(at >> 4, axis=0)  # of 16^3 blocks
    header, root, upper_bytes, lower_bytes, leaf_bytes = 736, 96, 270400, 33856, 2144
    upper_at = header + root
    lower_at = upper_at + upper_bytes
    leaf_at = lower_at + lower_bytes * len(lowers)
    out = bytearray(leaf_at + leaf_bytes * len(at))
    struct.pack_into("<QQIIIIQ", out, 0, 0x304244566F6E614E, 2**64 - 1, 32 << 21 | 4 << 10, 0, 0, 1, len(out))
    out[40 : 40 + len(name)] = name.encode()
    matrix, inverse = np.eye(3) * voxel, np.eye(3) / voxel
    struct.pack_into("<22f", out, 296, *matrix.flat, *inverse.flat, *origin, 1)
    struct.pack_into("<22d", out, 384, *matrix.flat, *inverse.flat, *origin, 1)
    active = np.argwhere(values != 0)
    low, high = active.min(axis=0), active.max(axis=0)
    world = [*(low * voxel + origin), *((high + 1) * voxel + origin)]
    struct.pack_into("<9d2I", out, 560, *world, voxel, voxel, voxel, 2, 1)  # a fog volume of floats
    struct.pack_into("<4Q6IQ", out, 672, leaf_at - 672, lower_at - 672, upper_at - 672, 64, len(at), len(lowers), 1, 0, 0, 0, len(active))
    struct.pack_into("<6iI5f", out, header, *low, *high, 1, 0, values.min(), values.max(), 0, 0)
    struct.pack_into("<QqIf", out, header + 64, 0, upper_at - header, 0, 0)

    def link(parent, mask, table, bits, child, offset):
        n = (int(child[0]) << 2 * bits) | (int(child[1]) << bits) | int(child[2])
        out[parent + mask + n // 8] |= 1 << n % 8
        struct.pack_into("<q", out, parent + table + 8 * n, offset - parent)

    struct.pack_into("<6i", out, upper_at, *low, *high)
    places = {}
    for i, lower in enumerate(lowers):
        places[tuple(lower)] = place = lower_at + lower_bytes * i
        struct.pack_into("<6i", out, place, *(lower * 128), *(lower * 128 + 127))
        link(upper_at, 4128, 8256, 5, lower, place)
    for i, block in enumerate(at):
        place = leaf_at + leaf_bytes * i
        voxels = leaves[tuple(block)]
        struct.pack_into("<3i4B", out, place, *(block * 8), 7, 7, 7, 2)
        out[place + 16 : place + 80] = np.packbits(voxels != 0, bitorder="little").tobytes()
        struct.pack_into("<4f", out, place + 80, voxels.min(), voxels.max(), voxels.mean(), voxels.std())
        out[place + 96 : place + leaf_bytes] = voxels.tobytes()
        link(places[tuple(block >> 4)], 544, 1088, 4, block & 15, place)
    return name, bytes(out)


def nvdb_file(path, grids):
    """Grids as they come from nvdb_grid(), packed by zip."""
    head = struct.pack("<QIHH", 0x304244566F6E614E, 32 << 21 | 4 << 10, len(grids), 1)
    body = b""
    for name, grid in grids:
        packed = zlib.compress(grid, 9)
        packed = struct.pack("<Q", len(packed)) + packed
        name_hash, voxels = 0, struct.unpack_from("<Q", grid, 672 + 56)[0]
        counts = struct.unpack_from("<3I", grid, 672 + 32)
        meta = struct.pack("<4Q2I", len(grid), len(packed), name_hash, voxels, 1, 2) + grid[560:608] + grid[736:760] + grid[608:632]
        meta += struct.pack("<I4I3IHHI", len(name) + 1, *counts, 1, 0, 0, 0, 1, 0, 32 << 21 | 4 << 10)
        head += meta + name.encode() + b"\0"
        body += packed
    with open(path, "wb") as file:
        file.write(head + body)


def noise(shape, cells, rng):
    """Smooth noise in [0, 1]: values on a lattice of `cells` along z, interpolated by cubics."""
    lattice = rng.random([int(np.ceil(n * cells / shape[2])) + 2 for n in shape])
    for axis, n in enumerate(shape):
        p = np.arange(n) * cells / shape[2]
        i = p.astype(int)
        t = (p - i).reshape([-1 if k == axis else 1 for k in range(3)])
        t = t * t * (3 - 2 * t)
        lattice = np.take(lattice, i, axis) * (1 - t) + np.take(lattice, i + 1, axis) * t
    return lattice


def fire(shape=(56, 56, 80)):
    rng = np.random.default_rng(7)
    x, y, z = np.meshgrid(*[(np.arange(n) + 0.5) / shape[2] for n in shape], indexing="ij")
    turbulence = sum(noise(shape, 5 * 2**o, rng) / 2 ** (o + 1) for o in range(4))
    radius = np.hypot(x - x.mean(), y - y.mean()) / (0.1 + 0.13 * z * (1.7 - z))
    density = np.clip(1.3 * (1.15 - radius + 2.2 * (turbulence - 0.47)), 0, 1) * np.clip(1.4 - 1.5 * z + turbulence - 0.5, 0, 1) * np.clip(5 - 5 * z, 0, 1) * np.clip(z * 12, 0, 1)
    heat = density ** 0.4 * np.clip(1.35 - 1.9 * z + 1.2 * (noise(shape, 9, rng) - 0.5), 0, 1)
    return np.round(density * 128) / 128, np.where(density > 0, np.round(heat * 140) * 15, 0)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    density, temperature = fire()
    voxel = 2.3 / density.shape[2]
    origin = np.array([-voxel * density.shape[0] / 2, -voxel * density.shape[1] / 2, 0])
    nvdb_file(sys.argv[1], [nvdb_grid("density", density, voxel, origin), nvdb_grid("temperature", temperature, voxel, origin)])
