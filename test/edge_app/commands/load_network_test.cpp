// What `run` and `check` say of a network that they cannot use.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "edge_app/commands/command.h"
#include "edge_app/commands/live_targets.h"
#include "edge_app/tracking/detected_frame.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// test/data/make_networks.py says what they answer.
std::string cells(const std::string& kind) {
  return std::string(ALIDADE_TEST_DATA) + "/bright_cells_" + kind + ".onnx";
}

NetworkFiles network_of(const std::string& model, const std::string& labels = "") {
  NetworkFiles files;
  files.model = model;
  files.labels = labels;
  files.options.width_px = files.options.height_px = 64;
  return files;
}

// The one line that it ends with.
std::string refusal_of(const NetworkFiles& files) {
  try {
    static_cast<void>(load_network(files));
  } catch (const CommandError& error) {
    EXPECT_EQ(error.exit_code, kExitUsage);
    return error.what();
  }
  ADD_FAILURE() << files.model << " is taken";
  return "";
}

TEST(LoadNetwork, NoneIsAskedForOrOneIsThereWithItsClasses) {
  EXPECT_FALSE(load_network(std::nullopt));
  const TemporaryDirectory directory;
  const std::string longest(kLongestClass, 'x');
  const auto network = load_network(
      network_of(cells("v8"), directory.write("labels.txt", "bright\r\n\n" + longest)));
  ASSERT_TRUE(network);
  EXPECT_EQ(network->classes(), 2);
}

// What a network itself is wrong in: network_detector_test.cpp.
TEST(LoadNetwork, SaysInOneLineWhichFileIsWrongAndWhatWouldBeRight) {
  const TemporaryDirectory directory;
  const std::string text = directory.write("text.onnx", "nothing of the kind\nnor here\n");
  const std::string absent = directory.path() + "/absent";
  int written = 0;
  const auto labels = [&](const std::string& lines) {
    const std::string name = std::to_string(++written) + "_labels.txt";
    return network_of(cells("v8"), directory.write(name, lines));
  };
  const std::string too_long(kLongestClass + 1, 'x');
  const struct {
    NetworkFiles files;
    std::string file, saying;
  } slips[] = {
      {network_of(absent), absent, "No such file"},
      {network_of(directory.path()), directory.path(), "cannot be read: not a file, but a folder"},
      {network_of(text), text,
       "is not an ONNX network that OpenCV can read; export it with opset 12"},
      {network_of(cells("v8"), absent), absent, "No such file"},
      {labels("\n\n"), "labels.txt", "is empty; expected the classes' names, one a line"},
      {labels("a\n\n" + too_long + "\n"), "labels.txt:3",
       "is not a class name (33 bytes); expected text of at most 32 bytes, without control"},
      {labels("a\n\tb\n"), "labels.txt:2", "is not a class name"},
  };
  for (const auto& slip : slips) {
    const std::string line = refusal_of(slip.files);
    EXPECT_THAT(line, StartsWith("detectors.onnx: "));
    EXPECT_THAT(line, HasSubstr(slip.file + ": "));
    EXPECT_THAT(line, HasSubstr(slip.saying));
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace alidade
