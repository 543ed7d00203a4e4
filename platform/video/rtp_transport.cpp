#include "platform/video/rtp_transport.h"

#include <cerrno>

#include "platform/system/clock.h"
#include "platform/video/session_description.h"

namespace alidade {
namespace {

constexpr std::size_t kPacket = 65'000;         // bytes: more than UDP carries
constexpr std::size_t kSocketBuffer = 4 << 20;  // bytes: several pictures

}  // namespace

int RtpPorts::is_over(void* self) {
  const auto* ports = static_cast<const RtpPorts*>(self);
  return ports->interrupted_ || monotonic_now_s() > ports->deadline_s_ ? 1 : 0;
}

ReadStatus RtpPorts::open(const std::string& address, int port, std::string* error) {
  const std::string host =
      address.find(':') == std::string::npos ? address : '[' + address + ']';  // IPv6
  const std::string url =
      "rtp://" + host + ":" + std::to_string(port) + "?localrtpport=" + std::to_string(port) +
      "&localrtcpport=" + std::to_string(port + 1) + "&pkt_size=" + std::to_string(kPacket);
  AVDictionary* options = nullptr;
  av_dict_set_int(&options, "buffer_size", kSocketBuffer, 0);
  deadline_s_ = monotonic_now_s() + 1;  // opening waits for nothing
  const AVIOInterruptCB interrupt{&RtpPorts::is_over, this};
  AVIOContext* io = nullptr;
  const int code = avio_open2(&io, url.c_str(), AVIO_FLAG_READ, &interrupt, &options);
  av_dict_free(&options);
  if (code < 0) {
    *error = "cannot listen on the UDP ports " + std::to_string(port) + " and " +
             std::to_string(port + 1) + " (" + av_error_text(code) + "); does another program?";
    return ReadStatus::kDisconnected;
  }
  io_.reset(io);
  return ReadStatus::kOk;
}

ReadStatus RtpPorts::receive(double deadline_s, std::uint8_t* data, std::size_t capacity,
                             std::size_t* size, std::string* error) {
  deadline_s_ = deadline_s;
  // Having been interrupted or found nothing is no end for good.
  io_->eof_reached = 0;
  io_->error = 0;
  const int code = avio_read_partial(io_.get(), data, static_cast<int>(capacity));
  if (code > 0) {
    *size = static_cast<std::size_t>(code);
    return ReadStatus::kOk;
  }
  if (interrupted_) return ReadStatus::kStopped;
  if (code == AVERROR(EAGAIN) || is_over(this) != 0) return ReadStatus::kTimeout;
  *error = av_error_text(code);
  return ReadStatus::kDisconnected;
}

ReadStatus UdpTransport::open(double /*deadline_s*/, std::string* sdp, std::string* error) {
  *sdp = sdp_;
  const std::optional<VideoDescription> video = find_video(sdp_);
  if (!video) {
    *error = "there is no video in this stream";
    return ReadStatus::kFailed;
  }
  if (video->port == 0) {
    *error = "the session description names no port, as for RTSP; give the rtsp:// URL";
    return ReadStatus::kFailed;
  }
  return ports_.open(video->address, video->port, error);
}

}  // namespace alidade
