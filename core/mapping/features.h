#pragma once
// FeatureDetector: SIFT features of an image, spread over it, with RootSIFT descriptors in 8 bits.
//   descriptor   r_i = round(512 sqrt(s_i / sum s)), s SIFT's histogram. Euclidean distances of r
//                are Hellinger distances of s (Arandjelovic, Zisserman 2012).
//   place        in Alidade's pixels (core/model/lens/camera.h); OpenCV's are half a pixel less.
//                OpenCV doubles the size of its first image. Before 4.8, and later by default, the
//                doubling moves all features by a quarter of a pixel. This shift is measured once,
//                on a blob at a known place, and subtracted.
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
  double scale = 0;     // px; sigma of the blob
  double angle = 0;     // rad, from u towards v
  double response = 0;  // contrast, 0 to 1
};

struct FeatureSet {
  std::vector<Feature> features;        // the strongest of each cell, then the second ones, ...
  std::vector<Descriptor> descriptors;  // one for each feature, in the same order

  [[nodiscard]] std::size_t size() const { return features.size(); }
};

struct FeatureOptions {
  int max_features = 1000;  // 1 or more
  int cells = 8;            // along a side; each cell of the image gets the same share of features
  double contrast_threshold = 0.02;  // SIFT's; OpenCV's default is 0.04
  // px of the searched image; of two features of about one size that are nearer, the stronger is
  // kept. SIFT gives some blobs two orientations.
  double least_distance_px = 1.5;
  // 1, 2 or 4: the searched image has this factor fewer pixels along a side. Faster, without the
  // smallest features. No side is shrunk below kLeastImage_px. Places and scales are those of the
  // whole image.
  int shrink = 1;
};

class FeatureDetector {
 public:
  static constexpr int kLeastImage_px = 16;  // smallest side of an image that is searched

  explicit FeatureDetector(const FeatureOptions& options = {});
  ~FeatureDetector();
  FeatureDetector(const FeatureDetector&) = delete;
  FeatureDetector& operator=(const FeatureDetector&) = delete;

  // 8-bit luma, row v at luma + v * stride. Empty if there are no features or no image (null), or a
  // side is shorter than kLeastImage_px.
  [[nodiscard]] FeatureSet find(const std::uint8_t* luma, int width, int height,
                                std::ptrdiff_t stride) const;

  // px; the shift that the installed OpenCV adds to both coordinates: a multiple of a quarter.
  // find() subtracts it.
  [[nodiscard]] double opencv_offset_px() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace alidade
