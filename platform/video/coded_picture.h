#pragma once
// What stands in a picture coded by H.264 (ITU-T H.264, 7.3) or H.265 (ITU-T H.265, 7.3) that libav does not tell: where it
// can be begun to decode, and a promise of reordering that no picture keeps.
//
// Data is as libavformat gives it: NAL units behind start codes (Annex B), from the picture's first on. Any bytes will do.
// Looks no further than the first slice. Pure functions.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace alidade {

enum class CodedBy { kH264, kH265 };

struct CodedPicture {
  bool has_beginning = false;   // its first slice is here, and the top of the picture is in it
  bool needs_no_other = false;  // H.264: IDR; H.265: IRAP
  // By a recovery point (SEI): decoding may begin here, and so many pictures later all is right. Those that count
  // in H.264 are reference pictures. At most 2^15.
  std::optional<int> right_after;
};

[[nodiscard]] CodedPicture look_at(CodedBy codec, const std::uint8_t* data, std::size_t size);

// The same data, whose parameter sets (SPS) say that no picture overtakes another: libav's decoders hold pictures back for
// as long as an SPS allows for, though none may come. Nothing where no SPS allows for any.
[[nodiscard]] std::optional<std::vector<std::uint8_t>> without_reordering(CodedBy codec,
                                                                          const std::uint8_t* data,
                                                                          std::size_t size);

}  // namespace alidade
