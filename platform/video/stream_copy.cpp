#include "platform/video/stream_copy.h"

extern "C" {
#include <libavcodec/bsf.h>
}

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace alidade {
namespace {

// Matroska needs H.264's and H.265's parameter sets in its header. If the sender's description
// lacks them, they are in the first key frame.
int fill_extradata(const AVPacket& key_frame, AVCodecParameters* parameters) {
  AVBSFContext* filter = nullptr;
  int code = av_bsf_alloc(av_bsf_get_by_name("extract_extradata"), &filter);
  if (code < 0) {
    return code;
  }
  const PacketPtr packet(av_packet_clone(&key_frame));
  code = avcodec_parameters_copy(filter->par_in, parameters);
  if (code >= 0) {
    code = av_bsf_init(filter);
  }
  if (code >= 0) {
    code = av_bsf_send_packet(filter, packet.get());
  }
  if (code >= 0) {
    code = av_bsf_receive_packet(filter, packet.get());
  }
  av_bsf_free(&filter);
  if (code < 0) {
    return code;
  }
  std::size_t size = 0;
  const std::uint8_t* data =
      av_packet_get_side_data(packet.get(), AV_PKT_DATA_NEW_EXTRADATA, &size);
  if (data == nullptr) {
    return AVERROR_INVALIDDATA;
  }
  parameters->extradata =
      static_cast<std::uint8_t*>(av_mallocz(size + AV_INPUT_BUFFER_PADDING_SIZE));
  if (parameters->extradata == nullptr) {
    return AVERROR(ENOMEM);
  }
  std::memcpy(parameters->extradata, data, size);
  parameters->extradata_size = static_cast<int>(size);
  return 0;
}

bool same_extradata(const AVCodecParameters& a, const AVCodecParameters& b) {
  return a.extradata_size == 0 || b.extradata_size == 0 ||
         (a.extradata_size == b.extradata_size &&
          std::memcmp(a.extradata, b.extradata, static_cast<std::size_t>(a.extradata_size)) == 0);
}

}  // namespace

std::shared_ptr<const AVCodecParameters> picture_parameters(AVCodecID codec) {
  CodecParametersPtr parameters(avcodec_parameters_alloc());
  parameters->codec_type = AVMEDIA_TYPE_VIDEO;
  parameters->codec_id = codec;
  if (codec == AV_CODEC_ID_RAWVIDEO) {
    parameters->format = AV_PIX_FMT_GRAY8;
    parameters->codec_tag = avcodec_pix_fmt_to_codec_tag(AV_PIX_FMT_GRAY8);
  }
  return parameters;
}

PacketPtr make_picture_packet(std::size_t bytes) {
  PacketPtr packet(av_packet_alloc());
  if (!packet || av_new_packet(packet.get(), static_cast<int>(bytes)) != 0) {
    return nullptr;
  }
  packet->flags |= AV_PKT_FLAG_KEY;
  return packet;
}

StreamCopy::StreamCopy(std::string path) : path_(std::move(path)) {}

StreamCopy::~StreamCopy() {
  if (format_ != nullptr) {
    if (header_written_) {
      av_write_trailer(format_);
    }
    avio_closep(&format_->pb);
    avformat_free_context(format_);
  }
}

int StreamCopy::create(const StreamPicture& first) {
  parameters_.reset(avcodec_parameters_alloc());
  int code = avcodec_parameters_copy(parameters_.get(), first.parameters.get());
  if (code < 0) {
    return code;
  }
  parameters_->width = first.width;
  parameters_->height = first.height;
  if (parameters_->codec_id != AV_CODEC_ID_RAWVIDEO) {  // its tag is the pixel format
    parameters_->codec_tag = 0;
  }
  const bool has_sets =
      parameters_->codec_id == AV_CODEC_ID_H264 || parameters_->codec_id == AV_CODEC_ID_HEVC;
  if (has_sets && parameters_->extradata_size == 0) {
    code = fill_extradata(*first.packet, parameters_.get());
    if (code < 0) {
      return code;
    }
  }
  code = avformat_alloc_output_context2(&format_, nullptr, "matroska", path_.c_str());
  if (code < 0) {
    return code;
  }
  AVStream* stream = avformat_new_stream(format_, nullptr);
  code = stream == nullptr ? AVERROR(ENOMEM)
                           : avcodec_parameters_copy(stream->codecpar, parameters_.get());
  if (code >= 0) {
    code = avio_open(&format_->pb, path_.c_str(), AVIO_FLAG_WRITE);
  }
  if (code >= 0) {
    format_->flags |= AVFMT_FLAG_FLUSH_PACKETS;
    AVDictionary* dictionary = nullptr;
    av_dict_set(&dictionary, "cluster_time_limit", "1000", 0);  // ms
    code = avformat_write_header(format_, &dictionary);
    av_dict_free(&dictionary);
    header_written_ = code >= 0;
  }
  return code;
}

std::string StreamCopy::fault_of(const StreamPicture& picture) const {
  if (format_ == nullptr) return "";
  const AVCodecParameters& parameters = *picture.parameters;
  if (parameters.codec_id != parameters_->codec_id || picture.width != parameters_->width ||
      picture.height != parameters_->height || !same_extradata(parameters, *parameters_)) {
    const auto size = [](int width, int height) {
      return std::to_string(width) + "x" + std::to_string(height);
    };
    return path_ + " began as " + avcodec_get_name(parameters_->codec_id) + " of " +
           size(parameters_->width, parameters_->height) + ", the stream is now another one (" +
           avcodec_get_name(parameters.codec_id) + " " + size(picture.width, picture.height) +
           "): start a new recording";
  }
  return "";
}

bool StreamCopy::add(const StreamPicture& picture, double receive_time_s, std::string* error) {
  int code = 0;
  if (format_ == nullptr) {
    code = create(picture);
    first_receive_time_s_ = receive_time_s;
  }
  if (code >= 0) {
    const AVStream& stream = *format_->streams[0];
    const PacketPtr packet(av_packet_clone(picture.packet.get()));
    const double since_first_s = receive_time_s - first_receive_time_s_;
    const auto pts =
        static_cast<std::int64_t>(std::llround(since_first_s / av_q2d(stream.time_base)));
    last_pts_ = std::max(last_pts_ + 1, pts);  // timestamps must differ
    packet->pts = last_pts_;
    packet->dts = last_pts_;
    packet->duration = 0;
    packet->pos = -1;
    packet->stream_index = 0;
    code = av_write_frame(format_, packet.get());
  }
  if (code >= 0) {
    code = format_->pb->error;  // a failure of the flush is reported only here
  }
  if (code < 0) {
    *error = "cannot write " + path_ + ": " + av_error_text(code);
    return false;
  }
  return true;
}

}  // namespace alidade
