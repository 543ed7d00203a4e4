// The program alidade-simulate as its users meet it: command line, real sockets, signals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <httplib.h>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <set>
#include <sstream>

#include "test/simulator/servers/av_client.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using testing::HasSubstr;

// A child process; its stdout and stderr come through one pipe.
class Child {
 public:
  explicit Child(const std::vector<std::string>& arguments) {
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) throw std::runtime_error("pipe");
    process_ = fork();
    if (process_ == 0) {
      dup2(ends[1], STDOUT_FILENO);
      dup2(ends[1], STDERR_FILENO);
      std::vector<char*> pointers{const_cast<char*>(ALIDADE_SIMULATE)};
      for (const std::string& argument : arguments) {
        pointers.push_back(const_cast<char*>(argument.c_str()));
      }
      pointers.push_back(nullptr);
      execv(ALIDADE_SIMULATE, pointers.data());
      _exit(127);
    }
    close(ends[1]);
    output_ = fdopen(ends[0], "r");
  }
  ~Child() {
    if (process_ > 0) {
      kill(process_, SIGKILL);
      waitpid(process_, nullptr, 0);
    }
    std::fclose(output_);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  // Empty at the end.
  std::string read_line() {
    std::string line;
    for (int c = std::fgetc(output_); c != EOF && c != '\n'; c = std::fgetc(output_)) {
      line += static_cast<char>(c);
    }
    return line;
  }
  void signal(int number) const { kill(process_, number); }
  int exit_code() {
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t process_;
  std::FILE* output_;
};

constexpr const char* kStillCamera =
    "image: {width: 160, height: 120, rate_hz: 25}\n"
    "camera: {focal_length_px: 1000, clock_offset_ms: -50, pan_scale: 1.5}\n"
    "path: {amplitude: 0, pan_deg: 12, tilt_deg: -3}\n"
    "truth_dir: truth\n";

TEST(VirtualCameraProgram, PrintsItsVersionAndItsHelp) {
  Child version({"--version"});
  EXPECT_THAT(version.read_line(), HasSubstr("alidade-simulate "));
  EXPECT_EQ(version.exit_code(), 0);
  Child help({"--help"});
  EXPECT_EQ(help.exit_code(), 0);
}

TEST(VirtualCameraProgram, ExplainsBadUsageAndBadConfigurationWithExitCodeTwo) {
  Child no_config({});
  EXPECT_THAT(no_config.read_line(), HasSubstr("--config is required"));
  EXPECT_EQ(no_config.read_line(), "");
  EXPECT_EQ(no_config.exit_code(), 2);
  const TemporaryDirectory directory;
  Child unknown_key({"-c", directory.write("a.yaml", "seed: 1\nsead: 2\n")});
  EXPECT_THAT(unknown_key.read_line(), HasSubstr("a.yaml:2: unknown key 'sead'"));
  EXPECT_EQ(unknown_key.read_line(), "");
  EXPECT_EQ(unknown_key.exit_code(), 2);
  Child early({"-c", directory.write("b.yaml", "camera: {clock_offset_ms: 5}\nduration_s: 1\n")});
  EXPECT_THAT(early.read_line(), HasSubstr("cannot arrive before it is captured"));
  EXPECT_EQ(early.exit_code(), 2);
}

TEST(VirtualCameraProgram, FailsWithExitCodeOneIfItCannotWrite) {
  const TemporaryDirectory directory;
  const std::string config =
      directory.write("a.yaml", kStillCamera + std::string("duration_s: 1\n"));
  Child child({"-c", config, "-o", directory.path()});
  EXPECT_THAT(child.read_line(), HasSubstr("is not empty"));
  EXPECT_EQ(child.exit_code(), 1);
}

TEST(VirtualCameraProgram, ServesVideoAndPanTiltWithTheTruthUntilItIsStopped) {
  for (const char* codec : {"mjpeg", "h264", "h265"}) {
    const TemporaryDirectory directory;
    Child child(
        {"-c", directory.write("camera.yaml",
                               kStillCamera + ("live: {codec: " + std::string(codec) + "}\n"))});
    std::stringstream ready(child.read_line());
    std::string word;
    std::string video_url;
    std::string http_url;
    ready >> word >> video_url >> http_url;
    ASSERT_EQ(word, "ready") << ready.str();

    httplib::Client client(http_url);
    const auto answer = client.Get("/axis-cgi/com/ptz.cgi?query=position");
    ASSERT_TRUE(answer);
    EXPECT_THAT(answer->body, HasSubstr("pan=18.0000\r\ntilt=-3.0000\r\n"));

    // Capture times as they come by RTCP; the first frames come before the first report.
    AvClient viewer;
    ASSERT_EQ(viewer.open(video_url, Transport::kTcp), 0);
    const double utc_offset = utc_minus_monotonic_s();
    std::vector<double> captures;
    while (captures.size() < 10) {
      const auto frame = viewer.read();
      ASSERT_TRUE(frame.has_value());
      if (frame->utc_s) captures.push_back(*frame->utc_s - utc_offset);
    }
    child.signal(SIGTERM);
    EXPECT_EQ(child.exit_code(), 0);

    std::ifstream truth(directory.path() + "/truth/truth.csv");
    std::string line;
    std::getline(truth, line);
    EXPECT_EQ(line, "frame,time_s,pan_rad,tilt_rad,sequence,sender_time_s,stamp_time_s");
    std::vector<double> true_captures;
    while (std::getline(truth, line)) {
      double frame = 0;
      double time = 0;
      double pan = 0;
      double tilt = 0;
      double sequence = 0;
      double sender = 0;
      double stamp = 0;
      ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf,%lf,%lf,%lf", &frame, &time, &pan, &tilt,
                            &sequence, &sender, &stamp),
                7);
      EXPECT_EQ(frame, static_cast<double>(true_captures.size()));
      EXPECT_NEAR(pan, 12 * 3.14159265358979323846 / 180, 1e-12);
      EXPECT_NEAR(stamp - time, 0.05, 1e-9);
      EXPECT_EQ(sender, time);
      true_captures.push_back(time);
    }
    ASSERT_GE(true_captures.size(), captures.size());
    for (const double capture : captures) {
      double nearest = 1;
      for (const double time : true_captures) nearest = std::min(nearest, std::abs(time - capture));
      // The two readings of the offset between the clocks, and a 90 kHz tick.
      EXPECT_LT(nearest, 2e-3) << codec;
    }
    EXPECT_TRUE(std::ifstream(directory.path() + "/truth/truth.yaml").good());
  }
}

TEST(VirtualCameraProgram, EndsByItselfAfterItsDuration) {
  const TemporaryDirectory directory;
  Child child({"-c", directory.write("a.yaml", kStillCamera + std::string("duration_s: 0.2\n"))});
  EXPECT_THAT(child.read_line(), HasSubstr("ready rtsp://127.0.0.1:"));
  EXPECT_EQ(child.exit_code(), 0);
  std::ifstream truth(directory.path() + "/truth/truth.csv");
  int lines = 0;
  for (std::string line; std::getline(truth, line);) ++lines;
  EXPECT_EQ(lines, 1 + 5);
}

// As long as it was told: a hand's motion does not repeat.
TEST(VirtualCameraProgram, ServesAPatternLiveWithItsTruth) {
  const TemporaryDirectory directory;
  const std::string small =
      "image: {width: 96, height: 64, rate_hz: 25}\ntruth_dir: truth\n"
      "camera: {line_delay_us: 80}\npattern: {kind: circles, lens: {focal_length_u_px: 90}}\n";
  EXPECT_THAT(Child({"-c", directory.write("endless.yaml", small)}).read_line(),
              HasSubstr("duration_s is missing"));
  Child child({"-c", directory.write("a.yaml", small + "duration_s: 0.2\n")});
  EXPECT_THAT(child.read_line(), HasSubstr("ready rtsp://127.0.0.1:"));
  EXPECT_EQ(child.exit_code(), 0);
  std::ifstream truth(directory.path() + "/truth/truth.csv");
  std::string line;
  std::getline(truth, line);
  EXPECT_EQ(line, "frame,time_s,x_m,y_m,z_m,q_x,q_y,q_z,q_w,sequence,stamp_time_s");
  int lines = 0;
  while (std::getline(truth, line)) ++lines;
  EXPECT_EQ(lines, 5);
  EXPECT_THAT(directory.read("truth/truth.yaml"), HasSubstr("focal_length_u: {value: 90"));
}

}  // namespace
}  // namespace alidade
