// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "dapple/base/error.h"
#include "dapple/base/transform.h"
#include "dapple/modelfile/model.h"
#include "dapple/scenefile/description_builder.h"

namespace dapple::modelfile {

/// How a model is looked at, and lit, where its file does not say.
struct ViewOptions {
  std::string from;            ///< a side: front, back, left, right, above, below, quarter; or "x,y,z"; empty: quarter
  std::optional<V3d> look_at;  ///< default: the middle of what is seen
  double fov = 0;              ///< degrees across the shorter side; 0: 35
  std::string sky;             ///< clear, overcast, uniform, none, or an image file; empty: clear
  std::string up;              ///< axis of the file: x, y, z, -x, -y, -z; empty: as its format has it
  bool ground = true;          ///< a plane under the model, where the sky is the default one
};

/// UsageError for what ViewOptions cannot be.
void check_view_options(const ViewOptions& options);

/// Three orthogonal directions of a model: where up is, where its front looks, and the right of who sees the front.
struct Axes {
  V3d up, front, right;
};
Axes axes_of(const ViewOptions& options, bool z_up);

/// Sides that ViewOptions::from may name.
inline constexpr const char* view_sides[] = {"quarter", "front", "back", "left", "right", "above", "below"};

struct View {
  V3d eye, look, up;
  double fov = 35;  ///< degrees, across the shorter side
  Transform world_to_camera() const;
};

/// A camera that sees all of the model, `scale` times as large, in a picture of this aspect (width over height).
View default_view(const Model& model, double scale, const ViewOptions& options, double aspect);

/// A camera of the file, whose pictures have this aspect unless it names one. At shutter close with `end`.
View view_of(const ModelCamera& camera, double scale, double aspect, bool end);

/// Sun and sky, and the ground under `bounds`, by the options. False for "none".
bool add_default_light(const Imath::Box3d& bounds, const ViewOptions& options, const Axes& axes, const FileLoc& loc,
                       scenefile::SceneDescription* description, scenefile::DescriptionBuilder* builder);

}  // namespace dapple::modelfile
