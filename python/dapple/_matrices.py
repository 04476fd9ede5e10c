# SPDX-License-Identifier: Apache-2.0
"""Matrices of placements, 4 x 4, for column vectors."""
from __future__ import annotations

import math
from typing import Optional, Sequence

import numpy as np
from numpy.typing import NDArray


def translate(x: float, y: float, z: float) -> NDArray[np.float64]:
    """The 4 x 4 matrix, for column vectors, that moves by (x, y, z)."""
    m = np.eye(4)
    m[:3, 3] = x, y, z
    return m


def scale(x: float, y: Optional[float] = None, z: Optional[float] = None) -> NDArray[np.float64]:
    """The 4 x 4 matrix that scales, alike along all axes if only x is given."""
    return np.diag([x, x if y is None else y, x if z is None else z, 1.0])


def rotate(degrees: float, axis: Sequence[float]) -> NDArray[np.float64]:
    """The 4 x 4 matrix that turns about an axis through the origin, counterclockwise as seen from its tip."""
    a = np.asarray(axis, dtype=float)
    x, y, z = a / np.linalg.norm(a)
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    m = np.eye(4)
    m[:3, :3] = c * np.eye(3) + s * k + (1 - c) * np.outer((x, y, z), (x, y, z))
    return m


def look_at(eye: Sequence[float], look: Sequence[float], up: Sequence[float]) -> NDArray[np.float64]:
    """The 4 x 4 matrix from camera to world of a camera at `eye` that looks at `look`."""
    eye_ = np.asarray(eye, dtype=float)
    ahead = np.asarray(look, dtype=float) - eye_
    right = np.cross(np.asarray(up, dtype=float), ahead)
    if not np.linalg.norm(ahead) > 0 or not np.linalg.norm(right) > 0:
        raise ValueError("look_at: eye and look must differ, and up must not be parallel to the direction between them")
    ahead /= np.linalg.norm(ahead)
    right /= np.linalg.norm(right)
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = right, np.cross(ahead, right), ahead, eye_
    return m
