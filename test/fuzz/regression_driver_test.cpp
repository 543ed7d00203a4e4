// The driver bites: it finds a planted defect (planted_defect_fuzz.cpp) in a file and among its mutations,
// names the input, keeps it, and takes no folder without files for a pass.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "test/support/process.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// The program works in a directory of its own: it leaves files there.
class RegressionDriver : public ::testing::Test {
 protected:
  RegressionDriver() { std::filesystem::current_path(directory_.path()); }
  ~RegressionDriver() override { std::filesystem::current_path(before_); }

  int run(const std::vector<std::string>& arguments) {
    std::vector<std::string> command{FUZZ_REGRESSIONS, "planted_defect"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    Process process(command);
    output_ = process.read_all();
    const int code = process.wait();
    errors_ = process.errors();
    return code;
  }

  std::filesystem::path before_ = std::filesystem::current_path();
  TemporaryDirectory directory_;
  std::string output_;
  std::string errors_;
};

TEST_F(RegressionDriver, PassesWhatDoesNotFail) {
  directory_.write("corpus/harmless", "other");
  directory_.write("corpus/empty", "");
  EXPECT_EQ(run({"--mutations=50", "corpus"}), 0) << errors_;
  EXPECT_EQ(output_, "planted_defect: 2 files and 50 mutations of them\n");
}

TEST_F(RegressionDriver, FindsAFileThatFails) {
  directory_.write("corpus/harmless", "other");
  directory_.write("regressions/defect", "bad and more");
  EXPECT_EQ(run({"--mutations=0", "corpus", "regressions"}), 1);
  EXPECT_THAT(errors_, HasSubstr("signal 6 at regressions/defect, kept as crash-"));
  EXPECT_EQ(directory_.read("crash-planted_defect"), "bad and more");
}

TEST_F(RegressionDriver, FindsAMutationThatFailsTheSameOneEachTime) {
  directory_.write("corpus/near", "bid");
  EXPECT_EQ(run({"--mutations=2000", "corpus"}), 1);
  EXPECT_THAT(errors_, HasSubstr("signal 6 at mutation "));
  EXPECT_THAT(errors_, HasSubstr("of corpus/near"));
  EXPECT_THAT(directory_.read("crash-planted_defect"), StartsWith("bad"));
  const std::string first = errors_;
  EXPECT_EQ(run({"--mutations=2000", "corpus"}), 1);
  EXPECT_EQ(errors_, first);
}

TEST_F(RegressionDriver, FindsNothingToRunWrong) {
  directory_.write("corpus/README.md", "no input");
  EXPECT_EQ(run({"corpus"}), 2);
  EXPECT_THAT(errors_, HasSubstr("no input"));
  EXPECT_NE(run({"no-such-folder"}), 0);
}

}  // namespace
}  // namespace alidade
