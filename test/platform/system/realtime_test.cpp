#include "platform/system/realtime.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
extern "C" {
#include <libavcodec/avcodec.h>
}
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "platform/system/clock.h"
#include "test/support/fresh_memory.h"

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

TEST(ApplyRealtime, LockedMemoryIsThereBeforeItIsTouched) {
  if (!kOwnMemoryOnly) GTEST_SKIP() << "the sanitizer touches memory too";
  const int result = in_child([] {
    {
      const FreshMemory memory(64 * kPage);
      if (faults_of_touching(memory.data(), memory.size()) == 0) return 1;
    }
    RealtimeOptions options;
    options.lock_memory = true;
    const RealtimeReport report = apply_realtime(options);
    if (std::find(report.granted.begin(), report.granted.end(), "memory locked") ==
        report.granted.end()) {
      return report.warnings.empty() ? 2 : kNotPermitted;
    }
    const FreshMemory memory(64 * kPage);
    return faults_of_touching(memory.data(), memory.size()) == 0 ? kGood : 3;
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
    if (line.find(" r-xp ") != std::string::npos || key.find('-') != std::string::npos)
      wanted = line.find(" r-xp ") != std::string::npos && line.find(name) != std::string::npos;
    if (wanted && key == "Size:") sum.mapped += size;
    if (wanted && key == "Rss:") sum.resident += size;
  }
  return sum;
}

TEST(ApplyRealtime, BringsInTheCodeOfTheProgramAndNotOfAllLibraries) {
  if (!kOwnMemoryOnly) GTEST_SKIP() << "the sanitizer touches memory too";
  const int result = in_child([] {
    if (avcodec_version() == 0) return 4;
    RealtimeOptions options;
    options.lock_memory = true;
    if (!apply_realtime(options).warnings.empty()) return kNotPermitted;
    for (const char* name : {"/libc.so", "/libstdc++.so", "platform_system_test"}) {
      const CodeSize code = code_of(name);
      if (code.mapped == 0 || code.resident != code.mapped) return 1;
    }
    // Megabytes of codecs, of which this program calls nothing else.
    const CodeSize codecs = code_of("/libavcodec.so");
    if (codecs.mapped == 0) return 2;
    return codecs.resident < codecs.mapped / 2 ? kGood : 3;
  });
  if (result == kNotPermitted) GTEST_SKIP() << "not permitted to lock memory";
  EXPECT_EQ(result, kGood);
}

TEST(UseSmallStacks, HoldsForThreadsStartedLater) {
  const int result = in_child([] {
    if (!use_small_stacks()) return 1;
    // More threads at a time than glibc keeps stacks of ended ones for.
    std::array<std::size_t, 16> sizes{};
    std::array<std::thread, 16> threads;
    std::atomic<bool> all_started{false};
    for (std::size_t i = 0; i < threads.size(); ++i) {
      threads[i] = std::thread([&, i] {
        pthread_attr_t attributes;
        void* lowest = nullptr;
        if (pthread_getattr_np(pthread_self(), &attributes) == 0) {
          pthread_attr_getstack(&attributes, &lowest, &sizes[i]);
          pthread_attr_destroy(&attributes);
        }
        while (!all_started) std::this_thread::yield();
      });
    }
    all_started = true;
    for (std::thread& thread : threads) thread.join();
    return sizes.back() == kThreadStack ? kGood : 2;
  });
  EXPECT_EQ(result, kGood);
}

TEST(ApplyRealtime, LockedMemoryStaysWithMalloc) {
  if (!kOwnMemoryOnly) GTEST_SKIP() << "the sanitizer has a malloc of its own";
  const int result = in_child([] {
    // More than malloc ever takes from its heap unless told to.
    constexpr std::size_t kBlock = std::size_t{40} << 20;
    const auto is_of_the_heap = [] {
      const std::unique_ptr<char, void (*)(void*)> block(static_cast<char*>(std::malloc(kBlock)),
                                                         std::free);
      return block != nullptr && std::less<>()(block.get(), static_cast<char*>(::sbrk(0)));
    };
    if (is_of_the_heap()) return 1;
    RealtimeOptions options;
    options.lock_memory = true;
    if (!apply_realtime(options).warnings.empty()) return kNotPermitted;
    const char* const before = static_cast<char*>(::sbrk(0));
    if (!is_of_the_heap()) return 2;
    const char* const after = static_cast<char*>(::sbrk(0));
    return after - before >= static_cast<std::ptrdiff_t>(kBlock / 2) ? kGood : 3;
  });
  if (result == kNotPermitted) GTEST_SKIP() << "not permitted to lock memory";
  EXPECT_EQ(result, kGood);
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
