#pragma once
// SceneUpkeep: keeps the scene map in use up to date by the pictures found in it
// (core/mapping/scene_map_upkeep.h), in memory and on disk. Each picture is one transaction, on
// disk when show() returns: if the process ends, at most the present picture is lost. If the disk
// refuses a transaction, the refusal is logged once and the upkeep ends; the map stays as it is on
// disk. The localizer's index is of an earlier state of the map: is_due() says when a new index is
// worthwhile. One thread.

#include <cstdint>
#include <functional>
#include <string>

#include "core/mapping/localization.h"
#include "core/mapping/map_change.h"
#include "core/mapping/scene_map_upkeep.h"
#include "edge_app/step/scene_report.h"

namespace alidade {

// Stores a change of the map as one transaction. False: one line in *error, and the map on disk is
// unchanged.
using StoreMapChange = std::function<bool(const MapChange& change, std::string* error)>;

class SceneUpkeep {
 public:
  // store: null: nothing is kept up.
  explicit SceneUpkeep(StoreMapChange store) : store_(std::move(store)) {}

  [[nodiscard]] bool keeps_up() const { return store_ != nullptr; }
  // Does nothing unless keeps_up(). found: kOk, from these features. *map: equals the map on disk,
  // before and after.
  void show(const Localization& found, const FeatureSet& features, double time_utc_s,
            SceneMap* map);

  // Enough landmarks have come and gone since the index was built.
  [[nodiscard]] bool is_due() const { return changed_ >= kWorthAnIndex; }
  void index_made() { changed_ = 0; }

  [[nodiscard]] const UpkeepReport& report() const { return report_; }

 private:
  static constexpr int kWorthAnIndex = 100;  // landmarks

  void stop(const std::string& error);

  StoreMapChange store_;
  SceneMapUpkeep upkeep_;
  int changed_ = 0;
  UpkeepReport report_;
};

}  // namespace alidade
