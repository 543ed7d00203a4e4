// A source that waits though its connection stands: what the link's health tells meanwhile.

#include "edge_app/pipeline/read_loop.h"

#include <gtest/gtest.h>

#include <deque>
#include <string>
#include <utility>
#include <vector>

namespace alidade {
namespace {

// Gives these answers, one after another, and says what it waits for as it gives them.
class WaitingVideo final : public FrameSource {
 public:
  using Answer = std::pair<ReadStatus, std::string>;
  explicit WaitingVideo(std::deque<Answer> answers) : answers_(std::move(answers)) {}
  ReadStatus read(Frame& frame, double /*timeout_s*/) override {
    frame = Frame{};
    const Answer answer = answers_.front();
    answers_.pop_front();
    waiting_ = answer.second;
    return answer.first;
  }
  void stop() override {}
  std::string error() const override { return "gone"; }
  std::string name() const override { return "camera"; }
  std::string waiting() const override { return waiting_; }
  std::size_t left() const { return answers_.size(); }

 private:
  std::deque<Answer> answers_;
  std::string waiting_;
};

TEST(ReadLoop, TellsTheLinkWhatIsWaitedForUntilItCame) {
  WaitingVideo video({{ReadStatus::kTimeout, ""},
                      {ReadStatus::kDisconnected, ""},
                      {ReadStatus::kTimeout, "a key frame since 3 s"},
                      {ReadStatus::kDisconnected, "a key frame since 4 s"},
                      {ReadStatus::kOk, ""},
                      {ReadStatus::kOk, "a key frame since 5 s"},
                      {ReadStatus::kEnd, ""}});
  LinkWatch watch;
  std::vector<std::string> of_frames;
  std::vector<std::string> of_losses;
  const std::string error = read_to_the_end<Frame>(
      video, &watch,
      [&](const Frame&) {
        of_frames.push_back(watch.now(0).reason);
        return true;
      },
      [&](double) { of_losses.push_back(watch.now(0).reason); });
  EXPECT_EQ(error, "");
  EXPECT_EQ(video.left(), 0U);
  // Asked before the source is: what it said last.
  EXPECT_EQ(of_losses, std::vector<std::string>({"gone"}));
  EXPECT_EQ(of_frames, std::vector<std::string>({"a key frame since 4 s", ""}));
  EXPECT_EQ(watch.now(0).reason, "a key frame since 5 s");
}

}  // namespace
}  // namespace alidade
