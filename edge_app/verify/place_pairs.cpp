#include "edge_app/verify/place_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "core/model/recording_needs.h"
#include "core/realtime/image/fast_corners.h"
#include "core/realtime/image/patch_alignment.h"
#include "core/realtime/image/pyramid.h"

namespace alidade {
namespace {

constexpr std::size_t kPartners = 8;  // of a frame, at most
constexpr std::size_t kPlaces = 24;   // looked for in a pair
constexpr std::size_t kLeastPlaces = 6;
constexpr double kBorder_px = 14;
constexpr std::uint8_t kCornerThreshold = 12;  // grey levels
constexpr double kMinContrast = 3;             // grey levels / px
constexpr int kCoarseOctave = 2;
constexpr std::size_t kLeastCoarse = 4;
constexpr double kOutlierSpreads = 4;  // of standard deviations, by the median deviation
constexpr double kNoOutlier_px = 0.5;

// What says where a frame looks while places are searched for.
const FrameOrientation& best_of(const SeenFrame& frame) {
  return frame.by_landmarks.mode == OrientationMode::kOe ? frame.by_landmarks
                                                         : frame.by_all_samples;
}

std::optional<Vector2<double>> transfer(const FrameOrientation& from, const FrameOrientation& to,
                                        const Vector2<double>& u) {
  Vector3<double> d;
  Vector2<double> out;
  if (from.direction(u, &d) != ProjectionStatus::kOk) return std::nullopt;
  if (to.pixel(d, &out) != ProjectionStatus::kOk) return std::nullopt;
  return out;
}

struct SearchedPicture {
  std::unique_ptr<Pyramid> pyramid;
  std::vector<Vector2<double>> corners;
};

SearchedPicture search_picture(const SeenFrame& frame) {
  constexpr int kColumns = 28;
  const ImageView image = frame.image();
  SearchedPicture out;
  out.pyramid = std::make_unique<Pyramid>(image.width, image.height, kCoarseOctave + 1);
  if (out.pyramid->build(image, kCoarseOctave + 1) != PyramidStatus::kOk) return out;
  FastGrid grid(image.width, image.height, std::max(8, image.width / kColumns));
  std::vector<FastCorner> found(static_cast<std::size_t>(grid.max_cells()));
  const FastResult result =
      grid.detect(image, kCornerThreshold, found.data(), static_cast<int>(found.size()));
  for (int i = 0; i < result.count; ++i) {
    const FastCorner& corner = found[static_cast<std::size_t>(i)];
    out.corners.emplace_back(corner.u + 0.5, corner.v + 0.5);
  }
  return out;
}

bool is_inside(const Vector2<double>& u, const ImageView& image, double border) {
  return u.x() > border && u.y() > border && u.x() < image.width - border &&
         u.y() < image.height - border;
}

struct SoughtPlace {
  Vector2<double> first;
  Vector2<double> expected;  // px, in the second picture
  Matrix2<double> A;         // d first / d second
};

std::optional<Vector2<double>> find_place(const SearchedPicture& first,
                                          const SearchedPicture& second, int octave,
                                          const SoughtPlace& place, const Vector2<double>& shift,
                                          Matrix2<double>* covariance) {
  if (octave >= first.pyramid->octaves() || octave >= second.pyramid->octaves()) return {};
  const double scale = std::ldexp(1.0, octave);
  ReferencePatch patch;
  if (prepare(first.pyramid->octave(octave), place.first / scale, place.A, kMinContrast, &patch) !=
      PrepareStatus::kOk) {
    return std::nullopt;
  }
  Alignment found;
  if (align(patch, second.pyramid->octave(octave), (place.expected + shift) / scale, {}, &found) !=
      AlignmentStatus::kConverged) {
    return std::nullopt;
  }
  if (covariance != nullptr) *covariance = found.covariance;
  return found.position * scale;
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Vector2<double> median_of(const std::vector<Vector2<double>>& values) {
  std::vector<double> u;
  std::vector<double> v;
  for (const Vector2<double>& value : values) {
    u.push_back(value.x());
    v.push_back(value.y());
  }
  return {median_of(std::move(u)), median_of(std::move(v))};
}

std::vector<SoughtPlace> sought_places(const SeenFrame& first, const SeenFrame& second,
                                       const std::vector<Vector2<double>>& corners,
                                       std::size_t turn) {
  std::vector<SoughtPlace> seen;
  for (const Vector2<double>& corner : corners) {
    const auto expected = transfer(best_of(first), best_of(second), corner);
    if (!expected || !is_inside(*expected, second.image(), kBorder_px) ||
        !is_inside(corner, first.image(), kBorder_px)) {
      continue;
    }
    SoughtPlace place;
    place.first = corner;
    place.expected = *expected;
    bool is_known = true;
    for (int axis = 0; axis < 2; ++axis) {
      const Vector2<double> step = Vector2<double>::Unit(axis);
      const auto after = transfer(best_of(second), best_of(first), *expected + step);
      const auto before = transfer(best_of(second), best_of(first), *expected - step);
      is_known = is_known && after && before;
      if (after && before) place.A.col(axis) = (*after - *before) / 2;
    }
    if (is_known) seen.push_back(place);
  }
  if (seen.size() <= kPlaces) return seen;
  // All over the picture, and others than in the frame's other pairs.
  std::vector<SoughtPlace> chosen;
  for (std::size_t k = 0; k < kPlaces; ++k) {
    const std::size_t low = k * seen.size() / kPlaces;
    const std::size_t high = (k + 1) * seen.size() / kPlaces;
    chosen.push_back(seen[low + turn % (high - low)]);
  }
  return chosen;
}

// Places that do not move as most of the pair's do are mismatches, or move in the world.
void leave_out_strays(const std::vector<SoughtPlace>& sought, PlacePair* pair,
                      std::vector<std::size_t> of_sought) {
  std::vector<Vector2<double>> off;
  for (std::size_t i = 0; i < pair->places.size(); ++i) {
    off.push_back(pair->places[i].second - sought[of_sought[i]].expected);
  }
  if (off.empty()) return;
  const Vector2<double> middle = median_of(off);
  std::vector<double> away;
  away.reserve(off.size());
  for (const Vector2<double>& each : off) away.push_back((each - middle).norm());
  // Of a Rayleigh distribution the median is 1.18 sigma.
  const double limit = std::max(kNoOutlier_px, kOutlierSpreads * median_of(away) / 1.18);
  std::vector<PlaceMatch> kept;
  for (std::size_t i = 0; i < away.size(); ++i) {
    if (away[i] <= limit) kept.push_back(pair->places[i]);
  }
  pair->places = std::move(kept);
}

PlacePair match_pair(const std::vector<SeenFrame>& frames,
                     const std::vector<SearchedPicture>& pictures, std::size_t first,
                     std::size_t second, std::size_t turn) {
  PlacePair pair{first, second, {}};
  const std::vector<SoughtPlace> sought =
      sought_places(frames[first], frames[second], pictures[first].corners, turn);
  std::vector<Vector2<double>> coarse;
  for (const SoughtPlace& place : sought) {
    const auto found = find_place(pictures[first], pictures[second], kCoarseOctave, place,
                                  Vector2<double>::Zero(), nullptr);
    if (found) coarse.push_back(*found - place.expected);
  }
  const Vector2<double> shift =
      coarse.size() < kLeastCoarse ? Vector2<double>(0, 0) : median_of(coarse);
  std::vector<std::size_t> of_sought;
  for (std::size_t i = 0; i < sought.size(); ++i) {
    Matrix2<double> covariance;
    const auto found =
        find_place(pictures[first], pictures[second], 0, sought[i], shift, &covariance);
    if (!found) continue;
    pair.places.push_back({sought[i].first, *found, covariance});
    of_sought.push_back(i);
  }
  leave_out_strays(sought, &pair, std::move(of_sought));
  return pair;
}

bool overlap(const SeenFrame& first, const SeenFrame& second) {
  const ImageView image = first.image();
  const Vector2<double> middle(image.width / 2.0, image.height / 2.0);
  const auto seen = transfer(best_of(first), best_of(second), middle);
  if (!seen) return false;
  const Vector2<double> shift = (*seen - middle).cwiseAbs();
  return shift.x() < (1 - kReturnOverlapLeast) * image.width &&
         shift.y() < (1 - kReturnOverlapLeast) * image.height;
}

}  // namespace

std::vector<PlacePair> match_places(const std::vector<SeenFrame>& frames) {
  std::vector<SearchedPicture> pictures;
  pictures.reserve(frames.size());
  for (const SeenFrame& frame : frames) pictures.push_back(search_picture(frame));
  std::vector<PlacePair> pairs;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    std::vector<std::size_t> partners;
    for (std::size_t j = i + 1; j < frames.size(); ++j) {
      if (frames[j].time_s - frames[i].time_s >= kReturnGapLeast_s && overlap(frames[i], frames[j]))
        partners.push_back(j);
    }
    const std::size_t wanted = std::min(kPartners, partners.size());
    for (std::size_t k = 0; k < wanted; ++k) {
      const std::size_t low = k * partners.size() / wanted;
      const std::size_t high = (k + 1) * partners.size() / wanted;
      PlacePair pair =
          match_pair(frames, pictures, i, partners[low + (i * 7 + k) % (high - low)], k);
      if (pair.places.size() >= kLeastPlaces) pairs.push_back(std::move(pair));
    }
  }
  return pairs;
}

}  // namespace alidade
