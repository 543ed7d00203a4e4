#pragma once
// scene.map: the scene map on disk (core/mapping/scene_map.h), an SQLite database in WAL mode, of this program's application_id; its
// user_version is the format's, 2; one of format 1 is read and updated as it is, and becomes one of format 2 when it is replaced. Tables:
// scene (one row), lens_knot, lens_point, lens_rest (one row), keyframe, picture, landmark, sighting; columns see
// scene_map_schema.h. Numbers keep their bits; of a covariance the upper half is kept.
// Each transaction is on disk when the call returns (synchronous = FULL): after a power cut at any moment the map is as one of them
// left it, and none that returned is lost. Each row has a checksum, and the scene row the sum of them all, so that what SQLite does
// not notice is refused: a changed bit, a lost row.
// What does not hold is one line, `path: what; what would be right`: missing, not a scene map, another format, cut off or damaged,
// larger than SceneMap allows, in use, not writable, disk full. After an error the file is as before.
// Memory: what the map itself takes, about 0.5 KB a landmark and as much a keyframe, its picture only where asked for, beside 8 MB.
// Not for the real-time thread. A SceneMapFile belongs to one thread at a time; several processes may read while one writes.

#include <cstdint>
#include <string>
#include <vector>

#include "core/mapping/map_change.h"
#include "core/mapping/scene_map.h"
#include "edge_app/storage/scene_map_rows.h"
#include "edge_app/storage/sqlite.h"

namespace alidade {

// Whole or not at all. A scene map that is there is replaced; another file, or a damaged one, is not.
[[nodiscard]] bool save_scene_map(const std::string& path, const SceneMap& map, std::string* error);

// False: what lies beside that place does not let a map be there. To be asked before minutes of work.
[[nodiscard]] bool may_write_scene_map(const std::string& path, std::string* error);

class SceneMapFile {
 public:
  // Checks all but the rows, which read() does.
  [[nodiscard]] bool open(const std::string& path, std::string* error);

  // As of the last open(), read() or update().
  [[nodiscard]] int width() const { return static_cast<int>(scene_.width); }
  [[nodiscard]] int height() const { return static_cast<int>(scene_.height); }
  [[nodiscard]] std::int64_t revision() const { return scene_.revision; }
  [[nodiscard]] std::int64_t keyframes() const { return scene_.keyframes; }
  [[nodiscard]] std::int64_t landmarks() const { return scene_.landmarks; }

  // False: the map of a camera with another size of image.
  [[nodiscard]] bool is_of(int width, int height, std::string* error) const;

  // All of one moment. Without pictures those are empty; they can be had one by one.
  [[nodiscard]] bool read(SceneMap* map, std::string* error, bool with_pictures = false);
  [[nodiscard]] bool read_picture(std::int64_t keyframe, std::vector<std::uint8_t>* picture,
                                  std::string* error);

  // One transaction. Refused where somebody else wrote since this one read or wrote.
  [[nodiscard]] bool update(const MapChange& change, std::string* error);
  // All of it by another map, which is_valid(), in one transaction.
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

// open() and read(): what a command needs.
[[nodiscard]] bool load_scene_map(const std::string& path, SceneMap* map, std::string* error,
                                  bool with_pictures = false);

}  // namespace alidade
