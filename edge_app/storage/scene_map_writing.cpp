#include "edge_app/storage/scene_map_writing.h"

namespace alidade {

SceneRows::SceneRows(SqliteDatabase* database, SceneRow* scene)
    : database_(database),
      scene_(scene),
      insert_keyframe_(
          database,
          "INSERT INTO keyframe VALUES(?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,"
          "?,?,?,?,?)"),
      insert_picture_(database, "INSERT INTO picture VALUES(?,?,?)"),
      put_landmark_(
          database,
          "INSERT OR REPLACE INTO landmark VALUES(?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)"),
      insert_sighting_(database, "INSERT INTO sighting VALUES(?,?,?,?,?)"),
      find_landmark_(database, "SELECT sightings, sightings_crc, crc FROM landmark WHERE id = ?"),
      delete_sightings_(database, "DELETE FROM sighting WHERE landmark = ?"),
      delete_landmark_(database, "DELETE FROM landmark WHERE id = ?") {}

void SceneRows::add(const SceneKeyframe& keyframe) {
  WrittenRow row(&insert_keyframe_);
  keyframe_fields(&row, keyframe);
  count(row.end(), 1);
  insert_keyframe_.run();
  if (!keyframe.picture.empty()) {
    WrittenRow picture(&insert_picture_);
    picture.field(keyframe.id);
    picture.field(keyframe.picture);
    count(picture.end(), 1);
    insert_picture_.run();
  }
  ++scene_->keyframes;
}

void SceneRows::add(const SceneLandmark& landmark) {
  put(landmark);
  put_sightings(landmark);
  ++scene_->landmarks;
  scene_->sightings += static_cast<std::int64_t>(landmark.sightings.size());
}

bool SceneRows::change(const SceneLandmark& landmark) {
  std::int64_t sightings = 0, sighting_sum = 0;
  if (!take_out(landmark.id, &sightings, &sighting_sum)) return false;
  put(landmark);
  scene_->sightings += static_cast<std::int64_t>(landmark.sightings.size()) - sightings;
  if (sighting_sum == sum_of(landmark.sightings)) return true;
  delete_sightings_of(landmark.id);
  put_sightings(landmark);
  return true;
}

bool SceneRows::remove(std::int64_t landmark) {
  std::int64_t sightings = 0, sighting_sum = 0;
  if (!take_out(landmark, &sightings, &sighting_sum)) return false;
  delete_sightings_of(landmark);
  delete_landmark_.bind(1, landmark);
  delete_landmark_.run();
  --scene_->landmarks;
  scene_->sightings -= sightings;
  return true;
}

void SceneRows::put_scene() {
  SqliteStatement insert(
      database_,
      "INSERT OR REPLACE INTO scene VALUES(1,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,"
      "?,?,?,?,?)");
  WrittenRow row(&insert);
  scene_fields(&row, static_cast<const SceneRow&>(*scene_));
  row.end();
  insert.run();
}

void SceneRows::put(const SceneLandmark& landmark) {
  const auto sightings = static_cast<std::int64_t>(landmark.sightings.size());
  const std::int64_t sighting_sum = sum_of(landmark.sightings);
  WrittenRow row(&put_landmark_);
  landmark_fields(&row, landmark, sightings, sighting_sum);
  count(row.end(), 1);
  put_landmark_.run();
}

void SceneRows::put_sightings(const SceneLandmark& landmark) {
  for (const SceneSighting& s : landmark.sightings) {
    insert_sighting_.bind(1, landmark.id);
    insert_sighting_.bind(2, s.keyframe);
    insert_sighting_.bind(3, s.u.x());
    insert_sighting_.bind(4, s.u.y());
    insert_sighting_.bind(5, s.scale_px);
    insert_sighting_.run();
  }
}

void SceneRows::delete_sightings_of(std::int64_t landmark) {
  delete_sightings_.bind(1, landmark);
  delete_sightings_.run();
}

bool SceneRows::take_out(std::int64_t landmark, std::int64_t* sightings,
                         std::int64_t* sighting_sum) {
  find_landmark_.bind(1, landmark);
  std::int64_t sum = 0;
  const bool found = find_landmark_.step() && find_landmark_.get(0, sightings) &&
                     find_landmark_.get(1, sighting_sum) && find_landmark_.get(2, &sum);
  find_landmark_.reset();
  if (found) count(sum, -1);
  return found;
}

std::int64_t sum_of(const LensCurve& lens, bool with_rest) {
  FieldSum sum;
  for (int i = 0; i <= lens.segments(); ++i) sum.add(lens.knot(i));
  for (int i = 0; i < lens.control_points(); ++i) {
    for (int j = 0; j < kLensQuantityCount; ++j) sum.add(lens.control_point(i)[j]);
  }
  if (with_rest) sum.add(lens.hold());
  return sum.value();
}

namespace {

void write_lens(const LensCurve& lens, SqliteDatabase* database) {
  SqliteStatement knot(database, "INSERT INTO lens_knot VALUES(?,?)");
  for (int i = 0; i <= lens.segments(); ++i) {
    knot.bind(1, std::int64_t{i});
    knot.bind(2, lens.knot(i));
    knot.run();
  }
  static_assert(kDistortionCount == 1, "a column for each quantity: a new kSceneMapFormat");
  SqliteStatement point(database, "INSERT INTO lens_point VALUES(?,?,?,?,?)");
  for (int i = 0; i < lens.control_points(); ++i) {
    point.bind(1, std::int64_t{i});
    for (int j = 0; j < kLensQuantityCount; ++j) point.bind(2 + j, lens.control_point(i)[j]);
    point.run();
  }
  SqliteStatement rest(database, "INSERT INTO lens_rest VALUES(0,?)");
  rest.bind(1, lens.hold());
  rest.run();
}

}  // namespace

void write_scene_map(const SceneMap& map, std::int64_t revision, SqliteDatabase* database) {
  SceneRow scene;
  scene.revision = revision;
  scene.width = map.lens.width();
  scene.height = map.lens.height();
  scene.aspect = map.lens.aspect();
  scene.line_delay = map.line_delay;
  scene.reference_row = map.reference_row;
  scene.has_mechanics = map.mechanics ? 1 : 0;
  if (map.mechanics) scene.mechanics = *map.mechanics;
  scene.next_landmark = map.next_landmark;
  scene.lens_points = map.lens.control_points();
  scene.lens_sum = sum_of(map.lens, true);
  write_lens(map.lens, database);
  SceneRows rows(database, &scene);
  for (const SceneKeyframe& keyframe : map.keyframes) rows.add(keyframe);
  for (const SceneLandmark& landmark : map.landmarks) rows.add(landmark);
  rows.put_scene();
}

}  // namespace alidade
