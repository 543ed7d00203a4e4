#pragma once
// LandmarkChoice: which of the visible fine landmarks are looked for in a frame. This is the one place that
// decides it: to choose otherwise, change choose(). README.md of this folder says what such a change touches.
//
// Where no more than max_chosen fine landmarks are visible, all are chosen, in their order; preferences begin where there are more. Then the image is divided into columns x rows parts, of each part the
// most reliable landmark comes first, parts in strides, so that a small max_chosen is spread over the image too;
// what room is left goes to the others in their order. The same inputs give the same choice: it is made anew within a frame.
// Reliable is what matched when it was looked for (rule of succession), halved for each octave further up,
// which sees half as sharply.
// Memory is taken by the constructor; nothing else allocates. One thread.

#include <cstdint>
#include <vector>

#include "core/model/camera.h"
#include "core/realtime/oe_mode/octaves.h"
#include "core/realtime/oe_mode/orientation_solve.h"
#include "core/realtime/oe_mode/visible_landmarks.h"

namespace alidade {

struct LandmarkChoiceOptions {
  static constexpr int kLeastChosen = SolveLimits().min_inliers;  // fewer never hold
  static constexpr int kMaxChosen = kMaxFoundLandmarks;           // as the solution has room for
  static constexpr int kMaxParts = 96;                            // in each direction

  int max_chosen = 200;  // landmarks, kLeastChosen to kMaxChosen
  // Parts of the image, 1 to kMaxParts. Where more of them than max_chosen have a landmark, some get none, spread over
  // the image; a max_chosen above columns * rows is filled in the order of the map's slots.
  int columns = 20;
  int rows = 12;

  // False and one line in *error (if not null) when a value is not valid.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

class LandmarkChoice {
 public:
  // options: valid; max_chosen may be less than kLeastChosen, as for a test. max_visible: of visible landmarks.
  LandmarkChoice(const LandmarkChoiceOptions& options, int max_visible);

  // Valid until the next call; visible is not changed.
  const std::vector<VisibleLandmark>& choose(const std::vector<VisibleLandmark>& visible,
                                             const LandmarkMap& map, const Octaves& octaves,
                                             const Camera<double>& camera);
  // As choose() left it.
  [[nodiscard]] const std::vector<VisibleLandmark>& chosen() const { return chosen_; }
  void clear();
  // How many visible fine landmarks choose() had the choice of.
  [[nodiscard]] int fine_visible() const { return fine_visible_; }

  [[nodiscard]] const LandmarkChoiceOptions& options() const { return options_; }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  void take(const std::vector<VisibleLandmark>& visible, std::size_t i);

  LandmarkChoiceOptions options_;
  int fine_visible_ = 0;
  std::vector<VisibleLandmark> chosen_;
  std::vector<int> best_;            // index of visible, by part of the image; kNone
  std::vector<std::uint8_t> taken_;  // by index of visible
};

}  // namespace alidade
