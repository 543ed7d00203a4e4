#include "core/realtime/image/fast_corners.h"

#include <algorithm>
#include <array>

#include "core/realtime/image/byte_vector.h"

namespace alidade {
namespace {

constexpr int kRadius = 3;
constexpr int kMinWidth = kByteLanes + 2 * kRadius;
constexpr int kMinHeight = 2 * kRadius + 1;
constexpr int kMaxSize = 65535;
constexpr int kCircle = 16;
constexpr std::array<std::array<int, 2>, kCircle> kOffsets = {{{0, -3},
                                                               {1, -3},
                                                               {2, -2},
                                                               {3, -1},
                                                               {3, 0},
                                                               {3, 1},
                                                               {2, 2},
                                                               {1, 3},
                                                               {0, 3},
                                                               {-1, 3},
                                                               {-2, 2},
                                                               {-3, 1},
                                                               {-3, 0},
                                                               {-3, -1},
                                                               {-2, -2},
                                                               {-1, -3}}};

// Upper bound of the scores from n pairs of opposite pixels: every arc of 9 contains one of each
// pair.
template <int kPairs>
ByteVector score_bound(ByteVector centre, const std::array<ByteVector, 2 * kPairs>& pairs) {
  ByteVector brightest = max(pairs[0], pairs[1]);
  ByteVector darkest = min(pairs[0], pairs[1]);
  for (std::size_t i = 2; i < pairs.size(); i += 2) {
    brightest = min(brightest, max(pairs[i], pairs[i + 1]));
    darkest = max(darkest, min(pairs[i], pairs[i + 1]));
  }
  return max(subtract_saturated(brightest, centre), subtract_saturated(centre, darkest));
}

// Scores of 16 pixels from the pixels of their circles. The minimum over an arc of 9 is built from
// those over 2, 4 and 8.
ByteVector scores(ByteVector centre, const std::array<ByteVector, kCircle>& circle) {
  std::array<ByteVector, kCircle> low = circle;
  std::array<ByteVector, kCircle> high = circle;
  for (std::size_t step = 1; step < 8; step *= 2) {
    const auto shorter_low = low;
    const auto shorter_high = high;
    for (std::size_t i = 0; i < kCircle; ++i) {
      low[i] = min(shorter_low[i], shorter_low[(i + step) % kCircle]);
      high[i] = max(shorter_high[i], shorter_high[(i + step) % kCircle]);
    }
  }
  ByteVector brightest = min(low[0], circle[8]);
  ByteVector darkest = max(high[0], circle[8]);
  for (std::size_t i = 1; i < kCircle; ++i) {
    brightest = max(brightest, min(low[i], circle[(i + 8) % kCircle]));
    darkest = min(darkest, max(high[i], circle[(i + 8) % kCircle]));
  }
  return max(subtract_saturated(brightest, centre), subtract_saturated(centre, darkest));
}

// True if a neighbour beats the pixel. Of equals the first in reading order wins.
bool beaten(const ImageView& image, const FastCorner& corner) {
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      const int u = corner.u + du;
      const int v = corner.v + dv;
      if (u < kRadius || v < kRadius || u >= image.width - kRadius || v >= image.height - kRadius) {
        continue;
      }
      const bool earlier = dv < 0 || (dv == 0 && du < 0);
      if (fast_score(image, u, v) >= corner.score + (earlier ? 0 : 1)) return true;
    }
  }
  return false;
}

}  // namespace

std::uint8_t fast_score(const ImageView& image, int u, int v) {
  std::array<int, kCircle> circle;
  for (std::size_t i = 0; i < kCircle; ++i) {
    circle[i] = image.row(v + kOffsets[i][1])[u + kOffsets[i][0]];
  }
  const int centre = image.row(v)[u];
  int score = 0;
  for (std::size_t first = 0; first < kCircle; ++first) {
    int low = 255;
    int high = 0;
    for (std::size_t i = first; i < first + 9; ++i) {
      low = std::min(low, circle[i % kCircle]);
      high = std::max(high, circle[i % kCircle]);
    }
    score = std::max({score, low - centre, centre - high});
  }
  return static_cast<std::uint8_t>(score);
}

FastGrid::FastGrid(int max_width, int max_height, int cell_size)
    : max_width_(std::clamp(max_width, kMinWidth, kMaxSize)),
      max_height_(std::clamp(max_height, kMinHeight, kMaxSize)),
      cell_size_(std::clamp(cell_size, 8, kMaxSize)),
      max_columns_((max_width_ - 2 * kRadius + cell_size_ - 1) / cell_size_),
      max_rows_((max_height_ - 2 * kRadius + cell_size_ - 1) / cell_size_),
      best_(static_cast<std::size_t>(max_columns_)) {}

void FastGrid::search_row(const ImageView& image, int v) {
  const std::uint8_t* const centres = image.row(v);
  std::array<const std::uint8_t*, kCircle> circles;
  for (std::size_t i = 0; i < kCircle; ++i) {
    circles[i] = image.row(v + kOffsets[i][1]) + kOffsets[i][0];
  }
  const int end = image.width - kRadius;
  for (int cell = 0, first = kRadius; first < end; ++cell, first += cell_size_) {
    FastCorner& best = best_[static_cast<std::size_t>(cell)];
    const int cell_end = std::min(first + cell_size_, end);
    for (int u = first; u < cell_end; u += kByteLanes) {
      // Sixteen pixels, not beyond the image's end. Pixels of other cells are skipped below.
      const int start = std::min(u, end - kByteLanes);
      const ByteVector to_beat = broadcast(best.score);
      const auto centre = load<ByteVector>(centres + start);
      const auto at = [&](std::size_t i) { return load<ByteVector>(circles[i] + start); };
      if (!any_greater(score_bound<2>(centre, {at(0), at(8), at(4), at(12)}), to_beat)) continue;
      if (!any_greater(score_bound<2>(centre, {at(2), at(10), at(6), at(14)}), to_beat)) continue;
      std::array<ByteVector, kCircle> circle;
      for (std::size_t i = 0; i < kCircle; ++i) circle[i] = at(i);
      const ByteVector score = scores(centre, circle);
      if (!any_greater(score, to_beat)) continue;
      std::array<std::uint8_t, kByteLanes> lanes;
      store(score, lanes.data());
      for (int i = u; i < std::min(u + kByteLanes, cell_end); ++i) {
        const std::uint8_t lane = lanes[static_cast<std::size_t>(i - start)];
        if (lane > best.score) {
          best = {static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(v), lane};
        }
      }
    }
  }
}

FastResult FastGrid::detect(const ImageView& image, std::uint8_t threshold, FastCorner* corners,
                            int capacity) {
  FastResult result;
  if (!image.valid()) {
    result.status = FastStatus::kNoImage;
  } else if (image.width > max_width_ || image.height > max_height_) {
    result.status = FastStatus::kTooLarge;
  } else if (image.width < kMinWidth || image.height < kMinHeight) {
    result.status = FastStatus::kTooSmall;
  }
  if (result.status != FastStatus::kOk) return result;

  const int end = image.height - kRadius;
  for (int first = kRadius; first < end; first += cell_size_) {
    // Row 0 has no corners, so v = 0 means none yet.
    std::fill(best_.begin(), best_.end(), FastCorner{0, 0, threshold});
    for (int v = first; v < std::min(first + cell_size_, end); ++v) search_row(image, v);
    for (const FastCorner& best : best_) {
      if (best.v == 0 || beaten(image, best)) continue;
      if (result.count < capacity) {
        corners[result.count++] = best;
      } else {
        ++result.dropped;
      }
    }
  }
  if (result.dropped > 0) result.status = FastStatus::kOverflow;
  return result;
}

}  // namespace alidade
