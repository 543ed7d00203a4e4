#pragma once
// The noise of an image, from the image alone: standard deviation of white noise, in grey levels, by the
// second differences of the smoothest quarter of a sample of its pixels (Immerkaer 1996, made robust).
// Where all is textured it is too large. Never below what rounding to whole grey levels makes.
// Pure; no allocation.

#include <vector>

#include "core/realtime/image/image_view.h"

namespace alidade {

// scratch: room for as many samples as shall be taken, at least 1.
[[nodiscard]] double image_noise(const ImageView& image, float* scratch, int capacity);

struct RunningNoiseOptions {
  double expected = 2;  // grey levels, > 0: until an image tells
  int samples = 2048;   // that an image is looked at by, at least 1
  double memory = 0.1;  // weight of the latest image, 0 to 1

  // False and one line in *error (if not null) when a value is not valid.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// The noise of a camera's images, one standard deviation in grey levels, averaged over the latest. Of the
// images and not of what alignment leaves over, which motion blur makes larger. Memory is taken by the
// constructor; nothing else allocates.
class RunningNoise {
 public:
  explicit RunningNoise(const RunningNoiseOptions& options);

  void reset() { sigma_ = options_.expected; }
  // first: nothing before it counts. image: valid.
  void learn(const ImageView& image, bool first);
  [[nodiscard]] double sigma() const { return sigma_; }

  [[nodiscard]] std::size_t memory_bytes() const { return scratch_.size() * sizeof(float); }

 private:
  RunningNoiseOptions options_;
  double sigma_;
  std::vector<float> scratch_;
};

}  // namespace alidade
