#pragma once
// Noise of an image, from the image alone: standard deviation of white noise (grey levels), from
// the second differences of the smoothest quarter of a sample of its pixels (Immerkaer 1996, made
// robust). Too large if everything is textured. Never below the noise of rounding to whole grey
// levels. Pure; no allocation.

#include <vector>

#include "core/realtime/image/image_view.h"

namespace alidade {

// image: valid. scratch: room for `capacity` samples, at least 1. An image below 3 x 3 px gives the
// noise of rounding.
[[nodiscard]] double image_noise(const ImageView& image, float* scratch, int capacity);

struct RunningNoiseOptions {
  double expected = 2;  // grey levels, > 0; until the first image
  int samples = 2048;   // samples per image, at least 1
  double memory = 0.1;  // weight of the latest image, 0 to 1

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// Noise of a camera's images: one standard deviation (grey levels), averaged over the latest ones.
// It comes from the images, not from alignment residuals, which motion blur increases. The
// constructor takes all memory.
class RunningNoise {
 public:
  explicit RunningNoise(const RunningNoiseOptions& options);

  void reset() { sigma_ = options_.expected; }
  // first: earlier images do not count. image: valid.
  void learn(const ImageView& image, bool first);
  [[nodiscard]] double sigma() const { return sigma_; }

  [[nodiscard]] std::size_t memory_bytes() const { return scratch_.size() * sizeof(float); }

 private:
  RunningNoiseOptions options_;
  double sigma_;
  std::vector<float> scratch_;
};

}  // namespace alidade
