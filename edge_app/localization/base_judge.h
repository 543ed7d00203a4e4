#pragma once
// BaseJudge: what it means that a picture was localized: how far its record is off, and whether telemetry's zero or the base has moved.
//   change = localized angle - record's angle, at the row for which the map's pose holds
// A record in telemetry's base is expected within zero_sigma of the map's; one in the map's base within what it claims. A change beyond that is
// a movement, if a second picture says the same. A movement is told as such, so that what was known counts no more, or reported only.
// Pure: no thread, no clock. Allocates nothing.

#include <optional>

#include "core/mapping/localization.h"
#include "edge_app/record/orientation_record.h"
#include "edge_app/step/scene_report.h"
#include "edge_app/step/told_base.h"

namespace alidade {

struct BaseJudgeOptions {
  double zero_sigma = 1e-3;  // rad, > 0: of telemetry's zero from one start to the next
  bool correct = true;       // a movement; false: report it only
};

class BaseJudge {
 public:
  enum class Verdict {
    kExpected,   // within what was to be expected: to be told
    kSuspected,  // beyond that: a second picture is to say so, too
    kMoved,      // it did: to be told
    kReported    // it did: not to be told
  };

  explicit BaseJudge(const BaseJudgeOptions& options = {}) : options_(options) {}

  // found: kOk, of the record's frame, which has an orientation. told: all but frame and time.
  [[nodiscard]] Verdict judge(const OrientationRecord& record, const Localization& found,
                              double reference_row, ToldBase* told, BaseOffset* offset);

 private:
  BaseJudgeOptions options_;
  std::optional<BaseOffset> suspected_;
};

}  // namespace alidade
