#pragma once
// What a camera does to its pictures before it sends them: temporal noise reduction and sharpening.
//
//   reduced_n = w reduced_(n-1) + (1 - w) new_n
//   sent_n    = reduced_n + a (reduced_n - Gauss(reduced_n, sigma)), rounded
//
// The first picture is taken as it is. What is sharpened is not fed back. Pictures are given in
// their order; one thread at a time.

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "test/simulator/config.h"

namespace alidade::simulator {

class PictureFilter {
 public:
  PictureFilter(const SensorConfig& sensor, const ImageConfig& image)
      : sensor_(sensor), image_(image) {}

  [[nodiscard]] bool changes() const {
    return sensor_.noise_reduction > 0 || sensor_.sharpening > 0;
  }
  // After so many pictures less than half a grey level of the one before them is left.
  [[nodiscard]] std::size_t memory() const;

  // Grey levels, row after row, in place.
  void apply(std::vector<std::uint8_t>* picture);

 private:
  SensorConfig sensor_;
  ImageConfig image_;
  cv::Mat reduced_;  // CV_32F
};

}  // namespace alidade::simulator
