#include "platform/system/realtime.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
extern "C" {
#include <libavcodec/avcodec.h>
}
#include <fcntl.h>
#include <link.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <future>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "platform/system/clock.h"
#include "platform/system/file_descriptor.h"
#include "platform/system/priority_mutex.h"
#include "test/platform/support/eventually.h"
#include "test/support/fresh_memory.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using test::FreshMemory;
using test::kOwnMemoryOnly;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::size_t kPage = 4096;

// In a thread of its own: the settings stay with the thread.
RealtimeReport apply_in_thread(const RealtimeOptions& options, int* cpu = nullptr) {
  RealtimeReport report;
  std::thread([&] {
    report = apply_realtime(options);
    if (cpu != nullptr) {
      *cpu = sched_getcpu();
    }
  }).join();
  return report;
}

// In a process of its own, for what stays with the process. Returns what it returns.
int in_child(const std::function<int()>& run) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(run());
  int status = 0;
  if (child < 0 || ::waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}
constexpr int kGood = 0;
constexpr int kNotPermitted = 77;

// Page faults of touching all of it.
long faults_of_touching(char* memory, std::size_t size) {
  const PageFaults before = thread_page_faults();
  for (std::size_t i = 0; i < size; i += kPage) {
    *static_cast<volatile char*>(memory + i) = 1;
  }
  const PageFaults after = thread_page_faults();
  return after.minor - before.minor + after.major - before.major;
}

// So deep the real-time thread may go.
__attribute__((noinline)) long faults_of_deep_call() {
  const PageFaults before = thread_page_faults();
  volatile char frame[kPrefaultedStack - (std::size_t{16} << 10)];
  for (std::size_t i = 0; i < sizeof frame; i += kPage) frame[i] = 1;
  const PageFaults after = thread_page_faults();
  return after.minor - before.minor;
}

// On a stack that no thread had before.
template <class Run>
void on_fresh_stack(std::size_t size, Run run) {
  const FreshMemory stack(size);
  pthread_attr_t attributes;
  ASSERT_EQ(pthread_attr_init(&attributes), 0);
  ASSERT_EQ(pthread_attr_setstack(&attributes, stack.data(), stack.size()), 0);
  pthread_t thread{};
  const auto start = [](void* argument) -> void* {
    (*static_cast<Run*>(argument))();
    return nullptr;
  };
  ASSERT_EQ(pthread_create(&thread, &attributes, start, &run), 0);
  ASSERT_EQ(pthread_join(thread, nullptr), 0);
  pthread_attr_destroy(&attributes);
}

TEST(ApplyRealtime, TouchesTheStackOnlyByDefault) {
  const RealtimeReport report = apply_in_thread(RealtimeOptions{});
  EXPECT_THAT(report.granted, ElementsAre("stack pre-faulted"));
  EXPECT_THAT(report.warnings, IsEmpty());
}

TEST(ApplyRealtime, RunsTheThreadOnTheProcessorAskedFor) {
  cpu_set_t allowed;
  ASSERT_EQ(sched_getaffinity(0, sizeof allowed, &allowed), 0);
  int last = 0;
  for (int i = 0; i < CPU_SETSIZE; ++i) {
    if (CPU_ISSET(static_cast<unsigned>(i), &allowed)) {
      last = i;
    }
  }
  RealtimeOptions options;
  options.cpu = last;
  int cpu = -1;
  const RealtimeReport report = apply_in_thread(options, &cpu);
  EXPECT_THAT(report.warnings, IsEmpty());
  EXPECT_THAT(report.granted, Contains("processor " + std::to_string(last)));
  EXPECT_EQ(cpu, last);
}

TEST(ApplyRealtime, SaysInPlainWordsWhatItCouldNotDoAndGoesOn) {
  RealtimeOptions options;
  options.priority = 1000;
  options.cpu = 100'000;
  const RealtimeReport report = apply_in_thread(options);
  EXPECT_THAT(report.warnings, ElementsAre(HasSubstr("no real-time priority 1000"),
                                           HasSubstr("cannot run on processor 100000")));
  EXPECT_THAT(report.granted, ElementsAre("stack pre-faulted"));
}

TEST(ApplyRealtime, ReportsInOneLine) {
  RealtimeReport report;
  EXPECT_EQ(report.line(), "granted: nothing");
  report.granted = {"SCHED_FIFO 60", "processor 3"};
  EXPECT_EQ(report.line(), "granted: SCHED_FIFO 60, processor 3");
  report.warnings = {"memory is not locked (why)", "something else"};
  EXPECT_EQ(report.line(),
            "granted: SCHED_FIFO 60, processor 3; not permitted: memory is not locked (why); "
            "something else");
}

TEST(ApplyRealtime, RunsTheThreadAsSaidOrSaysThatItDoesNot) {
  RealtimeOptions options;
  options.priority = 10;
  RealtimeReport report;
  int policy = -1;
  sched_param parameters{};
  std::thread([&] {
    report = apply_realtime(options);
    pthread_getschedparam(pthread_self(), &policy, &parameters);
  }).join();
  if (report.warnings.empty()) {
    EXPECT_THAT(report.granted, Contains("SCHED_FIFO 10"));
    EXPECT_EQ(policy, SCHED_FIFO);
    EXPECT_EQ(parameters.sched_priority, 10);
  } else {
    EXPECT_THAT(report.warnings, ElementsAre(HasSubstr("ulimit -r")));
    EXPECT_EQ(policy, SCHED_OTHER);
  }
}

TEST(ApplyRealtime, LeavesNoPageOfTheStackToBeFaultedIn) {
  if (!kOwnMemoryOnly) GTEST_SKIP() << "the sanitizer touches memory too";
  constexpr std::size_t kStack = std::size_t{1} << 20;
  long without = 0;
  on_fresh_stack(kStack, [&] { without = faults_of_deep_call(); });
  EXPECT_GT(without, 0);
  long with = -1;
  RealtimeReport report;
  on_fresh_stack(kStack, [&] {
    report = apply_realtime(RealtimeOptions{});
    // The first call of what measures is a fault or two of its own.
    static_cast<void>(thread_page_faults());
    with = faults_of_deep_call();
  });
  EXPECT_THAT(report.granted, ElementsAre("stack pre-faulted"));
  EXPECT_EQ(with, 0);
}

TEST(ApplyRealtime, LeavesASmallStackAlone) {
  RealtimeReport report;
  on_fresh_stack(kPrefaultedStack, [&] { report = apply_realtime(RealtimeOptions{}); });
  EXPECT_THAT(report.granted, IsEmpty());
  EXPECT_THAT(report.warnings, ElementsAre(HasSubstr("stack")));
}

// Of the mapping that holds an address, a line of /proc/self/smaps.
std::string line_of_mapping(const char* address, const std::string& key) {
  std::ifstream file("/proc/self/smaps");
  bool is_it = false;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string first;
    words >> first;
    if (first.empty()) continue;
    if (first.back() != ':') {
      const std::size_t dash = first.find('-');
      const auto at = reinterpret_cast<std::uintptr_t>(address);
      is_it = at >= std::stoull(first.substr(0, dash), nullptr, 16) &&
              at < std::stoull(first.substr(dash + 1), nullptr, 16);
    } else if (is_it && first == key + ":") {
      return line;
    }
  }
  return "";
}

TEST(LockProcessMemory, BringsInWhatThereIsAndKeepsWhatComesLater) {
  if (!kOwnMemoryOnly) GTEST_SKIP() << "the sanitizer touches memory too";
  const int result = in_child([] {
    const FreshMemory before(64 * kPage);
    if (!lock_process_memory().warnings.empty()) return kNotPermitted;
    if (faults_of_touching(before.data(), before.size()) != 0) return 1;
    const FreshMemory later(64 * kPage);
    if (faults_of_touching(later.data(), later.size()) == 0) return 2;
    const auto is_locked = [](const FreshMemory& memory) {
      return line_of_mapping(memory.data(), "VmFlags").find(" lo") != std::string::npos;
    };
    return is_locked(before) && is_locked(later) ? kGood : 3;
  });
  if (result == kNotPermitted) GTEST_SKIP() << "not permitted to lock memory";
  EXPECT_EQ(result, kGood);
}

TEST(LockProcessMemory, TakesNoMoreOfALaterStackThanItsThreadUses) {
  if (!kOwnMemoryOnly) GTEST_SKIP() << "the sanitizer touches memory too";
  const int result = in_child([] {
    if (!lock_process_memory().warnings.empty()) return kNotPermitted;
    // Larger than any that another test may have left behind.
    pthread_attr_t attributes;
    pthread_t thread{};
    if (pthread_attr_init(&attributes) != 0) return 1;
    if (pthread_attr_setstacksize(&attributes, std::size_t{64} << 20) != 0) return 1;
    long resident_kb = -1;
    const auto look = [](void* out) -> void* {
      const char here = 0;
      std::istringstream words(line_of_mapping(&here, "Rss"));
      std::string key;
      words >> key >> *static_cast<long*>(out);
      return nullptr;
    };
    if (pthread_create(&thread, &attributes, look, &resident_kb) != 0) return 1;
    pthread_join(thread, nullptr);
    pthread_attr_destroy(&attributes);
    return resident_kb > 0 && resident_kb < 1024 ? kGood : 2;
  });
  if (result == kNotPermitted) GTEST_SKIP() << "not permitted to lock memory";
  EXPECT_EQ(result, kGood);
}

TEST(LockProcessMemory, LetsGoOfFilesThatNobodyNeedsAnyMore) {
  if (!kOwnMemoryOnly) GTEST_SKIP() << "the sanitizer touches memory too";
  const TemporaryDirectory directory;
  constexpr std::size_t kSize = 64 * kPage;
  const std::string name = directory.write("tables", std::string(kSize, 'x'));
  const int result = in_child([&] {
    const FileDescriptor file(::open(name.c_str(), O_RDONLY | O_CLOEXEC));
    const auto* const tables =
        static_cast<const char*>(::mmap(nullptr, kSize, PROT_READ, MAP_PRIVATE, file.get(), 0));
    if (tables == MAP_FAILED) return 1;
    const auto is_whole = [&] {
      return std::count(tables, tables + kSize, 'x') == static_cast<std::ptrdiff_t>(kSize);
    };
    const auto resident_kb = [&] {
      std::istringstream words(line_of_mapping(tables, "Rss"));
      std::string key;
      long kb = -1;
      words >> key >> kb;
      return kb;
    };
    if (!is_whole() || resident_kb() != kSize / 1024) return 2;
    if (!lock_process_memory().warnings.empty()) return kNotPermitted;
    if (resident_kb() != 0) return 3;
    return is_whole() ? kGood : 4;  // from the file again
  });
  if (result == kNotPermitted) GTEST_SKIP() << "not permitted to lock memory";
  EXPECT_EQ(result, kGood);
}

// kB, of the code of libraries whose path has name: mapped, and in memory for this process.
struct CodeSize {
  long mapped = 0, resident = 0;
};
CodeSize code_of(const std::string& name) {
  std::ifstream maps("/proc/self/smaps");
  CodeSize sum;
  bool wanted = false;
  for (std::string line; std::getline(maps, line);) {
    std::istringstream words(line);
    std::string key;
    long size = 0;
    words >> key >> size;
    if (key.find('-') != std::string::npos)
      wanted = line.find(" r-xp ") != std::string::npos && line.find(name) != std::string::npos;
    if (wanted && key == "Size:") sum.mapped += size;
    if (wanted && key == "Rss:") sum.resident += size;
  }
  return sum;
}

TEST(LockProcessMemory, BringsInTheCodeOfTheProgramAndNotOfAllLibraries) {
  if (!kOwnMemoryOnly) GTEST_SKIP() << "the sanitizer touches memory too";
  const int result = in_child([] {
    if (avcodec_version() == 0) return 4;
    if (!lock_process_memory().warnings.empty()) return kNotPermitted;
    for (const char* name : {"/libc.so", "/libstdc++.so", "platform_system_test"}) {
      const CodeSize code = code_of(name);
      if (code.mapped == 0 || code.resident != code.mapped) return 1;
    }
    // Megabytes of codecs, of which this program calls nothing else.
    const CodeSize codecs = code_of("/libavcodec.so");
    if (codecs.mapped == 0) return 2;
    if (codecs.resident >= codecs.mapped / 2) return 3;
    // Nor of the megabytes of zeros that their data ends with.
    const auto end_of_codecs = [](dl_phdr_info* object, std::size_t, void* out) {
      if (std::strstr(object->dlpi_name, "/libavcodec.so") == nullptr) return 0;
      for (int i = 0; i < object->dlpi_phnum; ++i) {
        const ElfW(Phdr)& part = object->dlpi_phdr[i];
        if (part.p_type == PT_LOAD && part.p_memsz > part.p_filesz)
          *static_cast<ElfW(Addr)*>(out) = object->dlpi_addr + part.p_vaddr + part.p_memsz;
      }
      return 1;
    };
    ElfW(Addr) end = 0;
    dl_iterate_phdr(end_of_codecs, &end);
    if (end == 0) return 5;
    std::istringstream words(line_of_mapping(reinterpret_cast<const char*>(end - 1), "Rss"));
    std::string key;
    long kb = -1;
    words >> key >> kb;
    return kb >= 0 && kb < 1024 ? kGood : 6;
  });
  if (result == kNotPermitted) GTEST_SKIP() << "not permitted to lock memory";
  EXPECT_EQ(result, kGood);
}

// Of a library's constants: the tables for exceptions come last, behind what PT_GNU_EH_FRAME begins with.
struct Constants {
  ElfW(Addr) begin = 0, tables = 0, end = 0;
};
Constants constants_of_cpp_library() {
  Constants constants;
  const auto look = [](dl_phdr_info* object, std::size_t, void* out) {
    if (std::strstr(object->dlpi_name, "/libstdc++.so") == nullptr) return 0;
    Constants& found = *static_cast<Constants*>(out);
    for (int i = 0; i < object->dlpi_phnum; ++i) {
      if (object->dlpi_phdr[i].p_type == PT_GNU_EH_FRAME)
        found.tables = object->dlpi_addr + object->dlpi_phdr[i].p_vaddr;
    }
    for (int i = 0; i < object->dlpi_phnum; ++i) {
      const ElfW(Phdr)& part = object->dlpi_phdr[i];
      const ElfW(Addr) begin = object->dlpi_addr + part.p_vaddr;
      if (part.p_type != PT_LOAD || part.p_flags != PF_R || found.tables < begin ||
          found.tables >= begin + part.p_memsz) {
        continue;
      }
      found.begin = begin;
      found.end = begin + part.p_memsz;
    }
    return 1;
  };
  dl_iterate_phdr(look, &constants);
  return constants;
}

TEST(LockProcessMemory, LeavesOutTablesForExceptions) {
  if (!kOwnMemoryOnly) GTEST_SKIP() << "the sanitizer touches memory too";
  const Constants constants = constants_of_cpp_library();
  if (constants.begin == 0) GTEST_SKIP() << "they are not by themselves";
  const int result = in_child([&] {
    if (!lock_process_memory().warnings.empty()) return kNotPermitted;
    std::istringstream words(
        line_of_mapping(reinterpret_cast<const char*>(constants.begin), "Rss"));
    std::string key;
    long kb = -1;
    words >> key >> kb;
    const auto kb_between = [](ElfW(Addr) from, ElfW(Addr) to) {
      return static_cast<long>((to - from) / 1024);
    };
    const long page_kb = kPage / 1024;
    if (kb < kb_between(constants.begin, constants.tables) - page_kb) return 1;
    return kb <= kb_between(constants.begin, constants.tables) + 2 * page_kb ? kGood : 2;
  });
  if (result == kNotPermitted) GTEST_SKIP() << "not permitted to lock memory";
  EXPECT_EQ(result, kGood);
}

TEST(LockProcessMemory, LeavesAllButLargeBlocksWithMalloc) {
  if (!kOwnMemoryOnly) GTEST_SKIP() << "the sanitizer has a malloc of its own";
  const int result = in_child([] {
    // What malloc begins with, whatever other tests have taught it.
    constexpr int kUsual = 128 << 10;
    if (mallopt(M_MMAP_THRESHOLD, kUsual) != 1) return 1;
    // The last of so many that no gap is left for it.
    const auto is_of_the_heap = [](std::size_t size) {
      std::vector<std::unique_ptr<char, void (*)(void*)>> blocks;
      for (int i = 0; i < 64; ++i)
        blocks.emplace_back(static_cast<char*>(std::malloc(size)), std::free);
      return std::less<>()(blocks.back().get(), static_cast<char*>(::sbrk(0)));
    };
    constexpr std::size_t kBlock = kFetchedAlone / 2;
    if (is_of_the_heap(kBlock)) return 2;
    if (!lock_process_memory().warnings.empty()) return kNotPermitted;
    if (is_of_the_heap(2 * kFetchedAlone)) return 3;
    const char* const before = static_cast<char*>(::sbrk(0));
    if (!is_of_the_heap(kBlock)) return 4;
    // Nor does it go back.
    return static_cast<char*>(::sbrk(0)) - before > static_cast<std::ptrdiff_t>(kBlock) ? kGood : 5;
  });
  if (result == kNotPermitted) GTEST_SKIP() << "not permitted to lock memory";
  EXPECT_EQ(result, kGood);
}

TEST(PriorityOf, PutsBriefWorkBelowTheStepAndDecodingBelowThat) {
  EXPECT_EQ(priority_of(ThreadDuty::kStep, 60), 60);
  EXPECT_EQ(priority_of(ThreadDuty::kBrief, 60), 59);
  EXPECT_EQ(priority_of(ThreadDuty::kDecoding, 60), 58);
  for (const ThreadDuty duty : {ThreadDuty::kStep, ThreadDuty::kBrief, ThreadDuty::kDecoding}) {
    EXPECT_EQ(priority_of(duty, 1), 1);
    EXPECT_EQ(priority_of(duty, 0), 0);
  }
}

// Of the calling thread, as the kernel has it: 0 and more is normal, below are real-time priorities.
int effective_priority() {
  std::ifstream file("/proc/thread-self/stat");
  std::string line;
  std::getline(file, line);
  std::istringstream words(line.substr(line.rfind(')') + 1));
  std::string skipped;
  for (int i = 0; i < 15; ++i) words >> skipped;  // state to cstime
  int priority = 0;
  words >> priority;
  return priority;
}

TEST(PriorityMutex, ItsHolderRunsAsTheOneThatWaitsForIt) {
  constexpr int kWaiting = 20;
  PriorityMutex mutex;
  std::atomic<bool> held{false};
  std::atomic<bool> refused{false};
  bool lifted = false;
  int afterwards = -1;
  std::thread holder([&] {
    mutex.lock();
    held = true;
    lifted = eventually([&] { return refused || effective_priority() == -1 - kWaiting; });
    mutex.unlock();
    afterwards = effective_priority();
  });
  ASSERT_TRUE(eventually([&] { return held.load(); }));
  std::thread waiter([&] {
    refused = !apply_realtime({kWaiting, -1, false}).warnings.empty();
    mutex.lock();
    mutex.unlock();
  });
  waiter.join();
  holder.join();
  if (refused) GTEST_SKIP() << "not permitted to have a priority";
  EXPECT_TRUE(lifted);
  EXPECT_GE(afterwards, 0);
}

TEST(ThreadPageFaults, CountsThoseOfTheCallingThread) {
  const FreshMemory memory(64 * kPage);
  EXPECT_GT(faults_of_touching(memory.data(), memory.size()), 0);
  if (kOwnMemoryOnly) {
    EXPECT_EQ(faults_of_touching(memory.data(), memory.size()), 0);
  }
  // Another thread's are not counted here.
  const FreshMemory other(4096 * kPage);
  long elsewhere = 0;
  const PageFaults before = thread_page_faults();
  std::thread([&] { elsewhere = faults_of_touching(other.data(), other.size()); }).join();
  const PageFaults after = thread_page_faults();
  EXPECT_LT(after.minor - before.minor, elsewhere);
}

// Whether this thread runs behind all others.
bool runs_last() {
  int policy = -1;
  sched_param parameters{};
  pthread_getschedparam(pthread_self(), &policy, &parameters);
  return policy == SCHED_IDLE || (policy == SCHED_OTHER && ::getpriority(PRIO_PROCESS, 0) == 19);
}

TEST(SetLowestPriority, LetsAllOthersGoFirst) {
  std::string warning = "none";
  bool last = false;
  std::thread([&] {
    warning = set_lowest_priority();
    last = runs_last();
  }).join();
  EXPECT_EQ(warning, "");
  EXPECT_TRUE(last);
  EXPECT_FALSE(runs_last());
}

TEST(SetUsualPriority, LetsAThreadThatRunsLastRunAsOthersDo) {
  std::promise<void> is_last;
  std::promise<void> is_hurried;
  bool last = true;
  std::thread thread([&] {
    static_cast<void>(set_lowest_priority());
    is_last.set_value();
    is_hurried.get_future().wait();
    last = runs_last();
  });
  is_last.get_future().wait();
  const bool granted = set_usual_priority(thread.native_handle());
  is_hurried.set_value();
  thread.join();
  rlimit nice{};
  ::getrlimit(RLIMIT_NICE, &nice);
  if (::geteuid() == 0 || nice.rlim_cur >= 20) {
    EXPECT_TRUE(granted);
  }
  EXPECT_EQ(last, !granted);
}

TEST(SetLowestPriority, HoldsWhateverTheThreadThatStartedItRunsAs) {
  cpu_set_t allowed;
  ASSERT_EQ(sched_getaffinity(0, sizeof allowed, &allowed), 0);
  RealtimeOptions options;
  options.priority = 10;
  options.cpu = 0;
  while (CPU_ISSET(static_cast<unsigned>(options.cpu), &allowed) == 0) ++options.cpu;
  std::string warning = "none";
  bool last = false;
  int processors = 0;
  std::thread([&] {
    static_cast<void>(apply_realtime(options));
    std::thread([&] {
      warning = set_lowest_priority();
      last = runs_last();
      cpu_set_t cpus;
      if (sched_getaffinity(0, sizeof cpus, &cpus) == 0) processors = CPU_COUNT(&cpus);
    }).join();
  }).join();
  EXPECT_EQ(warning, "");
  EXPECT_TRUE(last);
  EXPECT_EQ(processors, CPU_COUNT(&allowed));
}

TEST(MonotonicNow, NeverGoesBackwards) {
  double last_s = monotonic_now_s();
  for (int i = 0; i < 10'000; ++i) {
    const double now_s = monotonic_now_s();
    ASSERT_GE(now_s, last_s);
    last_s = now_s;
  }
}

}  // namespace
}  // namespace alidade
