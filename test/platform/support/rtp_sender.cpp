#include "test/platform/support/rtp_sender.h"

extern "C" {
#include <libavutil/opt.h>
#include <libavutil/time.h>
}

#include <cmath>
#include <cstring>
#include <fstream>
#include <stdexcept>

namespace alidade {
namespace {

void must(int code) {
  if (code < 0) {
    throw std::runtime_error(av_error_text(code));
  }
}

// As the kernel tells: an attempt to bind it would take it from the one who is about to.
bool is_taken(int port) {
  std::ifstream sockets("/proc/net/udp");
  std::string line;
  std::getline(sockets, line);
  std::string number;
  std::string local;
  while (sockets >> number >> local && std::getline(sockets, line)) {
    if (std::stoi(local.substr(local.find(':') + 1), nullptr, 16) == port) return true;
  }
  return false;
}

}  // namespace

bool rtp_port_taken(int port) { return is_taken(port) && is_taken(port + 1); }

RtpSender::RtpSender(Codec codec, int port, double first_time_s, int packet_bytes,
                     const std::string& from, const std::string& to)
    : first_time_s_(first_time_s), began_utc_us_(av_gettime()) {
  const bool mjpeg = codec == Codec::kMjpeg;
  const bool h265 = codec == Codec::kH265;
  const AVCodec* encoder = avcodec_find_encoder_by_name(mjpeg  ? "mjpeg"
                                                        : h265 ? "libx265"
                                                               : "libx264");
  encoder_.reset(avcodec_alloc_context3(encoder));
  encoder_->width = kWidth;
  encoder_->height = kHeight;
  encoder_->time_base = {1, 30};
  encoder_->gop_size = 10;
  encoder_->max_b_frames = 0;
  encoder_->thread_count = 1;
  encoder_->pix_fmt = mjpeg ? AV_PIX_FMT_YUVJ420P : AV_PIX_FMT_YUV420P;
  if (mjpeg) {
    encoder_->color_range = AVCOL_RANGE_JPEG;
    av_opt_set(encoder_->priv_data, "huffman", "default", 0);  // RFC 2435 knows no other tables
    av_opt_set(encoder_->priv_data, "force_duplicated_matrix", "1", 0);
  } else {
    av_opt_set(encoder_->priv_data, "preset", "ultrafast", 0);
    av_opt_set(encoder_->priv_data, "tune", "zerolatency", 0);
    if (h265) {
      av_opt_set(encoder_->priv_data, "x265-params",
                 "log-level=none:repeat-headers=1:open-gop=0:scenecut=0:pools=none:frame-threads=1",
                 0);
    }
  }
  must(avcodec_open2(encoder_.get(), encoder, nullptr));

  const std::string url = "rtp://" + to + ":" + std::to_string(port) +
                          "?pkt_size=" + std::to_string(packet_bytes) +
                          (from.empty() ? "" : "&localaddr=" + from);
  must(avformat_alloc_output_context2(&format_, nullptr, "rtp", url.c_str()));
  format_->flags |= AVFMT_FLAG_BITEXACT;  // sequence numbers begin at zero, not at a random one
  // Lets the RTCP reports say that first_time_s is now.
  format_->start_time_realtime = began_utc_us_ - std::llround(1e6 * first_time_s);
  AVStream* stream = avformat_new_stream(format_, nullptr);
  must(avcodec_parameters_from_context(stream->codecpar, encoder_.get()));
  stream->time_base = {1, 90'000};
  must(avio_open(&format_->pb, url.c_str(), AVIO_FLAG_WRITE));
  must(avformat_write_header(format_, nullptr));

  picture_.reset(av_frame_alloc());
  picture_->width = kWidth;
  picture_->height = kHeight;
  picture_->format = encoder_->pix_fmt;
  must(av_frame_get_buffer(picture_.get(), 0));
}

RtpSender::~RtpSender() {
  av_write_trailer(format_);
  avio_closep(&format_->pb);
  avformat_free_context(format_);
}

void RtpSender::send(double fraction, const std::string& nal_units) {
  must(av_frame_make_writable(picture_.get()));
  for (int plane = 0; plane < 3; ++plane) {
    const int rows = plane == 0 ? kHeight : kHeight / 2;
    std::memset(picture_->data[plane], plane == 0 ? grey_of(next_) : 128,
                static_cast<std::size_t>(picture_->linesize[plane] * rows));
  }
  picture_->pts = next_;
  must(avcodec_send_frame(encoder_.get(), picture_.get()));
  const PacketPtr packet(av_packet_alloc());
  must(avcodec_receive_packet(encoder_.get(), packet.get()));
  av_shrink_packet(packet.get(), static_cast<int>(fraction * packet->size));
  if (!nal_units.empty()) {
    const int picture = packet->size;
    must(av_grow_packet(packet.get(), static_cast<int>(nal_units.size())));
    std::memmove(packet->data + nal_units.size(), packet->data, static_cast<std::size_t>(picture));
    std::memcpy(packet->data, nal_units.data(), nal_units.size());
  }
  packet->pts = std::llround(90'000 * (first_time_s_ + static_cast<double>(next_) * kPeriod_s));
  packet->dts = packet->pts;
  packet->stream_index = 0;
  must(av_write_frame(format_, packet.get()));
  ++next_;
}

std::string RtpSender::sdp() const {
  char text[2048];
  AVFormatContext* sessions[] = {format_};
  must(av_sdp_create(sessions, 1, text, sizeof text));
  return text;
}

}  // namespace alidade
