#include "test/platform/support/coded_stream.h"

extern "C" {
#include <libavutil/opt.h>
}

#include <cstring>
#include <stdexcept>
#include <string>

namespace alidade {
namespace {

void require_coding(int code) {
  if (code < 0) throw std::runtime_error(av_error_text(code));
}

CodecContextPtr make_encoder(const CodedStreamOptions& options) {
  const bool h265 = options.codec == CodedBy::kH265;
  const AVCodec* codec = avcodec_find_encoder_by_name(h265 ? "libx265" : "libx264");
  CodecContextPtr encoder(avcodec_alloc_context3(codec));
  encoder->width = options.width;
  encoder->height = options.height;
  if (options.references > 0) encoder->refs = options.references;
  encoder->time_base = {1, 30};
  encoder->gop_size = options.key_every;
  encoder->max_b_frames = options.allowed_to_overtake;
  encoder->thread_count = 1;
  encoder->pix_fmt = AV_PIX_FMT_YUV420P;
  if (!options.sets_in_band) encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  if (options.interlaced) {
    encoder->flags |= AV_CODEC_FLAG_INTERLACED_DCT | AV_CODEC_FLAG_INTERLACED_ME;
  }
  av_opt_set(encoder->priv_data, "preset", "ultrafast", 0);
  if (options.allowed_to_overtake == 0) av_opt_set(encoder->priv_data, "tune", "zerolatency", 0);
  if (h265) {
    std::string text = "log-level=none:open-gop=0:scenecut=0:pools=none:frame-threads=1";
    if (options.references > 0) text += ":ref=" + std::to_string(options.references);
    if (options.sets_in_band) text += ":repeat-headers=1";
    if (options.allowed_to_overtake > 0) text += ":b-adapt=0:rc-lookahead=5";
    av_opt_set(encoder->priv_data, "x265-params", text.c_str(), 0);
  } else {
    av_opt_set(encoder->priv_data, "x264-params", "b-adapt=0:scenecut=0", 0);
  }
  require_coding(avcodec_open2(encoder.get(), codec, nullptr));
  return encoder;
}

// Stripes that move: no two pictures are the same.
void paint(AVFrame* picture, int number) {
  require_coding(av_frame_make_writable(picture));
  for (int plane = 0; plane < 3; ++plane) {
    const int rows = plane == 0 ? picture->height : picture->height / 2;
    for (int v = 0; v < rows; ++v) {
      for (int u = 0; u < (plane == 0 ? picture->width : picture->width / 2); ++u) {
        picture->data[plane][v * picture->linesize[plane] + u] =
            static_cast<std::uint8_t>(plane == 0 ? 40 + ((u + 3 * number) * 5 + v) % 160 : 128);
      }
    }
  }
}

}  // namespace

CodedStream coded_stream(const CodedStreamOptions& options) {
  const CodecContextPtr encoder = make_encoder(options);
  CodedStream stream;
  stream.parameters.reset(avcodec_parameters_alloc());
  require_coding(avcodec_parameters_from_context(stream.parameters.get(), encoder.get()));
  const FramePtr picture(av_frame_alloc());
  picture->width = options.width;
  picture->height = options.height;
  picture->format = encoder->pix_fmt;
  picture->interlaced_frame = options.interlaced ? 1 : 0;
  require_coding(av_frame_get_buffer(picture.get(), 0));
  const PacketPtr packet(av_packet_alloc());
  for (int i = 0; i <= options.pictures; ++i) {
    if (i < options.pictures) {
      paint(picture.get(), i);
      picture->pts = i;
      // The encoder uses no more of what it is allowed to.
      picture->pict_type = i % options.key_every == 0 ? AV_PICTURE_TYPE_I : AV_PICTURE_TYPE_P;
    }
    require_coding(
        avcodec_send_frame(encoder.get(), i < options.pictures ? picture.get() : nullptr));
    while (avcodec_receive_packet(encoder.get(), packet.get()) == 0) {
      stream.pictures.emplace_back(reinterpret_cast<const char*>(packet->data),
                                   static_cast<std::size_t>(packet->size));
      av_packet_unref(packet.get());
    }
  }
  return stream;
}

}  // namespace alidade
