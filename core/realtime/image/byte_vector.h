#pragma once
// Sixteen bytes at a time, by the compiler's own vectors: one source for SSE2 and for NEON, which
// every x86-64 and ARM64 processor has.
//
// Besides: four floats. load and store touch exactly 16 bytes and need no alignment. max and min become one instruction.

#include <cstdint>
#include <cstring>

namespace alidade {

using ByteVector = std::uint8_t __attribute__((vector_size(16)));
using ShortVector = std::uint16_t __attribute__((vector_size(16)));
inline constexpr int kByteLanes = 16;

template <class V>
[[nodiscard]] inline V load(const std::uint8_t* from) {
  V v;
  std::memcpy(&v, from, sizeof(v));
  return v;
}

inline void store(ByteVector v, std::uint8_t* to) { std::memcpy(to, &v, sizeof(v)); }

[[nodiscard]] inline ByteVector max(ByteVector a, ByteVector b) { return a > b ? a : b; }
[[nodiscard]] inline ByteVector min(ByteVector a, ByteVector b) { return a < b ? a : b; }

// a - b, or 0 where b is larger.
[[nodiscard]] inline ByteVector subtract_saturated(ByteVector a, ByteVector b) {
  return max(a, b) - b;
}

[[nodiscard]] inline ByteVector broadcast(std::uint8_t value) { return ByteVector{} + value; }

// Whether a lane of a is greater than the same lane of b.
[[nodiscard]] inline bool any_greater(ByteVector a, ByteVector b) {
  const auto greater = a > b;
  std::uint64_t halves[2];
  std::memcpy(halves, &greater, sizeof(halves));
  return (halves[0] | halves[1]) != 0;
}

using FloatVector = float __attribute__((vector_size(16)));

// Four bytes as numbers.
[[nodiscard]] inline FloatVector load_four(const std::uint8_t* from) {
  using FourBytes = std::uint8_t __attribute__((vector_size(4)));
  FourBytes bytes;
  std::memcpy(&bytes, from, sizeof(bytes));
  return __builtin_convertvector(bytes, FloatVector);
}

[[nodiscard]] inline FloatVector load_four(const float* from) {
  FloatVector v;
  std::memcpy(&v, from, sizeof(v));
  return v;
}

[[nodiscard]] inline float sum(FloatVector v) { return (v[0] + v[1]) + (v[2] + v[3]); }

}  // namespace alidade
