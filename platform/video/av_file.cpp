#include "platform/video/av_file.h"

#include <vector>

#include "platform/streams/picture_size.h"

namespace alidade {
namespace {

// This decodes pictures, and would take a forged size for true.
int find_stream_info(AVFormatContext* format) {
  std::vector<AVDictionary*> options(format->nb_streams, nullptr);
  for (AVDictionary*& of_stream : options) {
    av_dict_set_int(&of_stream, "max_pixels", kMostFilePixels, 0);
  }
  const int code = avformat_find_stream_info(format, options.empty() ? nullptr : options.data());
  for (AVDictionary*& of_stream : options) av_dict_free(&of_stream);
  return code;
}

}  // namespace

AvFile::~AvFile() { avformat_close_input(&format_); }

bool AvFile::open(const std::string& path, std::string* error) {
  int code = avformat_open_input(&format_, path.c_str(), nullptr, nullptr);
  if (code >= 0) {
    code = find_stream_info(format_);  // finds out how far pictures are out of order
  }
  if (code < 0) {
    *error = path + ": " + av_error_text(code);
    return false;
  }
  const int stream = av_find_best_stream(format_, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  if (stream < 0) {
    *error = path + ": there is no video in it";
    return false;
  }
  stream_ = format_->streams[stream];
  return true;
}

bool AvFile::read(AVPacket* packet) {
  int code = 0;
  do {
    av_packet_unref(packet);
    code = av_read_frame(format_, packet);
  } while (code >= 0 && packet->stream_index != stream_->index);
  return code >= 0;
}

}  // namespace alidade
