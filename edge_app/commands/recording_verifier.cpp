#include "edge_app/commands/recording_verifier.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "platform/system/clock.h"
#include "platform/system/realtime.h"

namespace alidade {
namespace {

constexpr double kLongest_s = 1800;
constexpr std::size_t kMostBytes = 4U << 20U;  // of either stream; its JSON has some hundred KB

struct Child {
  pid_t process = -1;
  FileDescriptor out, errors;
};

// process stays -1 if it cannot be started; then *error is one line.
Child start(const std::string& program, const std::string& recording, std::string* error) {
  Child child;
  std::array<int, 2> out = {-1, -1};
  std::array<int, 2> errors = {-1, -1};
  if (::pipe2(out.data(), O_CLOEXEC) != 0) {
    *error = std::string("no pipe: ") + std::strerror(errno);
    return child;
  }
  child.out.reset(out[0]);
  const FileDescriptor out_end(out[1]);
  if (::pipe2(errors.data(), O_CLOEXEC) != 0) {
    *error = std::string("no pipe: ") + std::strerror(errno);
    return child;
  }
  child.errors.reset(errors[0]);
  const FileDescriptor errors_end(errors[1]);
  posix_spawn_file_actions_t actions;
  if (::posix_spawn_file_actions_init(&actions) != 0) {
    *error = "no memory for a process";
    return child;
  }
  static_cast<void>(
      ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0));
  static_cast<void>(::posix_spawn_file_actions_adddup2(&actions, out_end.get(), STDOUT_FILENO));
  static_cast<void>(::posix_spawn_file_actions_adddup2(&actions, errors_end.get(), STDERR_FILENO));
  std::string name = "alidade";
  std::string command = "verify";
  std::string directory = recording;
  std::string json = "--json";
  std::array<char*, 5> arguments = {name.data(), command.data(), directory.data(), json.data(),
                                    nullptr};
  const int failed = ::posix_spawn(&child.process, program.c_str(), &actions, nullptr,
                                   arguments.data(), ::environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) {
    child.process = -1;
    *error = program + ": cannot be started: " + std::strerror(failed);
  }
  return child;
}

// Reads both streams to their end. False: it took too long, or `ends` became readable.
bool hear(const Child& child, int ends, std::string* out, std::string* errors) {
  const double end_s = monotonic_now_s() + kLongest_s;
  std::array<pollfd, 3> polled = {
      {{child.out.get(), POLLIN, 0}, {child.errors.get(), POLLIN, 0}, {ends, POLLIN, 0}}};
  while (polled[0].fd >= 0 || polled[1].fd >= 0) {
    const double left_s = end_s - monotonic_now_s();
    if (left_s <= 0) return false;
    if (::poll(polled.data(), polled.size(), static_cast<int>(left_s * 1000) + 1) <= 0) continue;
    if (polled[2].revents != 0) return false;
    for (const auto& [at, text] : {std::pair{0U, out}, std::pair{1U, errors}}) {
      if (polled[at].fd < 0 || polled[at].revents == 0) continue;
      std::array<char, 4096> piece{};
      const ssize_t n = ::read(polled[at].fd, piece.data(), piece.size());
      if (n > 0 && text->size() < kMostBytes)
        text->append(piece.data(), static_cast<std::size_t>(n));
      if (n == 0 || (n < 0 && errno != EINTR)) polled[at].fd = -1;
    }
  }
  return true;
}

// The last line, without the program's name.
std::string reason_in(const std::string& errors) {
  const std::size_t end = errors.find_last_not_of('\n');
  if (end == std::string::npos) return "it said nothing";
  const std::size_t before = errors.find_last_of('\n', end);
  const std::size_t begin = before == std::string::npos ? 0 : before + 1;
  const std::string line = errors.substr(begin, end + 1 - begin);
  const std::string name = "alidade: ";
  return line.rfind(name, 0) == 0 ? line.substr(name.size()) : line;
}

RecordingVerification verify(const std::string& program, const std::string& recording, int ends) {
  RecordingVerification result;
  result.recording = recording;
  result.state = RecordingVerification::State::kFailed;
  const Child child = start(program, recording, &result.error);
  if (child.process < 0) return result;
  std::string out;
  std::string errors;
  const bool has_ended = hear(child, ends, &out, &errors);
  if (!has_ended) ::kill(child.process, SIGKILL);
  int status = 0;
  while (::waitpid(child.process, &status, 0) < 0 && errno == EINTR) {
  }
  const nlohmann::json told = nlohmann::json::parse(out, nullptr, false);
  const auto text = [](const nlohmann::json& object, const char* key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  if (!has_ended) {
    result.error = "it took too long, or was ended";
  } else if (WIFSIGNALED(status)) {
    result.error = std::string("it crashed: ") + ::strsignal(WTERMSIG(status));
  } else if (told.is_object() && !text(told, "sentence").empty()) {
    result.state = RecordingVerification::State::kDone;
    result.verdict = text(told, "verdict");
    result.sentence = text(told, "sentence");
    const auto files = told.find("files");
    if (files != told.end() && files->is_object()) result.report = text(*files, "report");
  } else {
    result.error = reason_in(errors);
  }
  return result;
}

}  // namespace

RecordingVerifier::RecordingVerifier(std::string program)
    : program_(std::move(program)), ends_(::eventfd(0, EFD_CLOEXEC)) {
  if (!ends_.is_open()) throw std::system_error(errno, std::generic_category(), "eventfd");
}

RecordingVerifier::~RecordingVerifier() {
  static_cast<void>(::eventfd_write(ends_.get(), 1));
  if (thread_.joinable()) thread_.join();
}

bool RecordingVerifier::begin(const std::string& recording) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (state_.state == RecordingVerification::State::kRunning) return false;
  if (thread_.joinable()) thread_.join();  // it has done its last: the state
  state_ = {};
  state_.state = RecordingVerification::State::kRunning;
  state_.recording = recording;
  thread_ = std::thread(&RecordingVerifier::run, this, recording);
  return true;
}

RecordingVerification RecordingVerifier::state() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return state_;
}

void RecordingVerifier::run(std::string recording) {
  // The process inherits it. What is refused was said by the calibration thread.
  static_cast<void>(set_lowest_priority());
  RecordingVerification result = verify(program_, recording, ends_.get());
  spdlog::info("verification: {}: {}", recording,
               result.error.empty() ? result.sentence : result.error);
  const std::lock_guard<std::mutex> lock(mutex_);
  state_ = std::move(result);
}

}  // namespace alidade
