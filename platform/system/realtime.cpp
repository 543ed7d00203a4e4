#include "platform/system/realtime.h"

#include <limits.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>

namespace alidade {
namespace {

// A locked process under a finite limit fails in some later allocation instead of now.
bool memory_lock_is_limited() {
  rlimit limit{};
  return geteuid() != 0 && getrlimit(RLIMIT_MEMLOCK, &limit) == 0 &&
         limit.rlim_cur != RLIM_INFINITY;
}

void set_priority(int priority, RealtimeReport* report) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  if (error == 0) {
    report->granted.push_back("SCHED_FIFO " + std::to_string(priority));
  } else {
    report->warnings.push_back("no real-time priority " + std::to_string(priority) + " (" +
                               std::strerror(error) +
                               "): allow it with `ulimit -r` or LimitRTPRIO=, values 1 to 99");
  }
}

void set_processor(int cpu, RealtimeReport* report) {
  int error = EINVAL;
  if (cpu < CPU_SETSIZE) {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    CPU_SET(static_cast<unsigned>(cpu), &cpus);
    error = pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus);
  }
  if (error == 0) {
    report->granted.push_back("processor " + std::to_string(cpu));
  } else {
    report->warnings.push_back("cannot run on processor " + std::to_string(cpu) + " (" +
                               std::strerror(error) + "): this machine has processors 0 to " +
                               std::to_string(sysconf(_SC_NPROCESSORS_CONF) - 1));
  }
}

std::atomic<bool> freed_memory_is_kept{false};

// Whether a mapping, a line of /proc/self/maps, is brought in as a whole: heap and stacks, and code and data that
// the real-time thread may use.
bool is_brought_in(const std::string& permissions, const std::string& path,
                   const std::string& program) {
  if (permissions[0] != 'r') return false;
  if (path.empty() || path[0] == '[') return permissions.compare(1, 3, "w-p") == 0;
  if (path == program) return true;
  const std::string name = path.substr(path.rfind('/') + 1);
  for (const char* library : {"libc.so", "libm.so", "libstdc++.so", "libgcc_s.so", "ld-linux"}) {
    if (name.compare(0, std::strlen(library), library) == 0) return true;
  }
  return false;
}

// What there is now is locked as it is touched, but for what is brought in; what comes later is brought in.
bool lock_all() {
  if (mlockall(MCL_CURRENT | MCL_ONFAULT) != 0) return false;
  std::array<char, PATH_MAX> program{};
  if (readlink("/proc/self/exe", program.data(), program.size() - 1) < 0) return false;
  std::ifstream maps("/proc/self/maps");
  std::vector<std::pair<std::uintptr_t, std::uintptr_t>> ranges;
  for (std::string line; std::getline(maps, line);) {
    std::istringstream words(line);
    std::uintptr_t begin = 0, end = 0;
    char dash = 0;
    std::string permissions, offset, device, inode, path;
    words >> std::hex >> begin >> dash >> end >> permissions >> offset >> device >> inode >> path;
    if (permissions.size() == 4 && is_brought_in(permissions, path, program.data()))
      ranges.emplace_back(begin, end);
  }
  // A mapping may have gone since, a thread's stack say: then there is nothing to lock.
  for (const auto& [begin, end] : ranges) {
    if (mlock(reinterpret_cast<const void*>(begin), end - begin) != 0 && errno != ENOMEM)
      return false;
  }
  return mlockall(MCL_FUTURE) == 0;
}

void lock_memory(RealtimeReport* report) {
  if (memory_lock_is_limited()) {
    report->warnings.emplace_back(
        "memory is not locked: the limit is finite; allow it with `ulimit -l unlimited` or "
        "LimitMEMLOCK=infinity");
    return;
  }
  // First, so that what malloc has is locked once and stays.
  freed_memory_is_kept = true;
  const bool kept = mallopt(M_TRIM_THRESHOLD, -1) == 1 && mallopt(M_MMAP_MAX, 0) == 1;
  if (!lock_all()) {
    report->warnings.push_back(std::string("memory is not locked (") + std::strerror(errno) + ")");
    return;
  }
  report->granted.emplace_back("memory locked");
  if (!kept) {
    report->warnings.emplace_back(
        "freed memory may go back to the kernel: this malloc cannot be told to keep it");
  }
}

__attribute__((noinline)) void touch_stack() {
  constexpr std::size_t kPage = 4096;  // or larger
  volatile char stack[kPrefaultedStack];
  for (std::size_t i = 0; i < sizeof stack; i += kPage) stack[i] = 0;
}

void prefault_stack(RealtimeReport* report) {
  constexpr std::size_t kReserve = std::size_t{64}
                                   << 10;  // what the caller and this one still need
  pthread_attr_t attributes;
  void* lowest = nullptr;
  std::size_t size = 0;
  if (pthread_getattr_np(pthread_self(), &attributes) != 0) return;
  const bool known = pthread_attr_getstack(&attributes, &lowest, &size) == 0;
  pthread_attr_destroy(&attributes);
  const char here = 0;
  if (known && &here - static_cast<const char*>(lowest) >
                   static_cast<std::ptrdiff_t>(kPrefaultedStack + kReserve)) {
    touch_stack();
    report->granted.emplace_back("stack pre-faulted");
  } else {
    report->warnings.emplace_back("stack is not pre-faulted: too small");
  }
}

std::string joined(const std::vector<std::string>& words, const char* between) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : between) + word;
  return all;
}

}  // namespace

std::string RealtimeReport::line() const {
  std::string text = "granted: " + (granted.empty() ? "nothing" : joined(granted, ", "));
  if (!warnings.empty()) text += "; not permitted: " + joined(warnings, "; ");
  return text;
}

RealtimeReport apply_realtime(const RealtimeOptions& options) {
  RealtimeReport report;
  if (options.priority > 0) set_priority(options.priority, &report);
  if (options.cpu >= 0) set_processor(options.cpu, &report);
  if (options.lock_memory) lock_memory(&report);
  prefault_stack(&report);
  return report;
}

bool use_small_stacks() {
  pthread_attr_t attributes;
  if (pthread_attr_init(&attributes) != 0) return false;
  const bool set = pthread_attr_setstacksize(&attributes, kThreadStack) == 0 &&
                   pthread_setattr_default_np(&attributes) == 0;
  pthread_attr_destroy(&attributes);
  return set;
}

void return_freed_memory() {
  if (!freed_memory_is_kept) malloc_trim(0);
}

std::string set_lowest_priority() {
  // Where the process may run, as its first thread does: not on the processor that a thread that started
  // this one has for itself.
  cpu_set_t cpus;
  if (sched_getaffinity(getpid(), sizeof cpus, &cpus) == 0) {
    static_cast<void>(pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus));
  }
  const sched_param none{};
  const int error = pthread_setschedparam(pthread_self(), SCHED_IDLE, &none);
  if (error == 0) return "";
  constexpr int kNicest = 19;
  if (pthread_setschedparam(pthread_self(), SCHED_OTHER, &none) == 0 &&
      setpriority(PRIO_PROCESS, 0, kNicest) == 0) {  // of this thread alone, on Linux
    return "";
  }
  return std::string("cannot run at the lowest priority (") + std::strerror(error) + ")";
}

PageFaults thread_page_faults() {
  rusage usage{};
  if (getrusage(RUSAGE_THREAD, &usage) != 0) return {};
  return {usage.ru_minflt, usage.ru_majflt};
}

PageFaults page_faults_of(int thread) {
  std::ifstream file("/proc/self/task/" + std::to_string(thread) + "/stat");
  std::string line;
  std::getline(file, line);
  // What follows the name, which is in parentheses and may hold blanks: state, six more, minflt, cminflt, majflt.
  std::istringstream words(line.substr(std::min(line.size(), line.rfind(')') + 1)));
  std::string skipped;
  for (int i = 0; i < 7; ++i) words >> skipped;
  PageFaults faults;
  long of_children = 0;
  words >> faults.minor >> of_children >> faults.major;
  return words ? faults : PageFaults{};
}

int this_thread() { return static_cast<int>(::syscall(SYS_gettid)); }

}  // namespace alidade
