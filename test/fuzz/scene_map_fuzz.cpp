// scene.map: a small map's tables, changed as the input says: any value in any column, rows less or more. The checksums of rows and their
// sum are put right, which no mutation would hit; or some are not, or bytes of the file itself are changed. What is read is valid, can be
// changed by one transaction and written anew, and read again as the same.

#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <vector>

#include "edge_app/storage/scene_map_file.h"
#include "edge_app/storage/scene_map_rows.h"
#include "platform/system/whole_file.h"
#include "test/edge_app/storage/changing_scene_map.h"
#include "test/fuzz/fuzz_target.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 8> kTables = {"keyframe", "landmark", "lens_knot", "lens_point",
                                                "picture",  "scene",    "sighting",  "lens_rest"};

// In memory, where there is such a folder: each transaction waits for the disk.
class FuzzFolder {
 public:
  FuzzFolder() {
    std::error_code none;
    path_ = fs::is_directory("/dev/shm", none) ? "/dev/shm" : fs::temp_directory_path().string();
    path_ += "/alidade-scene-map-" + std::to_string(::getpid());
    fs::create_directories(path_);
  }
  ~FuzzFolder() {
    std::error_code none;
    fs::remove_all(path_, none);
  }
  FuzzFolder(const FuzzFolder&) = delete;
  FuzzFolder& operator=(const FuzzFolder&) = delete;

  [[nodiscard]] std::string file(const char* name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

const FuzzFolder& folder() {
  static const FuzzFolder made;
  return made;
}

std::string bytes_of_file(const std::string& path) {
  std::string bytes;
  std::string error;
  FUZZ_REQUIRE(read_file(path, &bytes, &error));
  return bytes;
}

// Without the log of a map that lay there before.
void put_file(const std::string& path, const std::string& bytes) {
  for (const char* rest : {"-wal", "-shm"}) fs::remove(path + rest);
  std::ofstream(path, std::ios::binary) << bytes;
}

const std::string& untouched_file() {
  static const std::string bytes = [] {
    std::string error;
    const std::string path = folder().file("untouched.map");
    FUZZ_REQUIRE(save_scene_map(path, test::random_scene_map(3, 3, 6, 20), &error));
    return bytes_of_file(path);
  }();
  return bytes;
}

const std::vector<std::string>& columns_of(std::size_t table) {
  static std::array<std::vector<std::string>, kTables.size()> names;
  if (names[table].empty()) {
    put_file(folder().file("columns.map"), untouched_file());
    SqliteDatabase database;
    FUZZ_REQUIRE(database.open(folder().file("columns.map"), false));
    SqliteStatement select(
        &database,
        (std::string("SELECT name FROM pragma_table_info('") + kTables[table] + "')").c_str());
    while (select.step()) FUZZ_REQUIRE(select.get_text(0, &names[table].emplace_back()));
  }
  return names[table];
}

double telling_number(std::uint8_t which) {
  constexpr std::array<double, 16> kNumbers = {
      0,   -0.0,  1,      -1,     0.5,    7.5,  1e-9, -1e-9,
      1e9, 1e300, -1e300, 1e-300, 4e-324, 1280, 3.15, std::numeric_limits<double>::infinity()};
  return kNumbers[which % kNumbers.size()];
}

std::int64_t telling_integer(std::uint8_t which) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  constexpr std::array<std::int64_t, 16> kIntegers = {0,
                                                      1,
                                                      2,
                                                      3,
                                                      -1,
                                                      -2,
                                                      100,
                                                      100'001,
                                                      1LL << 31,
                                                      1LL << 32,
                                                      (1LL << 32) - 1,
                                                      1LL << 53,
                                                      kMost,
                                                      kMost - 1,
                                                      -kMost,
                                                      -kMost - 1};
  return kIntegers[which % kIntegers.size()];
}

void bind_any(FuzzInput* input, SqliteStatement* statement) {
  const std::uint8_t kind = input->byte();
  switch (kind % 8) {
    case 0:
      return statement->bind(1, std::int64_t{static_cast<std::int8_t>(input->byte())});
    case 1:
      return statement->bind(1, telling_integer(input->byte()));
    case 2:
      return statement->bind(1, telling_number(input->byte()));
    case 3:
      return statement->bind(1, input->number());
    case 4:
      return statement->bind_null(1);
    case 5:
      return statement->bind_text(1, input->bytes(input->byte() % 32));
    default: {
      const std::string_view bytes = input->bytes(kind % 8 == 6 ? input->byte() % 32 : 128);
      return statement->bind_blob(1, reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                  bytes.size());
    }
  }
}

std::string row_of(std::size_t table, std::uint8_t rank) {
  const std::string key = kTables[table] == std::string("sighting") ? "(landmark, keyframe)"
                                                                    : columns_of(table).front();
  const std::string listed = key.front() == '(' ? key.substr(1, key.size() - 2) : key;
  return " WHERE " + key + " = (SELECT " + listed + " FROM " + kTables[table] + " LIMIT 1 OFFSET " +
         std::to_string(rank % 8) + ")";
}

void change_one(FuzzInput* input, SqliteDatabase* database) {
  const std::size_t table = input->byte() % kTables.size();
  const std::uint8_t what = input->byte();
  const std::string row = row_of(table, input->byte());
  std::string sql;
  if (what % 8 == 0) {
    sql = std::string("DELETE FROM ") + kTables[table] + row;
  } else if (what % 8 == 1) {
    sql = std::string("INSERT OR IGNORE INTO ") + kTables[table] + "(" + columns_of(table).front() +
          ") VALUES(?)";
  } else {
    const std::vector<std::string>& columns = columns_of(table);
    sql = std::string("UPDATE OR IGNORE ") + kTables[table] + " SET " +
          columns[input->byte() % columns.size()] + " = ?" + row;
  }
  SqliteStatement statement(database, sql.c_str());
  if (what % 8 != 0) bind_any(input, &statement);
  statement.run();
  database->forget_failure();
}

// As ReadRow takes it, whatever type it has.
void add_column(const SqliteStatement& row, int column, FieldSum* sum) {
  std::int64_t integer = 0;
  double number = 0;
  std::string text;
  std::vector<std::uint8_t> blob;
  if (row.is_null(column)) return sum->add_null();
  if (row.get(column, &integer)) return sum->add(integer);
  if (row.get(column, &number)) return sum->add(number);
  if (row.get_text(column, &text)) return sum->add(text.data(), text.size());
  if (row.get_blob(column, &blob)) sum->add(blob.data(), blob.size());
}

void set(SqliteDatabase* database, const std::string& sql, std::int64_t value) {
  SqliteStatement statement(database, sql.c_str());
  statement.bind(1, value);
  statement.run();
}

// Of each row from column `first` on.
void put_sums_right(std::size_t table, int first, SqliteDatabase* database, std::int64_t* row_sum) {
  const std::vector<std::string>& columns = columns_of(table);
  std::vector<std::pair<std::int64_t, std::int64_t>> sums;
  {
    SqliteStatement select(database, (std::string("SELECT * FROM ") + kTables[table]).c_str());
    while (select.step()) {
      FieldSum sum;
      for (int i = first; i + 1 < static_cast<int>(columns.size()); ++i) {
        add_column(select, i, &sum);
      }
      std::int64_t id = 0;
      FUZZ_REQUIRE(select.get(0, &id));
      sums.emplace_back(id, sum.value());
      add_sum(sum.value(), 1, row_sum);
    }
  }
  for (const auto& [id, sum] : sums) {
    set(database,
        std::string("UPDATE ") + kTables[table] + " SET crc = ? WHERE " + columns.front() + " = " +
            std::to_string(id),
        sum);
  }
}

void put_sightings_right(SqliteDatabase* database) {
  std::vector<std::int64_t> ids;
  {
    SqliteStatement select(database, "SELECT id FROM landmark");
    while (select.step()) FUZZ_REQUIRE(select.get(0, &ids.emplace_back()));
  }
  for (const std::int64_t id : ids) {
    SqliteStatement select(
        database,
        "SELECT keyframe, u_px, v_px, scale_px FROM sighting WHERE landmark = ? ORDER BY keyframe");
    select.bind(1, id);
    FieldSum sum;
    std::int64_t count = 0;
    for (; select.step(); ++count) {
      for (int i = 0; i < 4; ++i) add_column(select, i, &sum);
    }
    const std::string row = " = ? WHERE id = " + std::to_string(id);
    set(database, "UPDATE landmark SET sightings" + row, count);
    set(database, "UPDATE landmark SET sightings_crc" + row, sum.value());
  }
}

void put_lens_right(SqliteDatabase* database) {
  FieldSum sum;
  for (const auto& [sql, columns] :
       {std::pair{"SELECT log_f FROM lens_knot ORDER BY number", 1},
        std::pair{"SELECT delta, kappa, centre_u, centre_v FROM lens_point ORDER BY number", 4},
        std::pair{"SELECT hold FROM lens_rest", 1}}) {
    SqliteStatement select(database, sql);
    while (select.step()) {
      for (int i = 0; i < columns; ++i) add_column(select, i, &sum);
    }
  }
  set(database, "UPDATE scene SET lens_crc = ?", sum.value());
}

// The bits say what: rows, counts, sightings, lens, and again the sums of them all.
void put_right(std::uint8_t what, SqliteDatabase* database) {
  if ((what & 1U) != 0) put_sightings_right(database);
  if ((what & 2U) != 0) put_lens_right(database);
  if ((what & 4U) != 0) {
    database->execute(
        "UPDATE scene SET keyframes = (SELECT count(*) FROM keyframe), landmarks = "
        "(SELECT count(*) FROM landmark), sightings = (SELECT count(*) FROM sighting)");
  }
  if ((what & 8U) != 0) {
    std::int64_t row_sum = 0;
    std::int64_t of_scene = 0;
    for (const std::size_t table : {0U, 1U, 4U}) put_sums_right(table, 0, database, &row_sum);
    set(database, "UPDATE scene SET row_sum = ?", row_sum);
    put_sums_right(5, 1, database, &of_scene);
  }
  database->forget_failure();
}

void require_same(const std::string& path, const SceneMap& map) {
  SceneMap again;
  std::string error;
  const bool is_read = load_scene_map(path, &again, &error, true);
  if (!is_read) std::fprintf(stderr, "%s\n", error.c_str());
  FUZZ_REQUIRE(is_read);
  FUZZ_REQUIRE(test::bytes_of(again) == test::bytes_of(map));
}

void require_sound(const std::string& path) {
  SceneMapFile file;
  SceneMap map;
  std::string error;
  if (!file.open(path, &error) || !file.read(&map, &error, true)) {
    FUZZ_REQUIRE(is_one_line(error));
    return;
  }
  FUZZ_REQUIRE(is_valid(map, &error));
  for (const SceneKeyframe& keyframe : map.keyframes) {
    FUZZ_REQUIRE(std::isfinite(map.camera_of(keyframe).focal_length));
  }
  const std::string copy = folder().file("copy.map");
  FUZZ_REQUIRE(save_scene_map(copy, map, &error));
  require_same(copy, map);
  if (map.keyframes.empty()) return;
  MapChange change = test::change_of(map, 5);
  SceneMap changed = map;
  // It refuses what does not fit, as ids or sizes at their ends.
  if (!apply(change, &changed, &error)) {
    FUZZ_REQUIRE(is_one_line(error));
    return;
  }
  FUZZ_REQUIRE(file.update(change, &error));
  require_same(path, changed);
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  FuzzInput input(data, size);
  const std::uint8_t right = input.byte();
  const std::string path = folder().file("scene.map");
  put_file(path, untouched_file());
  {
    SqliteDatabase database;
    FUZZ_REQUIRE(database.open(path, false));
    for (const char* pragma : {"journal_mode = OFF", "synchronous = OFF"}) {
      database.execute(std::string("PRAGMA ") + pragma);
    }
    for (int i = 0; i < 12 && !input.empty(); ++i) change_one(&input, &database);
    put_right(right, &database);
    database.execute("PRAGMA journal_mode = WAL");
  }
  // A byte of the file, too.
  if ((right & 16U) != 0) {
    std::string bytes = bytes_of_file(path);
    const std::size_t at = (input.byte() + std::size_t{256} * input.byte()) % bytes.size();
    bytes[at] = static_cast<char>(input.byte());
    put_file(path, bytes);
  }
  require_sound(path);
  return 0;
}
