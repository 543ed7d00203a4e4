#pragma once
// Picture and video files of even greys, made with libavcodec.

#include <string>

#include "platform/video/av_handles.h"

namespace alidade {

// One picture as "png", "pgm" or "mjpeg" (JPEG with full-range luma), all of this grey.
std::string picture_file(const std::string& encoder, int width, int height, int grey,
                         AVPixelFormat format = AV_PIX_FMT_GRAY8);

// H.264 in Matroska; picture n has the grey 20 + 10 n; b_frames of them in a row are reordered.
void write_video(const std::string& path, int width, int height, int pictures, int b_frames);

}  // namespace alidade
