#include "edge_app/commands/recording_verifier.h"

#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/wait.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "edge_app/commands/child_process.h"
#include "platform/system/realtime.h"

namespace alidade {
namespace {

constexpr double kLongest_s = 1800;
constexpr std::size_t kMostBytes = 4U << 20U;  // of either stream; its JSON has some hundred KB

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
  ChildCommand command;
  command.program = program;
  command.arguments = {"alidade", "verify", recording, "--json"};
  command.longest_s = kLongest_s;
  command.ends = ends;
  command.most_bytes = kMostBytes;
  const ChildResult child = run_child(command);
  const nlohmann::json told = nlohmann::json::parse(child.out, nullptr, false);
  const auto text = [](const nlohmann::json& object, const char* key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  if (!child.not_started.empty()) {
    result.error = child.not_started;
  } else if (!child.has_ended) {
    result.error = "it took too long, or was ended";
  } else if (WIFSIGNALED(child.status)) {
    result.error = std::string("it crashed: ") + ::strsignal(WTERMSIG(child.status));
  } else if (told.is_object() && !text(told, "sentence").empty()) {
    result.state = RecordingVerification::State::kDone;
    result.verdict = text(told, "verdict");
    result.sentence = text(told, "sentence");
    const auto files = told.find("files");
    if (files != told.end() && files->is_object()) result.report = text(*files, "report");
  } else {
    result.error = reason_in(child.errors);
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
