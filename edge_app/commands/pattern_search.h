#pragma once
// PatternSearch: the frames of a video, one after the other, become PatternVideo: the pattern's points in them, on a steady clock.
// Images that repeat the one before are left out, lost ones noticed, stamps that jitter put right (fit_clock_line), each connection's
// by itself; what lies between two is a gap.
//
// Stamps of all frames go into the clock, also of those whose image nobody looked at: note() and look() share no state, so that
// a thread may read while another looks.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/pattern/known_pattern.h"
#include "core/pattern/pattern_data.h"
#include "core/pattern/pattern_detector.h"
#include "platform/streams/frame.h"

namespace alidade {

struct PatternVideo {
  std::string name;  // of the video, for messages
  PatternData data;
  int images = 0;                    // looked at, or found to be
  int repeated = 0;                  // the same image again
  int skipped = 0;                   // came while others were looked at
  int found = 0;                     // images with the pattern
  int lost = 0;                      // by the stamps
  std::vector<std::string> remarks;  // about the video
  std::string doubt;  // what is there in place of the pattern; empty: nothing is known
};

class PatternSearch {
 public:
  // name: of the video, for messages.
  PatternSearch(std::string name, const KnownPattern& pattern);

  // To be told of every frame. True: its image is one to look at. Throws CommandError: an image too small, or of another size.
  [[nodiscard]] bool note(const Frame& frame);

  // Frames that were noted, in their order, not necessarily all. True: the pattern is in it.
  bool look(const Frame& frame);

  // look()'s thread: what it has found so far; times are those of arrival.
  [[nodiscard]] const PatternData& found_so_far();

  // look()'s thread: what the images show in place of the pattern; empty: nothing is known.
  [[nodiscard]] std::string doubt() const { return detector_.doubt(); }

  // Ends it. Throws CommandError: too few images, stamps that do not increase.
  [[nodiscard]] PatternVideo finish();

 private:
  // A connection's stamps and what became of them.
  struct Span {
    std::size_t begin = 0;
    std::size_t end = 0;
  };
  [[nodiscard]] std::vector<Span> connections() const;
  // Row 0's exposure of each of its frames, on a steady clock where there is one.
  [[nodiscard]] std::vector<double> times_of(Span span);
  [[nodiscard]] std::vector<double> all_times();
  void remark_clock();
  // A symmetric pattern's points, the same way round from image to image.
  void undo_half_turns();

  const std::string name_;
  const KnownPattern pattern_;
  // note()'s.
  std::vector<FrameStamp> stamps_;       // of all but repeated images
  std::optional<std::uint64_t> before_;  // digest of the image before
  int width_ = 0;
  int height_ = 0;
  int repeated_ = 0;
  int to_look_at_ = 0;
  bool interlaced_ = false;
  // look()'s.
  PatternDetector detector_;
  PatternVideo video_;
  std::vector<std::int64_t> looked_;  // FrameStamp::frame of each of video_.data.frames
  // finish()'s.
  bool unsteady_ = false;
  bool stamps_left_out_ = false;
  double worst_scatter_ = 0;  // of a period
  double scatter_s_ = 0;
  double period_s_ = 0;
};

}  // namespace alidade
