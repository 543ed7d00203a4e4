#include "edge_app/storage/scene_map_file.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "edge_app/storage/scene_map_schema.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

constexpr const char* kDamaged = "damaged, or cut off; build it again, or put back a copy";

std::string to_text(std::size_t number) { return std::to_string(number); }

void set_up(SqliteDatabase* database) {
  // The largest is a picture; a row has a few hundred bytes beside.
  database->limit_length(static_cast<int>(SceneMap::kMostPictureBytes) + 65536);
  for (const char* pragma :
       {"PRAGMA trusted_schema = OFF", "PRAGMA cell_size_check = ON", "PRAGMA foreign_keys = ON",
        "PRAGMA synchronous = FULL", "PRAGMA cache_size = -8192", "PRAGMA temp_store = MEMORY",
        "PRAGMA journal_size_limit = 16777216"}) {
    database->execute(pragma);
  }
}

void make_tables(SqliteDatabase* database) {
  database->execute("PRAGMA application_id = " + std::to_string(kSceneMapApplication));
  database->execute("PRAGMA user_version = " + std::to_string(kSceneMapFormat));
  for (const std::string& table : kSceneMapTables) database->execute(table);
}

// What is written into an open database, row by row; sums and counts are kept.
class SceneRows {
 public:
  SceneRows(SqliteDatabase* database, SceneRow* scene)
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

  void add(const SceneKeyframe& keyframe) {
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

  void add(const SceneLandmark& landmark) {
    put(landmark);
    put_sightings(landmark);
    ++scene_->landmarks;
    scene_->sightings += static_cast<std::int64_t>(landmark.sightings.size());
  }

  // False: there is none.
  [[nodiscard]] bool change(const SceneLandmark& landmark) {
    std::int64_t sightings = 0, sighting_sum = 0;
    if (!take_out(landmark.id, &sightings, &sighting_sum)) return false;
    put(landmark);
    scene_->sightings += static_cast<std::int64_t>(landmark.sightings.size()) - sightings;
    if (sighting_sum == sum_of(landmark.sightings)) return true;
    delete_sightings_of(landmark.id);
    put_sightings(landmark);
    return true;
  }

  [[nodiscard]] bool remove(std::int64_t landmark) {
    std::int64_t sightings = 0, sighting_sum = 0;
    if (!take_out(landmark, &sightings, &sighting_sum)) return false;
    delete_sightings_of(landmark);
    delete_landmark_.bind(1, landmark);
    delete_landmark_.run();
    --scene_->landmarks;
    scene_->sightings -= sightings;
    return true;
  }

  void put_scene() {
    SqliteStatement insert(
        database_,
        "INSERT OR REPLACE INTO scene VALUES(1,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,"
        "?,?,?,?,?)");
    WrittenRow row(&insert);
    scene_fields(&row, static_cast<const SceneRow&>(*scene_));
    row.end();
    insert.run();
  }

 private:
  void count(std::int64_t sum, std::int64_t sign) { add_sum(sum, sign, &scene_->row_sum); }

  void put(const SceneLandmark& landmark) {
    const auto sightings = static_cast<std::int64_t>(landmark.sightings.size());
    const std::int64_t sighting_sum = sum_of(landmark.sightings);
    WrittenRow row(&put_landmark_);
    landmark_fields(&row, landmark, sightings, sighting_sum);
    count(row.end(), 1);
    put_landmark_.run();
  }

  void put_sightings(const SceneLandmark& landmark) {
    for (const SceneSighting& s : landmark.sightings) {
      insert_sighting_.bind(1, landmark.id);
      insert_sighting_.bind(2, s.keyframe);
      insert_sighting_.bind(3, s.u.x());
      insert_sighting_.bind(4, s.u.y());
      insert_sighting_.bind(5, s.scale_px);
      insert_sighting_.run();
    }
  }

  void delete_sightings_of(std::int64_t landmark) {
    delete_sightings_.bind(1, landmark);
    delete_sightings_.run();
  }

  bool take_out(std::int64_t landmark, std::int64_t* sightings, std::int64_t* sighting_sum) {
    find_landmark_.bind(1, landmark);
    std::int64_t sum = 0;
    const bool found = find_landmark_.step() && find_landmark_.get(0, sightings) &&
                       find_landmark_.get(1, sighting_sum) && find_landmark_.get(2, &sum);
    find_landmark_.reset();
    if (found) count(sum, -1);
    return found;
  }

  SqliteDatabase* database_;
  SceneRow* scene_;
  SqliteStatement insert_keyframe_, insert_picture_, put_landmark_, insert_sighting_,
      find_landmark_, delete_sightings_, delete_landmark_;
};

std::int64_t sum_of(const LensCurve& lens) {
  FieldSum sum;
  for (int i = 0; i <= lens.segments(); ++i) sum.add(lens.knot(i));
  for (int i = 0; i < lens.control_points(); ++i) {
    for (int j = 0; j < kLensQuantityCount; ++j) sum.add(lens.control_point(i)[j]);
  }
  return sum.value();
}

void write_lens(const LensCurve& lens, SqliteDatabase* database) {
  SqliteStatement knot(database, "INSERT INTO lens_knot VALUES(?,?)");
  for (int i = 0; i <= lens.segments(); ++i) {
    knot.bind(1, std::int64_t{i});
    knot.bind(2, lens.knot(i));
    knot.run();
  }
  SqliteStatement point(database, "INSERT INTO lens_point VALUES(?,?,?,?,?)");
  for (int i = 0; i < lens.control_points(); ++i) {
    point.bind(1, std::int64_t{i});
    for (int j = 0; j < kLensQuantityCount; ++j) point.bind(2 + j, lens.control_point(i)[j]);
    point.run();
  }
}

// Into empty tables.
void write_all(const SceneMap& map, std::int64_t revision, SqliteDatabase* database) {
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
  scene.lens_sum = sum_of(map.lens);
  write_lens(map.lens, database);
  SceneRows rows(database, &scene);
  for (const SceneKeyframe& keyframe : map.keyframes) rows.add(keyframe);
  for (const SceneLandmark& landmark : map.landmarks) rows.add(landmark);
  rows.put_scene();
}

bool write_new(const std::string& path, const SceneMap& map, std::string* error) {
  // A log that outlived its database would be taken for this one's.
  for (const char* rest : {"-wal", "-shm"}) ::unlink((path + rest).c_str());
  const std::string temporary = path + ".new";
  for (const char* rest : {"", "-wal", "-shm", "-journal"}) ::unlink((temporary + rest).c_str());
  SqliteDatabase database;
  bool written = database.open(temporary, true);
  if (written) {
    set_up(&database);
    // Nobody sees it before it is whole, and safely on disk.
    database.execute("PRAGMA synchronous = OFF");
    database.execute("PRAGMA journal_mode = OFF");
    {
      SqliteTransaction transaction(&database, true);
      make_tables(&database);
      write_all(map, 1, &database);
      written = transaction.commit();
    }
    database.execute("PRAGMA journal_mode = WAL");
    written = written && !database.failed();
  }
  if (!written) *error = path + ": cannot be written: " + database.failure_text();
  database.close();
  written = written && move_into_place(temporary, path, error);
  if (!written) {
    for (const char* rest : {"", "-wal", "-shm"}) ::unlink((temporary + rest).c_str());
  }
  return written;
}

}  // namespace

bool save_scene_map(const std::string& path, const SceneMap& map, std::string* error) {
  std::string flaw;
  if (!is_valid(map, &flaw)) {
    *error = path + ": refused to write it: " + flaw;
    return false;
  }
  std::error_code code;
  if (!std::filesystem::exists(path, code)) return write_new(path, map, error);
  SceneMapFile file;
  return file.open(path, error) && file.replace(map, error);
}

bool load_scene_map(const std::string& path, SceneMap* map, std::string* error,
                    bool with_pictures) {
  SceneMapFile file;
  return file.open(path, error) && file.read(map, error, with_pictures);
}

bool SceneMapFile::refuse(const std::string& what, std::string* error) const {
  *error = path_ + ": " + what;
  return false;
}

bool SceneMapFile::refuse_failure(std::string* error) {
  const std::string what = database_.failure_text();
  database_.forget_failure();
  return refuse(what, error);
}

bool SceneMapFile::open(const std::string& path, std::string* error) {
  path_ = path;
  std::error_code code;
  const auto status = std::filesystem::status(path, code);
  if (!std::filesystem::exists(status)) {
    return refuse("there is no such file; make it with `alidade map build`", error);
  }
  if (!std::filesystem::is_regular_file(status)) return refuse("not a file", error);
  if (!database_.open(path, false)) return refuse_failure(error);
  set_up(&database_);
  const bool sound = check_kind(error) && check_pages(error) && read_scene(&scene_, error);
  if (!sound) database_.close();
  return sound;
}

bool SceneMapFile::check_kind(std::string* error) {
  const std::int64_t application = database_.number_of("PRAGMA application_id");
  if (database_.failed()) return refuse_failure(error);
  if (application != kSceneMapApplication)
    return refuse("not a scene map; make one with `alidade map build`", error);
  const std::int64_t format = database_.number_of("PRAGMA user_version");
  if (!database_.failed() && format != kSceneMapFormat) {
    return refuse("a scene map of format " + std::to_string(format) + ", this program has format " +
                      std::to_string(kSceneMapFormat) + "; build it again",
                  error);
  }
  SqliteStatement schema(&database_,
                         "SELECT sql FROM sqlite_schema WHERE sql IS NOT NULL ORDER BY name");
  std::size_t tables = 0;
  bool same = true;
  while (schema.step() && tables <= kSceneMapTables.size()) {
    std::string sql;
    same = same && tables < kSceneMapTables.size() && schema.get_text(0, &sql) &&
           sql == kSceneMapTables[tables];
    ++tables;
  }
  if (database_.failed()) return refuse_failure(error);
  if (!same || tables != kSceneMapTables.size()) return refuse(kDamaged, error);
  return true;
}

bool SceneMapFile::check_pages(std::string* error) {
  const std::string found = database_.text_of("PRAGMA quick_check(1)");
  if (database_.failed()) return refuse_failure(error);
  return found == "ok" || refuse(kDamaged, error);
}

bool SceneMapFile::is_of(int width, int height, std::string* error) const {
  if (width == scene_.width && height == scene_.height) return true;
  return refuse("of a camera with images of " + std::to_string(scene_.width) + "x" +
                    std::to_string(scene_.height) + ", not " + std::to_string(width) + "x" +
                    std::to_string(height) + "; build a map of this camera",
                error);
}

bool SceneMapFile::read_scene(SceneRow* scene, std::string* error) {
  SqliteStatement select(&database_, "SELECT * FROM scene");
  std::int64_t id = 0, sum = 0;
  SceneRow found;
  // The id is not a field.
  bool fits = select.step() && select.get(0, &id) && id == 1;
  if (fits) {
    ReadRow row(&select, 1);
    scene_fields(&row, found);
    fits = row.end(&sum) && !select.step();
  }
  if (database_.failed()) return refuse_failure(error);
  if (!fits || found.has_mechanics < 0 || found.has_mechanics > 1) return refuse(kDamaged, error);
  const auto beyond = [&](const char* what, std::int64_t count, std::size_t most) {
    if (count >= 0 && static_cast<std::size_t>(count) <= most) return false;
    *error = path_ + ": has " + std::to_string(count) + " " + what + ", at most " + to_text(most) +
             " are allowed";
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
    SqliteStatement select(
        &database_, "SELECT delta, kappa, centre_u, centre_v FROM lens_point ORDER BY number");
    int i = 0;
    for (; fits && select.step(); ++i) {
      fits = i < found.control_points();
      for (int j = 0; fits && j < kLensQuantityCount; ++j) {
        fits = select.get(j, &found.control_point(i)[j]);
      }
    }
    fits = fits && i == found.control_points() && sum_of(found) == scene.lens_sum;
    *lens = found;
  }
  if (database_.failed()) return refuse_failure(error);
  return fits || refuse(kDamaged, error);
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
  // Without pictures their own sums are believed: they are looked at when a picture is read.
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
  return fits || refuse(kDamaged, error);
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
  return (fits && !more) || refuse(kDamaged, error);
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
  if (row_sum != scene.row_sum ||
      static_cast<std::int64_t>(found.keyframes.size()) != scene.keyframes ||
      static_cast<std::int64_t>(found.landmarks.size()) != scene.landmarks) {
    return refuse(kDamaged, error);
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
  if (!row.end(&sum)) return refuse(kDamaged, error);
  *picture = std::move(bytes);
  return true;
}

bool SceneMapFile::replace(const SceneMap& map, std::string* error) {
  SqliteTransaction transaction(&database_, true);
  for (const char* table :
       {"sighting", "picture", "landmark", "keyframe", "lens_point", "lens_knot", "scene"}) {
    database_.execute(std::string("DELETE FROM ") + table);
  }
  write_all(map, scene_.revision + 1, &database_);
  if (!transaction.commit()) return refuse_failure(error);
  return read_scene(&scene_, error);
}

bool SceneMapFile::update(const MapChange& change, std::string* error) {
  std::string flaw;
  for (const SceneKeyframe& keyframe : change.new_keyframes) {
    if (!is_valid(keyframe, &flaw)) return refuse("refused to write: " + flaw, error);
  }
  for (const std::vector<SceneLandmark>* landmarks : {&change.changed, &change.born}) {
    for (const SceneLandmark& landmark : *landmarks) {
      if (!is_valid(landmark, &flaw)) return refuse("refused to write: " + flaw, error);
    }
  }
  SqliteTransaction transaction(&database_, true);
  if (database_.failed()) return refuse_failure(error);
  SceneRow scene;
  if (!read_scene(&scene, error)) return false;
  if (scene.revision != scene_.revision) {
    return refuse("changed by another process; read it again", error);
  }
  SceneRows rows(&database_, &scene);
  for (const SceneKeyframe& keyframe : change.new_keyframes) rows.add(keyframe);
  const auto missing = [&](std::int64_t id) {
    if (database_.failed()) return refuse_failure(error);
    return refuse("has no landmark " + std::to_string(id), error);
  };
  for (const SceneLandmark& landmark : change.changed) {
    if (!rows.change(landmark)) return missing(landmark.id);
  }
  for (const std::int64_t id : change.died) {
    if (!rows.remove(id)) return missing(id);
  }
  for (const SceneLandmark& landmark : change.born) {
    if (landmark.id < scene.next_landmark) {
      return refuse("refused to write: landmark " + std::to_string(landmark.id) + " has no new id",
                    error);
    }
    rows.add(landmark);
    scene.next_landmark = landmark.id + 1;
  }
  if (scene.keyframes > static_cast<std::int64_t>(SceneMap::kMostKeyframes) ||
      scene.landmarks > static_cast<std::int64_t>(SceneMap::kMostLandmarks) ||
      scene.sightings > static_cast<std::int64_t>(SceneMap::kMostSightings)) {
    return refuse("refused to write: the map would become too large", error);
  }
  ++scene.revision;
  rows.put_scene();
  if (!transaction.commit()) return refuse_failure(error);
  scene_ = scene;
  return true;
}

}  // namespace alidade
