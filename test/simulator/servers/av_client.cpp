#include "test/simulator/servers/av_client.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <chrono>
#include <cstddef>

namespace alidade {
namespace {

constexpr int kNumberBits = 16;

template <class Clock>
double seconds() {
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

struct CodecDeleter {
  void operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
};

struct FrameDeleter {
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
};

struct PacketDeleter {
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};

}  // namespace

double monotonic_s() { return seconds<std::chrono::steady_clock>(); }

double utc_minus_monotonic_s() {
  double offset = 0;
  double narrowest = 1e9;
  for (int i = 0; i < 16; ++i) {
    const double before = monotonic_s();
    const double utc = seconds<std::chrono::system_clock>();
    const double after = monotonic_s();
    if (after - before < narrowest) {
      narrowest = after - before;
      offset = utc - (before + after) / 2;
    }
  }
  return offset;
}

std::vector<std::uint8_t> numbered_picture(int width, int height, int number) {
  std::vector<std::uint8_t> gray;
  gray.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const int side = width / kNumberBits;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const bool bit = ((number >> (u / side)) & 1) != 0;
      const int level = v < side ? (bit ? 235 : 20) : 40 + (u + v + 3 * number) % 160;
      gray.push_back(static_cast<std::uint8_t>(level));
    }
  }
  return gray;
}

int read_number(const std::uint8_t* gray, int width, std::ptrdiff_t stride) {
  const int side = width / kNumberBits;
  int number = 0;
  for (int bit = 0; bit < kNumberBits; ++bit) {
    const int u = bit * side + side / 2;
    if (gray[stride * (side / 2) + u] > 127) number |= 1 << bit;
  }
  return number;
}

struct AvClient::Session {
  Session() = default;
  ~Session() { avformat_close_input(&format); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  static int is_overdue(void* self) {
    return monotonic_s() > static_cast<Session*>(self)->deadline_s ? 1 : 0;
  }

  AVFormatContext* format = nullptr;
  std::unique_ptr<AVCodecContext, CodecDeleter> decoder;
  std::unique_ptr<AVPacket, PacketDeleter> packet{av_packet_alloc()};
  std::unique_ptr<AVFrame, FrameDeleter> frame{av_frame_alloc()};
  double deadline_s = 0;
};

// libav complains of every packet that comes before the first key frame.
AvClient::AvClient() { av_log_set_level(AV_LOG_FATAL); }
AvClient::~AvClient() = default;

int AvClient::open(const std::string& url, Transport transport) {
  session_ = std::make_unique<Session>();
  Session& session = *session_;
  session.deadline_s = monotonic_s() + kDeadlineS;
  session.format = avformat_alloc_context();
  session.format->interrupt_callback = {&Session::is_overdue, &session};
  AVDictionary* options = nullptr;
  av_dict_set(&options, "protocol_whitelist", "file,udp,rtp,tcp,rtsp", 0);
  if (transport != Transport::kPlainRtp) {
    av_dict_set(&options, "rtsp_transport", transport == Transport::kTcp ? "tcp" : "udp", 0);
  }
  av_dict_set(&options, "buffer_size", "4000000", 0);
  av_dict_set(&options, "fflags", "nobuffer", 0);
  const int status = avformat_open_input(&session.format, url.c_str(), nullptr, &options);
  av_dict_free(&options);
  if (status < 0) return status;
  if (session.format->nb_streams != 1) return AVERROR_STREAM_NOT_FOUND;
  const AVCodecParameters* parameters = session.format->streams[0]->codecpar;
  const AVCodec* codec = avcodec_find_decoder(parameters->codec_id);
  if (codec == nullptr) return AVERROR_DECODER_NOT_FOUND;
  session.decoder.reset(avcodec_alloc_context3(codec));
  avcodec_parameters_to_context(session.decoder.get(), parameters);
  session.decoder->flags |= AV_CODEC_FLAG_LOW_DELAY;
  session.decoder->thread_count = 1;
  return avcodec_open2(session.decoder.get(), codec, nullptr);
}

std::optional<ReceivedFrame> AvClient::read() {
  Session& session = *session_;
  session.deadline_s = monotonic_s() + kDeadlineS;
  AVPacket* packet = session.packet.get();
  while (av_read_frame(session.format, packet) >= 0) {
    ReceivedFrame received;
    received.receive_time_s = monotonic_s();
    if (session.format->start_time_realtime != AV_NOPTS_VALUE && packet->pts != AV_NOPTS_VALUE) {
      const double since_start_s =
          static_cast<double>(packet->pts) * av_q2d(session.format->streams[0]->time_base);
      received.utc_s =
          static_cast<double>(session.format->start_time_realtime) * 1e-6 + since_start_s;
    }
    const int status = avcodec_send_packet(session.decoder.get(), packet);
    av_packet_unref(packet);
    AVFrame* frame = session.frame.get();
    // Until the first key frame nothing can be decoded.
    if (status < 0 || avcodec_receive_frame(session.decoder.get(), frame) < 0) continue;
    received.key_frame = frame->key_frame != 0;
    received.number = read_number(frame->data[0], frame->width, frame->linesize[0]);
    return received;
  }
  return std::nullopt;
}

}  // namespace alidade
