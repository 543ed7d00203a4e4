#pragma once
// Writes the tables of scene.map, row by row, and keeps sums and counts of the scene row up to
// date. For use inside a transaction. A failure is the database's (SqliteDatabase::failed()); after
// a failure nothing is written.

#include <cstdint>

#include "core/mapping/scene_map.h"
#include "edge_app/storage/scene_map_rows.h"
#include "edge_app/storage/sqlite.h"

namespace alidade {

class SceneRows {
 public:
  // Borrows both. *scene: as in the database, until put_scene().
  SceneRows(SqliteDatabase* database, SceneRow* scene);

  void add(const SceneKeyframe& keyframe);
  void add(const SceneLandmark& landmark);
  // False: there is no such landmark.
  [[nodiscard]] bool change(const SceneLandmark& landmark);
  [[nodiscard]] bool remove(std::int64_t landmark);
  void put_scene();

 private:
  void count(std::int64_t sum, std::int64_t sign) { add_sum(sum, sign, &scene_->row_sum); }
  void put(const SceneLandmark& landmark);
  void put_sightings(const SceneLandmark& landmark);
  void delete_sightings_of(std::int64_t landmark);
  [[nodiscard]] bool take_out(std::int64_t landmark, std::int64_t* sightings,
                              std::int64_t* sighting_sum);

  SqliteDatabase* database_;
  SceneRow* scene_;
  SqliteStatement insert_keyframe_, insert_picture_, put_landmark_, insert_sighting_,
      find_landmark_, delete_sightings_, delete_landmark_;
};

// Writes the whole map into empty tables of this program's format.
void write_scene_map(const SceneMap& map, std::int64_t revision, SqliteDatabase* database);

// Checksum of a lens. with_rest: for the format that stores the lens's hold().
[[nodiscard]] std::int64_t sum_of(const LensCurve& lens, bool with_rest);

}  // namespace alidade
