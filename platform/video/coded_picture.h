#pragma once
// What libav does not report of a picture coded by H.264 (ITU-T H.264, 7.3) or H.265 (ITU-T H.265,
// 7.3): whether decoding can start at this picture, and a permission to reorder that no picture
// uses. Data is as libavformat delivers it: NAL units behind start codes (Annex B), from the
// picture's first NAL unit. Any bytes are safe. Only the data up to the first slice is read. Pure
// functions.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace alidade {

enum class CodedBy { kH264, kH265 };

struct CodedPicture {
  bool has_beginning = false;   // the data has the first slice, with the top of the picture
  bool needs_no_other = false;  // H.264: IDR; H.265: IRAP
  // From a recovery point (SEI): decoding may start here, and the picture is right after this
  // number of pictures (in H.264 only reference pictures count). At most 2^15.
  std::optional<int> right_after;
};

[[nodiscard]] CodedPicture look_at(CodedBy codec, const std::uint8_t* data, std::size_t size);

// Returns the same data with parameter sets (SPS) that permit no reordering. libav's decoders hold
// back as many pictures as an SPS permits to be reordered, even if none are. nullopt if no SPS
// permits any.
[[nodiscard]] std::optional<std::vector<std::uint8_t>> without_reordering(CodedBy codec,
                                                                          const std::uint8_t* data,
                                                                          std::size_t size);

}  // namespace alidade
