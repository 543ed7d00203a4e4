// The calibrations of a camera on disk: what is found again, what is set aside, and what a full disk, missing
// permissions and power cuts leave.

#include "edge_app/storage/calibration_store.h"
#include "edge_app/storage/calibration_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <set>

#include "edge_app/storage/calibration_file.h"
#include "edge_app/storage/map_file.h"
#include "test/support/temporary_directory.h"
#include "test/support/zoom_by_formula.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;
using ::testing::UnorderedElementsAre;

namespace fs = std::filesystem;

constexpr int kWidth = 640;
constexpr int kHeight = 480;

// Told apart by its focal length; its map by the number of landmarks.
StoredCalibration some(double focal_length, std::optional<double> zoom = {}, int landmarks = 3) {
  StoredCalibration out;
  out.calibration.camera = {focal_length, 1, {0}, kWidth, kHeight};
  out.calibration.zoom = zoom;
  for (int i = 0; i < landmarks; ++i) {
    Landmark landmark;
    landmark.d = Vector3<double>(1, 0.01 * i, 0).normalized();
    out.map.landmarks.push_back(landmark);
  }
  return out;
}

// Lowers the largest size of a file that may be written: so much of the disk is left.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    signal_ = std::signal(SIGXFSZ, SIG_IGN);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, signal_);
  }

 private:
  rlimit before_{};
  void (*signal_)(int) = SIG_DFL;
};

// Takes permissions from a folder; root, who needs none, becomes nobody meanwhile.
class Forbidden {
 public:
  Forbidden(std::string folder, fs::perms allowed) : folder_(std::move(folder)) {
    fs::permissions(folder_, allowed);
    if (::geteuid() == 0) changed_ = ::seteuid(kNobody) == 0;
  }
  Forbidden(const Forbidden&) = delete;
  Forbidden& operator=(const Forbidden&) = delete;
  ~Forbidden() {
    if (changed_ && ::seteuid(0) != 0) std::abort();
    fs::permissions(folder_, fs::perms::owner_all);
  }

 private:
  static constexpr uid_t kNobody = 65534;
  std::string folder_;
  bool changed_ = false;
};
// For everybody: nobody may be in the owner's group.
constexpr fs::perms kNoReading =
    fs::perms::owner_exec | fs::perms::group_exec | fs::perms::others_exec;
constexpr fs::perms kNoWriting =
    kNoReading | fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read;

class CalibrationStoreTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name = "calibration.yaml") const {
    return directory_.path() + "/" + name;
  }
  [[nodiscard]] CalibrationStore store(double tolerance = 0) const {
    return CalibrationStore(path(), tolerance);
  }
  void put(const StoredCalibration& calibration) const { put_into(path(), calibration); }
  static void put_into(const std::string& file, const StoredCalibration& calibration) {
    CalibrationStore store(file);
    static_cast<void>(store.load(0, 0));
    std::string error;
    ASSERT_TRUE(store.save(calibration, &error)) << error;
  }
  // Names of all files.
  [[nodiscard]] std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(directory_.path())) {
      names.insert(entry.path().filename().string());
    }
    return names;
  }
  // The one map.
  [[nodiscard]] std::string map_name() const {
    std::string found;
    for (const std::string& name : files()) {
      if (name.find(".map-") == std::string::npos || name.find("damaged") != std::string::npos) {
        continue;
      }
      EXPECT_EQ(found, "") << name;
      found = name;
    }
    EXPECT_NE(found, "");
    return found;
  }
  static double focal_length(const StoredCalibration* found) {
    return found == nullptr ? 0 : found->calibration.camera.focal_length;
  }
  // What another run finds there.
  void expect_stored(double f, std::size_t landmarks, std::optional<double> zoom = {}) const {
    CalibrationStore again = store();
    static_cast<void>(again.load(kWidth, kHeight));
    const StoredCalibration* found = again.find(zoom);
    ASSERT_EQ(focal_length(found), f);
    EXPECT_EQ(found->map.landmarks.size(), landmarks);
  }

  TemporaryDirectory directory_;
};

TEST_F(CalibrationStoreTest, FindsNothingWhereNothingIs) {
  CalibrationStore nowhere(path("not/yet/calibration.yaml"));
  EXPECT_THAT(nowhere.load(kWidth, kHeight), IsEmpty());
  EXPECT_EQ(nowhere.find({}), nullptr);
  EXPECT_EQ(nowhere.find(5), nullptr);
  EXPECT_FALSE(nowhere.has_pending());
}

TEST_F(CalibrationStoreTest, FindsBetweenTheZoomsByTheCurve) {
  const ZoomCurve curve = test::zoom_curve();
  CalibrationNotes notes;
  notes.zoom_curve = curve;
  std::string error;
  ASSERT_TRUE(save_calibration(path("zoom.yaml"), curve.node(0), notes, &error)) << error;
  CalibrationStore first(path("zoom.yaml"));
  EXPECT_THAT(first.load(kWidth, kHeight),
              Contains(HasSubstr("zoom curve from reading 1000 to 2000")));
  EXPECT_EQ(focal_length(first.find({})), curve.node(0).camera.focal_length);
  const StoredCalibration* between = first.find(1400);
  ASSERT_NE(between, nullptr);
  EXPECT_EQ(between->calibration.zoom, 1400);
  EXPECT_NEAR(focal_length(between), test::zoom_focal_length(1400), 0.05 * 3000);
  EXPECT_EQ(first.find(5000), nullptr) << "as far from the nodes";
  // A calibration made at its first reading, and one between: the curve stays.
  ASSERT_TRUE(first.save(some(1001, 1000), &error)) << error;
  ASSERT_TRUE(first.save(some(2222, 1400), &error)) << error;
  CalibrationStore again(path("zoom.yaml"));
  static_cast<void>(again.load(kWidth, kHeight));
  EXPECT_EQ(focal_length(again.find(1000)), 1001);
  EXPECT_EQ(focal_length(again.find(1400)), 2222);
  EXPECT_NEAR(focal_length(again.find(1600)), test::zoom_focal_length(1600), 0.05 * 4000);
  EXPECT_FALSE(again.zoom_curve().empty());
}

TEST_F(CalibrationStoreTest, FindsACalibrationAndItsMapAgain) {
  CalibrationStore first(path("made/by/it/calibration.yaml"));
  std::string error;
  ASSERT_TRUE(first.save(some(1000), &error)) << error;
  EXPECT_EQ(first.find({})->path, path("made/by/it/calibration.yaml"));
  CalibrationStore again(path("made/by/it/calibration.yaml"));
  EXPECT_THAT(again.load(kWidth, kHeight), ElementsAre(path("made/by/it/calibration.yaml") +
                                                       ": calibration for any zoom, 3 landmarks"));
  const StoredCalibration* found = again.find({});
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->path, path("made/by/it/calibration.yaml"));
  EXPECT_EQ(format_calibration(found->calibration), format_calibration(some(1000).calibration));
  EXPECT_EQ(format_map({{}, found->map}, found->calibration),
            format_map({{}, some(1000).map}, some(1000).calibration));
}

TEST_F(CalibrationStoreTest, TakesWhatTheCommandCalibrateWrites) {
  const StoredCalibration made = some(1000);
  CalibrationNotes notes;
  notes.landmarks = "map.bin";
  std::string error;
  ASSERT_TRUE(save_map(path("map.bin"), {{}, made.map}, made.calibration, &error)) << error;
  ASSERT_TRUE(save_calibration(path(), made.calibration, notes, &error)) << error;
  expect_stored(1000, 3);
  // What was not written here is not removed here.
  put(some(1001));
  EXPECT_THAT(files(), Contains("map.bin"));
  expect_stored(1001, 3);
}

TEST_F(CalibrationStoreTest, HasOneForEachZoom) {
  CalibrationStore first = store(2);
  std::string error;
  for (const double zoom : {100.0, 200.5}) {
    ASSERT_TRUE(first.save(some(10 * zoom, zoom), &error)) << error;
  }
  EXPECT_EQ(first.find({}), nullptr);
  EXPECT_THAT(files(), AllOf(Contains("calibration.zoom-100.yaml"),
                             Contains("calibration.zoom-200.5.yaml")));
  const std::string folder = fs::path(path()).parent_path();
  EXPECT_THAT(calibrations_of_zooms(path()), ElementsAre(folder + "/calibration.zoom-100.yaml",
                                                         folder + "/calibration.zoom-200.5.yaml"));
  EXPECT_THAT(calibrations_of_zooms(folder + "/other.yaml"), IsEmpty());
  ASSERT_TRUE(first.save(some(5000), &error)) << error;
  CalibrationStore again = store(2);
  EXPECT_EQ(again.load(kWidth, kHeight).size(), 3U);
  for (const CalibrationStore* either : {&first, &again}) {
    EXPECT_EQ(focal_length(either->find(100)), 1000);
    EXPECT_EQ(focal_length(either->find(101.9)), 1000);
    EXPECT_EQ(focal_length(either->find(98.1)), 1000);
    EXPECT_EQ(focal_length(either->find(199)), 2005);
    // Beyond the tolerance only one for any zoom will do.
    EXPECT_EQ(focal_length(either->find(102.1)), 5000);
    EXPECT_EQ(focal_length(either->find({})), 5000);
  }
}

TEST_F(CalibrationStoreTest, TakesTheNearestWithinTheTolerance) {
  put(some(1000, 100));
  put(some(1010, 101));
  CalibrationStore again = store(5);
  EXPECT_EQ(again.load(kWidth, kHeight).size(), 2U);
  EXPECT_EQ(focal_length(again.find(100.4)), 1000);
  EXPECT_EQ(focal_length(again.find(100.6)), 1010);
}

TEST_F(CalibrationStoreTest, WithoutAZoomTakesTheOnlyOne) {
  put(some(1000, 100));
  CalibrationStore again = store();
  EXPECT_EQ(again.load(kWidth, kHeight).size(), 1U);
  EXPECT_EQ(focal_length(again.find({})), 1000);
  EXPECT_EQ(again.find(101), nullptr);
}

TEST_F(CalibrationStoreTest, ReplacesTheOneWithinTheTolerance) {
  CalibrationStore first = store(2);
  std::string error;
  ASSERT_TRUE(first.save(some(1000, 100), &error)) << error;
  ASSERT_TRUE(first.save(some(1001, 101), &error)) << error;
  EXPECT_EQ(first.find(99), first.find(101));
  EXPECT_EQ(focal_length(first.find(101)), 1001);
  EXPECT_EQ(files().size(), 2U);
  expect_stored(1001, 3, 101);
}

// What was named 100 holds 101 now.
TEST_F(CalibrationStoreTest, NeverTakesTheFileOfAnotherZoom) {
  CalibrationStore first = store(2);
  std::string error;
  ASSERT_TRUE(first.save(some(1000, 100), &error)) << error;
  ASSERT_TRUE(first.save(some(1001, 101), &error)) << error;
  put(some(999, 100));
  expect_stored(1001, 3, 101);
  expect_stored(999, 3, 100);
}

TEST_F(CalibrationStoreTest, GoesByTheZoomInAFileNotByItsName) {
  put(some(1000, 100));
  fs::rename(path("calibration.zoom-100.yaml"), path("calibration.zoom-7.yaml"));
  expect_stored(1000, 3, 100);
  // FILE itself may be of one zoom: another one for any then has another name.
  fs::rename(path("calibration.zoom-7.yaml"), path());
  expect_stored(1000, 3, 100);
  put(some(500));
  expect_stored(1000, 3, 100);
  expect_stored(500, 3);
}

TEST_F(CalibrationStoreTest, UsesOneOfTwoForTheSameZoom) {
  put(some(1000, 100));
  fs::copy(path("calibration.zoom-100.yaml"), path("calibration.zoom-99.yaml"));
  CalibrationStore again = store();
  EXPECT_THAT(again.load(kWidth, kHeight),
              ElementsAre(HasSubstr("calibration.zoom-100.yaml: calibration for zoom 100"),
                          AllOf(HasSubstr("calibration.zoom-99.yaml: for zoom 100, as "),
                                HasSubstr("not used"))));
}

TEST_F(CalibrationStoreTest, LeavesOtherFilesAlone) {
  put(some(1000));
  for (const char* name : {"notes.txt", "calibration.zoom-.txt", "other.zoom-5.yaml",
                           "calibration.map-12.bin", "calibration.yaml.old"}) {
    directory_.write(name, "mine");
  }
  fs::create_directory(path("calibration.zoom-5.yaml"));
  CalibrationStore again = store();
  EXPECT_THAT(again.load(kWidth, kHeight),
              ElementsAre(HasSubstr("3 landmarks"),
                          path("calibration.zoom-5.yaml") + ": not a file: not used"));
  put(some(1001));
  EXPECT_EQ(files().size(), 8U);
}

TEST_F(CalibrationStoreTest, SetsADamagedFileAsideAndNeverOverOne) {
  for (int i = 0; i < 3; ++i) {
    const std::string text = "damaged " + std::to_string(i);
    directory_.write("calibration.yaml", text);
    CalibrationStore again = store();
    const std::string name =
        i == 0 ? "calibration.yaml.damaged" : "calibration.yaml.damaged." + std::to_string(i);
    EXPECT_THAT(
        again.load(kWidth, kHeight),
        ElementsAre(AllOf(StartsWith(path() + ":1: "), HasSubstr("; set aside as " + name))));
    EXPECT_EQ(again.find({}), nullptr);
    EXPECT_EQ(directory_.read(name), text);
    EXPECT_FALSE(fs::exists(path()));
  }
  // The next start has nothing to say of them.
  CalibrationStore again = store();
  EXPECT_THAT(again.load(kWidth, kHeight), IsEmpty());
}

// The configured size may be a slip: only when a calibration of that size is stored was it none.
TEST_F(CalibrationStoreTest, SetsAsideWhatIsOfAnotherSizeWithItsMapWhenAnotherIsStored) {
  put(some(1000));
  const std::string map = map_name();
  const std::string yaml = directory_.read("calibration.yaml");
  const std::set<std::string> before = files();
  CalibrationStore other = store();
  EXPECT_THAT(other.load(1920, 1080),
              ElementsAre(AllOf(HasSubstr("640x480"),
                                HasSubstr("video.width and video.height are 1920 and 1080"),
                                HasSubstr("it stays until another calibration is stored"))));
  EXPECT_EQ(other.find({}), nullptr);
  EXPECT_EQ(files(), before);
  StoredCalibration large = some(3000);
  large.calibration.camera.width = 1920;
  large.calibration.camera.height = 1080;
  std::string error;
  ASSERT_TRUE(other.save(large, &error)) << error;
  // Both are still there for the day the size is changed back.
  EXPECT_EQ(directory_.read("calibration.yaml.replaced"), yaml);
  EXPECT_THAT(files(), Contains(map + ".replaced"));
}

TEST_F(CalibrationStoreTest, WhoOnlyLooksTouchesNoFile) {
  put(some(900));
  const std::set<std::string> before = files();
  CalibrationStore looking = store();
  EXPECT_THAT(looking.load(1920, 1080, CalibrationStore::Use::kLook),
              ElementsAre(HasSubstr("it stays until another calibration is stored")));
  EXPECT_TRUE(looking.empty());
  EXPECT_EQ(files(), before);
}

TEST_F(CalibrationStoreTest, AnySizeWillDoIfNoneIsGiven) {
  put(some(1000));
  CalibrationStore any = store();
  EXPECT_THAT(any.load(0, 0), ElementsAre(HasSubstr("3 landmarks")));
}

TEST_F(CalibrationStoreTest, ADamagedMapCostsTheMapOnly) {
  put(some(1000));
  const std::string map = map_name();
  std::string bytes = directory_.read(map);
  bytes[200] = static_cast<char>(bytes[200] ^ 1);
  directory_.write(map, bytes);
  CalibrationStore again = store();
  EXPECT_THAT(again.load(kWidth, kHeight),
              ElementsAre(AllOf(HasSubstr("checksum"), HasSubstr("set aside as " + map)),
                          HasSubstr("0 landmarks")));
  EXPECT_EQ(focal_length(again.find({})), 1000);
  EXPECT_EQ(directory_.read(map + ".damaged"), bytes);
  CalibrationStore third = store();
  EXPECT_THAT(third.load(kWidth, kHeight),
              ElementsAre(HasSubstr("is missing"), HasSubstr("0 landmarks")));
}

TEST_F(CalibrationStoreTest, AMapElsewhereIsNotLookedAt) {
  CalibrationNotes notes;
  notes.landmarks = "../map.bin";
  std::string error;
  ASSERT_TRUE(save_calibration(path(), some(1000).calibration, notes, &error)) << error;
  CalibrationStore again = store();
  EXPECT_THAT(again.load(kWidth, kHeight), Contains(HasSubstr("not a file beside it")));
  EXPECT_EQ(focal_length(again.find({})), 1000);
}

TEST_F(CalibrationStoreTest, LeavesAloneWhatANameTakesForAMap) {
  CalibrationNotes notes;
  notes.landmarks = "alidade.yaml";
  std::string error;
  ASSERT_TRUE(save_calibration(path(), some(1000).calibration, notes, &error)) << error;
  directory_.write("alidade.yaml", "video: {}\n");
  CalibrationStore again = store();
  EXPECT_THAT(again.load(kWidth, kHeight), Contains(HasSubstr("does not end in .bin: not used")));
  EXPECT_EQ(directory_.read("alidade.yaml"), "video: {}\n");
}

TEST_F(CalibrationStoreTest, WithoutLandmarksWritesNoMap) {
  put(some(1000));
  put(some(1001, {}, 0));
  EXPECT_THAT(files(), ElementsAre("calibration.yaml"));
  expect_stored(1001, 0);
}

TEST_F(CalibrationStoreTest, KeepsOneMapForEachCalibration) {
  put(some(500, 5));
  for (int i = 0; i < 5; ++i) put(some(1000, {}, 3 + i));
  EXPECT_EQ(files().size(), 4U);
  // The same once more.
  put(some(1000, {}, 7));
  EXPECT_EQ(files().size(), 4U);
  expect_stored(1000, 7);
  expect_stored(500, 3, 5);
}

// Power cuts: what is on disk after each of the steps of a save.

TEST_F(CalibrationStoreTest, AfterANewMapTheOldPairIsStillThere) {
  put(some(1000));
  const TemporaryDirectory elsewhere;
  put_into(elsewhere.path() + "/calibration.yaml", some(2000, {}, 5));
  for (const auto& entry : fs::directory_iterator(elsewhere.path())) {
    if (entry.path().extension() == ".bin") fs::copy(entry.path(), directory_.path());
  }
  ASSERT_EQ(files().size(), 3U);
  expect_stored(1000, 3);
  put(some(2001, {}, 6));
  expect_stored(2001, 6);
  EXPECT_EQ(files().size(), 2U);
}

TEST_F(CalibrationStoreTest,
       AfterTheNewCalibrationTheNewPairIsThereAndTheOldMapGoesWithTheNextSave) {
  put(some(1000));
  const std::string old_map = map_name();
  const std::string old_bytes = directory_.read(old_map);
  put(some(2000, {}, 5));
  directory_.write(old_map, old_bytes);
  expect_stored(2000, 5);
  put(some(2001, {}, 6));
  expect_stored(2001, 6);
  EXPECT_EQ(files().size(), 2U);
}

TEST_F(CalibrationStoreTest, WhatAKilledProcessLeftUnfinishedGoesAtTheStart) {
  put(some(1000));
  for (const char* name :
       {"calibration.yaml.unfinished-a1B2c3", "calibration.zoom-5.yaml.unfinished-a1B2c3",
        "calibration.map-1a2b3c4d.bin.unfinished-a1B2c3"})
    directory_.write(name, "half");
  for (const char* other : {"calibration.yaml.backup", "other.yaml.unfinished-a1B2c3"})
    directory_.write(other, "somebody's");
  const auto before = std::distance(fs::directory_iterator(directory_.path()), {});
  CalibrationStore looking = store();
  static_cast<void>(looking.load(kWidth, kHeight, CalibrationStore::Use::kLook));
  EXPECT_EQ(std::distance(fs::directory_iterator(directory_.path()), {}), before);
  CalibrationStore loaded = store();
  EXPECT_THAT(loaded.load(kWidth, kHeight),
              Contains(path() + ": 3 unfinished files of a killed process removed"));
  EXPECT_EQ(std::distance(fs::directory_iterator(directory_.path()), {}), before - 3);
  EXPECT_FALSE(loaded.empty());
}

TEST_F(CalibrationStoreTest, HalfWrittenFilesBesideAreNotTakenForAnything) {
  put(some(1000));
  directory_.write("calibration.yaml.Ab12cD", "format: 1\n");
  directory_.write("calibration.map-0123abcd.bin.Ab12cD", "ALIDMAP\n");
  expect_stored(1000, 3);
}

// Faults while saving: each then a start that still finds the old pair, and a save that succeeds.

TEST_F(CalibrationStoreTest, AFullDiskLosesNothing) {
  // No room for the map; for the map, but not for the calibration.
  for (const int landmarks : {3, 0}) {
    SCOPED_TRACE(landmarks);
    put(some(1000));
    const std::set<std::string> before = files();
    CalibrationStore running = store();
    static_cast<void>(running.load(kWidth, kHeight));
    std::string error;
    {
      const FullDisk full(200);
      EXPECT_FALSE(running.save(some(2000, {}, landmarks), &error));
      EXPECT_THAT(error, AllOf(StartsWith(directory_.path()), HasSubstr("File too large")));
      EXPECT_EQ(error.find('\n'), std::string::npos);
      EXPECT_FALSE(running.save_pending(&error));
    }
    EXPECT_TRUE(running.has_pending());
    EXPECT_EQ(focal_length(running.find({})), 2000);
    EXPECT_EQ(files(), before);
    expect_stored(1000, 3);
    EXPECT_TRUE(running.save_pending(&error));
    EXPECT_FALSE(running.has_pending());
    expect_stored(2000, static_cast<std::size_t>(landmarks));
  }
}

TEST_F(CalibrationStoreTest, AFullDiskAfterTheMapLeavesNoMapBehind) {
  put(some(1000));
  const std::set<std::string> before = files();
  CalibrationStore running = store();
  static_cast<void>(running.load(kWidth, kHeight));
  StoredCalibration wordy = some(2000);
  wordy.notes.quality.emplace();
  wordy.notes.excluded.assign(100, std::string(100, 'x'));
  std::string error;
  {
    // Room for a map of three landmarks, not for ten thousand characters.
    const FullDisk full(5000);
    EXPECT_FALSE(running.save(wordy, &error));
    EXPECT_THAT(error, StartsWith(path()));
  }
  EXPECT_EQ(files(), before);
  expect_stored(1000, 3);
  EXPECT_TRUE(running.save_pending(&error)) << error;
  expect_stored(2000, 3);
}

TEST_F(CalibrationStoreTest, AFolderThatCannotBeWrittenLosesNothing) {
  put(some(1000));
  CalibrationStore running = store();
  static_cast<void>(running.load(kWidth, kHeight));
  std::string error;
  {
    const Forbidden forbidden(directory_.path(), kNoWriting);
    EXPECT_FALSE(running.save(some(2000), &error));
    EXPECT_THAT(error, HasSubstr("Permission denied"));
    EXPECT_FALSE(running.save(some(3000, 30), &error));
    expect_stored(1000, 3);
  }
  EXPECT_TRUE(running.has_pending());
  EXPECT_EQ(running.find(30)->path, "");
  EXPECT_TRUE(running.save_pending(&error)) << error;
  expect_stored(2000, 3);
  expect_stored(3000, 3, 30);
  EXPECT_EQ(running.find(30)->path, path("calibration.zoom-30.yaml"));
}

TEST_F(CalibrationStoreTest, AFileWhereTheFolderShouldBeIsSaid) {
  directory_.write("occupied", "");
  CalibrationStore running(path("occupied/calibration.yaml"));
  EXPECT_THAT(running.load(kWidth, kHeight),
              ElementsAre(path("occupied") + ": cannot be read: Not a directory"));
  std::string error;
  EXPECT_FALSE(running.save(some(1000), &error));
  EXPECT_THAT(error, StartsWith(path("occupied") + ": "));
  EXPECT_TRUE(running.has_pending());
  fs::remove(path("occupied"));
  EXPECT_TRUE(running.save_pending(&error)) << error;
}

TEST_F(CalibrationStoreTest, ADamagedFileInAFolderThatCannotBeWrittenIsSaidAndNotUsed) {
  directory_.write("calibration.yaml", "damaged");
  CalibrationStore running = store();
  {
    const Forbidden forbidden(directory_.path(), kNoWriting);
    EXPECT_THAT(running.load(kWidth, kHeight),
                ElementsAre(HasSubstr("not used; cannot be set aside: Permission denied")));
  }
  EXPECT_EQ(running.find({}), nullptr);
}

TEST_F(CalibrationStoreTest, AFolderThatCannotBeReadIsSaid) {
  put(some(1000));
  CalibrationStore running = store();
  const Forbidden forbidden(directory_.path(), kNoReading);
  EXPECT_THAT(running.load(kWidth, kHeight),
              ElementsAre(directory_.path() + ": cannot be read: Permission denied",
                          HasSubstr("3 landmarks")));
  EXPECT_EQ(focal_length(running.find({})), 1000);
}

TEST_F(CalibrationStoreTest, AMapThatMakesNoSenseIsLeftOutAndSaid) {
  StoredCalibration spoilt = some(1000);
  spoilt.map.landmarks[1].d.setZero();
  CalibrationStore running = store();
  std::string error;
  EXPECT_FALSE(running.save(spoilt, &error));
  EXPECT_THAT(error, AllOf(HasSubstr("landmark 1"), HasSubstr("unit vector")));
  // Another try would end alike.
  EXPECT_FALSE(running.has_pending());
  expect_stored(1000, 0);
}

}  // namespace
}  // namespace alidade
