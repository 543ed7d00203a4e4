#pragma once
// scene.map: the scene map on disk (core/mapping/scene_map.h), an SQLite database in WAL mode with
// this program's application_id. Columns: scene_map_schema.h. Numbers keep their bits; of a
// covariance the upper half is kept. user_version is the format, 2. A map of format 1 is read and
// updated as it is, and becomes format 2 when it is replaced. Each transaction is on disk when the
// call returns (synchronous = FULL). After a power cut the map is as a transaction left it, and no
// transaction whose call returned is lost. Checksums of the rows, and their sum in the scene row,
// reveal what SQLite does not notice: a changed bit, a lost row. Not for the real-time thread.

#include <cstdint>
#include <string>
#include <vector>

#include "core/mapping/map_change.h"
#include "core/mapping/scene_map.h"
#include "edge_app/storage/scene_map_rows.h"
#include "edge_app/storage/sqlite.h"

namespace alidade {

// All or nothing. Replaces a scene map, but neither another file nor a damaged map.
[[nodiscard]] bool save_scene_map(const std::string& path, const SceneMap& map, std::string* error);

// False with one line in *error: a file at or beside `path` forbids a map there. To be asked before
// minutes of work.
[[nodiscard]] bool may_write_scene_map(const std::string& path, std::string* error);

// One thread at a time; several processes may read while one writes. An error is one line, `path:
// what; what would be right` (missing, not a scene map, another format, cut off or damaged, larger
// than SceneMap allows, in use, not writable, disk full), and the file is as before. Memory: the
// map itself, about 0.5 KB per landmark and per keyframe, plus 8 MB; pictures only on request.
class SceneMapFile {
 public:
  // Must come first. Checks everything except the rows, which read() checks.
  [[nodiscard]] bool open(const std::string& path, std::string* error);

  // As of the last open(), read() or update().
  [[nodiscard]] int width() const { return static_cast<int>(scene_.width); }
  [[nodiscard]] int height() const { return static_cast<int>(scene_.height); }
  [[nodiscard]] std::int64_t revision() const { return scene_.revision; }
  [[nodiscard]] std::int64_t keyframes() const { return scene_.keyframes; }
  [[nodiscard]] std::int64_t landmarks() const { return scene_.landmarks; }

  // False: the map belongs to a camera with another image size.
  [[nodiscard]] bool is_of(int width, int height, std::string* error) const;

  // Reads the whole map, all from one moment. Without pictures the keyframes' pictures are empty;
  // read_picture() reads a single one.
  [[nodiscard]] bool read(SceneMap* map, std::string* error, bool with_pictures = false);
  [[nodiscard]] bool read_picture(std::int64_t keyframe, std::vector<std::uint8_t>* picture,
                                  std::string* error);

  // One transaction. Refused if another process has written since this object read or wrote.
  [[nodiscard]] bool update(const MapChange& change, std::string* error);
  // Replaces the whole map by another one, which is_valid(), in one transaction, also if another
  // process has written.
  [[nodiscard]] bool replace(const SceneMap& map, std::string* error);

 private:
  [[nodiscard]] bool refuse(const std::string& what, std::string* error) const;
  [[nodiscard]] bool refuse_failure(std::string* error);
  [[nodiscard]] bool check_kind(std::string* error);
  [[nodiscard]] bool check_pages(std::string* error);
  [[nodiscard]] bool read_scene(SceneRow* scene, std::string* error);
  [[nodiscard]] bool read_lens(const SceneRow& scene, LensCurve* lens, std::string* error);
  [[nodiscard]] bool read_keyframes(bool with_pictures, std::int64_t* row_sum, SceneMap* map,
                                    std::string* error);
  [[nodiscard]] bool read_landmarks(std::int64_t* row_sum, SceneMap* map, std::string* error);

  std::string path_;
  SqliteDatabase database_;
  SceneRow scene_;
};

// open() and read() in one.
[[nodiscard]] bool load_scene_map(const std::string& path, SceneMap* map, std::string* error,
                                  bool with_pictures = false);

}  // namespace alidade
