#pragma once
// Input of a step over a recording, for `replay` and `verify`: calibration, frames and samples one
// after the other, images.

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/realtime/image/image_view.h"
#include "edge_app/commands/command.h"
#include "edge_app/record/published_calibration.h"
#include "platform/storage/recording.h"
#include "platform/video/recording_frame_source.h"

namespace alidade {

// calibration: a file; empty: <recording>/alidade/calibration.yaml. Throws CommandError if the file
// does not exist, cannot be read or is not a calibration.
[[nodiscard]] PublishedCalibration find_calibration(const std::string& recording,
                                                    const std::string& calibration);

// Empty: the frames have the calibration's size. Else one line.
[[nodiscard]] std::string size_error(const RecordingInfo& info,
                                     const PublishedCalibration& calibration,
                                     const std::string& recording);

// The next item of a recording; empty at its end. Throws CommandError if the recording cannot be
// read on.
template <typename Item, typename Source>
std::optional<Item> next_of(Source& source) {
  Item item;
  const ReadStatus status = source.read(item, std::numeric_limits<double>::infinity());
  if (status == ReadStatus::kOk) return item;
  if (status == ReadStatus::kEnd) return std::nullopt;
  throw CommandError(kExitFailed, source.error());
}

// Whether the recording holds video.mkv or frames/.
[[nodiscard]] bool has_images(const std::string& recording);

// The images of a recording. Its frames come from another source; some of them may have no image.
class RecordedImages {
 public:
  // Throws CommandError if no image can be decoded.
  explicit RecordedImages(const std::string& recording);

  // The image of the frame with this stamp; empty if there is none. To be called once for each
  // frame, in order. Throws CommandError if the images cannot be read on.
  std::optional<Frame> of(const FrameStamp& stamp);

  [[nodiscard]] std::vector<std::string> remarks() const { return source_->remarks(); }

 private:
  std::unique_ptr<RecordingFrameSource> source_;
  std::optional<Frame> next_;
};

// Lent with `image`. Not valid() if there is no image.
[[nodiscard]] ImageView view_of(const std::optional<Frame>& image);

}  // namespace alidade
