#pragma once
// BaseJudge: how far a record's angles differ from those of the localized picture, and whether
// telemetry's zero or the base has moved.
//   change = localized angle - record's angle, at the row for which the map's pose holds
// Two things are expected: telemetry's zero within zero_sigma of the map's base, or of the movement
// told last; and a record in the map's base within its own sigma. The first may show itself only
// later, once telemetry is known well enough (a link whose delay was open). More is a movement once
// a second picture confirms it. A movement is corrected, and earlier results no longer count; or it
// is only reported. Pure: no thread, no clock. Allocates nothing.

#include <optional>

#include "core/mapping/localization.h"
#include "edge_app/record/orientation_record.h"
#include "edge_app/step/scene_report.h"
#include "edge_app/step/told_base.h"

namespace alidade {

struct BaseJudgeOptions {
  double zero_sigma = 1e-3;  // rad, > 0: change of telemetry's zero between starts
  bool correct = true;       // correct movements; false: only report them
};

class BaseJudge {
 public:
  enum class Verdict {
    kExpected,   // as expected: the result is to be used
    kSuspected,  // a larger change: a second picture has to confirm it
    kMoved,      // confirmed: the result is to be used
    kReported,   // confirmed: the movement is only to be reported
    kVague       // movements are only to be reported, and the record is too uncertain to show one
  };

  explicit BaseJudge(const BaseJudgeOptions& options = {}) : options_(options) {}

  // found: a result with kOk for the record's frame, which has an orientation. reference_row: px,
  // row for which its pose holds. Whatever the verdict, sets change_rad, covariance and moved of
  // *told, and all of *offset: the offset of telemetry's base in the map's, by this picture.
  [[nodiscard]] Verdict judge(const OrientationRecord& record, const Localization& found,
                              double reference_row, ToldBase* told, BaseOffset* offset);

 private:
  [[nodiscard]] bool is_vague(const OrientationRecord& record, const Matrix2<double>& covariance);

  BaseJudgeOptions options_;
  std::optional<BaseOffset> suspected_;
  BaseOffset told_;  // of the movement corrected last, else 0
  std::optional<double> vague_since_s_;
};

}  // namespace alidade
