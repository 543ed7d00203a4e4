// Images for those who ask: none without a wish, one wish for all who ask at once, no more than one an interval, and
// nobody waits for ever.

#include "edge_app/taps/image_tap.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <thread>
#include <vector>

namespace alidade {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr milliseconds kNow{0};

class ImageTapTest : public ::testing::Test {
 protected:
  [[nodiscard]] TappedFrame frame(std::int64_t number) const {
    TappedFrame tapped;
    tapped.frame = number;
    tapped.image = {luma_.data(), 960, 540, 960};
    tapped.slot = static_cast<ImageSlot>(number % kImageSlots);
    tapped.landmarks.kind = FrameLandmarks::Kind::kLandmarks;
    tapped.landmarks.count = 1;
    tapped.landmarks.found[0] = {100, 200, 0.5F, -0.25F, true};
    return tapped;
  }
  // What the real-time thread does; without waiting for anybody.
  static void serve(ImageTap* tap, std::int64_t frames, const TappedFrame& prototype) {
    TappedFrame tapped = prototype;
    for (std::int64_t served = 0; served < frames;) {
      if (!tap->take_wish()) {
        std::this_thread::yield();
        continue;
      }
      ++tapped.frame;
      EXPECT_TRUE(tap->push(tapped));
      ++served;
    }
  }

  std::vector<std::uint8_t> luma_ = std::vector<std::uint8_t>(960 * 540, 100);
};

TEST_F(ImageTapTest, WantsNothingUntilSomebodyAsksAndThenOne) {
  ImageTap tap;
  EXPECT_FALSE(tap.take_wish());
  EXPECT_EQ(tap.ask(kNow), nullptr);
  EXPECT_EQ(tap.ask(kNow), nullptr);
  EXPECT_TRUE(tap.take_wish());
  EXPECT_FALSE(tap.take_wish()) << "two who ask, one wish";
  EXPECT_EQ(tap.ask(kNow), nullptr);
  EXPECT_FALSE(tap.take_wish()) << "it is still on its way";
}

TEST_F(ImageTapTest, GivesTheNextFrameSmallWithItsLandmarksAndTheSlotBack) {
  ImageTap tap;
  std::thread tap_thread(&ImageTap::run, &tap);
  std::thread realtime([&] { serve(&tap, 1, frame(7)); });
  const auto image = tap.ask(seconds(60));
  realtime.join();
  tap.end();
  tap_thread.join();
  ASSERT_NE(image, nullptr);
  EXPECT_EQ(image->frame, 8);
  EXPECT_EQ(image->width, 960);
  EXPECT_EQ(image->height, 540);
  EXPECT_EQ(image->jpeg.substr(0, 2), "\xff\xd8");
  EXPECT_EQ(image->landmarks.count, 1);
  EXPECT_EQ(image->landmarks.found[0].du_px, 0.5F);
  ImageSlot slot = kNoImageSlot;
  ASSERT_TRUE(tap.pop_returned(slot));
  EXPECT_EQ(slot, 7);
  EXPECT_FALSE(tap.pop_returned(slot));
}

TEST_F(ImageTapTest, GivesTheSameImageAgainWithinTheInterval) {
  ImageTap tap(hours(1));
  std::thread tap_thread(&ImageTap::run, &tap);
  std::thread realtime([&] { serve(&tap, 1, frame(0)); });
  const auto image = tap.ask(seconds(60));
  realtime.join();
  ASSERT_NE(image, nullptr);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(tap.ask(kNow), image);
  EXPECT_FALSE(tap.take_wish());
  tap.end();
  tap_thread.join();
}

TEST_F(ImageTapTest, ManyWhoAskAtOnceShareTheirImages) {
  constexpr int kAskers = 8;
  ImageTap tap(hours(1));
  std::thread tap_thread(&ImageTap::run, &tap);
  std::vector<std::shared_ptr<const LiveImage>> got(kAskers);
  std::vector<std::thread> askers;
  for (auto& image : got) askers.emplace_back([&] { image = tap.ask(seconds(60)); });
  serve(&tap, 1, frame(0));
  for (std::thread& asker : askers) asker.join();
  tap.end();
  tap_thread.join();
  ASSERT_NE(got[0], nullptr);
  for (const auto& image : got) EXPECT_EQ(image, got[0]);
}

TEST_F(ImageTapTest, KeepsTheLastImagesByTheirFrames) {
  constexpr auto kKept = static_cast<std::int64_t>(ImageTap::kKept);
  constexpr std::int64_t kServed = 2 * kKept + 1;  // one is let go at a time
  ImageTap tap(kNow);
  std::thread tap_thread(&ImageTap::run, &tap);
  std::thread realtime([&] { serve(&tap, kServed, frame(0)); });
  for (std::int64_t i = 1; i <= kServed; ++i) {
    const auto image = tap.ask(seconds(60));
    ASSERT_NE(image, nullptr);
    EXPECT_EQ(image->frame, i);
    // As the capture thread does.
    for (ImageSlot slot = kNoImageSlot; tap.pop_returned(slot);) {
    }
  }
  realtime.join();
  EXPECT_EQ(tap.of_frame(kServed - kKept), nullptr);
  for (std::int64_t i = kServed - kKept + 1; i <= kServed; ++i) {
    const auto kept = tap.of_frame(i);
    EXPECT_TRUE(kept != nullptr && kept->frame == i) << i;
  }
  EXPECT_EQ(tap.of_frame(kServed + 1), nullptr);
  tap.end();
  tap_thread.join();
}

TEST_F(ImageTapTest, TheEndWakesWhoWaits) {
  ImageTap tap;
  std::thread tap_thread(&ImageTap::run, &tap);
  std::thread asker([&] { EXPECT_EQ(tap.ask(hours(1)), nullptr); });
  while (!tap.take_wish()) std::this_thread::yield();
  tap.end();
  tap_thread.join();
  asker.join();
  EXPECT_EQ(tap.ask(hours(1)), nullptr) << "who asks later does not wait at all";
}

TEST_F(ImageTapTest, WhoWaitsIsLetGoWhenItIsClosed) {
  ImageTap tap;
  std::thread asker([&] { EXPECT_EQ(tap.ask(hours(1)), nullptr); });
  while (!tap.take_wish()) std::this_thread::yield();
  tap.close();
  asker.join();
}

TEST_F(ImageTapTest, WhatFindsNoRoomIsRefusedAndTheWishStands) {
  ImageTap tap;
  EXPECT_TRUE(tap.push(frame(0)));
  EXPECT_TRUE(tap.push(frame(1)));
  EXPECT_FALSE(tap.take_wish());
  EXPECT_FALSE(tap.push(frame(2)));
  EXPECT_TRUE(tap.take_wish());
}

}  // namespace
}  // namespace alidade
