// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::glimpostor {

/// What shaders of both paths begin with: a list of matrices, and which sub-samples of a pixel a draw may take
/// (LevelChoice). Texels of `draws`: the rows X, Y, W, Z of depthimage::ScreenMap; and number, samples | share << 16.
inline constexpr char draw_list_glsl[] = R"(#version 330 core
uniform samplerBuffer draws;
uniform vec4 region;      // first film place, sub-samples' sides in clip space
uniform vec2 clip_depth;  // of a depth: its multiple, and what is added
struct DrawRow { vec4 X, Y, W, Z; uint number, limits; };
DrawRow draw_at(int slot) {
  DrawRow d;
  d.X = texelFetch(draws, 5 * slot), d.Y = texelFetch(draws, 5 * slot + 1);
  d.W = texelFetch(draws, 5 * slot + 2), d.Z = texelFetch(draws, 5 * slot + 3);
  vec4 last = texelFetch(draws, 5 * slot + 4);
  d.number = floatBitsToUint(last.x), d.limits = floatBitsToUint(last.y);
  return d;
}
vec4 to_clip(DrawRow d, vec4 P, out float depth) {
  float W = dot(d.W, P);
  depth = dot(d.Z, P);
  return vec4((dot(d.X, P) - region.x * W) * region.z - W, (dot(d.Y, P) - region.y * W) * region.w - W,
              clip_depth.x * depth + clip_depth.y, W);
}
)";

inline constexpr char limits_glsl[] = R"(#version 330 core
uniform ivec2 corner;
uniform int turn;
bool is_left_out(uint limits) {
  ivec2 at = ivec2(gl_FragCoord.xy), pixel = corner + at / 4;
  if ((limits >> uint(at.y % 4 * 4 + at.x % 4) & 1u) == 0u) return true;
  return uint(pixel.x + 3 * pixel.y + turn) % 8u < limits >> 16;
}
)";

/// Points: two triangles for each fragment of each chunk of each draw. Texels of `fragments`: place, slope along u;
/// slope along v, mask | view << 16, rectangle in hundredths of a texel.
inline constexpr char point_vertex_glsl[] = R"(
uniform usamplerBuffer fragments, instances;
uniform vec3 frames[78];
uniform float texel;
flat out uint mask, limits;
flat out uvec2 id;
out vec2 on_texel;
out float depth;
void main() {
  uvec2 instance = texelFetch(instances, gl_InstanceID).xy;
  int fragment = int(instance.y) * 32 + gl_VertexID / 6;
  uvec4 a = texelFetch(fragments, 2 * fragment), b = texelFetch(fragments, 2 * fragment + 1);
  DrawRow d = draw_at(int(instance.x));
  bool second = gl_VertexID % 6 > 2;
  bvec2 high = second ? bvec2(gl_VertexID % 3 != 0, gl_VertexID % 3 != 1) : bvec2(gl_VertexID % 3 == 1, gl_VertexID % 3 == 2);
  ivec4 sides = ivec4(int(b.z << 24) >> 24, int(b.z << 16) >> 24, int(b.z << 8) >> 24, int(b.z) >> 24);
  on_texel = 0.01 * vec2(high.x ? sides.y : sides.x, high.y ? sides.w : sides.z);
  vec2 slope = vec2(uintBitsToFloat(a.w), uintBitsToFloat(b.x));
  int view = int(b.y >> 16);
  vec3 P = uintBitsToFloat(a.xyz) + texel * (frames[3 * view] * on_texel.x + frames[3 * view + 1] * on_texel.y +
           frames[3 * view + 2] * dot(slope, on_texel));
  mask = b.y & 0xffffu;
  limits = d.limits;
  id = uvec2(d.number, uint(fragment));
  gl_Position = mask == 0u ? vec4(2, 2, 2, 1) : to_clip(d, vec4(P, 1), depth);
}
)";

inline constexpr char point_fragment_glsl[] = R"(
flat in uint mask, limits;
flat in uvec2 id;
in vec2 on_texel;
in float depth;
out uvec2 shown;
out float distance_along;
void main() {
  ivec2 at = clamp(ivec2(floor((on_texel + 0.5) * 4.0)), 0, 3);
  if ((mask >> uint(at.y * 4 + at.x) & 1u) == 0u || is_left_out(limits)) discard;
  shown = id;
  distance_along = depth;
}
)";

}  // namespace dapple::glimpostor
