# SPDX-License-Identifier: Apache-2.0
"""Dapple's Python package: `dapple.canopy` (light in layers of leaves) and `dapple.plot` (line plots as SVG)."""
