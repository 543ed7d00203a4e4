#pragma once
// Checks whether images show what landmarks need, and how the scene moves through them. No image is
// kept.
//   light    histogram of every 8th pixel of every 8th row. Dark: grey levels up to 16, which is
//            black in video's narrow range. Saturated: the topmost level that occurs and the one
//            below it, if the topmost is 230 or more: there the range of sensor or codec ends,
//            narrow or full.
//   texture  points that the start-up tracker (core/realtime) finds and follows: corners, with the
//            contrast that a calibration and OE mode demand at their start
//   motion   px, the tracker's shift of the image's centre from one image to the next
// Allocates when the image size changes, and for its notes of each image. One thread.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/realtime/image/image_view.h"
#include "core/realtime/start_up/start_up_tracker.h"
#include "edge_app/check/finding.h"
#include "edge_app/check/spread.h"

namespace alidade {

// How far the scene at the image's centre moved between two frames. from, to: the frames' numbers.
struct ImageShift {
  std::int64_t from = 0;
  std::int64_t to = 0;
  Vector2<double> shift = Vector2<double>::Zero();  // px
};

struct ImageLight {
  double mean = 0;       // grey levels
  double range = 0;      // grey levels, from the darkest 1 % to the brightest 1 %
  double dark = 0;       // share of the pixels
  double saturated = 0;  // share of the pixels
};

// image: valid().
[[nodiscard]] ImageLight measure_light(const ImageView& image);

struct ImageNeeds {
  std::string source;
  bool landmarks = true;  // OE mode; in PT mode images without texture are advice only
};

struct ImageReport {
  std::size_t images = 0;
  std::size_t without = 0;  // frames without an image
  ImageLight light;         // medians
  std::optional<Spread> points;
  double noise = 0;  // of a pixel, grey levels, median
  std::vector<ImageShift> shifts;
  Findings findings;
};

class ImageCheck {
 public:
  // frame: its number. image: if it is not valid(), the frame counts as one without an image.
  // connected: as far as known, no frame is missing since the one before.
  void add(std::int64_t frame, const ImageView& image, bool connected);

  [[nodiscard]] ImageReport report(const ImageNeeds& needs) const;

 private:
  std::unique_ptr<StartUpTracker> tracker_;
  int width_ = 0;
  int height_ = 0;
  std::optional<std::int64_t> before_;  // the frame with which the tracker compares
  std::vector<ImageLight> lights_;
  std::vector<double> points_;
  std::vector<double> noise_;
  std::vector<ImageShift> shifts_;
  std::size_t without_ = 0;
};

[[nodiscard]] ReportLines describe(const ImageReport& report);

}  // namespace alidade
