#include "edge_app/commands/network_trial.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <optional>

#include "platform/system/clock.h"
#include "platform/system/file_descriptor.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

constexpr int kRefused = 3;      // exit code; the reason is on stdout
constexpr int kLongest_s = 120;  // enough for a large network on a small processor
// Bytes of address space. Eight times the size of the model come on top.
constexpr rlim_t kMostBytes = rlim_t{4} << 30;

bool& trials_are_allowed() {
  static bool allowed = false;
  return allowed;
}

void limit(int resource, rlim_t most) {
  rlimit now = {};
  if (::getrlimit(static_cast<__rlimit_resource_t>(resource), &now) != 0) return;
  now.rlim_cur = now.rlim_max == RLIM_INFINITY ? most : std::min(most, now.rlim_max);
  static_cast<void>(::setrlimit(static_cast<__rlimit_resource_t>(resource), &now));
}

// Not with a sanitizer: its shadow memory takes terabytes of address space.
void limit_addresses([[maybe_unused]] std::size_t model_bytes) {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  if constexpr (sizeof(void*) > 4) limit(RLIMIT_AS, kMostBytes + 8 * rlim_t{model_bytes});
#endif
}

struct Trial {
  pid_t process = -1;
  FileDescriptor says;
};

std::optional<Trial> begin_trial(const std::string& model, const NetworkOptions& options) {
  const FileDescriptor file(::memfd_create("network", MFD_CLOEXEC));
  if (!file.is_open() || !write_all(file.get(), model)) return std::nullopt;
  int ends[2] = {-1, -1};
  if (::pipe2(ends, O_CLOEXEC) != 0) return std::nullopt;
  Trial trial;
  trial.says.reset(ends[0]);
  const FileDescriptor other_end(ends[1]);
  posix_spawn_file_actions_t actions;
  if (::posix_spawn_file_actions_init(&actions) != 0) return std::nullopt;
  static_cast<void>(::posix_spawn_file_actions_adddup2(&actions, file.get(), STDIN_FILENO));
  static_cast<void>(::posix_spawn_file_actions_adddup2(&actions, other_end.get(), STDOUT_FILENO));
  static_cast<void>(
      ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0));
  std::string name = "alidade";
  std::string option = kNetworkTrial;
  std::string width = std::to_string(options.width_px);
  std::string height = std::to_string(options.height_px);
  std::array<char*, 5> arguments = {name.data(), option.data(), width.data(), height.data(),
                                    nullptr};
  const int failed = ::posix_spawn(&trial.process, "/proc/self/exe", &actions, nullptr,
                                   arguments.data(), ::environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return std::nullopt;
  return trial;
}

// Reads what the process says until it ends. False: it did not end in time.
bool hear(int from, std::string* said) {
  const double end_s = monotonic_now_s() + kLongest_s;
  for (;;) {
    const double left_s = end_s - monotonic_now_s();
    if (left_s <= 0) return false;
    pollfd ready = {from, POLLIN, 0};
    if (::poll(&ready, 1, static_cast<int>(left_s * 1000) + 1) <= 0) continue;
    char piece[512];
    const ssize_t n = ::read(from, piece, sizeof piece);
    if (n == 0) return true;
    if (n > 0 && said->size() < 1000) said->append(piece, static_cast<std::size_t>(n));
  }
}

std::string end_of(int status) {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) return "takes too long to be read";
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)
    return "needs more memory than there is, or takes too long to be read";
  return std::string("makes OpenCV crash") +
         (WIFSIGNALED(status) ? std::string(": ") + ::strsignal(WTERMSIG(status)) : std::string());
}

}  // namespace

void allow_network_trials() { trials_are_allowed() = true; }

bool survives_trial(const std::string& model, const NetworkOptions& options, std::string* error) {
  if (!trials_are_allowed()) return true;
  const std::optional<Trial> trial = begin_trial(model, options);
  if (!trial) return true;
  std::string said;
  if (!hear(trial->says.get(), &said)) ::kill(trial->process, SIGKILL);
  int status = 0;
  while (::waitpid(trial->process, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return true;
  // 127: under an emulator that cannot start another program.
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127) return true;
  const bool refused = WIFEXITED(status) && WEXITSTATUS(status) == kRefused && !said.empty();
  *error =
      refused ? said : end_of(status) + "; it is damaged, or not what it seems: export it again";
  return false;
}

int run_network_trial(int argc, char** argv) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, kLongest_s);
  NetworkOptions options;
  struct stat status = {};
  if (argc != 4 || ::fstat(STDIN_FILENO, &status) != 0) return kRefused;
  options.width_px = std::atoi(argv[2]);
  options.height_px = std::atoi(argv[3]);
  if (!options.validate()) return kRefused;
  std::string error;
  try {
    limit_addresses(static_cast<std::size_t>(status.st_size));
    std::string model;
    if (!read_file("/proc/self/fd/0", &model, &error, static_cast<std::size_t>(status.st_size)))
      return kRefused;
    if (NetworkDetector::load(model, options, &error)) return 0;
  } catch (const std::exception&) {
    error = "needs more memory than it may take";
  }
  std::fputs(error.c_str(), stdout);
  return kRefused;
}

}  // namespace alidade
