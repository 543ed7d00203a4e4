#include "test/simulator/servers/encoder.h"

#include <turbojpeg.h>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace alidade {
namespace {

constexpr std::uint8_t kNeutralChroma = 128;

struct JpegHandleDeleter {
  void operator()(void* handle) const { tjDestroy(handle); }
};

struct JpegBufferDeleter {
  void operator()(unsigned char* buffer) const { tjFree(buffer); }
};

struct CodecDeleter {
  void operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
};

struct FrameDeleter {
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
};

struct PacketDeleter {
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};

bool fail(std::string* error, const std::string& reason) {
  *error = "video encoder: " + reason;
  return false;
}

std::string av_error(int code) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(code, text.data(), text.size());
  return text.data();
}

}  // namespace

std::vector<std::uint8_t> encode_jpeg(const std::uint8_t* gray, int width, int height,
                                      std::ptrdiff_t stride, int quality) {
  if (width <= 0 || height <= 0 || quality < 1 || quality > 100) return {};
  const std::unique_ptr<void, JpegHandleDeleter> handle(tjInitCompress());
  if (!handle) return {};
  const int chroma_width = tjPlaneWidth(1, width, TJSAMP_420);
  const int chroma_height = tjPlaneHeight(1, height, TJSAMP_420);
  const std::vector<std::uint8_t> chroma(
      static_cast<std::size_t>(chroma_width) * static_cast<std::size_t>(chroma_height),
      kNeutralChroma);
  std::array<const unsigned char*, 3> planes{gray, chroma.data(), chroma.data()};
  const std::array<int, 3> strides{static_cast<int>(stride), chroma_width, chroma_width};
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int status =
      tjCompressFromYUVPlanes(handle.get(), planes.data(), width, strides.data(), height,
                              TJSAMP_420, &bytes, &size, quality, TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, JpegBufferDeleter> owner(bytes);
  if (status != 0) return {};
  return {bytes, bytes + size};
}

struct VideoEncoder::Codec {
  std::unique_ptr<AVCodecContext, CodecDeleter> context;
  std::unique_ptr<AVFrame, FrameDeleter> frame;
  std::unique_ptr<AVPacket, PacketDeleter> packet;
};

VideoEncoder::VideoEncoder() = default;
VideoEncoder::~VideoEncoder() = default;

bool VideoEncoder::open(Standard standard, int width, int height, double rate_hz, const Rate& rate,
                        std::string* error) {
  codec_.reset();
  if (width <= 0 || height <= 0 || width % 2 != 0 || height % 2 != 0) {
    return fail(error, "width and height must be even and positive, not " + std::to_string(width) +
                           "x" + std::to_string(height));
  }
  if (!(rate_hz > 0)) return fail(error, "the frame rate must be positive");
  const bool h265 = standard == Standard::kH265;
  const std::string name = h265 ? "libx265" : "libx264";
  const AVCodec* encoder = avcodec_find_encoder_by_name(name.c_str());
  if (encoder == nullptr) return fail(error, "this libavcodec has no " + name);

  auto codec = std::make_unique<Codec>();
  codec->context.reset(avcodec_alloc_context3(encoder));
  codec->frame.reset(av_frame_alloc());
  codec->packet.reset(av_packet_alloc());
  if (!codec->context || !codec->frame || !codec->packet) return fail(error, "out of memory");

  AVCodecContext& context = *codec->context;
  context.width = width;
  context.height = height;
  context.pix_fmt = AV_PIX_FMT_YUV420P;
  context.color_range = AVCOL_RANGE_JPEG;
  context.framerate = av_d2q(rate_hz, 100000);
  context.time_base = av_inv_q(context.framerate);
  context.gop_size = rate.gop > 0 ? rate.gop : std::max(1, static_cast<int>(std::lround(rate_hz)));
  context.max_b_frames = 0;
  context.thread_count = 1;
  context.log_level_offset = AV_LOG_VERBOSE - AV_LOG_INFO;  // x264 is talkative
  av_opt_set(context.priv_data, "preset", "superfast", 0);
  av_opt_set(context.priv_data, "tune", "zerolatency", 0);
  if (rate.kbit_s > 0) {
    context.bit_rate = std::int64_t{1000} * rate.kbit_s;
    context.rc_max_rate = context.bit_rate;
    context.rc_buffer_size = 1000 * rate.kbit_s;
  } else {
    av_opt_set(context.priv_data, "crf", "20", 0);
  }
  av_opt_set(context.priv_data, "forced-idr", "1", 0);
  if (h265) {
    av_opt_set(context.priv_data, "x265-params",
               "log-level=none:repeat-headers=1:open-gop=0:scenecut=0:pools=none", 0);
  }
  int status = avcodec_open2(&context, encoder, nullptr);
  if (status < 0) return fail(error, av_error(status));

  AVFrame& frame = *codec->frame;
  frame.width = width;
  frame.height = height;
  frame.format = context.pix_fmt;
  frame.color_range = context.color_range;
  frame.pts = 0;
  status = av_frame_get_buffer(&frame, 0);
  if (status < 0) return fail(error, av_error(status));
  for (int plane = 1; plane < 3; ++plane) {
    std::memset(
        frame.data[plane], kNeutralChroma,
        static_cast<std::size_t>(frame.linesize[plane]) * static_cast<std::size_t>(height / 2));
  }
  codec_ = std::move(codec);
  return true;
}

std::vector<std::uint8_t> VideoEncoder::encode(const std::uint8_t* gray, std::ptrdiff_t stride,
                                               bool force_idr) {
  if (!codec_) return {};
  AVFrame& frame = *codec_->frame;
  if (av_frame_make_writable(&frame) < 0) return {};
  for (int row = 0; row < frame.height; ++row) {
    std::memcpy(frame.data[0] + std::ptrdiff_t{row} * frame.linesize[0],
                gray + std::ptrdiff_t{row} * stride, static_cast<std::size_t>(frame.width));
  }
  frame.pict_type = force_idr ? AV_PICTURE_TYPE_I : AV_PICTURE_TYPE_NONE;
  if (avcodec_send_frame(codec_->context.get(), &frame) < 0) return {};
  ++frame.pts;
  AVPacket& packet = *codec_->packet;
  if (avcodec_receive_packet(codec_->context.get(), &packet) < 0) return {};
  std::vector<std::uint8_t> access_unit(packet.data, packet.data + packet.size);
  av_packet_unref(&packet);
  return access_unit;
}

}  // namespace alidade
