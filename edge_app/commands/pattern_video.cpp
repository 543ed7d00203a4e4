#include "edge_app/commands/pattern_video.h"

#include <filesystem>
#include <limits>
#include <memory>

#include "edge_app/commands/command.h"
#include "platform/system/whole_file.h"
#include "platform/video/recording_frame_source.h"
#include "platform/video/video_file.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

std::unique_ptr<FrameSource> open_video(const std::string& video) {
  std::error_code error;
  if (!fs::exists(video, error)) {
    throw CommandError(kExitFailed,
                       video + ": is not there; expected a recording's directory or a video file");
  }
  if (fs::is_directory(video, error)) return open_recorded_frames({video, true, false});
  std::string why;
  if (!open_to_read(video, &why).is_open()) throw CommandError(kExitFailed, why);
  return open_video_file(video);
}

}  // namespace

PatternVideo find_pattern(const std::string& path, const KnownPattern& pattern,
                          const std::function<bool(int images, int found)>& progress) {
  const std::unique_ptr<FrameSource> source = open_video(path);
  PatternSearch search(path, pattern);
  int images = 0;
  int found = 0;
  for (;;) {
    Frame frame;
    const ReadStatus status = source->read(frame, std::numeric_limits<double>::infinity());
    if (status == ReadStatus::kEnd) break;
    if (status != ReadStatus::kOk) throw CommandError(kExitFailed, source->error());
    if (frame.luma == nullptr)
      throw CommandError(kExitFailed, path + ": holds no images; expected video.mkv or frames/");
    ++images;
    if (search.note(frame) && search.look(frame)) ++found;
    if (!progress(images, found))
      throw CommandError(kExitFailed, path + ": interrupted; nothing stored");
  }
  return search.finish();
}

}  // namespace alidade
