#pragma once
// Writes JPEG pictures as a Matroska file, unchanged, through libavformat.
// Throws std::runtime_error naming the file. One thread at a time.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

namespace alidade::simulator {

class VideoWriter {
 public:
  VideoWriter(const std::filesystem::path& file, int width, int height, double rate_hz);
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  void write(const std::vector<std::uint8_t>& jpeg, double time_s);
  // The file is complete only after this.
  void finish();

 private:
  struct Muxer;
  std::unique_ptr<Muxer> muxer_;
};

}  // namespace alidade::simulator
