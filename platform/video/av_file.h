#pragma once
// AvFile: the packets of a video file's one video stream, by libavformat. One thread at a time.

#include <string>

#include "platform/video/av_handles.h"

namespace alidade {

class AvFile {
 public:
  AvFile() = default;
  ~AvFile();
  AvFile(const AvFile&) = delete;
  AvFile& operator=(const AvFile&) = delete;

  // False leaves `path: why` in *error.
  [[nodiscard]] bool open(const std::string& path, std::string* error);
  [[nodiscard]] bool is_open() const { return stream_ != nullptr; }
  // Valid once it is open.
  [[nodiscard]] const AVStream& stream() const { return *stream_; }

  // The next one. False: the end, or where a kill cut the file off.
  [[nodiscard]] bool read(AVPacket* packet);

 private:
  AVFormatContext* format_ = nullptr;
  const AVStream* stream_ = nullptr;
};

}  // namespace alidade
