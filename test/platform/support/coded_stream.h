#pragma once
// coded_stream(): pictures coded by another program's H.264 or H.265 (x264, x265), by way of libavcodec.

#include <string>
#include <vector>

#include "platform/video/av_handles.h"
#include "platform/video/coded_picture.h"

namespace alidade {

struct CodedStreamOptions {
  CodedBy codec = CodedBy::kH264;
  int pictures = 12;
  int key_every = 10;
  int allowed_to_overtake = 0;  // so many pictures by the parameter sets; none does
  bool interlaced = false;      // H.264
  int width = 160;
  int height = 128;
  int references = 0;        // pictures that a decoder is to keep; 0: the encoder's choice
  bool sets_in_band = true;  // parameter sets; else in the parameters only
};

struct CodedStream {
  CodecParametersPtr parameters;
  std::vector<std::string> pictures;  // Annex B, in the order of decoding
};

// Throws where libavcodec cannot.
CodedStream coded_stream(const CodedStreamOptions& options);

}  // namespace alidade
