// scene.map after a power cut: its process killed at random moments, files cut off, bits flipped. What opens is as one of the
// transactions left it, to the bit; after a kill none that was acknowledged is missing.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <random>
#include <set>
#include <thread>

#include "edge_app/storage/scene_map_file.h"
#include "test/edge_app/storage/changing_scene_map.h"
#include "test/support/temporary_directory.h"

namespace alidade::test {
namespace {

// Changes the map until it is killed; says each revision that is on disk.
[[noreturn]] void change_until_killed(const std::string& path, int acknowledged) {
  SceneMapFile file;
  SceneMap map;
  std::string error;
  if (!file.open(path, &error) || !file.read(&map, &error, true)) ::_exit(1);
  for (;;) {
    const MapChange change = change_of(map, static_cast<int>(file.revision()));
    if (!file.update(change, &error) || !apply(change, &map, &error)) ::_exit(2);
    const std::int64_t revision = file.revision();
    if (::write(acknowledged, &revision, sizeof revision) != sizeof revision) ::_exit(3);
  }
}

// Kills it so many times, one after the other on the same map.
void kill_writers(int times) {
  const TemporaryDirectory directory;
  const std::string path = directory.path() + "/scene.map";
  std::string error;
  SceneMap map = map_before_changes();
  ASSERT_TRUE(save_scene_map(path, map, &error)) << error;
  std::int64_t revision = 1;
  std::mt19937_64 random(4);
  int while_changing = 0;
  for (int i = 0; i < times; ++i) {
    int ends[2] = {-1, -1};
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) change_until_killed(path, ends[1]);
    ::close(ends[1]);
    // Not before the first acknowledgement: starting would be most of what is hit. Then at any moment of several changes.
    std::int64_t acknowledged = revision, said = 0;
    if (::read(ends[0], &said, sizeof said) == sizeof said) acknowledged = said;
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 20000));
    ::kill(child, SIGKILL);
    while (::read(ends[0], &said, sizeof said) == sizeof said) acknowledged = said;
    ::close(ends[0]);
    int status = 0;
    ::waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status)) << "it ended by itself: " << WEXITSTATUS(status);
    while_changing += std::filesystem::exists(path + "-wal") ? 1 : 0;

    SceneMapFile file;
    SceneMap found;
    ASSERT_TRUE(file.open(path, &error) && file.read(&found, &error, true)) << i << ": " << error;
    ASSERT_GE(file.revision(), acknowledged) << i;
    ASSERT_LE(file.revision(), acknowledged + 1) << i;
    for (; revision < file.revision(); ++revision) {
      ASSERT_TRUE(apply(change_of(map, static_cast<int>(revision)), &map, &error)) << error;
    }
    ASSERT_TRUE(bytes_of(found) == bytes_of(map)) << i << ", revision " << revision;
  }
  EXPECT_GT(while_changing, times / 2);
  std::printf("%d kills, %d transactions\n", times, static_cast<int>(revision - 1));
}

TEST(SceneMapPowerCut, TenKilledWritersLoseNothing) { kill_writers(10); }
TEST(SceneMapPowerCut, TwoHundredKilledWritersLoseNothing) { kill_writers(200); }

// A map with a log of several transactions, as a process that was killed leaves it.
class TornSceneMap : public ::testing::Test {
 protected:
  void SetUp() override {
    SceneMap map = map_before_changes();
    states_.insert(bytes_of(map));
    ASSERT_TRUE(save_scene_map(path_, map, &error_)) << error_;
    SceneMapFile file;
    ASSERT_TRUE(file.open(path_, &error_)) << error_;
    for (int step = 1; step <= 6; ++step) {
      const MapChange change = change_of(map, step);
      ASSERT_TRUE(file.update(change, &error_) && apply(change, &map, &error_)) << error_;
      states_.insert(bytes_of(map));
    }
    last_ = bytes_of(map);
    main_ = directory_.read("scene.map");
    log_ = directory_.read("scene.map-wal");
    ASSERT_GT(log_.size(), 20000U);
  }

  // Lays these files down, and says what comes of it: the bytes of a map; "" where it is refused.
  std::string loaded(const std::string& main, const std::string& log) {
    std::filesystem::remove(path_ + "-shm");
    directory_.write("torn.map", main);
    std::filesystem::remove(directory_.path() + "/torn.map-wal");
    if (!log.empty()) directory_.write("torn.map-wal", log);
    SceneMap map;
    const bool read = load_scene_map(directory_.path() + "/torn.map", &map, &error_, true);
    EXPECT_TRUE(read || error_.find('\n') == std::string::npos);
    return read ? bytes_of(map) : "";
  }
  [[nodiscard]] bool is_a_state(const std::string& bytes) const {
    return states_.count(bytes) == 1;
  }

  TemporaryDirectory directory_;
  std::string path_ = directory_.path() + "/scene.map";
  std::string error_, main_, log_, last_;
  std::set<std::string> states_;
  std::mt19937_64 random_{8};
};

TEST_F(TornSceneMap, IsWholeWithItsLog) { EXPECT_TRUE(loaded(main_, log_) == last_); }

TEST_F(TornSceneMap, WithALogThatIsCutOffItIsAsATransactionLeftIt) {
  std::set<std::string> seen;
  for (int i = 0; i < 50; ++i) {
    const std::string found = loaded(main_, log_.substr(0, random_() % log_.size()));
    EXPECT_TRUE(is_a_state(found)) << i << ": " << error_;
    seen.insert(found);
  }
  EXPECT_EQ(seen.size(), states_.size() - 1) << "the last one has its end in the log's last frame";
}

TEST_F(TornSceneMap, CutOffItIsRefused) {
  int refused = 0;
  for (int i = 0; i < 150; ++i) {
    const std::string found = loaded(main_.substr(0, random_() % main_.size()), "");
    refused += found.empty() ? 1 : 0;
    EXPECT_TRUE(found.empty() || is_a_state(found)) << i;
  }
  EXPECT_EQ(refused, 150);
}

TEST_F(TornSceneMap, AFlippedBitIsNeverTakenForAValue) {
  // Without a log, so that the main file's pages are read.
  int refused = 0;
  for (int i = 0; i < 400; ++i) {
    std::string torn = main_;
    torn[random_() % torn.size()] ^= static_cast<char>(1U << (random_() % 8));
    const std::string found = loaded(torn, "");
    refused += found.empty() ? 1 : 0;
    EXPECT_TRUE(found.empty() || is_a_state(found)) << i;
  }
  // What is free in a page may be anything: half of a file of so few rows.
  EXPECT_GT(refused, 100);
}

TEST_F(TornSceneMap, AFlippedBitInTheLogGivesAnEarlierTransaction) {
  for (int i = 0; i < 50; ++i) {
    std::string torn = log_;
    torn[random_() % torn.size()] ^= static_cast<char>(1U << (random_() % 8));
    const std::string found = loaded(main_, torn);
    EXPECT_TRUE(found.empty() || is_a_state(found)) << i;
  }
}

TEST_F(TornSceneMap, PagesThatAreLostOrOldAreRefused) {
  constexpr std::size_t kPage = 4096;
  // The file with all that is in its log, and the one before.
  ASSERT_TRUE(loaded(main_, log_) == last_);
  const std::string after = directory_.read("torn.map");
  for (std::size_t at = 0; at < std::min(main_.size(), after.size()); at += kPage) {
    std::string zeroed = after, old = after;
    zeroed.replace(at, kPage, kPage, '\0');
    old.replace(at, kPage, main_, at, kPage);
    for (const std::string& torn : {zeroed, old}) {
      const std::string found = loaded(torn, "");
      EXPECT_TRUE(found.empty() || is_a_state(found)) << at / kPage;
    }
  }
}

}  // namespace
}  // namespace alidade::test
