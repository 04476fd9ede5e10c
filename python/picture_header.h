// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dapple/dapple.h>
#include <pybind11/pybind11.h>

/// Picture::header as a dictionary: texts, numbers, and matrices as 16 numbers row by row. With it goes
/// "dapple/window", (x, y, width, height), which is of Python alone: the corner of a crop and the size of its film.
pybind11::dict header_of(const dapple::Picture& picture);

/// The same the other way. ValueError names the entry that is none.
void set_header(const pybind11::dict& entries, dapple::Picture* picture);
