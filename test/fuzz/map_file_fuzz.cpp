// map.bin: as it stands, and again with its magic, version, calibration, sizes and checksum put right,
// which no mutation would hit. What is read is written as the same bytes.

#include <zlib.h>

#include "edge_app/storage/map_file.h"
#include "test/fuzz/fuzz_target.h"

namespace alidade {
namespace {

constexpr std::size_t kCounts = 16;  // where the numbers of points and landmarks stand
constexpr std::size_t kFrame = 32;   // what follows them
constexpr std::size_t kFrameSize = 320;
constexpr std::size_t kPointSize = 60;
constexpr std::size_t kLandmarkSize = 464;

const Calibration& some_calibration() {
  static const Calibration calibration = [] {
    Calibration some;
    some.camera = {32000.0, 1.0, {0.0}, 1920, 1080};
    return some;
  }();
  return calibration;
}

void append_u32(std::uint32_t value, std::string* bytes) {
  for (unsigned i = 0; i < 4; ++i) *bytes += static_cast<char>(value >> (8 * i) & 0xFFU);
}

// As many points as told, of three at most, and landmarks in what is left.
std::string put_right(std::string_view bytes) {
  const std::uint32_t points = static_cast<std::uint8_t>(bytes[kCounts]) % 4;
  std::string content(bytes.substr(kFrame));
  content.resize(std::max(content.size(), kFrameSize + points * kPointSize));
  const std::size_t landmarks = (content.size() - kFrameSize - points * kPointSize) / kLandmarkSize;
  content.resize(kFrameSize + points * kPointSize + landmarks * kLandmarkSize);
  std::string right = "ALIDMAP\n";
  append_u32(3, &right);
  append_u32(calibration_check(some_calibration()), &right);
  append_u32(points, &right);
  append_u32(0, &right);
  append_u32(static_cast<std::uint32_t>(landmarks), &right);
  append_u32(0, &right);
  right += content;
  append_u32(static_cast<std::uint32_t>(
                 crc32_z(0, reinterpret_cast<const unsigned char*>(right.data()), right.size())),
             &right);
  return right;
}

void require_sound(const std::string& bytes) {
  MapContent content;
  std::string error;
  if (!parse_map(bytes, "map.bin", some_calibration(), &content, &error)) {
    FUZZ_REQUIRE(is_one_line(error));
    return;
  }
  FUZZ_REQUIRE(format_map(content, some_calibration()) == bytes);
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  const std::string bytes(text_of(data, size));
  require_sound(bytes);
  if (bytes.size() >= kFrame) require_sound(put_right(bytes));
  return 0;
}
