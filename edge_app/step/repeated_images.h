#pragma once
// RepeatedImages: which images of a stream repeat the one before exactly, although the camera had
// turned.
// An equal image counts as repeated if the image should have moved by kMoved_px since the first
// equal one, by telemetry less kSigmas of its uncertainty. For kMemory_s after that every equal
// image counts. Why equal images alone show nothing: docs/derivations.md. Seconds, px. Fixed
// memory, no allocation, one thread. Every kRowStep-th row is compared by digest: 10 us at
// 1920x1080.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>

#include "core/realtime/image/image_view.h"
#include "core/realtime/telemetry/telemetry_interpolation.h"

namespace alidade {

// Equal for equal images. Different if a sampled row differs, except by chance. image: valid.
[[nodiscard]] inline std::uint64_t image_digest(const ImageView& image) {
  constexpr int kRowStep = 32;
  constexpr std::size_t kLanes = 4;
  constexpr std::uint64_t kFactor = 0x9e3779b97f4a7c15;
  constexpr std::size_t kBlock = kLanes * sizeof(std::uint64_t);
  std::array<std::uint64_t, kLanes> lanes{1, 2, 3, 4};
  const auto take = [&lanes](const std::array<std::uint64_t, kLanes>& block) {
    for (std::size_t i = 0; i < kLanes; ++i) lanes[i] = (lanes[i] ^ block[i]) * kFactor;
    for (std::uint64_t& lane : lanes) lane ^= lane >> 29;
  };
  const auto width = static_cast<std::size_t>(image.width);
  for (int v = std::min(kRowStep / 2, image.height - 1); v < image.height; v += kRowStep) {
    const std::uint8_t* row = image.row(v);
    std::size_t u = 0;
    std::array<std::uint64_t, kLanes> block{};
    for (; u + kBlock <= width; u += kBlock) {
      std::memcpy(block.data(), row + u, kBlock);
      take(block);
    }
    block = {};
    std::memcpy(block.data(), row + u, width - u);
    take(block);
  }
  std::uint64_t digest = 0;
  for (const std::uint64_t lane : lanes) digest = (digest ^ lane) * kFactor;
  return digest;
}

class RepeatedImages {
 public:
  // A frame, its time, and telemetry's answer for it (null if there is none). True: the image was
  // sent again.
  bool judge(const ImageView& image, double time_s, const InterpolatedPanTilt* measured,
             double focal_length_px) {
    if (!image.valid()) return false;
    const std::uint64_t digest = image_digest(image);
    const bool equal = digest == digest_;
    interval_s_ = digest_ ? std::max(0.0, time_s - last_s_) : 0;
    last_s_ = time_s;
    if (!equal) {
      if (last_run_ && run_ != *last_run_) uneven_until_s_ = time_s + kMemory_s;
      if (digest_) last_run_ = run_;
      digest_ = digest;
      run_ = 0;
      fresh_s_ = time_s;
      return false;
    }
    ++run_;
    if (measured != nullptr && has_moved(*measured, time_s - fresh_s_, focal_length_px)) {
      until_s_ = time_s + kMemory_s;
    }
    return time_s < until_s_;
  }

  // s, one standard deviation: how late a fresh image is, as of the frame judged last.
  [[nodiscard]] double sigma_s() const {
    const bool late = last_s_ < until_s_ && last_s_ < uneven_until_s_;
    return late ? interval_s_ / std::sqrt(12.0) : 0;
  }

 private:
  static constexpr double kMoved_px = 1;
  static constexpr double kSigmas = 5;
  static constexpr double kMemory_s = 10;
  static constexpr double kNever = -std::numeric_limits<double>::infinity();

  static bool has_moved(const InterpolatedPanTilt& measured, double since_s,
                        double focal_length_px) {
    const auto moved = [&](double rate, double variance, double shortened) {
      const double sure = std::abs(rate) * shortened - kSigmas * std::sqrt(std::max(0.0, variance));
      return sure * since_s * focal_length_px > kMoved_px;
    };
    return moved(measured.rate.pan, measured.covariance(2, 2), std::cos(measured.angle.tilt)) ||
           moved(measured.rate.tilt, measured.covariance(3, 3), 1);
  }

  std::optional<std::uint64_t> digest_;  // of the image before
  double last_s_ = 0;
  double interval_s_ = 0;
  double fresh_s_ = 0;           // time of the first equal image
  int run_ = 0;                  // repeats since then
  std::optional<int> last_run_;  // repeats of the image before
  double until_s_ = kNever;
  double uneven_until_s_ = kNever;
};

}  // namespace alidade
