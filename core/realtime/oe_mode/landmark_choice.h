#pragma once
// LandmarkChoice: which of the visible fine landmarks are aligned in a frame. This is the one place that
// decides it: to choose otherwise, change choose().
//
// Up to max_used visible fine landmarks: all of them, in their order; the choice begins where there are more (with the
// defaults, from images of 1280x720 on). Then the image is
// divided into columns x rows parts, of each part the most reliable landmark comes first, parts in strides, so
// that a small max_used is spread over the image too; what room is left goes to the others in their order.
// Reliable is what was found when it was looked for (rule of succession), halved for each octave further up,
// which sees half as sharply.
// Memory is taken by the constructor; nothing else allocates. One thread.

#include <cstdint>
#include <vector>

#include "core/model/camera.h"
#include "core/realtime/oe_mode/octaves.h"
#include "core/realtime/oe_mode/visible_landmarks.h"

namespace alidade {

struct LandmarkChoiceOptions {
  static constexpr int kMaxUsed = 1024;  // as many as the solution has room for

  int max_used = 200;  // landmarks, 1 to kMaxUsed
  // Parts of the image. Where more of them than max_used have a landmark, the last of the strides get none.
  int columns = 20;
  int rows = 12;

  // False and one line in *error (if not null) when a value is not valid.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

class LandmarkChoice {
 public:
  // max_visible: of visible landmarks. Options that are not valid are replaced by the nearest that are.
  LandmarkChoice(const LandmarkChoiceOptions& options, int max_visible);

  // Valid until the next call; visible is not changed.
  const std::vector<VisibleLandmark>& choose(const std::vector<VisibleLandmark>& visible,
                                             const LandmarkMap& map, const Octaves& octaves,
                                             const Camera<double>& camera);
  // As choose() left it.
  [[nodiscard]] const std::vector<VisibleLandmark>& chosen() const { return chosen_; }
  void clear();
  // How many visible fine landmarks choose() had the choice of.
  [[nodiscard]] int candidates() const { return candidates_; }

  [[nodiscard]] const LandmarkChoiceOptions& options() const { return options_; }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  void take(const std::vector<VisibleLandmark>& visible, std::size_t i);

  LandmarkChoiceOptions options_;
  int candidates_ = 0;
  std::vector<VisibleLandmark> chosen_;
  std::vector<int> best_;            // index of visible, by part of the image; kNone
  std::vector<std::uint8_t> taken_;  // by index of visible
};

}  // namespace alidade
