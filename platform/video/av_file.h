#pragma once
// AvFile: the packets of the one video stream of a video file, by libavformat. One thread at a
// time.

#include <string>

#include "platform/video/av_handles.h"

namespace alidade {

class AvFile {
 public:
  AvFile() = default;
  ~AvFile();
  AvFile(const AvFile&) = delete;
  AvFile& operator=(const AvFile&) = delete;

  // On false, *error is `path: why`.
  [[nodiscard]] bool open(const std::string& path, std::string* error);
  [[nodiscard]] bool is_open() const { return stream_ != nullptr; }
  // Valid once the file is open.
  [[nodiscard]] const AVStream& stream() const { return *stream_; }

  // Reads the next packet. False: the end, or the place where a kill cut the file off.
  [[nodiscard]] bool read(AVPacket* packet);

 private:
  AVFormatContext* format_ = nullptr;
  const AVStream* stream_ = nullptr;
};

}  // namespace alidade
