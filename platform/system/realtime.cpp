#include "platform/system/realtime.h"

#include <limits.h>
#include <link.h>
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

// Set by the linker if it gathers that code (cmake/batch_code.ld), else null.
extern "C" {
extern const char alidade_batch_code_begin[] __attribute__((weak));
extern const char alidade_batch_code_end[] __attribute__((weak));
}

namespace alidade {
namespace {

// Under a finite limit, a locked process would fail in some later allocation instead of now.
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

// The kernel and the loader give addresses as numbers.
char* at_address(std::uintptr_t address) {
  return reinterpret_cast<char*>(address);  // NOLINT(performance-no-int-to-ptr)
}

// A range of addresses, from /proc/self/smaps.
struct Mapping {
  char* begin = nullptr;
  std::size_t size = 0;  // bytes
  std::string permissions;
  std::string path;        // empty or in brackets: not backed by a file
  bool is_changed = true;  // some of its pages differ from the file

  [[nodiscard]] bool is_data() const {
    return permissions == "rw-p" && (path.empty() || path[0] == '[');
  }
  [[nodiscard]] bool is_unchanged_file() const {
    return !path.empty() && path[0] == '/' && permissions[0] == 'r' && permissions[1] == '-' &&
           permissions[3] == 'p' && !is_changed;
  }
};

std::vector<Mapping> all_mappings() {
  std::vector<Mapping> mappings;
  std::ifstream file("/proc/self/smaps");
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string first;
    words >> first;
    if (first.empty()) continue;
    if (first.back() != ':') {
      std::istringstream range(first);
      std::uintptr_t begin = 0, end = 0;
      char dash = 0;
      range >> std::hex >> begin >> dash >> end;
      Mapping& mapping = mappings.emplace_back();
      std::string offset, device, inode;
      words >> mapping.permissions >> offset >> device >> inode >> mapping.path;
      mapping.begin = at_address(begin);
      mapping.size = end - begin;
      if (mapping.permissions.size() != 4) mappings.pop_back();
    } else if (first == "Anonymous:" && !mappings.empty()) {
      long changed_kb = 1;
      words >> changed_kb;
      mappings.back().is_changed = changed_kb != 0;
    }
  }
  return mappings;
}

// True for files with code and data that the real-time thread may use.
bool is_of_the_real_time_thread(const std::string& path, const std::string& program) {
  if (path == program) return true;
  const std::string name = path.substr(path.rfind('/') + 1);
  for (const char* library : {"libc.so", "libm.so", "libstdc++.so", "libgcc_s.so", "ld-linux"}) {
    if (name.compare(0, std::strlen(library), library) == 0) return true;
  }
  return false;
}

struct AddressRange {
  char* begin = nullptr;
  char* end = nullptr;
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(end - begin); }
};

// A mapping without the ranges left_out, which are whole pages in any order.
std::vector<AddressRange> rest_of(const Mapping& mapping,
                                  const std::vector<AddressRange>& left_out) {
  std::vector<AddressRange> rest{{mapping.begin, mapping.begin + mapping.size}};
  for (const AddressRange& out : left_out) {
    std::vector<AddressRange> left;
    for (const AddressRange& range : rest) {
      const AddressRange before{range.begin, std::min(range.end, out.begin)};
      const AddressRange behind{std::max(range.begin, out.end), range.end};
      if (out.end <= range.begin || range.end <= out.begin || out.end <= out.begin) {
        left.push_back(range);
        continue;
      }
      for (const AddressRange& part : {before, behind}) {
        if (part.begin < part.end) left.push_back(part);
      }
    }
    rest = std::move(left);
  }
  return rest;
}

AddressRange whole_pages(std::uintptr_t begin, std::uintptr_t end) {
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  return {at_address((begin + page - 1) / page * page), at_address(end / page * page)};
}

// Ranges that the real-time thread does not need, within the mappings that are paged in:
//   - the zeros at the end of other libraries' data: /proc/self/smaps lists them without a file,
//     and a library of codecs has megabytes of them
//   - exception tables, which lie together behind the constants: the thread throws none
//   - program code of rooms that it never enters
std::vector<AddressRange> done_without(const std::string& program) {
  struct Search {
    const std::string& program;
    std::vector<AddressRange> found;
  };
  Search search{program, {}};
  const auto look = [](dl_phdr_info* object, std::size_t, void* out) {
    Search& so_far = *static_cast<Search*>(out);
    const std::string name = object->dlpi_name;
    const bool is_needed = name.empty() || is_of_the_real_time_thread(name, so_far.program);
    const ElfW(Phdr)* const parts = object->dlpi_phdr;
    const ElfW(Phdr)* const end_of_parts = parts + object->dlpi_phnum;
    const ElfW(Phdr)* const tables = std::find_if(parts, end_of_parts, [](const ElfW(Phdr) & part) {
      return part.p_type == PT_GNU_EH_FRAME;
    });
    for (const ElfW(Phdr)* part = parts; part != end_of_parts; ++part) {
      if (part->p_type != PT_LOAD) continue;
      const std::uintptr_t at = object->dlpi_addr + part->p_vaddr;
      if (!is_needed && part->p_filesz < part->p_memsz) {
        so_far.found.push_back(whole_pages(at + part->p_filesz, at + part->p_memsz));
      }
      if (is_needed && tables != end_of_parts && part->p_flags == PF_R &&
          tables->p_vaddr >= part->p_vaddr && tables->p_vaddr < part->p_vaddr + part->p_memsz) {
        so_far.found.push_back(
            whole_pages(object->dlpi_addr + tables->p_vaddr, at + part->p_memsz));
      }
    }
    return 0;
  };
  dl_iterate_phdr(look, &search);
  if (alidade_batch_code_begin != nullptr) {
    search.found.push_back(whole_pages(reinterpret_cast<std::uintptr_t>(alidade_batch_code_begin),
                                       reinterpret_cast<std::uintptr_t>(alidade_batch_code_end)));
  }
  return search.found;
}

// Existing memory is locked as it is touched, except what is paged in here.
bool lock_all() {
  std::array<char, PATH_MAX> program{};
  if (readlink("/proc/self/exe", program.data(), program.size() - 1) < 0) return false;
  std::vector<AddressRange> brought_in;
  std::vector<AddressRange> let_go;
  const std::vector<AddressRange> left_out = done_without(program.data());
  for (const Mapping& mapping : all_mappings()) {
    const bool wanted =
        mapping.is_data() ||
        (mapping.permissions[0] == 'r' && is_of_the_real_time_thread(mapping.path, program.data()));
    const std::vector<AddressRange> rest =
        wanted ? rest_of(mapping, left_out) : std::vector<AddressRange>();
    brought_in.insert(brought_in.end(), rest.begin(), rest.end());
    if (!mapping.is_unchanged_file()) continue;
    const std::vector<AddressRange> others = rest_of(mapping, rest);
    let_go.insert(let_go.end(), others.begin(), others.end());
  }
  // If one of these pages is needed again, the kernel reads it from the same file.
  for (const AddressRange& range : let_go)
    static_cast<void>(madvise(range.begin, range.size(), MADV_DONTNEED));
  if (mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) != 0) return false;
  // A mapping may have been removed since: then there is nothing to lock.
  return std::all_of(brought_in.begin(), brought_in.end(), [](const AddressRange& range) {
    return mlock(range.begin, range.size()) == 0 || errno == ENOMEM;
  });
}

void lock_memory(RealtimeReport* report) {
  if (memory_lock_is_limited()) {
    report->warnings.emplace_back(
        "memory is not locked: the limit is finite; allow it with `ulimit -l unlimited` or "
        "LimitMEMLOCK=infinity");
    return;
  }
  // First, so that malloc's memory is locked once and stays.
  freed_memory_is_kept = true;
  const bool kept = mallopt(M_TRIM_THRESHOLD, -1) == 1 &&
                    mallopt(M_MMAP_THRESHOLD, static_cast<int>(kFetchedAlone)) == 1;
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
  constexpr std::size_t kReserve = std::size_t{64} << 10;  // for the caller and this function
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
  if (options.lock_memory) lock_memory(&report);
  if (options.priority > 0) set_priority(options.priority, &report);
  if (options.cpu >= 0) set_processor(options.cpu, &report);
  prefault_stack(&report);
  return report;
}

int priority_of(ThreadDuty duty, int priority) {
  if (priority <= 0) return 0;
  const int below = duty == ThreadDuty::kStep ? 0 : duty == ThreadDuty::kBrief ? 1 : 2;
  return std::max(1, priority - below);
}

RealtimeReport lock_process_memory() {
  RealtimeReport report;
  lock_memory(&report);
  return report;
}

void return_freed_memory() {
  if (!freed_memory_is_kept) malloc_trim(0);
}

std::string set_lowest_priority() {
  // Runs on the processors of the process's first thread, not on the one that the starting thread
  // has for itself.
  cpu_set_t cpus;
  if (sched_getaffinity(getpid(), sizeof cpus, &cpus) == 0) {
    static_cast<void>(pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus));
  }
  const sched_param none{};
  const int error = pthread_setschedparam(pthread_self(), SCHED_IDLE, &none);
  if (error == 0) return "";
  constexpr int kNicest = 19;
  if (pthread_setschedparam(pthread_self(), SCHED_OTHER, &none) == 0 &&
      setpriority(PRIO_PROCESS, 0, kNicest) == 0) {  // for this thread only, on Linux
    return "";
  }
  return std::string("cannot run at the lowest priority (") + std::strerror(error) + ")";
}

bool set_usual_priority(pthread_t thread) {
  const sched_param none{};
  return pthread_setschedparam(thread, SCHED_OTHER, &none) == 0;
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
  // The thread's name is in parentheses and may contain blanks. After it: state, six more, minflt,
  // cminflt, majflt.
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
