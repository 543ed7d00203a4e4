#include "edge_app/storage/scene_map_file.h"

#include <unistd.h>

#include <filesystem>
#include <system_error>

#include "edge_app/storage/scene_map_schema.h"
#include "edge_app/storage/scene_map_writing.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

void set_up(SqliteDatabase* database) {
  // The largest value is a picture; the rest of a row takes a few hundred bytes.
  database->limit_length(static_cast<int>(SceneMap::kMostPictureBytes) + 65536);
  for (const char* pragma :
       {"PRAGMA trusted_schema = OFF", "PRAGMA cell_size_check = ON", "PRAGMA foreign_keys = ON",
        "PRAGMA synchronous = FULL", "PRAGMA cache_size = -8192", "PRAGMA temp_store = MEMORY",
        "PRAGMA journal_size_limit = 16777216"}) {
    database->execute(pragma);
  }
}

// A copy made by another tool may have no log, so it could not be changed (sqlite.h).
void set_up_log(SqliteDatabase* database) {
  if (database->text_of("PRAGMA journal_mode") == "wal") return;
  database->execute("PRAGMA journal_mode = OFF");
  database->execute("PRAGMA journal_mode = WAL");
}

void make_tables(SqliteDatabase* database) {
  database->execute("PRAGMA application_id = " + std::to_string(kSceneMapApplication));
  database->execute("PRAGMA user_version = " + std::to_string(kSceneMapFormat));
  for (const std::string& table : kSceneMapTables) database->execute(table);
}

bool write_new(const std::string& path, const SceneMap& map, std::string* error) {
  if (!may_write_scene_map(path, error)) return false;
  // A log that outlived its database would be taken for this database's.
  for (const char* rest : {"-wal", "-shm"}) ::unlink((path + rest).c_str());
  const std::string temporary = path + ".new";
  for (const char* rest : {"", "-wal", "-shm", "-journal"}) ::unlink((temporary + rest).c_str());
  SqliteDatabase database;
  bool written = database.open(temporary, true);
  if (written) {
    set_up(&database);
    // Nobody sees the file before it is complete and safely on disk.
    database.execute("PRAGMA synchronous = OFF");
    database.execute("PRAGMA journal_mode = OFF");
    {
      SqliteTransaction transaction(&database, true);
      make_tables(&database);
      write_scene_map(map, 1, &database);
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

bool may_write_scene_map(const std::string& path, std::string* error) {
  const std::string foreign = foreign_file_beside(path);
  if (!foreign.empty()) *error = path + ": " + foreign_file_text(foreign);
  return foreign.empty();
}

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
  const bool without_rest = format == kSceneMapFormatWithoutRest;
  if (!database_.failed() && format != kSceneMapFormat && !without_rest) {
    return refuse("a scene map of format " + std::to_string(format) + ", this program has format " +
                      std::to_string(kSceneMapFormat) + "; build it again",
                  error);
  }
  std::vector<std::string> expected(kSceneMapTables.begin(), kSceneMapTables.end());
  if (without_rest)
    expected.assign(kSceneMapTablesWithoutRest.begin(), kSceneMapTablesWithoutRest.end());
  SqliteStatement schema(&database_,
                         "SELECT sql FROM sqlite_schema WHERE sql IS NOT NULL ORDER BY name");
  std::size_t tables = 0;
  bool same = true;
  while (schema.step() && tables <= expected.size()) {
    std::string sql;
    same = same && tables < expected.size() && schema.get_text(0, &sql) && sql == expected[tables];
    ++tables;
  }
  if (database_.failed()) return refuse_failure(error);
  if (!same || tables != expected.size()) return refuse(kSceneMapDamaged, error);
  return true;
}

bool SceneMapFile::check_pages(std::string* error) {
  const std::string found = database_.text_of("PRAGMA quick_check(1)");
  if (database_.failed()) return refuse_failure(error);
  return found == "ok" || refuse(kSceneMapDamaged, error);
}

bool SceneMapFile::is_of(int width, int height, std::string* error) const {
  if (width == scene_.width && height == scene_.height) return true;
  return refuse("of a camera with images of " + std::to_string(scene_.width) + "x" +
                    std::to_string(scene_.height) + ", not " + std::to_string(width) + "x" +
                    std::to_string(height) + "; build a map of this camera",
                error);
}

bool SceneMapFile::replace(const SceneMap& map, std::string* error) {
  set_up_log(&database_);
  SqliteTransaction transaction(&database_, true);
  if (database_.failed()) return refuse_failure(error);
  // Another process may have written: its next update must see that the map is another one.
  if (!read_scene(&scene_, error)) return false;
  const bool other_tables = database_.number_of("PRAGMA user_version") != kSceneMapFormat;
  for (const char* table : {"sighting", "picture", "landmark", "keyframe", "lens_rest",
                            "lens_point", "lens_knot", "scene"}) {
    database_.execute(std::string(other_tables ? "DROP TABLE IF EXISTS " : "DELETE FROM ") + table);
  }
  if (other_tables) make_tables(&database_);
  write_scene_map(map, scene_.revision + 1, &database_);
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
  set_up_log(&database_);
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
      return refuse("refused to write: landmark " + std::to_string(landmark.id) +
                        " has an id that is not new",
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
