#include "test/platform/support/picture_files.h"

extern "C" {
#include <libavutil/opt.h>
}

#include <cstring>
#include <stdexcept>

namespace alidade {
namespace {

void check(int code) {
  if (code < 0) {
    throw std::runtime_error(av_error_text(code));
  }
}

CodecContextPtr encoder_of(const char* name, int width, int height, AVPixelFormat format) {
  const AVCodec* codec = avcodec_find_encoder_by_name(name);
  CodecContextPtr encoder(avcodec_alloc_context3(codec));
  encoder->width = width;
  encoder->height = height;
  encoder->pix_fmt = format;
  encoder->time_base = {1, 25};
  encoder->thread_count = 1;
  encoder->strict_std_compliance = FF_COMPLIANCE_UNOFFICIAL;
  return encoder;
}

FramePtr picture_of(const AVCodecContext& encoder, int grey) {
  FramePtr picture(av_frame_alloc());
  picture->width = encoder.width;
  picture->height = encoder.height;
  picture->format = encoder.pix_fmt;
  check(av_frame_get_buffer(picture.get(), 0));
  for (int plane = 0; plane < 3 && picture->buf[plane] != nullptr; ++plane) {
    std::memset(picture->buf[plane]->data, plane == 0 ? grey : 128,
                static_cast<std::size_t>(picture->buf[plane]->size));
  }
  return picture;
}

}  // namespace

std::string picture_file(const std::string& encoder_name, int width, int height, int grey,
                         AVPixelFormat format) {
  const bool jpeg = encoder_name == "mjpeg";
  const CodecContextPtr encoder =
      encoder_of(encoder_name.c_str(), width, height, jpeg ? AV_PIX_FMT_YUVJ420P : format);
  check(avcodec_open2(encoder.get(), encoder->codec, nullptr));
  const FramePtr picture = picture_of(*encoder, grey);
  picture->quality = FF_QP2LAMBDA;
  check(avcodec_send_frame(encoder.get(), picture.get()));
  const PacketPtr packet(av_packet_alloc());
  check(avcodec_receive_packet(encoder.get(), packet.get()));
  return {reinterpret_cast<const char*>(packet->data), static_cast<std::size_t>(packet->size)};
}

void write_video(const std::string& path, int width, int height, int pictures, int b_frames) {
  const CodecContextPtr encoder = encoder_of("libx264", width, height, AV_PIX_FMT_YUV420P);
  encoder->max_b_frames = b_frames;
  encoder->gop_size = 10;
  encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  // Not as few as it thinks fit.
  av_opt_set(encoder->priv_data, "x264-params", "b-adapt=0:scenecut=0", 0);
  check(avcodec_open2(encoder.get(), encoder->codec, nullptr));
  AVFormatContext* file = nullptr;
  check(avformat_alloc_output_context2(&file, nullptr, "matroska", path.c_str()));
  AVStream* stream = avformat_new_stream(file, nullptr);
  check(avcodec_parameters_from_context(stream->codecpar, encoder.get()));
  check(avio_open(&file->pb, path.c_str(), AVIO_FLAG_WRITE));
  check(avformat_write_header(file, nullptr));
  const PacketPtr packet(av_packet_alloc());
  for (int i = 0; i <= pictures; ++i) {
    const FramePtr picture = i < pictures ? picture_of(*encoder, 20 + 10 * i) : nullptr;
    if (picture) {
      picture->pts = i;
    }
    check(avcodec_send_frame(encoder.get(), picture.get()));
    while (avcodec_receive_packet(encoder.get(), packet.get()) == 0) {
      av_packet_rescale_ts(packet.get(), encoder->time_base, stream->time_base);
      check(av_write_frame(file, packet.get()));
    }
  }
  check(av_write_trailer(file));
  check(avio_closep(&file->pb));
  avformat_free_context(file);
}

}  // namespace alidade
