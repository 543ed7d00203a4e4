// scene.map: the same bits back, and what is refused.

#include "edge_app/storage/scene_map_file.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <array>
#include <filesystem>
#include <limits>
#include <string>

#include "edge_app/storage/scene_map_writing.h"
#include "test/edge_app/storage/changing_scene_map.h"
#include "test/edge_app/storage/forged_journal.h"
#include "test/support/temporary_directory.h"

namespace alidade::test {
namespace {

class SceneMapFileTest : public ::testing::Test {
 protected:
  // Writes a map, and gives what was written.
  SceneMap save(const SceneMap& map) {
    EXPECT_TRUE(save_scene_map(path, map, &error)) << error;
    return map;
  }
  std::string loaded_bytes() {
    SceneMap map;
    EXPECT_TRUE(load_scene_map(path, &map, &error, true)) << error;
    return bytes_of(map);
  }
  void expect_refused(const std::string& why) {
    SceneMap map = random_scene_map(1, 1, 1);
    const std::string before = bytes_of(map);
    error.clear();
    EXPECT_FALSE(load_scene_map(path, &map, &error)) << why;
    EXPECT_NE(error.find(why), std::string::npos) << why << ": " << error;
    EXPECT_EQ(error.find(path + ": "), 0U) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
    EXPECT_TRUE(bytes_of(map) == before) << why;
  }
  void execute(const std::string& sql) {
    SqliteDatabase database;
    ASSERT_TRUE(database.open(path, false));
    database.execute(sql);
    ASSERT_FALSE(database.failed()) << database.failure_text();
  }
  // Puts another scene row in its place, with a sum that fits.
  template <class Change>
  void forge(Change change) {
    SqliteDatabase database;
    ASSERT_TRUE(database.open(path, false));
    SceneRow scene;
    {
      SqliteStatement select(&database, "SELECT * FROM scene");
      ASSERT_TRUE(select.step());
      ReadRow row(&select, 1);
      std::int64_t sum = 0;
      scene_fields(&row, scene);
      ASSERT_TRUE(row.end(&sum));
    }
    change(&scene);
    SqliteStatement insert(
        &database,
        "INSERT OR REPLACE INTO scene VALUES(1,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,"
        "?,?,?,?,?)");
    WrittenRow row(&insert);
    scene_fields(&row, static_cast<const SceneRow&>(scene));
    row.end();
    insert.run();
    ASSERT_FALSE(database.failed()) << database.failure_text();
  }

  TemporaryDirectory directory;
  std::string path = directory.path() + "/scene.map";
  std::string error;
};

TEST_F(SceneMapFileTest, GivesBackTheSameBits) {
  for (std::uint64_t seed = 1; seed < 6; ++seed) {
    SceneMap map = random_scene_map(seed, 15, 200);
    // Zeros of both signs, whole numbers, the smallest and the largest.
    map.keyframes[3].eps = -0.0;
    map.keyframes[3].zoom = 7;
    map.keyframes[4].angular_velocity << -0.0, 5e-324, 1.7e308;
    map.landmarks[6].d_b << -0.0, -1, 0;
    map.keyframes[5].recording = std::string("a\0b\n", 4);
    save(map);
    EXPECT_TRUE(loaded_bytes() == bytes_of(map)) << seed;
    EXPECT_FALSE(std::filesystem::exists(path + "-wal"));
    EXPECT_FALSE(std::filesystem::exists(path + ".new"));
  }
}

TEST_F(SceneMapFileTest, KeepsAMapOfNothing) {
  SceneMap map = random_scene_map(1, 0, 0);
  map.mechanics.reset();
  save(map);
  EXPECT_TRUE(loaded_bytes() == bytes_of(map));
}

TEST_F(SceneMapFileTest, PicturesAreReadOnlyWhereAskedFor) {
  const SceneMap map = save(random_scene_map(2, 9, 30));
  SceneMapFile file;
  SceneMap found;
  ASSERT_TRUE(file.open(path, &error) && file.read(&found, &error)) << error;
  for (const SceneKeyframe& keyframe : found.keyframes) EXPECT_TRUE(keyframe.picture.empty());
  std::vector<std::uint8_t> picture;
  ASSERT_TRUE(file.read_picture(map.keyframes[4].id, &picture, &error)) << error;
  EXPECT_EQ(picture, map.keyframes[4].picture);
  EXPECT_FALSE(file.read_picture(map.keyframes[6].id, &picture, &error));
  EXPECT_NE(error.find("has no picture of keyframe"), std::string::npos) << error;
}

TEST_F(SceneMapFileTest, EachChangeIsThereForTheNextReader) {
  SceneMap map = save(map_before_changes());
  SceneMapFile file;
  ASSERT_TRUE(file.open(path, &error)) << error;
  for (int step = 1; step <= 30; ++step) {
    const MapChange change = change_of(map, step);
    ASSERT_TRUE(file.update(change, &error)) << error;
    ASSERT_TRUE(apply(change, &map, &error)) << error;
    ASSERT_TRUE(loaded_bytes() == bytes_of(map)) << step;
  }
  EXPECT_EQ(file.revision(), 31);
  EXPECT_EQ(file.landmarks(), static_cast<std::int64_t>(map.landmarks.size()));
  EXPECT_EQ(file.keyframes(), 14);
}

TEST_F(SceneMapFileTest, AMapIsReplacedAsAWhole) {
  save(random_scene_map(2, 9, 30));
  const SceneMap map = save(random_scene_map(3, 4, 70));
  EXPECT_TRUE(loaded_bytes() == bytes_of(map));
}

TEST_F(SceneMapFileTest, ALogThatOutlivedItsMapIsNotTakenForTheNewOnes) {
  SceneMap map = save(map_before_changes());
  {
    SceneMapFile file;
    ASSERT_TRUE(file.open(path, &error)) << error;
    ASSERT_TRUE(file.update(change_of(map, 1), &error)) << error;
    std::filesystem::copy(path + "-wal", path + ".kept");
  }
  std::filesystem::remove(path);
  std::filesystem::rename(path + ".kept", path + "-wal");
  const SceneMap other = save(random_scene_map(4, 9, 60));
  EXPECT_TRUE(loaded_bytes() == bytes_of(other));
}

TEST_F(SceneMapFileTest, AForgedJournalIsRefusedAndDeletesNothing) {
  const SceneMap map = save(map_before_changes());
  const std::string victim = directory.write("victim", "of no concern to a map");
  const std::string journal = path + "-journal";
  forge_journal(journal, victim);
  expect_refused(journal + " lies beside it");
  EXPECT_NE(error.find("remove it"), std::string::npos) << error;
  EXPECT_FALSE(save_scene_map(path, map, &error));
  EXPECT_TRUE(std::filesystem::exists(journal));
  EXPECT_EQ(directory.read("victim"), "of no concern to a map");
  // The journal of a link lies beside what it leads to.
  const std::string link = directory.path() + "/link.map";
  std::filesystem::create_symlink(path, link);
  SceneMapFile file;
  EXPECT_FALSE(file.open(link, &error));
  EXPECT_EQ(error.find(link + ": " + journal), 0U) << error;
  // A link as a journal, too, wherever it leads.
  std::filesystem::rename(journal, directory.path() + "/elsewhere");
  std::filesystem::create_symlink(directory.path() + "/elsewhere", journal);
  expect_refused(journal + " lies beside it");
  std::filesystem::remove(directory.path() + "/elsewhere");
  expect_refused(journal + " lies beside it");
  std::filesystem::remove(journal);
  EXPECT_TRUE(loaded_bytes() == bytes_of(map));
  EXPECT_EQ(directory.read("victim"), "of no concern to a map");
}

TEST_F(SceneMapFileTest, AJournalForgedOnceTheMapIsOpenIsNotBelieved) {
  const SceneMap map = save(map_before_changes());
  const std::string victim = directory.write("victim", "of no concern to a map");
  SqliteDatabase database;
  ASSERT_TRUE(database.open(path, false));
  forge_journal(path + "-journal", victim);
  EXPECT_EQ(database.number_of("SELECT count(*) FROM keyframe"),
            static_cast<std::int64_t>(map.keyframes.size()));
  EXPECT_FALSE(database.failed()) << database.failure_text();
  EXPECT_EQ(directory.read("victim"), "of no concern to a map");
}

TEST_F(SceneMapFileTest, AJournalWhereAMapShallBeIsRefusedAndNoMapWritten) {
  const std::string victim = directory.write("victim", "of no concern to a map");
  forge_journal(path + "-journal", victim);
  EXPECT_FALSE(may_write_scene_map(path, &error));
  EXPECT_FALSE(save_scene_map(path, map_before_changes(), &error));
  EXPECT_EQ(error.find(path + ": " + path + "-journal lies beside it"), 0U) << error;
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_TRUE(std::filesystem::exists(path + "-journal"));
}

TEST_F(SceneMapFileTest, ALogThatLeadsToAnotherFileIsRefusedAndThatFileKept) {
  save(map_before_changes());
  directory.write("victim", "of no concern to a map");
  for (const char* rest : {"-wal", "-shm"}) {
    std::filesystem::create_symlink(directory.path() + "/victim", path + rest);
    expect_refused(path + rest + " lies beside it");
    std::filesystem::remove(path + rest);
  }
  EXPECT_EQ(directory.read("victim"), "of no concern to a map");
}

TEST_F(SceneMapFileTest, ACopyThatAnotherToolMadeIsReadAndCanBeChanged) {
  SceneMap map = save(map_before_changes());
  execute("PRAGMA journal_mode = OFF");  // of this connection; the next has a rollback journal
  EXPECT_TRUE(loaded_bytes() == bytes_of(map));
  SceneMapFile file;
  ASSERT_TRUE(file.open(path, &error)) << error;
  const MapChange change = change_of(map, 1);
  ASSERT_TRUE(file.update(change, &error)) << error;
  ASSERT_TRUE(apply(change, &map, &error)) << error;
  EXPECT_TRUE(loaded_bytes() == bytes_of(map));
}

TEST_F(SceneMapFileTest, AChangeThatDoesNotFitChangesNothing) {
  const SceneMap map = save(map_before_changes());
  SceneMapFile file;
  ASSERT_TRUE(file.open(path, &error)) << error;
  std::vector<std::pair<const char*, MapChange>> slips(5, {"", change_of(map, 5)});
  slips[0].first = "has no landmark 5000";
  slips[0].second.died.push_back(5000);
  slips[1].first = "has an id that is not new";
  slips[1].second.born[1].id = 1;
  slips[2].first = "not there";
  slips[2].second.born[1].sightings = {{5000, {1, 1}, 1}};
  slips[3].first = "not a unit vector";
  slips[3].second.changed[3].d_b.setZero();
  slips[4].first = "twice";
  slips[4].second.new_keyframes[0].id = map.keyframes[2].id;
  for (const auto& [what, change] : slips) {
    EXPECT_FALSE(file.update(change, &error)) << what;
    EXPECT_NE(error.find(what), std::string::npos) << what << ": " << error;
    EXPECT_TRUE(loaded_bytes() == bytes_of(map)) << what;
  }
  EXPECT_TRUE(file.update(change_of(map, 5), &error)) << error;
}

TEST_F(SceneMapFileTest, TwoWhoWriteAreToldOfEachOther) {
  const SceneMap map = save(map_before_changes());
  SceneMapFile one, other;
  ASSERT_TRUE(one.open(path, &error) && other.open(path, &error)) << error;
  ASSERT_TRUE(one.update(change_of(map, 1), &error)) << error;
  EXPECT_FALSE(other.update(change_of(map, 1), &error));
  EXPECT_NE(error.find("changed by another process"), std::string::npos) << error;
  SceneMap now;
  ASSERT_TRUE(other.read(&now, &error)) << error;
  EXPECT_TRUE(other.update(change_of(now, 2), &error)) << error;
}

TEST_F(SceneMapFileTest, WhoReplacesAfterAnotherHasWrittenIsSeenByTheOther) {
  const SceneMap map = save(map_before_changes());
  SceneMapFile one, other;
  ASSERT_TRUE(one.open(path, &error) && other.open(path, &error)) << error;
  ASSERT_TRUE(other.update(change_of(map, 1), &error)) << error;
  ASSERT_TRUE(one.replace(map_before_changes(), &error)) << error;
  EXPECT_FALSE(other.update(change_of(map, 1), &error));
  EXPECT_NE(error.find("changed by another process"), std::string::npos) << error;
}

TEST_F(SceneMapFileTest, WhoeverWritesLongIsNotWaitedForForever) {
  const SceneMap map = save(map_before_changes());
  SceneMapFile file;
  ASSERT_TRUE(file.open(path, &error)) << error;
  SqliteDatabase other;
  ASSERT_TRUE(other.open(path, false));
  const SqliteTransaction held(&other, true);
  EXPECT_FALSE(file.update(change_of(map, 1), &error));
  EXPECT_NE(error.find("in use by another process"), std::string::npos) << error;
  EXPECT_TRUE(loaded_bytes() == bytes_of(map));
}

TEST_F(SceneMapFileTest, RefusesWhatIsNoSceneMap) {
  expect_refused("there is no such file");
  std::filesystem::create_directory(path);
  expect_refused("not a file");
  std::filesystem::remove(path);
  directory.write("scene.map", "");
  expect_refused("not a scene map");
  directory.write("scene.map", std::string(5000, 'x'));
  expect_refused("not a database");
  EXPECT_FALSE(save_scene_map(path, random_scene_map(1, 1, 1), &error));
  EXPECT_EQ(directory.read("scene.map").size(), 5000U) << "another file was overwritten";
  std::filesystem::remove(path);
  SqliteDatabase database;
  ASSERT_TRUE(database.open(path, true));
  database.execute("CREATE TABLE landmark(id)");
  database.close();
  expect_refused("not a scene map");
}

TEST_F(SceneMapFileTest, RefusesAnotherFormat) {
  save(map_before_changes());
  execute("PRAGMA user_version = 3");
  expect_refused("of format 3, this program has format 2; build it again");
}

// The schema of a file of format 1, which is never to be changed.
constexpr const char* kFormat1 =
    "PRAGMA application_id = 1095521101; PRAGMA user_version = 1;"
    "CREATE TABLE keyframe(id INTEGER PRIMARY KEY, recording, frame, time_utc_s, zoom, position, "
    "telemetry_pan, telemetry_tilt, "
    "q_x, q_y, q_z, q_w, eps, "
    "cov_xx, cov_xy, cov_xz, cov_xf, cov_yy, cov_yz, cov_yf, cov_zz, cov_zf, cov_ff, "
    "w_x, w_y, w_z, zoom_rate, residual_px, crc);"
    "CREATE TABLE landmark(id INTEGER PRIMARY KEY, d_x, d_y, d_z, cov_xx, cov_xy, cov_yy, "
    "shared_xx, shared_xy, shared_yy, "
    "scale_rad, focal_length_px, descriptor, born_utc_s, last_seen_utc_s, looked_for, matched, "
    "missed, "
    "sightings, sightings_crc, crc);"
    "CREATE TABLE lens_knot(number INTEGER PRIMARY KEY, log_f);"
    "CREATE TABLE lens_point(number INTEGER PRIMARY KEY, delta, kappa, centre_u, centre_v);"
    "CREATE TABLE picture(keyframe INTEGER PRIMARY KEY REFERENCES keyframe(id), luma, crc);"
    "CREATE TABLE scene(id INTEGER PRIMARY KEY, revision, width, height, aspect, line_delay_s, "
    "reference_row_px, "
    "has_mechanics, pan_axis_x, pan_axis_y, pan_axis_z, tilt_axis_x, tilt_axis_y, tilt_axis_z, "
    "pan_scale, tilt_scale, "
    "next_landmark, lens_points, lens_crc, keyframes, landmarks, sightings, row_sum, crc);"
    "CREATE TABLE sighting(landmark REFERENCES landmark(id), keyframe REFERENCES keyframe(id), "
    "u_px, v_px, scale_px, "
    "PRIMARY KEY(landmark, keyframe)) WITHOUT ROWID;";

// The same rows, in tables as the program of that time made them.
void rewrite_in_format_1(const std::string& path) {
  SqliteDatabase database;
  ASSERT_TRUE(database.open(path, false));
  const std::array<std::string, 7> tables = {"sighting", "picture",    "landmark", "keyframe",
                                             "scene",    "lens_point", "lens_knot"};
  for (const std::string& table : tables) {
    database.execute("CREATE TEMP TABLE rows_of_" + table + " AS SELECT * FROM main." + table);
    database.execute("DROP TABLE main." + table);
  }
  database.execute("DROP TABLE main.lens_rest");
  database.execute(kFormat1);
  for (const std::string& table : tables) {
    const std::string columns =
        table == "lens_point" ? "number, delta, kappa, centre_u, centre_v" : "*";
    database.execute("INSERT INTO main." + table + " SELECT " + columns + " FROM rows_of_" + table);
  }
  ASSERT_FALSE(database.failed()) << database.failure_text();
}

// A map that was written before a lens had a hold: as it was then, updated as it is, replaced by one of today.
TEST_F(SceneMapFileTest, ReadsTheFormatBefore) {
  SceneMap map = save(map_before_changes());
  rewrite_in_format_1(path);
  forge([&](SceneRow* scene) { scene->lens_sum = sum_of(map.lens, false); });
  map.lens.hold() = 1;
  EXPECT_TRUE(loaded_bytes() == bytes_of(map));
  SceneMapFile file;
  ASSERT_TRUE(file.open(path, &error)) << error;
  const MapChange change = change_of(map, 1);
  ASSERT_TRUE(file.update(change, &error)) << error;
  ASSERT_TRUE(apply(change, &map, &error)) << error;
  EXPECT_TRUE(loaded_bytes() == bytes_of(map));
  map.lens.hold() = 0.25;
  ASSERT_TRUE(file.replace(map, &error)) << error;
  EXPECT_TRUE(loaded_bytes() == bytes_of(map));
  execute("DROP TABLE lens_rest");
  expect_refused("damaged");
}

TEST_F(SceneMapFileTest, RefusesAnotherCamera) {
  save(map_before_changes());
  SceneMapFile file;
  ASSERT_TRUE(file.open(path, &error)) << error;
  EXPECT_TRUE(file.is_of(1280, 720, &error));
  EXPECT_FALSE(file.is_of(1920, 1080, &error));
  EXPECT_EQ(error, path +
                       ": of a camera with images of 1280x720, not 1920x1080; build a map of this "
                       "camera");
}

TEST_F(SceneMapFileTest, RefusesWhatADatabaseCanHoldBesideTables) {
  for (const char* sql :
       {"CREATE TRIGGER t AFTER INSERT ON landmark BEGIN DELETE FROM landmark; END",
        "CREATE VIEW v AS SELECT * FROM landmark", "CREATE INDEX i ON landmark(d_x)",
        "DROP TABLE picture",
        "DROP TABLE lens_knot; CREATE VIEW lens_knot AS WITH RECURSIVE n(number, log_f) AS (SELECT "
        "0, "
        "7.0 UNION ALL SELECT number + 1, log_f + 0.1 FROM n) SELECT * FROM n"}) {
    std::filesystem::remove(path);
    save(map_before_changes());
    execute(sql);
    expect_refused("damaged");
  }
}

TEST_F(SceneMapFileTest, RefusesMoreThanIsAllowed) {
  save(map_before_changes());
  forge([](SceneRow* scene) { scene->keyframes = 100'001; });
  expect_refused("has 100001 keyframes, at most 100000 are allowed");
  forge([](SceneRow* scene) { scene->keyframes = 8, scene->landmarks = -1; });
  expect_refused("has -1 landmarks");
  forge([](SceneRow* scene) { scene->landmarks = 60, scene->width = std::int64_t{1} << 40; });
  expect_refused("columns, at most");
  forge([](SceneRow* scene) { scene->width = 1280, scene->lens_points = 2'000'000'000; });
  expect_refused("points of the lens, at most");
}

// Else an update would take them for true, and write on from there.
TEST_F(SceneMapFileTest, RefusesCountsThatDoNotCount) {
  const SceneMap map = save(map_before_changes());
  std::int64_t sightings = 0;
  for (const SceneLandmark& landmark : map.landmarks) {
    sightings += static_cast<std::int64_t>(landmark.sightings.size());
  }
  forge([](SceneRow* scene) { scene->sightings -= 1; });
  expect_refused("damaged");
  forge([&](SceneRow* scene) {
    EXPECT_EQ(scene->sightings, sightings - 1);
    scene->sightings = sightings;
    scene->revision = std::numeric_limits<std::int64_t>::max();
  });
  expect_refused("damaged");
}

TEST_F(SceneMapFileTest, RefusesARowThatWasChangedOrLost) {
  for (const char* sql :
       {"UPDATE landmark SET cov_xx = 2 * cov_xx WHERE id = 5", "DELETE FROM landmark WHERE id = 1",
        "UPDATE landmark SET descriptor = 'text' WHERE id = 5",
        "UPDATE landmark SET matched = NULL WHERE id = 5",
        "UPDATE sighting SET u_px = u_px + 1 WHERE landmark = 5",
        "DELETE FROM sighting WHERE landmark = 5", "UPDATE keyframe SET frame = 2 * frame + 1",
        "UPDATE keyframe SET q_x = 'x'", "DELETE FROM picture", "UPDATE lens_knot SET log_f = 7",
        "UPDATE lens_rest SET hold = 0.75", "DELETE FROM lens_rest",
        "INSERT INTO lens_rest VALUES(1, 0.5)", "UPDATE lens_point SET kappa = 0.1",
        "DELETE FROM lens_point WHERE number = 2", "DELETE FROM scene",
        "UPDATE scene SET aspect = 2.0", "INSERT INTO sighting VALUES(5, 3000, 1.0, 1.0, 1.0)"}) {
    std::filesystem::remove(path);
    save(map_before_changes());
    SCOPED_TRACE(sql);
    execute(sql);
    expect_refused("damaged");
  }
}

TEST_F(SceneMapFileTest, ADamagedPictureIsNotGiven) {
  const SceneMap map = save(map_before_changes());
  const std::string id = std::to_string(map.keyframes[1].id);
  execute("UPDATE picture SET luma = substr(luma, 1, 50) WHERE keyframe = " + id);
  SceneMapFile file;
  std::vector<std::uint8_t> picture;
  ASSERT_TRUE(file.open(path, &error)) << error;
  EXPECT_FALSE(file.read_picture(map.keyframes[1].id, &picture, &error));
  EXPECT_NE(error.find("damaged"), std::string::npos) << error;
}

TEST_F(SceneMapFileTest, AnInvalidMapIsNotWritten) {
  SceneMap map = random_scene_map(1, 3, 3);
  map.landmarks[1].scale_rad = -1;
  EXPECT_FALSE(save_scene_map(path, map, &error));
  EXPECT_EQ(error, path + ": refused to write it: landmark 3 has a size out of range");
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(SceneMapFileTest, AMissingFolderIsSaidSo) {
  const std::string nowhere = directory.path() + "/no/scene.map";
  EXPECT_FALSE(save_scene_map(nowhere, random_scene_map(1, 3, 3), &error));
  EXPECT_EQ(error, nowhere + ": cannot be written: cannot be opened: No such file or directory");
}

// Files that this process writes end at a size, as on a disk that is full.
class SmallDisk {
 public:
  explicit SmallDisk(rlim_t bytes) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limit);
    ::signal(SIGXFSZ, SIG_IGN);
  }
  ~SmallDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, SIG_DFL);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

 private:
  rlimit before_{};
};

TEST_F(SceneMapFileTest, AFullDiskLosesNothing) {
  const SceneMap map = save(map_before_changes());
  const std::string other = directory.path() + "/other.map";
  {
    SceneMapFile file;
    ASSERT_TRUE(file.open(path, &error)) << error;
    for (const rlim_t bytes : {0U, 1000U, 8000U, 30000U}) {
      {
        const SmallDisk full(bytes);
        EXPECT_FALSE(file.replace(random_scene_map(9, 40, 600), &error)) << bytes;
        EXPECT_FALSE(save_scene_map(other, map, &error)) << bytes;
      }
      EXPECT_FALSE(std::filesystem::exists(other));
      EXPECT_TRUE(loaded_bytes() == bytes_of(map)) << bytes;
    }
    // And goes on once there is room.
    EXPECT_TRUE(file.update(change_of(map, 1), &error)) << error;
  }
  EXPECT_FALSE(loaded_bytes() == bytes_of(map));
}

}  // namespace
}  // namespace alidade::test
