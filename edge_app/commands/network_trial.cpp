#include "edge_app/commands/network_trial.h"

#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>

#include "edge_app/commands/child_process.h"
#include "platform/system/file_descriptor.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

constexpr int kRefused = 3;      // exit code; the reason is on stdout
constexpr int kLongest_s = 120;  // enough for a large network on a small processor
// Bytes of address space. Eight times the size of the model come on top.
constexpr rlim_t kMostBytes = rlim_t{4} << 30;

constexpr std::size_t kMostSaid = 1000;  // bytes

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
  const FileDescriptor file(::memfd_create("network", MFD_CLOEXEC));
  if (!file.is_open() || !write_all(file.get(), model)) return true;
  ChildCommand command;
  command.program = "/proc/self/exe";
  command.arguments = {"alidade", kNetworkTrial, std::to_string(options.width_px),
                       std::to_string(options.height_px)};
  command.input = file.get();
  command.longest_s = kLongest_s;
  command.most_bytes = kMostSaid;
  const ChildResult trial = run_child(command);
  if (!trial.not_started.empty()) return true;
  const int status = trial.status;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return true;
  // 127: under an emulator that cannot start another program.
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127) return true;
  const bool refused = WIFEXITED(status) && WEXITSTATUS(status) == kRefused && !trial.out.empty();
  *error = refused ? trial.out
                   : end_of(status) + "; it is damaged, or not what it seems: export it again";
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
