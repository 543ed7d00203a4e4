#include "platform/video/picture_file.h"

#include <algorithm>

#include "platform/video/av_file.h"
#include "platform/video/av_handles.h"
#include "platform/video/luma_decoder.h"

namespace alidade {

bool read_picture_file(const std::string& path, Picture* picture, std::string* error) {
  silence_av_log();
  AvFile file;
  if (!file.open(path, error)) return false;
  LumaDecoder decoder;
  if (!decoder.open(*file.stream().codecpar, false)) {
    *error = path + ": " + decoder.error();
    return false;
  }
  const PacketPtr packet(av_packet_alloc());
  if (packet != nullptr && file.read(packet.get()) && decoder.send(packet.get())) {
    (void)decoder.send(nullptr);
    if (decoder.receive(picture) == LumaDecoder::Result::kPicture) return true;
  }
  *error = path + ": holds no picture that can be decoded";
  return false;
}

std::string grey_png(const std::uint8_t* luma, int width, int height, std::ptrdiff_t stride) {
  silence_av_log();
  const AVCodec* codec = avcodec_find_encoder(AV_CODEC_ID_PNG);
  const CodecContextPtr context(codec == nullptr ? nullptr : avcodec_alloc_context3(codec));
  const FramePtr frame(av_frame_alloc());
  const PacketPtr packet(av_packet_alloc());
  if (context == nullptr || frame == nullptr || packet == nullptr) return "";
  context->width = frame->width = width;
  context->height = frame->height = height;
  context->pix_fmt = AV_PIX_FMT_GRAY8;
  context->time_base = {1, 1};
  frame->format = AV_PIX_FMT_GRAY8;
  if (avcodec_open2(context.get(), codec, nullptr) < 0 || av_frame_get_buffer(frame.get(), 0) < 0) {
    return "";
  }
  for (int v = 0; v < height; ++v) {
    std::copy_n(luma + v * stride, width, frame->data[0] + std::ptrdiff_t{v} * frame->linesize[0]);
  }
  if (avcodec_send_frame(context.get(), frame.get()) < 0 ||
      avcodec_receive_packet(context.get(), packet.get()) < 0) {
    return "";
  }
  return {packet->data, packet->data + packet->size};
}

}  // namespace alidade
