#include "test/simulator/video_writer.h"

extern "C" {
#include <libavcodec/packet.h>
#include <libavformat/avformat.h>
#include <libavutil/error.h>
}

#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace alidade::simulator {

struct VideoWriter::Muxer {
  std::string file;
  AVFormatContext* context = nullptr;
  AVPacket* packet = av_packet_alloc();

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
};

VideoWriter::VideoWriter(const std::filesystem::path& file, int width, int height, double rate_hz)
    : muxer_(std::make_unique<Muxer>()) {
  muxer_->file = file.string();
  muxer_->check(
      avformat_alloc_output_context2(&muxer_->context, nullptr, "matroska", file.c_str()));
  AVStream* stream = avformat_new_stream(muxer_->context, nullptr);
  if (stream == nullptr || muxer_->packet == nullptr) throw std::bad_alloc();
  stream->time_base = {1, 1000};
  stream->avg_frame_rate = av_d2q(rate_hz, 100000);
  stream->codecpar->codec_type = AVMEDIA_TYPE_VIDEO;
  stream->codecpar->codec_id = AV_CODEC_ID_MJPEG;
  stream->codecpar->format = AV_PIX_FMT_YUVJ420P;
  stream->codecpar->width = width;
  stream->codecpar->height = height;
  muxer_->check(avio_open(&muxer_->context->pb, file.c_str(), AVIO_FLAG_WRITE));
  muxer_->check(avformat_write_header(muxer_->context, nullptr));
}

VideoWriter::~VideoWriter() = default;

void VideoWriter::write(const std::vector<std::uint8_t>& jpeg, double time_s) {
  muxer_->check(av_new_packet(muxer_->packet, static_cast<int>(jpeg.size())));
  std::copy(jpeg.begin(), jpeg.end(), muxer_->packet->data);
  muxer_->packet->pts = std::lround(time_s * 1000);
  muxer_->packet->dts = muxer_->packet->pts;
  muxer_->packet->flags |= AV_PKT_FLAG_KEY;
  av_packet_rescale_ts(muxer_->packet, {1, 1000}, muxer_->context->streams[0]->time_base);
  muxer_->check(av_interleaved_write_frame(muxer_->context, muxer_->packet));
}

void VideoWriter::finish() {
  muxer_->check(av_write_trailer(muxer_->context));
  muxer_->check(avio_closep(&muxer_->context->pb));
}

}  // namespace alidade::simulator
