#include "platform/video/rtp_connection.h"

extern "C" {
#include <libavutil/time.h>
}

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>

#include "platform/system/clock.h"
#include "platform/system/url.h"
#include "platform/video/luma_decoder.h"
#include "platform/video/rtsp_session.h"
#include "platform/video/session_description.h"

namespace alidade {
namespace {

constexpr int kMaxPacket = 65'536;       // bytes: RTSP and UDP have 16-bit lengths
constexpr int kMaxDescription = 16'384;  // bytes of the SDP that libavformat reads

// The session description for plain RTP, where the sender gives none.
std::string sdp_of(const Url& url, const std::string& format) {
  const bool jpeg = format == "MJPG";
  return "v=0\nc=IN IP4 " + url.host + "\nt=0 0\nm=video " + url.port + " RTP/AVP " +
         (jpeg ? "26\n" : "96\na=rtpmap:96 " + format + "/90000\n");
}

bool read_text(const std::string& path, std::string* text, std::string* error) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream content;
  content << file.rdbuf();
  if (!file) *error = std::strerror(errno);
  *text = content.str();
  return error->empty();
}

struct Text {
  const std::string& text;
  std::size_t read = 0;
};

int read_description(void* opaque, std::uint8_t* data, int capacity) {
  auto* from = static_cast<Text*>(opaque);
  const std::size_t count =
      std::min(from->text.size() - from->read, static_cast<std::size_t>(capacity));
  std::copy_n(from->text.data() + from->read, count, data);
  from->read += count;
  return count == 0 ? AVERROR_EOF : static_cast<int>(count);
}

AVIOContext* make_io(int size, void* opaque, int (*read)(void*, std::uint8_t*, int)) {
  auto* buffer = static_cast<std::uint8_t*>(av_malloc(static_cast<std::size_t>(size)));
  return avio_alloc_context(buffer, size, 0, opaque, read, nullptr, nullptr);
}

}  // namespace

void RtpConnection::FreeIo::operator()(AVIOContext* io) const {
  av_freep(&io->buffer);
  avio_context_free(&io);
}

RtpConnection::RtpConnection(const RtpSourceOptions& options, SenderChoice* choice)
    : options_(options), choice_(*choice) {
  Url url;
  if (options_.url.find("://") == std::string::npos) {
    std::string sdp;
    std::string error;
    if (!read_text(options_.url, &sdp, &error)) {
      no_transport_ = "no usable SDP description: " + error;
    }
    transport_ = std::make_unique<UdpTransport>(sdp, choice);
  } else if (parse_url(options_.url, &url, &no_transport_) && url.scheme == "rtp") {
    transport_ = std::make_unique<UdpTransport>(sdp_of(url, options_.format), choice);
  } else {
    transport_ = std::make_unique<RtspSession>(options_);
  }
}

RtpConnection::~RtpConnection() { avformat_close_input(&format_); }

ReadStatus RtpConnection::nothing_received(std::string* error) const {
  char text[128];
  // The same text each time, so that a log need not repeat it.
  std::snprintf(text, sizeof text,
                arrival_s_ > last_picture_s_ ? "packets came, but no whole picture for %g s"
                                             : "nothing received for %g s",
                options_.timeout_s);
  *error = text;
  if (foreign() > 0 && !filter_.source())
    *error += "; the packets that come are of " + foreign_kind();
  if (arrival_s_ > 0 && !any_picture_ && options_.url.rfind("rtp://", 0) == 0) {
    *error += "; is what comes " + options_.format + "?";
  }
  return ReadStatus::kDisconnected;
}

std::string RtpConnection::foreign_kind() const {
  return filter_.foreign() > 0 ? filter_.foreign_kind() : transport_->foreign_kind();
}

ReadStatus RtpConnection::open(std::string* error) {
  if (!no_transport_.empty()) {
    *error = no_transport_;
    return ReadStatus::kFailed;
  }
  std::string sdp;
  const ReadStatus status = transport_->open(monotonic_now_s() + options_.timeout_s, &sdp, error);
  if (status == ReadStatus::kTimeout) return nothing_received(error);
  return status == ReadStatus::kOk ? open_demuxer(sdp, error) : status;
}

ReadStatus RtpConnection::open_demuxer(const std::string& sdp, std::string* error) {
  format_ = avformat_alloc_context();
  if (format_ == nullptr) {
    *error = av_error_text(AVERROR(ENOMEM));
    return ReadStatus::kFailed;
  }
  format_->flags |= AVFMT_FLAG_NOPARSE | AVFMT_FLAG_NOFILLIN;
  // With a second stream libavformat would rewrite timestamps at the first RTCP report.
  format_->max_streams = 1;
  format_->max_delay = 20'000;  // us; wait for the packets of a gap in UDP
  Text text{sdp};
  const IoPtr description(make_io(kMaxDescription, &text, &read_description));
  format_->pb = description.get();
  AVDictionary* dictionary = nullptr;
  av_dict_set(&dictionary, "sdp_flags", "custom_io", 0);
  av_dict_set(&dictionary, "allowed_media_types", "video", 0);
  // Over TCP nothing comes out of order.
  const bool by_rtsp =
      options_.url.rfind("rtsp://", 0) == 0 || options_.url.rfind("rtsps://", 0) == 0;
  const bool by_tcp = by_rtsp && options_.transport == RtpSourceOptions::Transport::kTcp;
  if (by_tcp) av_dict_set(&dictionary, "reorder_queue_size", "0", 0);
  const int code = avformat_open_input(&format_, "", av_find_input_format("sdp"), &dictionary);
  av_dict_free(&dictionary);
  if (code < 0) {
    *error = "no usable SDP description: " + av_error_text(code);
    return ReadStatus::kFailed;
  }
  const std::optional<VideoDescription> video = find_video(sdp);
  filter_ = StreamFilter(video ? video->payload_type : -1, transport_->agreed_source());
  // libavformat also writes its receiver reports there. `direct` keeps them out of the buffer;
  // without a write function they are discarded.
  packets_.reset(make_io(2 * kMaxPacket, this, &RtpConnection::next_packet));
  packets_->max_packet_size = kMaxPacket;
  packets_->direct = AVIO_FLAG_DIRECT;
  format_->pb = packets_.get();
  last_picture_s_ = monotonic_now_s();
  return prepare(error);
}

// Called by libavformat for the next packet.
int RtpConnection::next_packet(void* self, std::uint8_t* data, int capacity) {
  auto* connection = static_cast<RtpConnection*>(self);
  ReceivedPacket packet;
  const double deadline_s = connection->last_picture_s_ + connection->options_.timeout_s;
  do {
    if (const auto held = connection->filter_.release()) {
      packet = {held->bytes.size(), held->arrival_s};
      std::copy(held->bytes.begin(), held->bytes.end(), data);
      connection->arrival_s_ = packet.arrival_s;
      break;
    }
    // If packets come without end, no wait in receive() detects the timeout.
    connection->transport_status_ =
        monotonic_now_s() > deadline_s
            ? ReadStatus::kTimeout
            : connection->transport_->receive(deadline_s, data, static_cast<std::size_t>(capacity),
                                              &packet, &connection->transport_error_);
    if (connection->transport_status_ != ReadStatus::kOk) return AVERROR_EXIT;
    connection->arrival_s_ = packet.arrival_s;
  } while (!connection->filter_.takes(data, packet.size, packet.arrival_s));
  if (reporting_source(data, packet.size)) connection->report_is_old_ = false;
  connection->timestamps_.move(data, packet.size);
  if (const auto header = parse_rtp_header(data, packet.size)) {
    connection->filter_.for_each_between(
        [connection](const RtpHeader& other) { connection->ends_.packet_in(other); });
    connection->ends_.packet_in(*header);
  }
  return static_cast<int>(packet.size);
}

// Checks the found stream and prepares its parser.
ReadStatus RtpConnection::prepare(std::string* error) {
  if (format_->nb_streams == 0) {
    *error = "there is no video in this stream";
    return ReadStatus::kFailed;
  }
  const AVCodecParameters& found = *format_->streams[0]->codecpar;
  coded_by_ = coded_by(found.codec_id);
  if (found.codec_id != AV_CODEC_ID_MJPEG && !coded_by_) {
    *error = std::string("the video is ") + avcodec_get_name(found.codec_id) +
             "; set the camera to MJPEG, H.264 or H.265";
    return ReadStatus::kFailed;
  }
  const std::shared_ptr<AVCodecParameters> copy(avcodec_parameters_alloc(), AvDeleter());
  avcodec_parameters_copy(copy.get(), &found);
  parameters_ = copy;
  if (coded_by_) {
    parser_.reset(av_parser_init(found.codec_id));
    parser_context_.reset(avcodec_alloc_context3(avcodec_find_decoder(found.codec_id)));
    if (!parser_ || !parser_context_) {
      *error = std::string("this libavcodec has no parser of ") + avcodec_get_name(found.codec_id);
      return ReadStatus::kFailed;
    }
    avcodec_parameters_to_context(parser_context_.get(), &found);
    parser_->flags |= PARSER_FLAG_COMPLETE_FRAMES;
  }
  return ReadStatus::kOk;
}

ReadStatus RtpConnection::read_picture(AccessUnit* unit, std::string* error) {
  const bool in_pieces = coded_by_.has_value();
  while (!grown_) {
    AccessUnit piece;
    piece.packet.reset(av_packet_alloc());
    const int code = av_read_frame(format_, piece.packet.get());
    if (transport_status_ == ReadStatus::kTimeout) return nothing_received(error);
    if (transport_status_ != ReadStatus::kOk) {
      *error = transport_error_;
      return transport_status_;
    }
    if (code == AVERROR(EAGAIN)) continue;
    if (code < 0) {
      *error = av_error_text(code);
      return ReadStatus::kDisconnected;
    }
    piece.receive_time_s = arrival_s_;
    PictureEnds::Piece end;
    if (piece.packet->pts != AV_NOPTS_VALUE) end = ends_.piece_out(piece.packet->pts);
    piece.sender_utc_s = end.capture_utc_s;
    if ((piece.packet->flags & AV_PKT_FLAG_CORRUPT) != 0 || piece.packet->size == 0) {
      ++damaged_;
      continue;
    }
    const bool next = growing_.packet && growing_.packet->pts != piece.packet->pts;
    if (!in_pieces) {
      *unit = std::move(piece);
      return ReadStatus::kOk;
    }
    if (next) *unit = std::exchange(growing_, AccessUnit{});
    if (!append(&piece)) {
      *error = "a picture of more than " +
               std::to_string(most_picture_bytes(options_.max_pixels) >> 10U) +
               " KB; are video.width and video.height right?";
      return ReadStatus::kDisconnected;
    }
    grown_ = end.last;
    if (next) return ReadStatus::kOk;
  }
  grown_ = false;
  *unit = std::exchange(growing_, AccessUnit{});
  return ReadStatus::kOk;
}

// Adds the piece to the growing picture. False: too large.
bool RtpConnection::append(AccessUnit* piece) {
  if (!growing_.packet) {
    growing_ = std::move(*piece);
    return true;
  }
  const int end = growing_.packet->size;
  const auto most = static_cast<int>(most_picture_bytes(options_.max_pixels));
  if (end > most - piece->packet->size ||
      av_grow_packet(growing_.packet.get(), piece->packet->size) < 0) {
    return false;
  }
  std::memcpy(growing_.packet->data + end, piece->packet->data,
              static_cast<std::size_t>(piece->packet->size));
  growing_.receive_time_s = piece->receive_time_s;
  if (piece->sender_utc_s) growing_.sender_utc_s = piece->sender_utc_s;
  return true;
}

ReadStatus RtpConnection::read(AccessUnit* unit, std::string* error) {
  const ReadStatus status = read_picture(unit, error);
  if (status != ReadStatus::kOk) return status;
  any_picture_ = true;
  unit->trial = choice_.trial();
  const AVPacket& packet = *unit->packet;
  if (packet.pts != AV_NOPTS_VALUE && another_sender(unit)) {
    *error = "the sender's clock jumped: it began anew";
    return ReadStatus::kDisconnected;
  }
  if (!inspect(unit)) {
    *error = std::string("the ") + (coded_by_ == CodedBy::kH264 ? "H.264" : "H.265") +
             " stream has B-frames, which come late; switch them off in the camera";
    return ReadStatus::kFailed;
  }
  if (unit->whole) last_picture_s_ = monotonic_now_s();
  return ReadStatus::kOk;
}

// Finds key frames and losses; false for a B-frame. H.265 may have B-slices without reordering.
// There only a picture that is shown before an earlier one counts.
bool RtpConnection::inspect(AccessUnit* unit) {
  unit->key = true;
  bool at_once = true;  // no later picture depends on earlier ones
  if (coded_by_) {
    const AVPacket& packet = *unit->packet;
    const std::size_t bytes = static_cast<std::size_t>(packet.size);
    const CodedPicture coded = look_at(*coded_by_, packet.data, bytes);
    if (packet.pts != AV_NOPTS_VALUE) {
      const PictureEnds::Loss loss = ends_.loss_of(packet.pts);
      unit->whole = !loss.within;
      unit->follows = !loss.before;
    }
    std::uint8_t* data = nullptr;
    int size = 0;
    av_parser_parse2(parser_.get(), parser_context_.get(), &data, &size, packet.data, packet.size,
                     packet.pts, packet.dts, packet.pos);
    unit->key = coded.has_beginning &&
                (coded.needs_no_other || coded.right_after || parser_->key_frame == 1);
    at_once = coded.needs_no_other || coded.right_after == 0;
    const bool overtaken = parser_->output_picture_number < last_output_number_;
    last_output_number_ = parser_->output_picture_number;
    judge_size(unit);
    if (parser_->pict_type == AV_PICTURE_TYPE_B && (coded_by_ == CodedBy::kH264 || overtaken)) {
      return false;
    }
  }
  unit->packet->flags = unit->key && at_once ? AV_PKT_FLAG_KEY : 0;
  return true;
}

// Also by the whole blocks: a forged picture may show only a tiny part of them.
void RtpConnection::judge_size(AccessUnit* unit) const {
  constexpr std::int64_t kBlock = 64;  // px, H.265's largest
  const auto pixels = [](int width, int height) { return std::int64_t{width} * height; };
  unit->width = parser_->width;
  unit->height = parser_->height;
  const std::int64_t edges = kBlock * (unit->width + unit->height + kBlock);
  if (pixels(parser_->coded_width, parser_->coded_height) >
      pixels(unit->width, unit->height) + edges) {
    unit->width = parser_->coded_width;
    unit->height = parser_->coded_height;
  }
  unit->too_large = pixels(unit->width, unit->height) > options_.max_pixels;
}

// libavformat gives each packet the UTC of its timestamp by the latest RTCP report, but without
// unwrapping: between a wrap and the next report it is one wrap (13 h) off. That shows if the
// camera's clock and ours agree within some minutes. A sender without a clock reports 0 or the time
// since it started; the high bit of its NTP seconds is not set (RFC 3550, 6.4.1).
std::optional<double> RtpConnection::utc(const AVPacket& packet) const {
  const auto* reference = reinterpret_cast<const AVProducerReferenceTime*>(
      av_packet_get_side_data(&packet, AV_PKT_DATA_PRFT, nullptr));
  if (reference == nullptr) {
    return std::nullopt;
  }
  constexpr double kAgreement_s = 600;
  constexpr double kHighBit_s = -61'505'152;  // Unix time, in 1968
  const double utc_s = 1e-6 * static_cast<double>(reference->wallclock);
  if (utc_s < kHighBit_s) return std::nullopt;
  const double wrap_s = 4294967296.0 * av_q2d(format_->streams[0]->time_base);
  const double ahead_s = utc_s - 1e-6 * static_cast<double>(av_gettime());
  const double wraps = std::round(ahead_s / wrap_s);
  return std::abs(ahead_s - wraps * wrap_s) < kAgreement_s ? utc_s - wraps * wrap_s : utc_s;
}

// Stamps the picture if its stamp can be true. True: another sender on the same port started anew,
// so libavformat's clock must be restarted, too.
bool RtpConnection::another_sender(AccessUnit* unit) {
  // libavformat unwraps from stamp to stamp; wild stamps mislead it by whole wraps.
  const double tick_s = av_q2d(format_->streams[0]->time_base);
  const double wrap_s = 4294967296.0 * tick_s;
  const double told_s = static_cast<double>(unit->packet->pts) * tick_s;
  const double expected_s = stamps_.expected_s(unit->receive_time_s);
  const double wraps = any_stamp_ ? std::round((expected_s - told_s) / wrap_s) : 0;
  const double sender_s = told_s + wraps * wrap_s;
  const StampGuard::Verdict verdict = stamps_.judge(unit->receive_time_s, sender_s);
  if (verdict == StampGuard::Verdict::kBad) {
    ++bad_stamps_;
    bad_stamp_off_s_ = sender_s - expected_s;
    return false;
  }
  any_stamp_ = true;
  const bool other = stamped_by_ && stamped_by_ != filter_.source();
  stamped_by_ = filter_.source();
  unit->begins_anew = verdict == StampGuard::Verdict::kJumped;
  if (unit->begins_anew && other) return true;
  report_is_old_ = report_is_old_ || unit->begins_anew;
  unit->sender_time_s = sender_s;
  if (!unit->sender_utc_s && !report_is_old_) unit->sender_utc_s = utc(*unit->packet);
  return false;
}

}  // namespace alidade
