#pragma once
// Randomness of the virtual camera: one seed, independent streams.
//
// Every noise has its own stream, so that changing one (say, the frame loss) leaves the draws of
// the others as they were. Pixel noise is counter based: it depends on (seed, frame, row) alone,
// not on the thread that renders a frame.

#include <cstdint>
#include <random>

namespace alidade::simulator {

enum class Stream : std::uint64_t {
  kPath = 1,
  kImageStamp,
  kTelemetryStamp,
  kAngle,
  kStaleRepeat,
  kFrameLoss,
  kPixel,
  kBoil,
  kTexture,
  kTracks,
  kPeriods,
  kZoom,
  kDepth,
  kClouds,
  kWater,
  kFlutter
};

// The finaliser of splitmix64 (Steele, Lea, Flood 2014): every input bit changes half the output.
inline std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

inline std::uint64_t mix(std::uint64_t a, std::uint64_t b) { return mix(mix(a) ^ b); }

inline std::mt19937_64 make_generator(std::uint64_t seed, Stream stream) {
  return std::mt19937_64(mix(seed, static_cast<std::uint64_t>(stream)));
}

}  // namespace alidade::simulator
