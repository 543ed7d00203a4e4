#pragma once
// Writes encoded pictures as a Matroska file through libavformat: JPEG, or H.264 or H.265 in Annex
// B, each access unit that stands by itself with its parameter sets before it. Throws
// std::runtime_error naming the file. One thread at a time.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "test/simulator/config.h"

namespace alidade::simulator {

class VideoWriter {
 public:
  VideoWriter(const std::filesystem::path& file, VideoCodec codec, int width, int height,
              double rate_hz);
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  void write(const std::vector<std::uint8_t>& picture, double time_s);
  // The file is complete only after this.
  void finish();

 private:
  struct Muxer;
  std::unique_ptr<Muxer> muxer_;
};

}  // namespace alidade::simulator
