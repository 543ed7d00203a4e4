#include "platform/system/realtime.h"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace alidade {
namespace {

// A locked process under a finite limit fails in some later allocation instead of now.
bool memory_lock_is_limited() {
  rlimit limit{};
  return geteuid() != 0 && getrlimit(RLIMIT_MEMLOCK, &limit) == 0 &&
         limit.rlim_cur != RLIM_INFINITY;
}

}  // namespace

std::vector<std::string> apply_realtime(const RealtimeOptions& options) {
  std::vector<std::string> warnings;
  if (options.priority > 0) {
    sched_param parameters{};
    parameters.sched_priority = options.priority;
    const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
    if (error != 0) {
      warnings.push_back("no real-time priority " + std::to_string(options.priority) + " (" +
                         std::strerror(error) +
                         "): allow it with `ulimit -r` or LimitRTPRIO=, values 1 to 99");
    }
  }
  if (options.cpu >= 0) {
    int error = EINVAL;
    if (options.cpu < CPU_SETSIZE) {
      cpu_set_t cpus;
      CPU_ZERO(&cpus);
      CPU_SET(static_cast<unsigned>(options.cpu), &cpus);
      error = pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus);
    }
    if (error != 0) {
      warnings.push_back("cannot run on processor " + std::to_string(options.cpu) + " (" +
                         std::strerror(error) + "): this machine has processors 0 to " +
                         std::to_string(sysconf(_SC_NPROCESSORS_CONF) - 1));
    }
  }
  if (options.lock_memory) {
    if (memory_lock_is_limited()) {
      warnings.emplace_back(
          "memory is not locked: the limit is finite; allow it with `ulimit -l unlimited` or "
          "LimitMEMLOCK=infinity");
    } else if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
      warnings.push_back(std::string("memory is not locked (") + std::strerror(errno) + ")");
    }
  }
  return warnings;
}

std::vector<std::string> set_lowest_priority() {
  const sched_param parameters{};
  const int error = pthread_setschedparam(pthread_self(), SCHED_IDLE, &parameters);
  if (error == 0) return {};
  return {std::string("normal priority (") + std::strerror(error) + ")"};
}

}  // namespace alidade
