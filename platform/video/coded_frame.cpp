#include "platform/video/coded_frame.h"

#include "platform/video/stream_copy.h"

namespace alidade {

std::size_t coded_bytes(const Frame& frame) {
  return frame.coded ? static_cast<std::size_t>(frame.coded->packet->size) : 0;
}

std::pair<const std::uint8_t*, std::size_t> coded_jpeg(const Frame& frame) {
  if (!frame.coded || frame.coded->parameters->codec_id != AV_CODEC_ID_MJPEG) return {nullptr, 0};
  return {frame.coded->packet->data, coded_bytes(frame)};
}

}  // namespace alidade
