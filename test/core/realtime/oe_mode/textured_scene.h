#pragma once
// A far plane with a texture that is known everywhere, and a narrow camera that turns before it: the texture
// moves in the image by focal_length times the angles, to a ten-thousandth of a pixel.

#include <gtest/gtest.h>

#include <cstdint>
#include <random>

#include "core/model/calibration.h"
#include "core/model/rolling_shutter.h"
#include "core/realtime/image/pyramid.h"
#include "core/realtime/oe_mode/landmark_maker.h"
#include "core/realtime/oe_mode/landmark_map.h"
#include "core/realtime/oe_mode/octaves.h"
#include "core/realtime/oe_mode/processed_frame.h"
#include "core/realtime/oe_mode/view_projection.h"
#include "core/realtime/oe_mode/visible_landmarks.h"
#include "test/core/realtime/image/analytic_image.h"

namespace alidade::test {

class TexturedScene {
 public:
  static constexpr int kWidth = 320;                  // px
  static constexpr int kHeight = 240;                 // px
  static constexpr double kFocalLength = 20000;       // px
  static constexpr double kNoise = 1;                 // grey levels
  static constexpr double kPixel = 1 / kFocalLength;  // rad

  TexturedScene() {
    calibration_.camera = {kFocalLength, 1, {0}, kWidth, kHeight};
    octaves_.reset(kHeight);
    octaves_.set_noise(kNoise);
    map_.clear(kCell_px * kPixel, 3 * kCell_px * kPixel);
  }

  static LandmarkMakerOptions maker_options() {
    LandmarkMakerOptions options;
    options.cell_size_px = kCell_px;
    return options;
  }

  // Where the camera looks, by pixels to the right and up of where it began.
  static FrameMotion<double> motion_at(const Vector2<double>& px) {
    return {{kPixel * px.x(), kPixel * px.y()}, {0, 0}, 0.5 * kHeight};
  }

  // The image that it sees there, until the next.
  ImageView look(const Vector2<double>& px) {
    const auto grey = [&](const Vector2<double>& u) {
      return texture_(u + Vector2<double>(px.x(), -px.y()));
    };
    image_ = make_pixels(kWidth, kHeight, grey, kNoise, &random_);
    return show(image_.view);
  }
  // The same with nothing to see.
  ImageView look_at_nothing() {
    const auto grey = [](const Vector2<double>&) { return 100.0; };
    image_ = make_pixels(kWidth, kHeight, grey, kNoise, &random_);
    return show(image_.view);
  }

  // Landmarks of the image last looked at, seen from there.
  double make_landmarks(LandmarkMaker* maker, const Vector2<double>& px) {
    ProcessedFrame frame;
    frame.frame = ++frames_;
    frame.motion = motion_at(px);
    VisibleLandmarks visible(map_.capacity());
    visible.reset(calibration_, 1.3);
    const ViewProjection view(calibration_, frame.motion);
    return maker->make(calibration_, pyramid_, octaves_, frame,
                       visible.find(calibration_, map_, view), &map_);
  }

  Calibration calibration_;
  Octaves octaves_{OctaveOptions{}};
  Pyramid pyramid_{kWidth, kHeight, Pyramid::kMaxOctaves};
  LandmarkMap map_{1000, 1e-3};

 private:
  static constexpr double kCell_px = 24;

  ImageView show(const ImageView& view) {
    EXPECT_EQ(pyramid_.build(view, octaves_.count()), PyramidStatus::kOk);
    return view;
  }

  std::mt19937_64 random_{5};
  AnalyticImage texture_{&random_, 8};
  Pixels image_;
  std::uint32_t frames_ = 0;
};

}  // namespace alidade::test
