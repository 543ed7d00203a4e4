#pragma once
// AvFile: the packets of one video stream of a video file, by libavformat: of several streams that
// of av_find_best_stream(). One thread at a time.

#include <string>

#include "platform/video/av_handles.h"

namespace alidade {

class AvFile {
 public:
  AvFile() = default;
  ~AvFile();
  AvFile(const AvFile&) = delete;
  AvFile& operator=(const AvFile&) = delete;

  // To be called once. On false, *error is `path: why`; `why` may be that there is no video.
  [[nodiscard]] bool open(const std::string& path, std::string* error);
  [[nodiscard]] bool is_open() const { return stream_ != nullptr; }
  // Valid once the file is open.
  [[nodiscard]] const AVStream& stream() const { return *stream_; }

  // Reads the stream's next packet; the file must be open. False: the end, the place where a kill
  // cut the file off, or any other error of reading; *packet is then empty.
  [[nodiscard]] bool read(AVPacket* packet);

 private:
  AVFormatContext* format_ = nullptr;
  const AVStream* stream_ = nullptr;
};

}  // namespace alidade
