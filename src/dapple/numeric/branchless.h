// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple {
inline namespace numeric {

// Elementary functions in double precision without branches or calls, so that loops over them become vector code. Fixed
// sequences of IEEE operations: vectors and scalars give the same bits.

struct SineCosine {
  double sine, cosine;
};

/// Of an angle of at most 1000 (radians), each within 1e-15.
inline SineCosine sine_cosine(double angle) {
  // Of half the angle, which lies within a quarter turn, by their Taylor series.
  const double turns = __builtin_floor(angle * 0.15915494309189535 + 0.5);
  const double h = 0.5 * ((angle - turns * 6.283185307179586) - turns * 2.4492935982947064e-16), z = h * h;
  double s = 1 / 51090942171709440000.0;
  s = s * z - 1 / 121645100408832000.0;
  s = s * z + 1 / 355687428096000.0;
  s = s * z - 1 / 1307674368000.0;
  s = s * z + 1 / 6227020800.0;
  s = s * z - 1 / 39916800.0;
  s = s * z + 1 / 362880.0;
  s = s * z - 1 / 5040.0;
  s = s * z + 1 / 120.0;
  s = s * z - 1 / 6.0;
  s = s * z * h + h;
  double c = 1 / 2432902008176640000.0;
  c = c * z - 1 / 6402373705728000.0;
  c = c * z + 1 / 20922789888000.0;
  c = c * z - 1 / 87178291200.0;
  c = c * z + 1 / 479001600.0;
  c = c * z - 1 / 3628800.0;
  c = c * z + 1 / 40320.0;
  c = c * z - 1 / 720.0;
  c = c * z + 1 / 24.0;
  c = c * z - 0.5;
  c = c * z + 1;
  return {2 * s * c, 1 - 2 * s * s};
}

/// The argument of the complex number x + i y, in [0, 2 pi), within 1e-15 of itself where it is small; 0 of zero. The
/// rational function is that of Moshier, Cephes Mathematical Library.
inline double argument(double x, double y) {
  const double ax = __builtin_fabs(x), ay = __builtin_fabs(y);
  const bool steep = ay > ax;
  const double low = steep ? ax : ay, high = steep ? ay : ax;
  const bool beyond = low > 0.66 * high;  // of tan(pi / 4)
  const double t = (beyond ? low - high : low) / (beyond ? low + high : high == 0 ? 1.0 : high), z = t * t;
  const double p =
      (((-8.750608600031904122785e-1 * z - 1.615753718733365076637e1) * z - 7.500855792314704667340e1) * z -
       1.228866684490136173410e2) *
          z -
      6.485021904942025371773e1;
  const double q =
      ((((z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2) * z + 4.328810604912902668951e2) * z +
       4.853903996359136964868e2) *
          z +
      1.945506571482613964425e2;
  const double octant = t + t * (z * p / q), first = beyond ? octant + 0.7853981633974483 : octant;
  const double quadrant = steep ? 1.5707963267948966 - first : first;
  const double half = x < 0 ? 3.141592653589793 - quadrant : quadrant;
  return y < 0 ? 6.283185307179586 - half : half;
}

}  // namespace numeric
}  // namespace dapple
