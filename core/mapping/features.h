#pragma once
// SIFT features of an image, RootSIFT descriptors in 8 bits, spread over the image.
//   descriptor  r_i = round(512 sqrt(s_i / sum s)), s SIFT's histogram: Euclidean distances of r are Hellinger distances of s
//               (Arandjelovic, Zisserman 2012)
//   place       Alidade's pixels (core/model/camera.h): OpenCV's are half a pixel less. OpenCV's doubled first image is
//               a quarter of a pixel off, and so are features of all scales (before OpenCV 4.8, and later unless asked otherwise):
//               measured once on a blob whose place is known, and taken off.
// Batch work: allocates. One thread at a time.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/model/linear_algebra.h"

namespace alidade {

inline constexpr int kDescriptorSize = 128;
using Descriptor = std::array<std::uint8_t, kDescriptorSize>;

struct Feature {
  Vector2<double> u;    // px
  double scale = 0;     // px: sigma of the blob that it is
  double angle = 0;     // rad, from u towards v
  double response = 0;  // contrast, 0 to 1
};

struct FeatureSet {
  std::vector<Feature> features;  // the strongest of their part of the image first
  std::vector<Descriptor> descriptors;

  [[nodiscard]] std::size_t size() const { return features.size(); }
};

struct FeatureOptions {
  int max_features = 1000;  // 1 or more
  int cells = 8;            // a side: each cell of the image has the same right to features
  double contrast_threshold = 0.02;  // SIFT's; 0.04 is OpenCV's own
  double least_distance_px =
      1.5;  // of two features; SIFT gives some blobs two orientations: one is kept
  int shrink =
      1;  // 1, 2 or 4: the image is looked at in so many times fewer pixels; faster, without the smallest features
};

class FeatureDetector {
 public:
  static constexpr int kLeastImage_px = 16;  // a side of an image in which something can be found

  explicit FeatureDetector(const FeatureOptions& options = {});
  ~FeatureDetector();
  FeatureDetector(const FeatureDetector&) = delete;
  FeatureDetector& operator=(const FeatureDetector&) = delete;

  // 8-bit luma, row v at luma + v * stride. Empty: nothing to be seen, or no image.
  [[nodiscard]] FeatureSet find(const std::uint8_t* luma, int width, int height,
                                std::ptrdiff_t stride) const;

  // What the installed OpenCV adds to both coordinates, px: a multiple of a quarter.
  [[nodiscard]] double opencv_offset_px() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace alidade
