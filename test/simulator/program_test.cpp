// The program alidade-simulate as its users meet it: command line, real sockets, signals.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <httplib.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "test/simulator/parallel.h"
#include "test/simulator/servers/av_client.h"
#include "test/simulator/servers/simulated_head.h"
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

  // Empty at the end. How far a long work is, a slow machine may say.
  std::string read_line() {
    std::string line;
    do {
      line.clear();
      for (int c = std::fgetc(output_); c != EOF && c != '\n'; c = std::fgetc(output_)) {
        line += static_cast<char>(c);
      }
    } while (line.find("rendering frame ") != std::string::npos);
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

TEST(VirtualCameraProgram, SaysEachFiveSecondsHowFarItsLongWorkIs) {
  std::FILE* const log = std::tmpfile();
  ASSERT_NE(log, nullptr);
  double now_s = 100;
  simulator::Progress progress("rendering frame", 900, log, [&now_s] { return now_s; });
  for (std::size_t done = 30; done <= 900; done += 30) {
    now_s += 1;
    progress.show(done);
  }
  std::rewind(log);
  std::string text(2000, ' ');
  text.resize(std::fread(text.data(), 1, text.size(), log));
  std::fclose(log);
  EXPECT_THAT(text, testing::StartsWith("alidade-simulate: rendering frame 150/900, 25 s left \n"));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 6);
  // What is done at once says nothing.
  std::FILE* const quick = std::tmpfile();
  ASSERT_NE(quick, nullptr);
  simulator::Progress("rendering frame", 9, quick, [] { return 0.0; }).show(9);
  EXPECT_EQ(std::ftell(quick), 0);
  std::fclose(quick);
}

TEST(VirtualCameraProgram, PrintsItsVersionAndItsHelp) {
  Child version({"--version"});
  EXPECT_THAT(version.read_line(), HasSubstr("alidade-simulate "));
  EXPECT_EQ(version.exit_code(), 0);
  Child help({"--help"});
  EXPECT_EQ(help.exit_code(), 0);
}

TEST(VirtualCameraProgram, ExplainsBadUsageAndBadConfigurationWithExitCodeTwo) {
  Child no_config({});
  EXPECT_THAT(no_config.read_line(), HasSubstr("give -c FILE, or --example zoom"));
  EXPECT_EQ(no_config.read_line(), "");
  EXPECT_EQ(no_config.exit_code(), 2);
  Child unknown_example({"--example", "mountain"});
  EXPECT_THAT(unknown_example.read_line(), HasSubstr("cheap_dome"));
  EXPECT_EQ(unknown_example.exit_code(), 2);
  Child no_size({"--example", "zoom", "--size", "480"});
  EXPECT_THAT(no_size.read_line(), HasSubstr("'480' is no size; expected WIDTHxHEIGHT"));
  EXPECT_EQ(no_size.exit_code(), 2);
  const TemporaryDirectory directory;
  Child unknown_key({"-c", directory.write("a.yaml", "seed: 1\nsead: 2\n")});
  EXPECT_THAT(unknown_key.read_line(), HasSubstr("a.yaml:2: unknown key 'sead'"));
  EXPECT_EQ(unknown_key.read_line(), "");
  EXPECT_EQ(unknown_key.exit_code(), 2);
  Child early({"-c", directory.write("b.yaml", "camera: {clock_offset_ms: 5}\nduration_s: 1\n")});
  EXPECT_THAT(early.read_line(), HasSubstr("cannot arrive before it is captured"));
  EXPECT_EQ(early.exit_code(), 2);
  // Said before it draws, which takes minutes.
  std::string odd_size = kStillCamera;
  odd_size.replace(odd_size.find("160"), 3, "162");
  Child odd({"-c", directory.write("c.yaml", odd_size)});
  EXPECT_THAT(odd.read_line(), HasSubstr("JPEG only in multiples of 8 up to 2040, not 162x120"));
  EXPECT_EQ(odd.exit_code(), 2);
}

// Whoever makes the pictures smaller need not know what RTP carries.
TEST(VirtualCameraProgram, ServesAnySizeThatIsAskedFor) {
  const TemporaryDirectory directory;
  Child child(
      {"-c", directory.write("camera.yaml", kStillCamera), "--size", "82x62", "--duration", "1"});
  EXPECT_THAT(child.read_line(), HasSubstr("ready"));
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

// The zoom of an answer to a query of a head at the far end of a TCP connection.
std::string answer_of_head(const std::string& address, const std::string& query, std::size_t size) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port =
      htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
  std::string answer;
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0 &&
      ::send(fd, query.data(), query.size(), MSG_NOSIGNAL) > 0) {
    answer.resize(size);
    const ssize_t count = ::recv(fd, answer.data(), size, MSG_WAITALL);
    answer.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  }
  ::close(fd);
  return answer;
}

// Half way from wide to tele, in whole steps of 20: each protocol has its own units.
TEST(VirtualCameraProgram, TellsItsZoomByEveryProtocolThatHasOne) {
  const std::string zooming =
      "image: {width: 160, height: 120, rate_hz: 25}\n"
      "path: {amplitude: 0, period_s: 0.4}\ntruth_dir: truth\n"
      "zoom: {reading: {wide: 0, tele: 1000, step: 20}, path: {zoom: 507}}\n";
  struct Head {
    const char* name;
    std::string query, answer;
  };
  using namespace std::string_literals;
  // 0.5 of 0x4000 and of 0xFFFF, rounded.
  const std::vector<Head> heads{
      {"visca", "\x81\x09\x04\x47\xFF"s, "\x90\x50\x02\x00\x00\x00\xFF"s},
      {"pelco_d", "\xFF\x01\x00\x55\x00\x00\x56"s, "\xFF\x01\x00\x5D\x80\x00\xDE"s}};
  for (const HeadModel& model : kHeadModels) {
    const bool is_tried = std::any_of(heads.begin(), heads.end(), [&](const Head& head) {
      return std::string(model.name) == head.name;
    });
    EXPECT_EQ(is_tried, model.tele_zoom != 0) << model.name;
  }
  for (const Head& head : heads) {
    const TemporaryDirectory directory;
    Child child(
        {"-c", directory.write("a.yaml", zooming + "live: {onvif_port: 0, head_link: tcp, head: " +
                                             head.name + "}\n")});
    std::stringstream ready(child.read_line());
    std::vector<std::string> words;
    for (std::string word; ready >> word;) words.push_back(word);
    ASSERT_EQ(words.size(), 5U) << ready.str();
    EXPECT_EQ(answer_of_head(words[4], head.query, head.answer.size()), head.answer) << head.name;
    httplib::Client vapix(words[2]);
    const auto position = vapix.Get("/axis-cgi/com/ptz.cgi?query=position");
    ASSERT_TRUE(position);
    EXPECT_THAT(position->body, HasSubstr("zoom=500\r\n"));
    httplib::Client onvif(words[3].substr(std::string("onvif=").size()));
    const auto status =
        onvif.Post("/onvif/ptz", "<Body><GetStatus></GetStatus></Body>", "text/xml");
    ASSERT_TRUE(status);
    EXPECT_THAT(status->body, HasSubstr("Zoom x=\"0.5\""));
    child.signal(SIGTERM);
    EXPECT_EQ(child.exit_code(), 0);
    EXPECT_THAT(directory.read("truth/truth.csv"), HasSubstr("focal_length_px"));
  }
}

// Drawn anew by each movement it never repeats; else it does when path and zoom do.
TEST(VirtualCameraProgram, AZoomThatNeverRepeatsNeedsADuration) {
  const TemporaryDirectory directory;
  const auto zooming = [&](const std::string& keys) {
    return directory.write(
        "a.yaml",
        "image: {width: 32, height: 16, rate_hz: 5}\npath: {amplitude: 0, period_s: 2}\n"
        "zoom: {" +
            keys + "path: {type: sweep, factor: 1.2, sweep_s: 1, stop_s: 0.5}}\n");
  };
  Child endless({"-c", zooming("sigma_rep: 0.001, ")});
  EXPECT_THAT(endless.read_line(), HasSubstr("duration_s is missing"));
  EXPECT_EQ(endless.exit_code(), 2);
  Child repeating({"-c", zooming("backlash: 0.001, ")});
  EXPECT_THAT(repeating.read_line(), HasSubstr("ready rtsp://"));
  repeating.signal(SIGTERM);
  EXPECT_EQ(repeating.exit_code(), 0);
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
