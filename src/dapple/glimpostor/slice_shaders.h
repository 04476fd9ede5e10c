// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::glimpostor {

/// Slices: a square for each slab of each draw of a list, at the slab's middle, parallel to the image
/// (after draw_list_glsl).
inline constexpr char slice_vertex_glsl[] = R"(
uniform usamplerBuffer slots;
uniform vec3 centre, axis_u, axis_v, axis_w;  // of the length of the radius
uniform int slabs;
flat out uint number, limits;
flat out float slab_depth;
out vec2 on_image;
out float depth;
void main() {
  DrawRow d = draw_at(int(texelFetch(slots, gl_InstanceID / slabs).x));
  int corner = gl_VertexID % 3 + (gl_VertexID > 2 ? 1 : 0);
  on_image = vec2(corner == 1 || corner == 3 ? 1.0 : 0.0, corner > 1 ? 1.0 : 0.0);
  slab_depth = (float(gl_InstanceID % slabs) + 0.5) / float(slabs);
  vec2 side = 2.0 * on_image - 1.0;
  number = d.number, limits = d.limits;
  gl_Position = to_clip(d, vec4(centre + axis_u * side.x + axis_v * side.y + axis_w * (1.0 - 2.0 * slab_depth), 1), depth);
}
)";

/// Which layer of a texel a slice shows: the first in its slab that covers the place (after limits_glsl). Alpha is
/// depth: 255 near, 1 far, 0 nothing.
inline constexpr char slab_test_glsl[] = R"(
uniform sampler2DArray image;
uniform usampler2DArray numbers;
uniform int layers;
uniform float half_slab;
flat in uint number, limits;
flat in float slab_depth;
in vec2 on_image;
in float depth;
vec4 texel_in_slab(out uint fragment) {
  vec2 place = on_image * vec2(textureSize(image, 0).xy);
  ivec2 texel = clamp(ivec2(place), ivec2(0), textureSize(image, 0).xy - 1);
  ivec2 at = clamp(ivec2((place - vec2(texel)) * 4.0), 0, 3);
  for (int layer = 0; layer < layers; ++layer) {
    vec4 value = texelFetch(image, ivec3(texel, layer), 0);
    if (value.a == 0.0) break;
    float from_slab = 1.0 - (value.a * 255.0 - 1.0) / 254.0 - slab_depth;
    if (from_slab > half_slab) break;
    if (from_slab < -half_slab) continue;
    uvec2 number_and_mask = texelFetch(numbers, ivec3(texel, layer), 0).xy;
    if ((number_and_mask.y >> uint(at.y * 4 + at.x) & 1u) == 0u) continue;
    fragment = number_and_mask.x;
    return value;
  }
  discard;
}
)";

inline constexpr char slice_fragment_glsl[] = R"(
out uvec2 shown;
out float distance_along;
void main() {
  uint fragment = 0u;
  texel_in_slab(fragment);
  if (is_left_out(limits)) discard;
  shown = uvec2(number, fragment);
  distance_along = depth;
}
)";

/// Of a picture in two passes, whose product is lit: RGB as the image has it; RGB through a colour matrix.
inline constexpr char unshaded_fragment_glsl[] = R"(
out vec4 color;
void main() {
  uint fragment = 0u;
  color = vec4(texel_in_slab(fragment).rgb, 1);
}
)";

inline constexpr char shaded_fragment_glsl[] = R"(
uniform mat4 color_matrix;
uniform vec4 bias;
out vec4 color;
void main() {
  uint fragment = 0u;
  vec4 shaded = color_matrix * texel_in_slab(fragment) + bias;
  color = vec4(clamp(shaded.rgb, 0.0, 1.0), 1);
}
)";

}  // namespace dapple::glimpostor
