// SPDX-License-Identifier: Apache-2.0
// All kernels. Compiled once for each instruction set: define DAPPLE_KERNELS, the name of the function that returns
// them.
#include "dapple/pattern/noise.h"
#include "dapple/pattern/pattern_op.h"

// Lanes are independent; where a result overwrites an operand it does so lane by lane.
#if defined(__clang__)
#pragma clang diagnostic ignored "-Wpass-failed"  // a loop left scalar is slow, not wrong
#define DAPPLE_LANES _Pragma("clang loop vectorize(assume_safety) interleave(disable)") for
#else
#define DAPPLE_LANES _Pragma("GCC ivdep") for
#endif

namespace dapple::pattern {

const PatternKernels& DAPPLE_KERNELS();

namespace {

constexpr int capacity = 256;

/// A multiple of 8, as the compiler can see.
int lanes(const PatternCall& c) {
  return c.count & ~7;
}

void fill(const PatternCall& c) {
  const float value = c.parameters[0];
  float* out = c.out[0];
  const int n = lanes(c);
  DAPPLE_LANES(int i = 0; i < n; ++i) out[i] = value;
}

template <float (*F)(float)>
void unary(const PatternCall& c) {
  const float* a = c.in[0];
  float* out = c.out[0];
  const int n = lanes(c);
  DAPPLE_LANES(int i = 0; i < n; ++i) out[i] = F(a[i]);
}

template <float (*F)(float, float), int V>
void binary(const PatternCall& c) {
  const float *a = c.in[0], *b = c.in[1];
  const float ka = a[0], kb = b[0];
  float* out = c.out[0];
  const int n = lanes(c);
  DAPPLE_LANES(int i = 0; i < n; ++i) out[i] = F(V & 1 ? ka : a[i], V & 2 ? kb : b[i]);
}

template <float (*F)(float, float, float), int V>
void ternary(const PatternCall& c) {
  const float *a = c.in[0], *b = c.in[1], *d = c.in[2];
  const float ka = a[0], kb = b[0], kd = d[0];
  float* out = c.out[0];
  const int n = lanes(c);
  DAPPLE_LANES(int i = 0; i < n; ++i) out[i] = F(V & 1 ? ka : a[i], V & 2 ? kb : b[i], V & 4 ? kd : d[i]);
}

DAPPLE_LANE float add(float a, float b) {
  return a + b;
}
DAPPLE_LANE float subtract(float a, float b) {
  return a - b;
}
DAPPLE_LANE float multiply(float a, float b) {
  return a * b;
}
DAPPLE_LANE float less(float a, float b) {
  return a < b ? 1.0f : 0.0f;
}
DAPPLE_LANE float multiply_add(float a, float b, float d) {
  return a * b + d;
}
DAPPLE_LANE float select(float a, float b, float d) {
  return a != 0 ? b : d;
}

template <float (*F)(float, float, float)>
void noise(const PatternCall& c) {
  const float *x = c.in[0], *y = c.in[1], *z = c.in[2];
  float* __restrict out = c.out[0];
  const int n = lanes(c);
  DAPPLE_LANES(int i = 0; i < n; ++i) out[i] = F(x[i], y[i], z[i]);
}

/// Octaves each lane resolves; returns how many the finest does.
float resolve(const PatternCall& c, const float* width2, float* resolved) {
  const float octaves = c.parameters[0];
  const int n = lanes(c);
  int32_t most = 0;  // floats that are not negative compare as integers do, and their maximum vectorises
  DAPPLE_LANES(int i = 0; i < n; ++i) {
    resolved[i] = lane::resolved_octaves(width2[i], octaves);
    const int32_t bits = std::bit_cast<int32_t>(resolved[i]);
    most = bits > most ? bits : most;
  }
  return std::bit_cast<float>(most);
}

/// c: parameters octaves, omega. The sum over octaves i of omega^i times noise(1.99^i p); octaves finer than the
/// footprint are left out, the last one faded. Of absolute values: octaves left out are replaced by their mean, so that
/// the whole keeps its mean at any distance (pbrt-v4 counts the fading octave twice).
template <bool absolute>
void octaves(const PatternCall& c) {
  alignas(64) float resolved[capacity];
  const float *x = c.in[0], *y = c.in[1], *z = c.in[2];
  float* __restrict out = c.out[0];
  const int n = lanes(c);
  const float most = resolve(c, c.in[3], resolved), count = c.parameters[0];
  for (int i = 0; i < n; ++i) out[i] = 0;
  float frequency = 1, amplitude = 1;
  for (float octave = 0; octave < count; octave += 1) {
    if (octave < most) {
      DAPPLE_LANES(int i = 0; i < n; ++i) {
        const float v = lane::gradient_noise(x[i] * frequency, y[i] * frequency, z[i] * frequency);
        const float w = lane::octave_weight(resolved[i], octave);
        out[i] += absolute ? amplitude * lane::mix(lane::mean_absolute_noise, lane::abs(v), w) : amplitude * w * v;
      }
    } else if (absolute) {
      for (int i = 0; i < n; ++i) out[i] += amplitude * lane::mean_absolute_noise;
    } else {
      return;
    }
    frequency *= lane::lacunarity;
    amplitude *= c.parameters[1];
  }
}

/// Of the variance of a sum of octaves of variance 1, times their squared amplitudes, what octaves() leaves out: a mean
/// over the footprint with the weight w keeps w^2 of it.
void left_out_octaves(const PatternCall& c) {
  alignas(64) float resolved[capacity];
  const float count = c.parameters[0], omega = c.parameters[1];
  float* __restrict out = c.out[0];
  const int n = lanes(c);
  resolve(c, c.in[0], resolved);
  for (int i = 0; i < n; ++i) out[i] = 0;
  float power = 1;
  for (float octave = 0; octave < count; octave += 1) {
    DAPPLE_LANES(int i = 0; i < n; ++i) {
      const float w = lane::octave_weight(resolved[i], octave);
      out[i] += power * (1 - w * w);
    }
    power *= omega * omega;
  }
}

/// The 27 cells around a point hold one feature point each (Worley 1996, one point a cell): F1 and F2 are exact up to
/// 1, the width of a cell; larger ones are rare and may be too large.
void worley(const PatternCall& c) {
  alignas(64) float x[capacity], y[capacity], z[capacity];
  alignas(64) int32_t cx[capacity], cy[capacity], cz[capacity];
  const float *in_x = c.in[0], *in_y = c.in[1], *in_z = c.in[2];
  float* __restrict f1 = c.out[0], * __restrict f2 = c.out[1], * __restrict id = c.out[2];
  const float jitter = c.parameters[0], start = 0.5f - 0.5f * jitter;
  const int n = lanes(c);
  DAPPLE_LANES(int i = 0; i < n; ++i) {
    const float px = lane::on_lattice(in_x[i]), py = lane::on_lattice(in_y[i]), pz = lane::on_lattice(in_z[i]);
    const float fx = lane::floor(px), fy = lane::floor(py), fz = lane::floor(pz);
    x[i] = px - fx, y[i] = py - fy, z[i] = pz - fz;
    cx[i] = static_cast<int32_t>(fx), cy[i] = static_cast<int32_t>(fy), cz[i] = static_cast<int32_t>(fz);
    f1[i] = f2[i] = 100, id[i] = 0;
  }
  for (int cell = 0; cell < 27; ++cell) {
    const int32_t dx = cell % 3 - 1, dy = cell / 3 % 3 - 1, dz = cell / 9 - 1;
    const float ox = static_cast<float>(dx) + start, oy = static_cast<float>(dy) + start,
                oz = static_cast<float>(dz) + start;
    DAPPLE_LANES(int i = 0; i < n; ++i) {
      const uint32_t h = lane::lattice_hash(cx[i] + dx, cy[i] + dy, cz[i] + dz);
      const float qx = ox + jitter * lane::unit_of(h) - x[i];
      const float qy = oy + jitter * lane::unit_of(h >> 10) - y[i];
      const float qz = oz + jitter * lane::unit_of(h >> 20) - z[i];
      const float d = qx * qx + qy * qy + qz * qz, nearest = f1[i];
      const bool nearer = d < nearest;
      f2[i] = nearer ? nearest : lane::min(f2[i], d);
      f1[i] = nearer ? d : nearest;
      id[i] = nearer ? lane::unit_of((h * 0x9e3779b1u) >> 22) : id[i];
    }
  }
  DAPPLE_LANES(int i = 0; i < n; ++i) f1[i] = lane::sqrt(f1[i]), f2[i] = lane::sqrt(f2[i]);
}

/// Parameters: see PatternRamp.
void ramp(const PatternCall& c) {
  alignas(64) int32_t segment[capacity];
  const float* x = c.in[0];
  const int n = lanes(c), segments = static_cast<int>(c.parameters[0]);
  const float *starts = c.parameters + 1, *coefficients = starts + segments;
  for (int i = 0; i < n; ++i) segment[i] = 0;
  for (int s = 1; s < segments; ++s) {
    const float start = starts[s];
    DAPPLE_LANES(int i = 0; i < n; ++i) segment[i] += x[i] >= start ? 1 : 0;
  }
  for (int r = 0; r < c.results; ++r) {
    float* __restrict out = c.out[r];
    const float *c0 = coefficients + 4 * segments * r, *c1 = c0 + segments, *c2 = c1 + segments, *c3 = c2 + segments;
    DAPPLE_LANES(int i = 0; i < n; ++i) {
      const int s = segment[i];
      const float t = x[i] - starts[s];
      out[i] = ((c3[s] * t + c2[s]) * t + c1[s]) * t + c0[s];
    }
  }
}

/// Medians of the fifths of a normal distribution beside the middle one, scaled to a variance of 1.
constexpr float fifths[] = {-1.4634f, -0.5988f, 0.5988f, 1.4634f};

/// The mean or the standard deviation of an operation over an operand that is spread in a normal distribution: of five
/// applications. Exactly the operation where nothing is spread.
template <bool deviation>
void over_fifths(const PatternCall& c) {
  alignas(64) float moved[capacity], middle[max_pattern_results][capacity], there[max_pattern_results][capacity],
      squares[max_pattern_results][capacity];
  constexpr float most = 1e18f;
  const auto op = static_cast<PatternOp>(c.parameters[0]);
  const auto which = static_cast<size_t>(c.parameters[1]);
  const float *x = c.in[which], *spread = c.in[3];
  const int n = lanes(c);
  const PatternKernels::Kernel apply = DAPPLE_KERNELS().find(op, 0);
  PatternCall inner = c;
  inner.parameters += 2;
  for (int r = 0; r < c.results; ++r) inner.out[r] = middle[r];
  apply(inner);
  int32_t any = 0;
  DAPPLE_LANES(int i = 0; i < n; ++i) any |= std::bit_cast<int32_t>(spread[i]);
  for (int r = 0; r < c.results; ++r) {
    inner.out[r] = there[r];
    for (int i = 0; i < n; ++i) c.out[r][i] = squares[r][i] = 0;
  }
  inner.in[which] = moved;
  for (const float fifth : fifths) {
    if (any == 0) break;
    DAPPLE_LANES(int i = 0; i < n; ++i) moved[i] = x[i] + fifth * spread[i];
    apply(inner);
    for (int r = 0; r < c.results; ++r) {
      float* __restrict sums = c.out[r];
      DAPPLE_LANES(int i = 0; i < n; ++i) {
        const float d = there[r][i] - middle[r][i];  // of infinities: one that can be squared, or nothing
        const float change = (spread[i] != 0) & (d == d) ? lane::clamp(d, -most, most) : 0.0f;
        sums[i] += change;
        squares[r][i] += change * change;
      }
    }
  }
  for (int r = 0; r < c.results; ++r) {
    float* __restrict out = c.out[r];
    DAPPLE_LANES(int i = 0; i < n; ++i) {
      const float shift = 0.2f * out[i];
      out[i] = deviation ? lane::sqrt(0.2f * squares[r][i] - shift * shift) : middle[r][i] + shift;
    }
  }
}

void rgb_to_hsv(const PatternCall& c) {
  const float *r = c.in[0], *g = c.in[1], *b = c.in[2];
  float* __restrict h = c.out[0], * __restrict s = c.out[1], * __restrict v = c.out[2];
  const int n = lanes(c);
  DAPPLE_LANES(int i = 0; i < n; ++i) {
    const float high = lane::max(r[i], lane::max(g[i], b[i])), low = lane::min(r[i], lane::min(g[i], b[i]));
    const float chroma = high - low, scale = lane::divide(1, chroma);
    const float of_red = (g[i] - b[i]) * scale, of_green = (b[i] - r[i]) * scale + 2,
                of_blue = (r[i] - g[i]) * scale + 4;
    const float sextant = r[i] == high ? of_red : g[i] == high ? of_green : of_blue;
    h[i] = lane::fract(sextant * (1.0f / 6));
    s[i] = lane::divide(chroma, high);
    v[i] = high;
  }
}

void hsv_to_rgb(const PatternCall& c) {
  const float *h = c.in[0], *s = c.in[1], *v = c.in[2];
  const int n = lanes(c);
  for (int channel = 0; channel < 3; ++channel) {
    const float shift = channel == 0 ? 0 : channel == 1 ? 2.0f / 3 : 1.0f / 3;
    float* __restrict out = c.out[channel];
    DAPPLE_LANES(int i = 0; i < n; ++i) {
      const float k = lane::abs(6 * lane::fract(h[i] + shift) - 3) - 1;
      out[i] = v[i] * (1 - s[i] * (1 - lane::clamp(k, 0, 1)));
    }
  }
}

using Table = decltype(PatternKernels::table);

void put(Table* table, PatternOp op, int variant, PatternKernels::Kernel kernel) {
  (*table)[static_cast<size_t>(static_cast<int>(op) * PatternKernels::variants + variant)] = kernel;
}

template <float (*F)(float, float)>
void put_binary(Table* t, PatternOp op) {
  put(t, op, 0, binary<F, 0>);
  put(t, op, 1, binary<F, 1>);
  put(t, op, 2, binary<F, 2>);
}

template <float (*F)(float, float, float)>
void put_ternary(Table* t, PatternOp op) {
  put(t, op, 0, ternary<F, 0>);
  put(t, op, 1, ternary<F, 1>);
  put(t, op, 2, ternary<F, 2>);
  put(t, op, 3, ternary<F, 3>);
  put(t, op, 4, ternary<F, 4>);
  put(t, op, 5, ternary<F, 5>);
  put(t, op, 6, ternary<F, 6>);
}

void put_elementwise(Table* t) {
  put(t, PatternOp::absolute, 0, unary<lane::abs>);
  put(t, PatternOp::floor, 0, unary<lane::floor>);
  put(t, PatternOp::sqrt, 0, unary<lane::sqrt>);
  put(t, PatternOp::exp, 0, unary<lane::exp>);
  put(t, PatternOp::log, 0, unary<lane::log>);
  put(t, PatternOp::sin, 0, unary<lane::sin>);
  put(t, PatternOp::cos, 0, unary<lane::cos>);
  put_binary<add>(t, PatternOp::add);
  put_binary<subtract>(t, PatternOp::subtract);
  put_binary<multiply>(t, PatternOp::multiply);
  put_binary<lane::divide>(t, PatternOp::divide);
  put_binary<lane::min>(t, PatternOp::minimum);
  put_binary<lane::max>(t, PatternOp::maximum);
  put_binary<lane::modulo>(t, PatternOp::modulo);
  put(t, PatternOp::power, 0, binary<lane::pow, 0>);  // no vector code for a base that is one number
  put(t, PatternOp::power, 2, binary<lane::pow, 2>);
  put_binary<lane::atan2>(t, PatternOp::atan2);
  put_binary<less>(t, PatternOp::less);
  put_binary<lane::square_wave>(t, PatternOp::square_wave);
  put_ternary<multiply_add>(t, PatternOp::multiply_add);
  put_ternary<select>(t, PatternOp::select);
  put_ternary<lane::mix>(t, PatternOp::mix);
  put_ternary<lane::smoothstep>(t, PatternOp::smoothstep);
}

}  // namespace

const PatternKernels& DAPPLE_KERNELS() {
  static const PatternKernels kernels = [] {
    PatternKernels k;
    Table* t = &k.table;
    put(t, PatternOp::constant, 0, fill);
    put_elementwise(t);
    put(t, PatternOp::perlin, 0, noise<lane::gradient_noise>);
    put(t, PatternOp::simplex, 0, noise<lane::simplex_noise>);
    put(t, PatternOp::fbm, 0, octaves<false>);
    put(t, PatternOp::turbulence, 0, octaves<true>);
    put(t, PatternOp::left_out_octaves, 0, left_out_octaves);
    put(t, PatternOp::worley, 0, worley);
    put(t, PatternOp::ramp, 0, ramp);
    put(t, PatternOp::mean_over, 0, over_fifths<false>);
    put(t, PatternOp::deviation_over, 0, over_fifths<true>);
    put(t, PatternOp::rgb_to_hsv, 0, rgb_to_hsv);
    put(t, PatternOp::hsv_to_rgb, 0, hsv_to_rgb);
    return k;
  }();
  return kernels;
}

}  // namespace dapple::pattern
