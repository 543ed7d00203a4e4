// The thread that receives for a source, with a connection that the test writes.

#include "platform/video/receiving_thread.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <string>

#include "test/platform/support/eventually.h"

namespace alidade {
namespace {

constexpr double kPause_s = 60;  // longer than any of these tests

std::chrono::steady_clock::time_point soon() {
  return std::chrono::steady_clock::now() + std::chrono::seconds(20);
}

// A camera may send a picture of another size and close at once: the refusal finds no connection.
TEST(ReceivingThread, ReportsARefusalAlsoBehindAConnectionThatHasEndedByItself) {
  std::atomic<bool> ended{false};
  ReceivingThread<int>* pushes_to = nullptr;
  ReceivingThread<int> thread(
      kPause_s,
      [&](std::string* error) {
        pushes_to->push(1, 1);
        pushes_to->push(2, 1);
        *error = "closed by the camera";
        ended = true;
        return ReadStatus::kDisconnected;
      },
      [] {});
  pushes_to = &thread;
  int picture = 0;
  std::string error;
  ASSERT_EQ(thread.next(soon(), &picture, &error), ReadStatus::kOk);
  ASSERT_TRUE(eventually([&] { return ended.load(); }));
  // The thread may queue its report before or after the refusal: next() gives one of them.
  thread.refuse("another size");
  ASSERT_EQ(thread.next(soon(), &picture, &error), ReadStatus::kDisconnected);
  EXPECT_EQ(error, "another size");
}

}  // namespace
}  // namespace alidade
