#pragma once
// Vectors of sixteen bytes or four floats, by the compiler's vector extensions: one source for SSE2
// and NEON, which every x86-64 and ARM64 processor has. Little-endian processors only.
// Loads and stores touch only the bytes they name and need no alignment. max, min, shuffle and the
// steps from bytes to floats compile to one instruction each.

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

// True if any lane of a is greater than the same lane of b.
[[nodiscard]] inline bool any_greater(ByteVector a, ByteVector b) {
  const auto greater = a > b;
  std::uint64_t halves[2];
  std::memcpy(halves, &greater, sizeof(halves));
  return (halves[0] | halves[1]) != 0;
}

// Lanes of two vectors in any order. Indices first count those of a, then those of b.
template <int... kLanes, class V>
[[nodiscard]] inline V shuffle(V a, V b) {
#if defined(__clang__)
  return __builtin_shufflevector(a, b, kLanes...);
#else
  return __builtin_shuffle(a, b, decltype(a > b){kLanes...});
#endif
}

using FloatVector = float __attribute__((vector_size(16)));

struct EightFloats {
  FloatVector low, high;  // 0 to 3, 4 to 7
};

namespace internal {

using IntVector = std::int32_t __attribute__((vector_size(16)));
using LongVector = std::uint64_t __attribute__((vector_size(16)));

// The first sizeof(Word) bytes, at most eight, as 16-bit lanes. The compilers' own conversion works
// byte by byte.
template <class Word>
[[nodiscard]] inline ShortVector load_shorts(const std::uint8_t* from) {
  Word word;
  std::memcpy(&word, from, sizeof(word));
  const auto bytes = reinterpret_cast<ByteVector>(LongVector{word, 0});
  return reinterpret_cast<ShortVector>(
      shuffle<0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23>(bytes, ByteVector{}));
}

[[nodiscard]] inline FloatVector low_floats(ShortVector shorts) {
  return __builtin_convertvector(
      reinterpret_cast<IntVector>(shuffle<0, 8, 1, 9, 2, 10, 3, 11>(shorts, ShortVector{})),
      FloatVector);
}

[[nodiscard]] inline FloatVector high_floats(ShortVector shorts) {
  return __builtin_convertvector(
      reinterpret_cast<IntVector>(shuffle<4, 12, 5, 13, 6, 14, 7, 15>(shorts, ShortVector{})),
      FloatVector);
}

}  // namespace internal

// Four bytes as floats.
[[nodiscard]] inline FloatVector load_four(const std::uint8_t* from) {
  return internal::low_floats(internal::load_shorts<std::uint32_t>(from));
}

// Eight bytes as floats.
[[nodiscard]] inline EightFloats load_eight(const std::uint8_t* from) {
  const ShortVector shorts = internal::load_shorts<std::uint64_t>(from);
  return {internal::low_floats(shorts), internal::high_floats(shorts)};
}

[[nodiscard]] inline FloatVector load_four(const float* from) {
  FloatVector v;
  std::memcpy(&v, from, sizeof(v));
  return v;
}

inline void store(FloatVector v, float* to) { std::memcpy(to, &v, sizeof(v)); }

[[nodiscard]] inline float sum(FloatVector v) { return (v[0] + v[1]) + (v[2] + v[3]); }

}  // namespace alidade
