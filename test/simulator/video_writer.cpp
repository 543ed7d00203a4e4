#include "test/simulator/video_writer.h"

extern "C" {
#include <libavcodec/packet.h>
#include <libavformat/avformat.h>
#include <libavutil/error.h>
}

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace alidade::simulator {

struct VideoWriter::Muxer {
  std::string file;
  AVFormatContext* context = nullptr;
  AVPacket* packet = av_packet_alloc();
  VideoCodec codec = VideoCodec::kMjpeg;
  bool begun = false;

  Muxer() = default;
  Muxer(const Muxer&) = delete;
  Muxer& operator=(const Muxer&) = delete;
  ~Muxer() {
    av_packet_free(&packet);
    if (context != nullptr) avio_closep(&context->pb);
    avformat_free_context(context);
  }

  void check(int status) const {
    if (status >= 0) return;
    std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
    av_strerror(status, text.data(), text.size());
    throw std::runtime_error(file + ": " + text.data());
  }

  // The file's head tells the parameter sets of the first picture.
  void begin(const std::vector<std::uint8_t>& sets) {
    begun = true;
    if (!sets.empty()) {
      AVCodecParameters& parameters = *context->streams[0]->codecpar;
      parameters.extradata =
          static_cast<std::uint8_t*>(av_mallocz(sets.size() + AV_INPUT_BUFFER_PADDING_SIZE));
      if (parameters.extradata == nullptr) throw std::bad_alloc();
      std::copy(sets.begin(), sets.end(), parameters.extradata);
      parameters.extradata_size = static_cast<int>(sets.size());
    }
    check(avformat_write_header(context, nullptr));
  }
};

namespace {

AVCodecID codec_id(VideoCodec codec) {
  return codec == VideoCodec::kH264   ? AV_CODEC_ID_H264
         : codec == VideoCodec::kH265 ? AV_CODEC_ID_HEVC
                                      : AV_CODEC_ID_MJPEG;
}

bool is_parameter_set(VideoCodec codec, std::uint8_t header) {
  if (codec == VideoCodec::kH264) return (header & 31) == 7 || (header & 31) == 8;
  const int type = (header >> 1) & 63;
  return type >= 32 && type <= 34;
}

// The parameter sets of an access unit in Annex B, with their start codes; empty if it has none.
std::vector<std::uint8_t> parameter_sets(VideoCodec codec, const std::vector<std::uint8_t>& unit) {
  std::vector<std::uint8_t> sets;
  bool wanted = false;
  for (std::size_t i = 0; i < unit.size(); ++i) {
    const bool starts = i + 3 < unit.size() && unit[i] == 0 && unit[i + 1] == 0 && unit[i + 2] == 1;
    if (starts) {
      wanted = is_parameter_set(codec, unit[i + 3]);
      if (wanted) sets.push_back(0);  // a start code of four bytes
    }
    if (wanted) sets.push_back(unit[i]);
  }
  return sets;
}

}  // namespace

VideoWriter::VideoWriter(const std::filesystem::path& file, VideoCodec codec, int width, int height,
                         double rate_hz)
    : muxer_(std::make_unique<Muxer>()) {
  muxer_->file = file.string();
  muxer_->codec = codec;
  muxer_->check(
      avformat_alloc_output_context2(&muxer_->context, nullptr, "matroska", file.c_str()));
  AVStream* stream = avformat_new_stream(muxer_->context, nullptr);
  if (stream == nullptr || muxer_->packet == nullptr) throw std::bad_alloc();
  stream->time_base = {1, 1000};
  stream->avg_frame_rate = av_d2q(rate_hz, 100000);
  stream->codecpar->codec_type = AVMEDIA_TYPE_VIDEO;
  stream->codecpar->codec_id = codec_id(codec);
  stream->codecpar->format = AV_PIX_FMT_YUVJ420P;
  stream->codecpar->width = width;
  stream->codecpar->height = height;
  muxer_->check(avio_open(&muxer_->context->pb, file.c_str(), AVIO_FLAG_WRITE));
}

VideoWriter::~VideoWriter() = default;

void VideoWriter::write(const std::vector<std::uint8_t>& picture, double time_s) {
  const bool jpeg = muxer_->codec == VideoCodec::kMjpeg;
  const std::vector<std::uint8_t> sets =
      jpeg ? std::vector<std::uint8_t>() : parameter_sets(muxer_->codec, picture);
  if (!muxer_->begun) muxer_->begin(sets);
  muxer_->check(av_new_packet(muxer_->packet, static_cast<int>(picture.size())));
  std::copy(picture.begin(), picture.end(), muxer_->packet->data);
  muxer_->packet->pts = std::lround(time_s * 1000);
  muxer_->packet->dts = muxer_->packet->pts;
  if (jpeg || !sets.empty()) muxer_->packet->flags |= AV_PKT_FLAG_KEY;
  av_packet_rescale_ts(muxer_->packet, {1, 1000}, muxer_->context->streams[0]->time_base);
  muxer_->check(av_interleaved_write_frame(muxer_->context, muxer_->packet));
}

void VideoWriter::finish() {
  if (!muxer_->begun) muxer_->begin({});
  muxer_->check(av_write_trailer(muxer_->context));
  muxer_->check(avio_closep(&muxer_->context->pb));
}

}  // namespace alidade::simulator
