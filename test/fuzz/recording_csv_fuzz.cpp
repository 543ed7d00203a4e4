// The tables of a recording; the header tells which. All numbers are finite, frames and landmarks whole, and
// a table that is taken is not taken without its last line feed.

#include <sstream>

#include "platform/storage/recording.h"
#include "test/fuzz/fuzz_target.h"

namespace alidade {
namespace {

bool is_sound(const FrameStamp& stamp) {
  return stamp.frame >= 0 && std::isfinite(stamp.receive_time_s) &&
         std::isfinite(stamp.sender_time_s.value_or(0)) &&
         std::isfinite(stamp.sender_utc_s.value_or(0));
}

bool is_sound(const PanTiltSample& sample) {
  return sample.earliest_time_s <= sample.latest_time_s && std::isfinite(sample.latest_time_s) &&
         std::isfinite(sample.pan_rad) && std::isfinite(sample.tilt_rad) &&
         std::isfinite(sample.zoom.value_or(0)) && std::isfinite(sample.device_time_s.value_or(0));
}

bool is_sound(const TrackPoint& point) {
  return std::abs(static_cast<double>(point.landmark)) <= 0x1p53 && std::isfinite(point.u_px) &&
         std::isfinite(point.v_px) && std::isfinite(point.sigma_px);
}

template <class Row>
using Parser = bool (*)(std::istream&, const std::string&, std::vector<Row>*, std::string*);

template <class Row>
void require_sound(const std::string& text, Parser<Row> parse) {
  std::vector<Row> rows;
  std::string error;
  std::istringstream whole(text);
  if (!parse(whole, "table.csv", &rows, &error)) {
    FUZZ_REQUIRE(is_one_line(error));
    FUZZ_REQUIRE(error.rfind("table.csv:", 0) == 0);
    return;
  }
  FUZZ_REQUIRE(!text.empty() && text.back() == '\n');
  FUZZ_REQUIRE(std::all_of(rows.begin(), rows.end(), [](const Row& row) { return is_sound(row); }));
  if (text.size() < 2 || text[text.size() - 2] == '\n') return;
  std::istringstream cut_off(text.substr(0, text.size() - 1));
  FUZZ_REQUIRE(!parse(cut_off, "table.csv", &rows, &error));
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  const std::string text(text_of(data, size));
  const std::string header = text.substr(0, text.find('\n'));
  if (header.find("landmark") != std::string::npos) {
    require_sound<TrackPoint>(text, parse_tracks_csv);
  } else if (header.find("pan_rad") != std::string::npos) {
    require_sound<PanTiltSample>(text, parse_telemetry_csv);
  } else {
    require_sound<FrameStamp>(text, parse_frames_csv);
  }
  return 0;
}
