#pragma once
// How well tracks follow the truth. Names and definitions are those of PyPI's motmetrics where it has them:
//   CLEAR MOT  mota = 1 - (misses + false positives + switches) / objects, motp = mean of 1 - IoU over matches (Bernardin, Stiefelhagen 2008;
//              Lisanti et al. 18, 19, whose MOTP is 1 - motp). Who was matched stays matched while IoU suffices; the others are assigned
//              so that as many as possible are matched, at least distance. A pair may match at IoU >= 0.5
//   USC        mostly tracked (at least 0.8 of its frames), partially tracked, mostly lost (less than 0.2), fragmentations, faf: false positives a frame
//   identity   idf1, idp, idr: objects and tracks paired once for all frames (Ristani et al. 2016)
//   HOTA       hota, deta, assa, loca: means over IoU thresholds 0.05 to 0.95, as TrackEval defines them (Luiten et al. 2020)

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace alidade::test {

struct MotBox {
  std::int64_t frame = 0;
  std::int64_t identity = 0;
  double left = 0, top = 0, width = 0, height = 0;  // px
  bool counts = true;  // false, in a truth: is not there, but its frame is
};

struct MotMetrics {
  std::int64_t num_frames = 0, num_objects = 0, num_predictions = 0, num_unique_objects = 0;
  std::int64_t num_matches = 0, num_misses = 0, num_false_positives = 0, num_switches = 0;
  std::int64_t num_fragmentations = 0, num_transfer = 0, num_ascend = 0, num_migrate = 0;
  std::int64_t mostly_tracked = 0, partially_tracked = 0, mostly_lost = 0;
  double mota = 0, motp = 0, precision = 0, recall = 0,
         faf = 0;  // NaN where nothing is divided by nothing
  double idf1 = 0, idp = 0, idr = 0;
  double hota = 0, deta = 0, assa = 0, loca = 0;
};

// Boxes in any order of frames; a pair of frame and identity occurs once in each list.
[[nodiscard]] MotMetrics mot_metrics(const std::vector<MotBox>& truth,
                                     const std::vector<MotBox>& result);

[[nodiscard]] double intersection_over_union(const MotBox& a, const MotBox& b);

// By name, counts first.
[[nodiscard]] std::vector<std::pair<std::string, std::int64_t>> counts_of(
    const MotMetrics& metrics);
[[nodiscard]] std::vector<std::pair<std::string, double>> ratios_of(const MotMetrics& metrics);

}  // namespace alidade::test
