#include "platform/video/coded_picture.h"

#include <algorithm>
#include <array>

namespace alidade {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr int kMostPictures = 1 << 15;
constexpr int kRecoveryPoint = 6;  // SEI payload type, in both standards

struct NalUnit {
  const std::uint8_t* begin;  // after the start code
  const std::uint8_t* end;
  std::size_t size() const { return static_cast<std::size_t>(end - begin); }
};

constexpr std::size_t kStartCode = 3;  // bytes: 0 0 1

// The first start code from `at` on, or the end.
const std::uint8_t* find_start(const std::uint8_t* at, const std::uint8_t* end) {
  while (end - at >= static_cast<std::ptrdiff_t>(kStartCode)) {
    if (at[2] > 1) {
      at += 3;
    } else if (at[0] == 0 && at[1] == 0 && at[2] == 1) {
      return at;
    } else {
      ++at;
    }
  }
  return end;
}

class NalUnits {
 public:
  NalUnits(const std::uint8_t* data, std::size_t size)
      : end_(data + size), start_(find_start(data, end_)) {}

  std::optional<NalUnit> next() {
    if (start_ == end_) return std::nullopt;
    const std::uint8_t* const begin = start_ + kStartCode;
    start_ = find_start(begin, end_);
    const std::uint8_t* last = start_;
    while (last > begin && last[-1] == 0) --last;  // filler, or part of the next start code
    return NalUnit{begin, last};
  }

 private:
  const std::uint8_t* end_;
  const std::uint8_t* start_;
};

struct Kind {
  std::size_t header;  // bytes
  unsigned type;
  bool is_slice;
  bool is_base;  // belongs to the only layer that is decoded
};

std::optional<Kind> kind_of(CodedBy codec, const NalUnit& nal) {
  const std::size_t header = codec == CodedBy::kH264 ? 1 : 2;
  if (nal.size() <= header) return std::nullopt;
  if (codec == CodedBy::kH264) {
    const unsigned type = nal.begin[0] & 0x1FU;
    return Kind{header, type, type >= 1 && type <= 5, true};
  }
  const unsigned type = nal.begin[0] >> 1U & 0x3FU;
  return Kind{header, type, type < 32, (nal.begin[0] & 1U) == 0 && nal.begin[1] >> 3U == 0};
}

bool is_sei(CodedBy codec, unsigned type) { return type == (codec == CodedBy::kH264 ? 6U : 39U); }
bool is_sps(CodedBy codec, unsigned type) { return type == (codec == CodedBy::kH264 ? 7U : 33U); }
bool is_random_access(CodedBy codec, unsigned type) {
  return codec == CodedBy::kH264 ? type == 5 : type >= 16 && type <= 23;
}

// The payload without the bytes that prevent start codes in it.
Bytes unescaped(const std::uint8_t* begin, const std::uint8_t* end) {
  Bytes payload;
  payload.reserve(static_cast<std::size_t>(end - begin));
  int zeros = 0;
  for (; begin != end; ++begin) {
    if (zeros >= 2 && *begin == 3) {
      zeros = 0;
      continue;
    }
    zeros = *begin == 0 ? zeros + 1 : 0;
    payload.push_back(*begin);
  }
  return payload;
}

void append_escaped(const Bytes& payload, Bytes* data) {
  int zeros = 0;
  for (const std::uint8_t byte : payload) {
    if (zeros >= 2 && byte <= 3) {
      data->push_back(3);
      zeros = 0;
    }
    zeros = byte == 0 ? zeros + 1 : 0;
    data->push_back(byte);
  }
}

// Reads zeros beyond the end; ok() is false then.
class Bits {
 public:
  explicit Bits(const Bytes& bytes, std::size_t first_byte = 0)
      : bytes_(bytes), at_(8 * first_byte) {}

  [[nodiscard]] bool ok() const { return at_ <= 8 * bytes_.size(); }
  [[nodiscard]] std::size_t position() const { return at_; }

  bool flag() { return take(1) != 0; }
  void skip(std::size_t bits) { at_ += bits; }
  std::uint32_t take(int bits) {
    std::uint32_t value = 0;
    for (int i = 0; i < bits; ++i, ++at_) {
      const bool one = at_ < 8 * bytes_.size() && (bytes_[at_ / 8] >> (7 - at_ % 8) & 1U) != 0;
      value = value << 1U | (one ? 1U : 0U);
    }
    return value;
  }
  // ue(v): n zeros, a one, n bits.
  std::uint32_t unsigned_code() {
    int zeros = 0;
    while (zeros < 32 && ok() && !flag()) ++zeros;
    return zeros == 32 ? 0xFFFF'FFFFU : (1U << static_cast<unsigned>(zeros)) - 1U + take(zeros);
  }
  // se(v): 0, 1, -1, 2, -2, ...
  std::int64_t signed_code() {
    const std::uint32_t code = unsigned_code();
    const std::int64_t half = (std::int64_t{code} + 1) / 2;
    return code % 2 == 1 ? half : -half;
  }

 private:
  const Bytes& bytes_;
  std::size_t at_;
};

// SEI messages: type and size, each in bytes of which all but the last are 255.
std::optional<int> recovery_of(CodedBy codec, const Bytes& payload) {
  std::size_t at = 0;
  const auto number = [&] {
    std::size_t value = 0;
    while (at < payload.size() && payload[at] == 255) value += payload[at++];
    return at < payload.size() ? value + payload[at++] : value;
  };
  while (at + 1 < payload.size()) {
    const std::size_t type = number();
    const std::size_t size = number();
    if (at >= payload.size() || size == 0 || size > payload.size() - at) return std::nullopt;
    if (type == kRecoveryPoint) {
      Bits bits(payload, at);
      const std::int64_t count =
          codec == CodedBy::kH264 ? std::int64_t{bits.unsigned_code()} : bits.signed_code();
      if (!bits.ok()) return std::nullopt;
      return static_cast<int>(std::clamp<std::int64_t>(count, 0, kMostPictures));
    }
    at += size;
  }
  return std::nullopt;
}

// Bit positions of a number in a parameter set that says how many pictures may be reordered.
struct Range {
  std::size_t begin;
  std::size_t end;
};
using Ranges = std::vector<Range>;

void add_unless_zero(Bits* bits, Ranges* ranges) {
  const std::size_t begin = bits->position();
  if (bits->unsigned_code() != 0) ranges->push_back({begin, bits->position()});
}

void skip_codes(Bits* bits, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count && bits->ok(); ++i) bits->unsigned_code();
}

void skip_scaling_list(Bits* bits, int size) {
  int next = 8;
  for (int i = 0; i < size && next != 0 && bits->ok(); ++i) {
    next = static_cast<int>((next + bits->signed_code() + 256) % 256);
  }
}

void skip_h264_timing_of_buffers(Bits* bits) {  // E.1.2
  const std::uint32_t count = bits->unsigned_code();
  bits->skip(8);
  for (std::uint32_t i = 0; i <= count && bits->ok(); ++i) {
    skip_codes(bits, 2);
    bits->skip(1);
  }
  bits->skip(20);
}

void skip_h264_chroma(Bits* bits, std::uint32_t profile) {
  constexpr std::array<std::uint32_t, 13> kWithChroma = {100, 110, 122, 244, 44,  83, 86,
                                                         118, 128, 138, 139, 134, 135};
  if (std::find(kWithChroma.begin(), kWithChroma.end(), profile) == kWithChroma.end()) return;
  const std::uint32_t chroma = bits->unsigned_code();
  if (chroma == 3) bits->skip(1);
  skip_codes(bits, 2);
  bits->skip(1);
  if (!bits->flag()) return;
  for (int i = 0; i < (chroma == 3 ? 12 : 8); ++i) {
    if (bits->flag()) skip_scaling_list(bits, i < 6 ? 16 : 64);
  }
}

void skip_h264_order(Bits* bits) {
  const std::uint32_t type = bits->unsigned_code();
  if (type == 0) skip_codes(bits, 1);
  if (type != 1) return;
  bits->skip(1);
  skip_codes(bits, 2);
  skip_codes(bits, bits->unsigned_code());
}

// 7.3.2.1.1 and E.1.1.
Ranges h264_reordering(const Bytes& sps) {
  Ranges ranges;
  Bits bits(sps);
  const std::uint32_t profile = bits.take(8);
  bits.skip(16);
  skip_codes(&bits, 1);
  skip_h264_chroma(&bits, profile);
  skip_codes(&bits, 1);
  skip_h264_order(&bits);
  skip_codes(&bits, 1);
  bits.skip(1);
  skip_codes(&bits, 2);
  if (!bits.flag()) bits.skip(1);
  bits.skip(1);
  if (bits.flag()) skip_codes(&bits, 4);
  if (!bits.flag()) return ranges;  // no VUI (video usability information)
  if (bits.flag() && bits.take(8) == 255) bits.skip(32);
  if (bits.flag()) bits.skip(1);
  if (bits.flag()) {
    bits.skip(4);
    if (bits.flag()) bits.skip(24);
  }
  if (bits.flag()) skip_codes(&bits, 2);
  if (bits.flag()) bits.skip(65);
  const bool of_nal_units = bits.flag();
  if (of_nal_units) skip_h264_timing_of_buffers(&bits);
  const bool of_slices = bits.flag();
  if (of_slices) skip_h264_timing_of_buffers(&bits);
  if (of_nal_units || of_slices) bits.skip(1);
  bits.skip(1);
  if (!bits.flag())
    return ranges;  // no restrictions given: libav then waits for the first reordered picture
  bits.skip(1);
  skip_codes(&bits, 4);
  add_unless_zero(&bits, &ranges);
  return bits.ok() ? ranges : Ranges{};
}

void skip_h265_profile(Bits* bits, std::uint32_t more_layers) {  // 7.3.3
  constexpr std::size_t kProfile = 88;
  constexpr std::size_t kLevel = 8;
  bits->skip(kProfile + kLevel);
  std::size_t rest = 0;
  for (std::uint32_t i = 0; i < more_layers; ++i) {
    if (bits->flag()) rest += kProfile;
    if (bits->flag()) rest += kLevel;
  }
  for (std::uint32_t i = more_layers; more_layers > 0 && i < 8; ++i) bits->skip(2);
  bits->skip(rest);
}

// 7.3.2.2.1.
Ranges h265_reordering(const Bytes& sps) {
  Ranges ranges;
  Bits bits(sps);
  bits.skip(4);
  const std::uint32_t more_layers = bits.take(3);
  bits.skip(1);
  skip_h265_profile(&bits, more_layers);
  skip_codes(&bits, 1);
  if (bits.unsigned_code() == 3) bits.skip(1);
  skip_codes(&bits, 2);
  if (bits.flag()) skip_codes(&bits, 4);
  skip_codes(&bits, 3);
  for (std::uint32_t i = bits.flag() ? 0 : more_layers; i <= more_layers; ++i) {
    skip_codes(&bits, 1);
    add_unless_zero(&bits, &ranges);
    skip_codes(&bits, 1);
  }
  return bits.ok() ? ranges : Ranges{};
}

// Replaces each range by ue(v) 0, which is one bit, 1. The payload ends with a 1 and zeros up to a
// whole byte.
Bytes with_zeros(const Bytes& payload, const Ranges& ranges) {
  std::size_t end = 8 * payload.size();
  const auto bit = [&](std::size_t i) { return (payload[i / 8] >> (7 - i % 8) & 1U) != 0; };
  while (end > 0 && !bit(end - 1)) --end;
  Bytes changed;
  std::size_t written = 0;
  const auto write = [&](bool one) {
    if (written % 8 == 0) changed.push_back(0);
    if (one) changed.back() = static_cast<std::uint8_t>(changed.back() | 0x80U >> written % 8);
    ++written;
  };
  std::size_t at = 0;
  for (const Range& range : ranges) {
    for (; at < range.begin; ++at) write(bit(at));
    write(true);
    at = range.end;
  }
  for (; at < end; ++at) write(bit(at));
  return changed;
}

}  // namespace

CodedPicture look_at(CodedBy codec, const std::uint8_t* data, std::size_t size) {
  CodedPicture picture;
  NalUnits units(data, size);
  while (const std::optional<NalUnit> nal = units.next()) {
    const std::optional<Kind> kind = kind_of(codec, *nal);
    if (!kind || !kind->is_base) continue;
    if (kind->is_slice) {
      // First field of the slice header. H.264: number of the first macroblock, ue(v). H.265: a
      // flag.
      picture.has_beginning = (nal->begin[kind->header] & 0x80U) != 0;
      picture.needs_no_other = is_random_access(codec, kind->type);
      return picture;
    }
    if (is_sei(codec, kind->type) && !picture.right_after) {
      picture.right_after = recovery_of(codec, unescaped(nal->begin + kind->header, nal->end));
    }
  }
  return picture;
}

std::optional<std::vector<std::uint8_t>> without_reordering(CodedBy codec, const std::uint8_t* data,
                                                            std::size_t size) {
  Bytes changed;
  const std::uint8_t* copied = data;
  NalUnits units(data, size);
  while (const std::optional<NalUnit> nal = units.next()) {
    const std::optional<Kind> kind = kind_of(codec, *nal);
    if (!kind || !kind->is_base) continue;
    if (kind->is_slice) break;
    if (!is_sps(codec, kind->type)) continue;
    const Bytes payload = unescaped(nal->begin + kind->header, nal->end);
    const Ranges ranges =
        codec == CodedBy::kH264 ? h264_reordering(payload) : h265_reordering(payload);
    if (ranges.empty()) continue;
    changed.insert(changed.end(), copied, nal->begin + kind->header);
    append_escaped(with_zeros(payload, ranges), &changed);
    copied = nal->end;
  }
  if (copied == data) return std::nullopt;
  changed.insert(changed.end(), copied, data + size);
  return changed;
}

}  // namespace alidade
