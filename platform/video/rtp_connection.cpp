#include "platform/video/rtp_connection.h"

extern "C" {
#include <libavutil/time.h>
}

#include <cmath>
#include <cstdio>
#include <cstring>
#include <utility>

#include "platform/system/clock.h"
#include "platform/system/url.h"

namespace alidade {
namespace {

constexpr int kMaxPicture = 32 << 20;  // bytes of compressed data
// Given to RTSP's TEARDOWN, so that the camera frees the session.
constexpr double kGoodbye_s = 0.5;

// The description that a sender of plain RTP does not send.
std::string sdp_of(const Url& url, const std::string& format) {
  const bool h264 = format == "H264";
  return "data:application/sdp,v=0\nc=IN IP4 " + url.host + "\nt=0 0\nm=video " + url.port +
         " RTP/AVP " + (h264 ? "96\na=rtpmap:96 H264/90000\n" : "26\n");
}

}  // namespace

RtpConnection::RtpConnection(const RtpSourceOptions& options, const std::atomic<bool>& stopped)
    : options_(options), stopped_(stopped) {}

RtpConnection::~RtpConnection() {
  closing_ = true;
  deadline_s_ = monotonic_now_s() + kGoodbye_s;
  avformat_close_input(&format_);
}

int RtpConnection::is_over(void* self) {
  const auto* connection = static_cast<const RtpConnection*>(self);
  return (connection->stopped_ && !connection->closing_) ||
                 monotonic_now_s() > connection->deadline_s_
             ? 1
             : 0;
}

std::string RtpConnection::why_lost(int code) const {
  // Whatever libavformat makes of being interrupted.
  if (code == AVERROR(ETIMEDOUT) || monotonic_now_s() > deadline_s_) {
    char text[64];
    std::snprintf(text, sizeof text, "nothing received for %g s", options_.timeout_s);
    return text;
  }
  if (code == AVERROR_EOF) {
    return "the sender ended the stream";
  }
  if (code == AVERROR_HTTP_NOT_FOUND) {
    return "no such stream on this camera (404)";
  }
  if (code == AVERROR_HTTP_OTHER_4XX) {
    return "the camera refuses to play this stream (4xx); does it hold video?";
  }
  return av_error_text(code);
}

ReadStatus RtpConnection::open(std::string* error) {
  Url url;
  std::string input = options_.url;
  const AVInputFormat* input_format = nullptr;
  if (input.find("://") == std::string::npos) {
    input_format = av_find_input_format("sdp");
  } else if (!parse_url(options_.url, &url, error)) {
    return ReadStatus::kFailed;
  } else if (url.scheme == "rtp") {
    input_format = av_find_input_format("sdp");
    input = sdp_of(url, options_.format);
  } else {
    input = with_credentials(options_.url, options_.user, options_.password);
  }

  format_ = avformat_alloc_context();
  if (format_ == nullptr) {
    *error = av_error_text(AVERROR(ENOMEM));
    return ReadStatus::kFailed;
  }
  format_->interrupt_callback = {&RtpConnection::is_over, this};
  format_->flags |= AVFMT_FLAG_NOPARSE | AVFMT_FLAG_NOFILLIN;
  // With a second stream libavformat would begin to rewrite timestamps at the first RTCP report.
  format_->max_streams = 1;
  format_->max_delay = 20'000;  // us that a gap of UDP packets is waited for
  AVDictionary* dictionary = nullptr;
  av_dict_set(&dictionary, "allowed_media_types", "video", 0);
  av_dict_set(&dictionary, "rtsp_transport",
              options_.transport == RtpSourceOptions::Transport::kTcp ? "tcp" : "udp", 0);
  av_dict_set(&dictionary, "protocol_whitelist", "file,data,rtp,udp,tcp,rtsp", 0);
  av_dict_set_int(&dictionary, "buffer_size", 4 << 20, 0);  // bytes: several pictures in UDP
  deadline_s_ = monotonic_now_s() + options_.timeout_s;
  const int code = avformat_open_input(&format_, input.c_str(), input_format, &dictionary);
  av_dict_free(&dictionary);
  if (code == AVERROR_HTTP_UNAUTHORIZED) {
    *error = options_.user.empty() ? "the camera wants a user and a password (401)"
                                   : "wrong user or password (401)";
    return ReadStatus::kFailed;
  }
  if (input_format != nullptr && (code == AVERROR(ENOENT) || code == AVERROR(EACCES) ||
                                  code == AVERROR(EINVAL) || code == AVERROR_INVALIDDATA)) {
    *error = "no usable SDP description: " + av_error_text(code);
    return ReadStatus::kFailed;
  }
  if (code < 0) {
    *error = why_lost(code);
    return ReadStatus::kDisconnected;
  }
  return prepare(error);
}

// What can be read of the stream that was found.
ReadStatus RtpConnection::prepare(std::string* error) {
  if (format_->nb_streams == 0) {
    *error = "there is no video in this stream";
    return ReadStatus::kFailed;
  }
  const AVCodecParameters& found = *format_->streams[0]->codecpar;
  if (found.codec_id != AV_CODEC_ID_MJPEG && found.codec_id != AV_CODEC_ID_H264) {
    *error = std::string("the video is ") + avcodec_get_name(found.codec_id) +
             "; set the camera to MJPEG or H.264";
    return ReadStatus::kFailed;
  }
  const std::shared_ptr<AVCodecParameters> copy(avcodec_parameters_alloc(), AvDeleter());
  avcodec_parameters_copy(copy.get(), &found);
  parameters_ = copy;
  if (found.codec_id == AV_CODEC_ID_H264) {
    parser_.reset(av_parser_init(found.codec_id));
    parser_context_.reset(avcodec_alloc_context3(avcodec_find_decoder(found.codec_id)));
    if (!parser_ || !parser_context_) {
      *error = "this libavcodec has no H.264 parser";
      return ReadStatus::kFailed;
    }
    avcodec_parameters_to_context(parser_context_.get(), &found);
    parser_->flags |= PARSER_FLAG_COMPLETE_FRAMES;
  }
  return ReadStatus::kOk;
}

ReadStatus RtpConnection::read(AccessUnit* unit, std::string* error) {
  deadline_s_ = monotonic_now_s() + options_.timeout_s;
  const bool in_pieces = parameters_->codec_id == AV_CODEC_ID_H264;
  for (bool complete = false; !complete;) {
    AccessUnit piece;
    piece.packet.reset(av_packet_alloc());
    const int code = av_read_frame(format_, piece.packet.get());
    piece.receive_time_s = monotonic_now_s();
    if (code == AVERROR(EAGAIN) && is_over(this) == 0) {
      continue;
    }
    if (code < 0) {
      *error = why_lost(code);
      return ReadStatus::kDisconnected;
    }
    deadline_s_ = piece.receive_time_s + options_.timeout_s;
    if ((piece.packet->flags & AV_PKT_FLAG_CORRUPT) != 0 || piece.packet->size == 0) {
      ++damaged_;
    } else if (!in_pieces) {
      *unit = std::move(piece);
      complete = true;
    } else if (!growing_.packet) {
      growing_ = std::move(piece);
    } else if (growing_.packet->pts == piece.packet->pts) {
      const int end = growing_.packet->size;
      if (end > kMaxPicture - piece.packet->size ||
          av_grow_packet(growing_.packet.get(), piece.packet->size) < 0) {
        *error = "a picture of more than " + std::to_string(kMaxPicture >> 20) + " MB";
        return ReadStatus::kDisconnected;
      }
      std::memcpy(growing_.packet->data + end, piece.packet->data,
                  static_cast<std::size_t>(piece.packet->size));
      growing_.receive_time_s = piece.receive_time_s;
    } else {
      *unit = std::exchange(growing_, std::move(piece));
      complete = true;
    }
  }

  const AVPacket& packet = *unit->packet;
  if (packet.pts != AV_NOPTS_VALUE) {
    unit->sender_time_s = static_cast<double>(packet.pts) * av_q2d(format_->streams[0]->time_base);
    unit->sender_utc_s = utc(packet);
  }
  if (sender_jumped(*unit)) {
    *error = "the sender's clock jumped: it began anew";
    return ReadStatus::kDisconnected;
  }
  if (!inspect(unit)) {
    *error = "the H.264 stream has B-frames, which come late; switch them off in the camera";
    return ReadStatus::kFailed;
  }
  return ReadStatus::kOk;
}

// Finds key frames; false for a B-frame.
bool RtpConnection::inspect(AccessUnit* unit) {
  unit->key = true;
  if (parser_) {
    const AVPacket& packet = *unit->packet;
    std::uint8_t* data = nullptr;
    int size = 0;
    av_parser_parse2(parser_.get(), parser_context_.get(), &data, &size, packet.data, packet.size,
                     packet.pts, packet.dts, packet.pos);
    unit->key = parser_->key_frame == 1;
    if (parser_->pict_type == AV_PICTURE_TYPE_B) {
      return false;
    }
  }
  unit->packet->flags = unit->key ? AV_PKT_FLAG_KEY : 0;
  return true;
}

// libavformat adds to each packet what the latest RTCP report says about its timestamp, but without
// unwrapping: between a wrap and the next report the time is one wrap (13 h) off, which shows as long as
// the camera's clock and ours agree to some minutes.
std::optional<double> RtpConnection::utc(const AVPacket& packet) const {
  const auto* reference = reinterpret_cast<const AVProducerReferenceTime*>(
      av_packet_get_side_data(&packet, AV_PKT_DATA_PRFT, nullptr));
  if (reference == nullptr) {
    return std::nullopt;
  }
  constexpr double kAgreement_s = 600;
  const double utc_s = 1e-6 * static_cast<double>(reference->wallclock);
  const double wrap_s = 4294967296.0 * av_q2d(format_->streams[0]->time_base);
  const double ahead_s = utc_s - 1e-6 * static_cast<double>(av_gettime());
  const double wraps = std::round(ahead_s / wrap_s);
  return std::abs(ahead_s - wraps * wrap_s) < kAgreement_s ? utc_s - wraps * wrap_s : utc_s;
}

// A gap of the link moves the arrival against the sender's clock by less than timeout_s. More is
// another sender on the same port: libavformat's view of the clock must then begin anew, too.
bool RtpConnection::sender_jumped(const AccessUnit& unit) {
  bool jumped = false;
  if (unit.sender_time_s) {
    jumped = last_sender_time_s_ &&
             std::abs((*unit.sender_time_s - *last_sender_time_s_) -
                      (unit.receive_time_s - last_receive_time_s_)) > options_.timeout_s + 1;
    last_sender_time_s_ = unit.sender_time_s;
    last_receive_time_s_ = unit.receive_time_s;
  }
  return jumped;
}

}  // namespace alidade
