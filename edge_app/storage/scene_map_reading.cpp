// SceneMapFile, the reading part. Every number in the tables is checked.

#include <utility>

#include "edge_app/storage/scene_map_file.h"
#include "edge_app/storage/scene_map_schema.h"
#include "edge_app/storage/scene_map_writing.h"

namespace alidade {

namespace {

// No file reaches it, and each revision has a next one.
constexpr std::int64_t kMostRevision = std::int64_t{1} << 53;

}  // namespace

bool SceneMapFile::read_scene(SceneRow* scene, std::string* error) {
  SqliteStatement select(&database_, "SELECT * FROM scene");
  std::int64_t id = 0, sum = 0;
  SceneRow found;
  // The id is not one of scene_fields().
  bool fits = select.step() && select.get(0, &id) && id == 1;
  if (fits) {
    ReadRow row(&select, 1);
    scene_fields(&row, found);
    fits = row.end(&sum) && !select.step();
  }
  if (database_.failed()) return refuse_failure(error);
  if (!fits || found.has_mechanics < 0 || found.has_mechanics > 1 || found.revision < 0 ||
      found.revision > kMostRevision) {
    return refuse(kSceneMapDamaged, error);
  }
  const auto beyond = [&](const char* what, std::int64_t count, std::size_t most) {
    if (count >= 0 && static_cast<std::size_t>(count) <= most) return false;
    *error = path_ + ": has " + std::to_string(count) + " " + what + ", at most " +
             std::to_string(most) + " are allowed";
    return true;
  };
  if (beyond("keyframes", found.keyframes, SceneMap::kMostKeyframes) ||
      beyond("landmarks", found.landmarks, SceneMap::kMostLandmarks) ||
      beyond("sightings", found.sightings, SceneMap::kMostSightings) ||
      beyond("points of the lens", found.lens_points, SceneMap::kMostLensPoints) ||
      beyond("columns", found.width, SceneMap::kMostImageSide) ||
      beyond("rows", found.height, SceneMap::kMostImageSide)) {
    return false;
  }
  *scene = found;
  return true;
}

bool SceneMapFile::read_lens(const SceneRow& scene, LensCurve* lens, std::string* error) {
  std::vector<double> knots;
  SqliteStatement select_knots(&database_, "SELECT log_f FROM lens_knot ORDER BY number");
  const std::int64_t points = scene.lens_points;
  bool fits = points >= 4;
  while (fits && select_knots.step()) {
    double knot = 0;
    fits = select_knots.get(0, &knot) && static_cast<std::int64_t>(knots.size()) < points - 2 &&
           (knots.empty() || knot > knots.back());
    knots.push_back(knot);
  }
  fits = fits && static_cast<std::int64_t>(knots.size()) == points - 2;
  if (fits && !database_.failed()) {
    LensCurve found(static_cast<int>(scene.width), static_cast<int>(scene.height), scene.aspect,
                    knots);
    static_assert(kDistortionCount == 1, "a column for each quantity");
    SqliteStatement select(
        &database_, "SELECT delta, kappa, centre_u, centre_v FROM lens_point ORDER BY number");
    int i = 0;
    for (; fits && select.step(); ++i) {
      fits = i < found.control_points();
      for (int j = 0; fits && j < kLensQuantityCount; ++j) {
        fits = select.get(j, &found.control_point(i)[j]);
      }
    }
    const std::int64_t format = database_.number_of("PRAGMA user_version");
    const bool with_rest = format != kSceneMapFormatWithoutRest;
    found.hold() = 1;
    if (fits && with_rest) {
      SqliteStatement rest(&database_, "SELECT hold FROM lens_rest");
      fits = rest.step() && rest.get(0, &found.hold()) && !rest.step();
    }
    fits = fits && i == found.control_points() && sum_of(found, with_rest) == scene.lens_sum;
    *lens = found;
  }
  if (database_.failed()) return refuse_failure(error);
  return fits || refuse(kSceneMapDamaged, error);
}

bool SceneMapFile::read_keyframes(bool with_pictures, std::int64_t* row_sum, SceneMap* map,
                                  std::string* error) {
  SqliteStatement select(&database_, "SELECT * FROM keyframe ORDER BY id");
  bool fits = true;
  std::int64_t sum = 0;
  while (fits && select.step()) {
    SceneKeyframe& keyframe = map->keyframes.emplace_back();
    ReadRow row(&select);
    keyframe_fields(&row, keyframe);
    fits = row.end(&sum) && map->keyframes.size() <= SceneMap::kMostKeyframes;
    add_sum(sum, 1, row_sum);
  }
  // Without pictures the stored sums are used unchecked. A picture is checked when it is read.
  SqliteStatement pictures(&database_,
                           with_pictures ? "SELECT * FROM picture" : "SELECT crc FROM picture");
  while (fits && pictures.step()) {
    if (with_pictures) {
      std::int64_t id = 0;
      std::vector<std::uint8_t> bytes;
      ReadRow row(&pictures);
      row.field(id);
      row.field(bytes);
      fits = row.end(&sum);
      const std::ptrdiff_t at = keyframe_index(*map, id);
      fits = fits && at >= 0;
      if (fits) map->keyframes[static_cast<std::size_t>(at)].picture = std::move(bytes);
    } else {
      fits = pictures.get(0, &sum);
    }
    add_sum(sum, 1, row_sum);
  }
  if (database_.failed()) return refuse_failure(error);
  return fits || refuse(kSceneMapDamaged, error);
}

bool SceneMapFile::read_landmarks(std::int64_t* row_sum, SceneMap* map, std::string* error) {
  SqliteStatement select(&database_, "SELECT * FROM landmark ORDER BY id");
  SqliteStatement sightings(&database_, "SELECT * FROM sighting ORDER BY landmark, keyframe");
  bool fits = true;
  std::int64_t of = 0;
  bool more = sightings.step();
  while (fits && select.step()) {
    SceneLandmark& landmark = map->landmarks.emplace_back();
    std::int64_t count = 0, sighting_sum = 0, sum = 0;
    ReadRow row(&select);
    landmark_fields(&row, landmark, count, sighting_sum);
    fits = row.end(&sum) && map->landmarks.size() <= SceneMap::kMostLandmarks;
    add_sum(sum, 1, row_sum);
    while (fits && more) {
      fits = sightings.get(0, &of) && of >= landmark.id;
      if (!fits || of != landmark.id) break;
      SceneSighting& s = landmark.sightings.emplace_back();
      fits = sightings.get(1, &s.keyframe) && sightings.get(2, &s.u.x()) &&
             sightings.get(3, &s.u.y()) && sightings.get(4, &s.scale_px) &&
             static_cast<std::int64_t>(landmark.sightings.size()) <= count;
      more = sightings.step();
    }
    fits = fits && static_cast<std::int64_t>(landmark.sightings.size()) == count &&
           sum_of(landmark.sightings) == sighting_sum;
  }
  if (database_.failed()) return refuse_failure(error);
  return (fits && !more) || refuse(kSceneMapDamaged, error);
}

bool SceneMapFile::read(SceneMap* map, std::string* error, bool with_pictures) {
  SqliteTransaction moment(&database_, false);
  SceneRow scene;
  SceneMap found;
  std::int64_t row_sum = 0;
  if (!read_scene(&scene, error) || !read_lens(scene, &found.lens, error) ||
      !read_keyframes(with_pictures, &row_sum, &found, error) ||
      !read_landmarks(&row_sum, &found, error)) {
    return false;
  }
  std::int64_t sightings = 0;
  for (const SceneLandmark& landmark : found.landmarks) {
    sightings += static_cast<std::int64_t>(landmark.sightings.size());
  }
  if (row_sum != scene.row_sum || sightings != scene.sightings ||
      static_cast<std::int64_t>(found.keyframes.size()) != scene.keyframes ||
      static_cast<std::int64_t>(found.landmarks.size()) != scene.landmarks) {
    return refuse(kSceneMapDamaged, error);
  }
  found.line_delay = scene.line_delay;
  found.reference_row = scene.reference_row;
  if (scene.has_mechanics == 1) found.mechanics = scene.mechanics;
  found.next_landmark = scene.next_landmark;
  std::string flaw;
  if (!is_valid(found, &flaw)) return refuse(flaw + "; build it again", error);
  *map = std::move(found);
  scene_ = scene;
  return true;
}

bool SceneMapFile::read_picture(std::int64_t keyframe, std::vector<std::uint8_t>* picture,
                                std::string* error) {
  SqliteStatement select(&database_, "SELECT * FROM picture WHERE keyframe = ?");
  select.bind(1, keyframe);
  std::int64_t id = 0, sum = 0;
  std::vector<std::uint8_t> bytes;
  const bool found = select.step();
  if (database_.failed()) return refuse_failure(error);
  if (!found) {
    return refuse("has no picture of keyframe " + std::to_string(keyframe), error);
  }
  ReadRow row(&select);
  row.field(id);
  row.field(bytes);
  if (!row.end(&sum)) return refuse(kSceneMapDamaged, error);
  *picture = std::move(bytes);
  return true;
}

}  // namespace alidade
