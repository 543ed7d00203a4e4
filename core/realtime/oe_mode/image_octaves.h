#pragma once
// ImageOctaves: the image of a frame in octaves, with the noise that the camera's images leave in
// each. The constructor takes all memory; nothing else allocates. One thread.

#include <cstddef>

#include "core/model/lens/camera.h"
#include "core/realtime/image/image_noise.h"
#include "core/realtime/image/image_view.h"
#include "core/realtime/image/pyramid.h"
#include "core/realtime/oe_mode/octaves.h"
#include "core/realtime/oe_mode/oe_options.h"

namespace alidade {

class ImageOctaves {
 public:
  // options: valid.
  explicit ImageOctaves(const OeOptions& options)
      : pyramid_(options.max_width, options.max_height, Pyramid::kMaxOctaves),
        octaves_(options.octaves),
        noise_(options.noise) {}

  // height_px: of the images to come.
  void reset(int height_px) { octaves_.reset(height_px); }
  // From now on the noise is the one expected, until an image is learnt from.
  void forget_noise() {
    noise_.reset();
    octaves_.set_noise(noise_.sigma());
  }

  // False if there is no image, if it is not of the camera's size, or if it exceeds the options'.
  [[nodiscard]] bool build(const ImageView& image, const Camera<double>& camera) {
    return image.valid() && image.width == camera.width && image.height == camera.height &&
           pyramid_.build(image, octaves_.count()) == PyramidStatus::kOk;
  }
  // first: earlier images do not count. image: valid.
  void learn_noise(const ImageView& image, bool first) {
    noise_.learn(image, first);
    octaves_.set_noise(noise_.sigma());
  }

  // The octaves of the last image built. The image's memory must stay, unchanged: see Pyramid.
  [[nodiscard]] const Pyramid& pyramid() const { return pyramid_; }
  [[nodiscard]] const Octaves& octaves() const { return octaves_; }

  // Without its own size.
  [[nodiscard]] std::size_t memory_bytes() const {
    return pyramid_.memory_bytes() + noise_.memory_bytes();
  }

 private:
  Pyramid pyramid_;
  Octaves octaves_;
  RunningNoise noise_;
};

}  // namespace alidade
