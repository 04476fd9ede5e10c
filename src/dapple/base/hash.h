// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>

namespace dapple {
inline namespace base {

/// A bijective 64-bit mixer (the finaliser of SplitMix64; Steele et al. 2014).
constexpr uint64_t mix(uint64_t x) {
  x ^= x >> 30;
  x *= 0xbf58476d1ce4e5b9ull;
  x ^= x >> 27;
  x *= 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// Hash of a sequence of integers, enums and floats (floats by their bits, so 0 and -0 differ). This is how every
/// random number in Dapple gets its key: from what is sampled, never from a thread or the order of arrival.
template <class... T>
constexpr uint64_t hash(T... values) {
  uint64_t h = 0x9e3779b97f4a7c15ull;
  const auto add = [&h](auto v) {
    uint64_t bits = 0;
    if constexpr (std::is_same_v<decltype(v), float>)
      bits = std::bit_cast<uint32_t>(v);
    else if constexpr (std::is_same_v<decltype(v), double>)
      bits = std::bit_cast<uint64_t>(v);
    else
      bits = static_cast<uint64_t>(v);
    h = mix(h ^ (bits + 0x9e3779b97f4a7c15ull + (h << 6)));
  };
  (add(values), ...);
  return h;
}

/// Hash of a run of bytes, continuing from `seed`; for fingerprints, a few GB/s.
inline uint64_t hash_bytes(std::string_view bytes, uint64_t seed) {
  uint64_t h = mix(seed ^ bytes.size());
  size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    uint64_t word;
    std::memcpy(&word, bytes.data() + i, 8);
    h = (std::rotl(h, 29) ^ word) * 0x9e3779b97f4a7c15ull;
  }
  uint64_t tail = 0;
  if (i < bytes.size()) std::memcpy(&tail, bytes.data() + i, bytes.size() - i);
  return mix(h ^ tail);
}

/// The top 24 bits of h as a float in [0, 1).
constexpr float to_unit_float(uint64_t h) {
  return static_cast<float>(h >> 40) * 0x1p-24f;
}

/// Counter-based random numbers: the i-th number of a key is a pure function of (key, i).
class KeyedRng {
 public:
  explicit constexpr KeyedRng(uint64_t key, uint64_t counter = 0) : key_(mix(key)), counter_(counter) {}
  constexpr uint64_t next_bits() { return mix(key_ + 0x9e3779b97f4a7c15ull * ++counter_); }
  constexpr float next() { return to_unit_float(next_bits()); }  ///< uniform in [0, 1)

 private:
  uint64_t key_, counter_;
};

}  // namespace base
}  // namespace dapple
