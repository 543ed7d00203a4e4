#include "edge_app/commands/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "platform/system/clock.h"
#include "platform/system/file_descriptor.h"

namespace alidade {
namespace {

struct Pipe {
  FileDescriptor read, write;

  bool open() {
    std::array<int, 2> ends = {-1, -1};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return false;
    read.reset(ends[0]);
    write.reset(ends[1]);
    return true;
  }
};

// Its number; negative with the reason in *error.
pid_t start(const ChildCommand& command, int out, int errors, std::string* error) {
  posix_spawn_file_actions_t actions;
  if (::posix_spawn_file_actions_init(&actions) != 0) {
    *error = "no memory for a process";
    return -1;
  }
  if (command.input >= 0) {
    static_cast<void>(::posix_spawn_file_actions_adddup2(&actions, command.input, STDIN_FILENO));
  } else {
    static_cast<void>(
        ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0));
  }
  static_cast<void>(::posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO));
  static_cast<void>(::posix_spawn_file_actions_adddup2(&actions, errors, STDERR_FILENO));
  std::vector<std::string> words = command.arguments;
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t process = -1;
  const int failed = ::posix_spawn(&process, command.program.c_str(), &actions, nullptr,
                                   arguments.data(), ::environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failed == 0) return process;
  *error = command.program + ": cannot be started: " + std::strerror(failed);
  return -1;
}

// Reads both streams to their end. False: it took too long, or `ends` became readable.
bool hear(const ChildCommand& command, int out, int errors, ChildResult* result) {
  const double end_s = monotonic_now_s() + command.longest_s;
  std::array<pollfd, 3> polled = {
      {{out, POLLIN, 0}, {errors, POLLIN, 0}, {command.ends, POLLIN, 0}}};
  while (polled[0].fd >= 0 || polled[1].fd >= 0) {
    const double left_s = end_s - monotonic_now_s();
    if (left_s <= 0) return false;
    if (::poll(polled.data(), polled.size(), static_cast<int>(left_s * 1000) + 1) <= 0) continue;
    if (command.ends >= 0 && polled[2].revents != 0) return false;
    for (const auto& [at, text] : {std::pair{0U, &result->out}, std::pair{1U, &result->errors}}) {
      if (polled[at].fd < 0 || polled[at].revents == 0) continue;
      std::array<char, 4096> piece{};
      const ssize_t n = ::read(polled[at].fd, piece.data(), piece.size());
      if (n > 0 && text->size() < command.most_bytes)
        text->append(piece.data(), static_cast<std::size_t>(n));
      if (n == 0 || (n < 0 && errno != EINTR)) polled[at].fd = -1;
    }
  }
  return true;
}

}  // namespace

ChildResult run_child(const ChildCommand& command) {
  ChildResult result;
  Pipe out;
  Pipe errors;
  if (!out.open() || !errors.open()) {
    result.not_started = std::string("no pipe: ") + std::strerror(errno);
    return result;
  }
  const pid_t process = start(command, out.write.get(), errors.write.get(), &result.not_started);
  out.write.reset();
  errors.write.reset();
  if (process < 0) return result;
  result.has_ended = hear(command, out.read.get(), errors.read.get(), &result);
  if (!result.has_ended) ::kill(process, SIGKILL);
  while (::waitpid(process, &result.status, 0) < 0 && errno == EINTR) {
  }
  return result;
}

}  // namespace alidade
