#include "edge_app/commands/link_trial.h"

#include "edge_app/commands/command.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

// A stream with a key frame each ten seconds, as some cameras are set.
constexpr double kKeyFrameWait_s = 10;
// A link that fails twice in a row is not waited for.
constexpr int kMostFailures = 2;

// read: waits at most so long for an item.
template <class Source, class Item, class IsWanted>
bool first_item(Source& source, double wait_s, const IsWanted& is_wanted, Item* item,
                std::string* error) {
  const double end_s = monotonic_now_s() + wait_s;
  int failures = 0;
  while (true) {
    const double left_s = end_s - monotonic_now_s();
    if (!(left_s > 0)) break;
    switch (source.read(*item, left_s)) {
      case ReadStatus::kOk:
        if (is_wanted(*item)) return true;
        break;
      case ReadStatus::kTimeout:
        break;
      case ReadStatus::kDisconnected:
        *error = source.error();
        if (++failures == kMostFailures) return false;
        break;
      case ReadStatus::kEnd:
      case ReadStatus::kStopped:
      case ReadStatus::kFailed:
        *error = source.error();
        return false;
    }
  }
  if (error->empty()) *error = nothing_came(source.name(), wait_s);
  return false;
}

}  // namespace

bool first_sample(const PanTiltConfig& config, PanTiltSample* sample, std::string* error) {
  error->clear();
  const auto source = make_pan_tilt_source(config);
  return first_item(
      *source, config.timeout_s + kConnectSlack_s, [](const PanTiltSample&) { return true; },
      sample, error);
}

bool first_picture(const VideoConfig& config, int* width, int* height, std::string* error) {
  error->clear();
  const auto source = make_frame_source(config, true);
  Frame frame;
  // A frame without a picture has the size that the configuration allows at most.
  if (!first_item(
          *source, config.timeout_s + kConnectSlack_s + kKeyFrameWait_s,
          [](const Frame& each) { return each.luma != nullptr; }, &frame, error))
    return false;
  *width = frame.width;
  *height = frame.height;
  return true;
}

}  // namespace alidade
