#pragma once
// SceneUpkeep: keeps the scene map in use true by the pictures that were found in it (core/mapping/map_upkeep.h), and on disk: one
// transaction a picture, there when it returns, so that whatever ends the process costs no more than the picture under way.
// What the disk does not take is said once and ends the upkeep; the map goes on as it stands on disk. Whoever localizes has an index of
// the map as it was: is_due() says when another is worth its while. One thread.

#include <cstdint>
#include <functional>
#include <string>

#include "core/mapping/localization.h"
#include "core/mapping/map_change.h"
#include "core/mapping/map_upkeep.h"
#include "edge_app/step/scene_report.h"

namespace alidade {

// Stores a change of the map as one transaction. False: *error, one line, and the map on disk is as it was.
using StoreMapChange = std::function<bool(const MapChange& change, std::string* error)>;

class SceneUpkeep {
 public:
  // store: none: nothing is kept up.
  explicit SceneUpkeep(StoreMapChange store) : store_(std::move(store)) {}

  [[nodiscard]] bool keeps_up() const { return store_ != nullptr; }
  // found: kOk, of these features. *map: as on disk, before and after.
  void show(const Localization& found, const FeatureSet& features, double time_utc_s,
            SceneMap* map);

  // So much has come and gone since the index was made.
  [[nodiscard]] bool is_due() const { return changed_ >= kWorthAnIndex; }
  void index_made() { changed_ = 0; }

  [[nodiscard]] const UpkeepReport& report() const { return report_; }

 private:
  static constexpr int kWorthAnIndex = 100;  // landmarks

  void stop(const std::string& error);

  StoreMapChange store_;
  LandmarkUpkeep upkeep_;
  int changed_ = 0;
  UpkeepReport report_;
};

}  // namespace alidade
