// A verification beside `run`: what becomes of each way in which the process may end. A script takes
// its place.

#include "edge_app/commands/recording_verifier.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <string>

#include "test/platform/support/eventually.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using State = RecordingVerification::State;
using ::testing::HasSubstr;

class RecordingVerifierTest : public ::testing::Test {
 protected:
  // The program that is started.
  std::string script(const std::string& commands) {
    directory_.write("program", "#!/bin/sh\n" + commands + "\n");
    const std::string path = directory_.path() + "/program";
    EXPECT_EQ(::chmod(path.c_str(), 0755), 0);
    return path;
  }
  RecordingVerification result_of(const std::string& program) {
    RecordingVerifier verifier(program);
    EXPECT_EQ(verifier.state().state, State::kNone);
    EXPECT_TRUE(verifier.begin("a recording"));
    EXPECT_TRUE(eventually([&] { return verifier.state().state != State::kRunning; }));
    return verifier.state();
  }

  TemporaryDirectory directory_;
};

TEST_F(RecordingVerifierTest, TellsWhatTheProgramFound) {
  // More on stderr than a pipe holds; the verdict's exit code is not an error.
  const RecordingVerification result = result_of(
      script("[ \"$1 $2 $3\" = 'verify a recording --json' ] || exit 2\n"
             "i=0; while [ $i -lt 3000 ]; do echo 'a line that fills the pipe, forty bytes' >&2; "
             "i=$((i+1)); done\n"
             "echo '{\"verdict\": \"contradicted\", \"sentence\": \"contradicted: by 2\",'\n"
             "echo ' \"files\": {\"report\": \"x/verification.html\"}}'\n"
             "exit 1"));
  EXPECT_EQ(result.state, State::kDone);
  EXPECT_EQ(result.recording, "a recording");
  EXPECT_EQ(result.verdict, "contradicted");
  EXPECT_EQ(result.sentence, "contradicted: by 2");
  EXPECT_EQ(result.report, "x/verification.html");
  EXPECT_EQ(result.error, "");
}

TEST_F(RecordingVerifierTest, TellsWhyNothingWasJudged) {
  EXPECT_EQ(
      result_of(script("echo 'first' >&2; echo 'alidade: no calibration.yaml' >&2; exit 2")).error,
      "no calibration.yaml");
  EXPECT_EQ(result_of(script("exit 2")).error, "it said nothing");
  EXPECT_EQ(result_of(script("echo '{\"verdict\": 3'")).state, State::kFailed);
  EXPECT_EQ(result_of(script("echo '[]'")).state, State::kFailed);
  EXPECT_EQ(result_of(script("echo '{\"verdict\": 3, \"sentence\": 4}'")).state, State::kFailed);
  EXPECT_THAT(result_of(script("kill -SEGV $$")).error, HasSubstr("it crashed: "));
  EXPECT_THAT(result_of(directory_.path() + "/none").error, HasSubstr("none"));
}

TEST_F(RecordingVerifierTest, RunsOneAtATimeAndEndsItWithTheProgram) {
  const std::string program = script("echo $$ > " + directory_.path() + "/id; exec sleep 600");
  {
    RecordingVerifier verifier(program);
    ASSERT_TRUE(verifier.begin("a recording"));
    EXPECT_FALSE(verifier.begin("another"));
    EXPECT_EQ(verifier.state().recording, "a recording");
  }  // without waiting for ten minutes
}

}  // namespace
}  // namespace alidade
