#pragma once
// LandmarkChoice: selects the visible fine landmarks to look for in a frame. Nothing else decides
// this. What a change of the choice touches: docs/landmark_choice.md.
// If at most max_chosen fine landmarks are visible, all are chosen, in their order. Otherwise the
// most reliable landmark of each of columns x rows parts of the image comes first, with a stride
// between parts; the others follow in their order. The same inputs give the same choice, as the
// choice is repeated within a frame. Reliability is the share of matches when looked for (rule of
// succession), halved for each coarser octave, as its resolution is half.
// The constructor takes all memory; nothing else allocates. One thread.

#include <cstdint>
#include <vector>

#include "core/model/lens/camera.h"
#include "core/realtime/oe_mode/octaves.h"
#include "core/realtime/oe_mode/orientation_solve.h"
#include "core/realtime/oe_mode/visible_landmarks.h"

namespace alidade {

struct LandmarkChoiceOptions {
  static constexpr int kLeastChosen = SolveLimits().min_inliers;  // with fewer no solution holds
  static constexpr int kMaxChosen = kMaxFoundLandmarks;           // limit of the solution
  static constexpr int kMaxParts = 96;                            // in each direction

  int max_chosen = 200;  // landmarks, kLeastChosen to kMaxChosen
  // Parts of the image, 1 to kMaxParts. If more parts than max_chosen have a landmark, some parts
  // get none; these are spread over the image. A max_chosen above columns * rows is filled in the
  // order of the map's slots.
  int columns = 20;
  int rows = 12;

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

class LandmarkChoice {
 public:
  // options: valid, except that tests may set max_chosen below kLeastChosen. max_visible: largest
  // number of visible landmarks.
  LandmarkChoice(const LandmarkChoiceOptions& options, int max_visible);

  // The result is valid until the next call.
  const std::vector<VisibleLandmark>& choose(const std::vector<VisibleLandmark>& visible,
                                             const LandmarkMap& map, const Octaves& octaves,
                                             const Camera<double>& camera);
  // Result of the last choose().
  [[nodiscard]] const std::vector<VisibleLandmark>& chosen() const { return chosen_; }
  void clear();
  // Number of visible fine landmarks in the last choose().
  [[nodiscard]] int fine_visible() const { return fine_visible_; }

  [[nodiscard]] const LandmarkChoiceOptions& options() const { return options_; }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  void take(const std::vector<VisibleLandmark>& visible, std::size_t i);

  LandmarkChoiceOptions options_;
  int fine_visible_ = 0;
  std::vector<VisibleLandmark> chosen_;
  std::vector<int> best_;            // by part of the image: index of visible, or kNone
  std::vector<std::uint8_t> taken_;  // by index of visible
};

}  // namespace alidade
