#pragma once
// SceneLocalization: where a live picture looks by the scene map, and what follows for telemetry's
// base. A picture is searched at the place and focal length of its record, else in the whole map
// (core/mapping/localization.h). A picture that is not found is counted and changes neither the
// base nor the map. A movement of base or zero is logged once. A frame without orientation (no
// telemetry) is searched in the whole map, with its calibration's focal length; a result at another
// zoom is refused. For a lens that zooms, any focal length of its zoom curve is accepted. A result
// that contradicts nothing may update the map (scene_upkeep.h). One thread, except for report().

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/mapping/scene_map.h"
#include "edge_app/localization/base_judge.h"
#include "edge_app/localization/scene_search.h"
#include "edge_app/localization/scene_upkeep.h"
#include "edge_app/step/scene_report.h"
#include "edge_app/taps/scene_tap.h"

namespace alidade {

class SceneLocalization : public SceneLocator {
 public:
  // name: of the map, for people. has_telemetry: the camera has telemetry. range: without
  // telemetry, the focal lengths of a lens that zooms. store: null: the map is not kept up.
  SceneLocalization(SceneMap map, const std::string& name, const BaseJudgeOptions& options,
                    bool has_telemetry = true, std::optional<CurveRange> range = {},
                    StoreMapChange store = nullptr);
  ~SceneLocalization() override;

  void prepare() override;  // before look(): builds the index; frees the map unless it is kept up
  [[nodiscard]] Outcome look(const LocalizableFrame& frame, ToldBase* told) override;

  // What the keyframes show, as read at the start. Any thread.
  [[nodiscard]] const std::vector<SceneOutline>& outlines() const { return outlines_; }
  // Any thread but the real-time one.
  [[nodiscard]] SceneReport report() const;

 private:
  [[nodiscard]] Outcome judge(const LocalizableFrame& frame, const Localization& found,
                              ToldBase* told);
  void keep_up(const Localization& found, const FeatureSet& seen);
  [[nodiscard]] Outcome tell_whole(const LocalizableFrame& frame, const Localization& found,
                                   ToldBase* told);
  void count(std::int64_t frame, const Localization& found, double took_s);
  void say_moved(std::int64_t frame, const BaseOffset& offset, bool is_corrected);

  const double zero_sigma_;
  const bool has_telemetry_;
  const std::optional<CurveRange> range_;
  bool is_zoom_said_ = false;
  bool is_start_said_ = false;
  SceneMap map_;
  const double reference_row_;
  const std::vector<SceneOutline> outlines_;
  std::unique_ptr<const SceneSearch> searcher_;
  BaseJudge judge_;
  SceneUpkeep upkeep_;

  mutable std::mutex mutex_;  // guards what follows
  SceneReport report_;
};

}  // namespace alidade
