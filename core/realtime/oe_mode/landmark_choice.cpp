#include "core/realtime/oe_mode/landmark_choice.h"

#include <algorithm>
#include <cmath>

namespace alidade {
namespace {

constexpr int kNone = -1;
// Step from one part to the next: a prime above kMaxParts. It divides no number of parts, so all
// parts are visited.
constexpr std::size_t kStride = 97;
static_assert(kStride > LandmarkChoiceOptions::kMaxParts);

double reliability(const VisibleLandmark& visible, const LandmarkMap& map) {
  const LandmarkStatistics& s = map.at(visible.slot).statistics;
  return (s.matched + 1.0) / (s.looked_for + 2.0) / (1 << visible.octave);
}

}  // namespace

bool LandmarkChoiceOptions::validate(const char** error) const {
  static_assert(kLeastChosen == 8 && kMaxChosen == 1024 && kMaxParts == 96, "as the messages say");
  const char* problem = nullptr;
  if (rows < 1 || rows > kMaxParts) problem = "rows must be 1 to 96";
  if (columns < 1 || columns > kMaxParts) problem = "columns must be 1 to 96";
  if (max_chosen < kLeastChosen || max_chosen > kMaxChosen)
    problem = "max_chosen must be 8 to 1024";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

LandmarkChoice::LandmarkChoice(const LandmarkChoiceOptions& options, int max_visible)
    : options_(options) {
  chosen_.reserve(static_cast<std::size_t>(options_.max_chosen));
  best_.resize(static_cast<std::size_t>(options_.columns * options_.rows));
  taken_.resize(static_cast<std::size_t>(max_visible));
}

void LandmarkChoice::clear() {
  chosen_.clear();
  fine_visible_ = 0;
}

void LandmarkChoice::take(const std::vector<VisibleLandmark>& visible, std::size_t i) {
  if (taken_[i] != 0 || static_cast<int>(chosen_.size()) == options_.max_chosen) return;
  chosen_.push_back(visible[i]);
  taken_[i] = 1;
}

const std::vector<VisibleLandmark>& LandmarkChoice::choose(
    const std::vector<VisibleLandmark>& visible, const LandmarkMap& map, const Octaves& octaves,
    const Camera<double>& camera) {
  clear();
  std::fill_n(taken_.begin(), visible.size(), std::uint8_t{0});
  for (const VisibleLandmark& v : visible) fine_visible_ += octaves.is_coarse(v.octave) ? 0 : 1;
  if (fine_visible_ > options_.max_chosen) {
    std::fill(best_.begin(), best_.end(), kNone);
    for (std::size_t i = 0; i < visible.size(); ++i) {
      const VisibleLandmark& candidate = visible[i];
      if (octaves.is_coarse(candidate.octave)) continue;
      const int column =
          std::min(options_.columns - 1,
                   static_cast<int>(candidate.u.x() / camera.width * options_.columns));
      const int row = std::min(options_.rows - 1,
                               static_cast<int>(candidate.u.y() / camera.height * options_.rows));
      int& incumbent = best_[static_cast<std::size_t>(row * options_.columns + column)];
      if (incumbent == kNone ||
          reliability(candidate, map) >
              reliability(visible[static_cast<std::size_t>(incumbent)], map)) {
        incumbent = static_cast<int>(i);
      }
    }
    for (std::size_t j = 0; j < best_.size(); ++j) {
      const int i = best_[j * kStride % best_.size()];
      if (i != kNone) take(visible, static_cast<std::size_t>(i));
    }
  }
  for (std::size_t i = 0; i < visible.size(); ++i) {
    if (!octaves.is_coarse(visible[i].octave)) take(visible, i);
  }
  return chosen_;
}

std::size_t LandmarkChoice::memory_bytes() const {
  return chosen_.capacity() * sizeof(VisibleLandmark) + best_.size() * sizeof(int) + taken_.size();
}

}  // namespace alidade
