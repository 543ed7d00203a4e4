#pragma once
// KeptFrames: frames of the virtual camera that were rendered before, in a folder, so that an experiment that is repeated takes seconds.
//
// A folder of frames is named after all that they show: a change of it makes new ones, a change of the renderer does not.

#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <string>

#include "test/simulator/config.h"

namespace alidade::test {

// All of the configuration that a noise-free frame depends on.
[[nodiscard]] std::string image_key(const simulator::Config& config);

class KeptFrames {
 public:
  // key: all that the frames depend on. An empty cache keeps nothing.
  KeptFrames(const std::string& name, const std::string& key, const std::filesystem::path& cache);

  // 8 bits, one channel. By several threads, of different numbers. Throws std::runtime_error if a kept frame can be neither read nor
  // written.
  [[nodiscard]] cv::Mat frame(int number, const std::function<cv::Mat()>& render) const;

 private:
  std::filesystem::path folder_;  // or empty
};

}  // namespace alidade::test
