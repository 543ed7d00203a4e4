#include "platform/system/realtime.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>

#include <thread>

#include "platform/system/clock.h"

namespace alidade {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// In a thread of its own: the settings stay with the thread.
std::vector<std::string> apply_in_thread(const RealtimeOptions& options, int* cpu = nullptr) {
  std::vector<std::string> warnings;
  std::thread([&] {
    warnings = apply_realtime(options);
    if (cpu != nullptr) {
      *cpu = sched_getcpu();
    }
  }).join();
  return warnings;
}

TEST(ApplyRealtime, DoesNothingByDefault) {
  EXPECT_THAT(apply_in_thread(RealtimeOptions{}), IsEmpty());
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
  EXPECT_THAT(apply_in_thread(options, &cpu), IsEmpty());
  EXPECT_EQ(cpu, last);
}

TEST(ApplyRealtime, SaysInPlainWordsWhatItCouldNotDoAndGoesOn) {
  RealtimeOptions options;
  options.priority = 1000;
  options.cpu = 100'000;
  EXPECT_THAT(apply_in_thread(options), ElementsAre(HasSubstr("no real-time priority 1000"),
                                                    HasSubstr("cannot run on processor 100000")));
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
