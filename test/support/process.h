#pragma once
// Process: a program that runs while the test talks to it: its output line by line, its errors, its
// end. Output goes through a pipe that the test may close; stderr through a file.

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include "test/support/temporary_directory.h"

namespace alidade {

class Process {
 public:
  // arguments[0] is the program's path.
  explicit Process(std::vector<std::string> arguments) {
    int ends[2] = {-1, -1};
    check(::pipe2(ends, O_CLOEXEC), "pipe2");
    const std::string errors = directory_.path() + "/stderr";
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, errors.c_str(), O_WRONLY | O_CREAT,
                                     0600);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const int error = ::posix_spawn(&pid_, argv[0], &actions, nullptr, argv.data(), ::environ);
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
    output_ = ::fdopen(ends[0], "r");
    if (error != 0) throw std::system_error(error, std::generic_category(), arguments[0]);
  }
  ~Process() {
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      static_cast<void>(wait());
    }
    close_output();
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // The next line of its output, with its line feed; empty at the end of the output.
  std::string read_line() {
    std::string line;
    for (int c = ::fgetc(output_); c != EOF; c = ::fgetc(output_)) {
      line.push_back(static_cast<char>(c));
      if (c == '\n') break;
    }
    return line;
  }
  std::string read_all() {
    std::string text;
    for (std::string line = read_line(); !line.empty(); line = read_line()) text += line;
    return text;
  }
  void close_output() {
    if (output_ != nullptr) ::fclose(output_);
    output_ = nullptr;
  }
  void send(int signal) const { ::kill(pid_, signal); }
  // Whether it has that signal wait for it to be asked for.
  [[nodiscard]] bool blocks(int signal) const {
    std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
    for (std::string line; std::getline(status, line);) {
      if (line.rfind("SigBlk:", 0) != 0) continue;
      return (std::stoull(line.substr(7), nullptr, 16) >> (signal - 1) & 1U) != 0;
    }
    return false;
  }

  // Waits for its end: its exit code, or 128 + the signal that ended it.
  int wait() {
    int status = 0;
    pid_t ended = -1;
    do {
      ended = ::waitpid(pid_, &status, 0);
    } while (ended < 0 && errno == EINTR);
    check(ended, "waitpid");
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  // What it has written to stderr so far.
  [[nodiscard]] std::string errors() const { return directory_.read("stderr"); }

 private:
  static void check(int result, const char* what) {
    if (result < 0) throw std::system_error(errno, std::generic_category(), what);
  }

  TemporaryDirectory directory_;
  pid_t pid_ = -1;
  FILE* output_ = nullptr;
};

}  // namespace alidade
