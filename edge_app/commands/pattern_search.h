#pragma once
// PatternSearch: turns the frames of a video into a PatternVideo: the points of the pattern in each
// image, on a steady clock. Images that repeat the one before are left out. Lost frames are
// noticed. Jittering time stamps are corrected (fit_clock_line). Each connection is corrected by
// itself, as the length of the gap between two connections is not known.
//
// The time stamps of all frames go into the clock, also those of images that were not searched.
// note() and look() share no state, so one thread may read while another searches.

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
  int images = 0;                    // searched, or equal to the image before
  int repeated = 0;                  // of these, the ones equal to the image before
  int skipped = 0;                   // came while another one was searched
  int found = 0;                     // images with the pattern
  int lost = 0;                      // missing according to the time stamps
  std::vector<std::string> remarks;  // about the video
  std::string doubt;  // what the images show in place of the pattern; empty: nothing is known
};

class PatternSearch {
 public:
  // name: of the video, for messages.
  PatternSearch(std::string name, const KnownPattern& pattern);

  // Must be called for every frame, in order. True: its image should be searched. Throws
  // CommandError if an image is too small (PatternDetector::kLeastImage_px) or has another size
  // than those before.
  [[nodiscard]] bool note(const Frame& frame);

  // Searches a frame. Frames must have been noted and come in the same order; some may be left out.
  // True: the pattern was found.
  bool look(const Frame& frame);

  // For the thread of look(): what it has found so far. Times are the frames' arrivals.
  [[nodiscard]] const PatternData& found_so_far();

  // For the thread of look(): what the images show in place of the pattern; empty: nothing is
  // known.
  [[nodiscard]] std::string doubt() const { return detector_.doubt(); }

  // Ends the search: no call may follow. Throws CommandError if fewer than three images were
  // searched, or if the time stamps do not increase.
  [[nodiscard]] PatternVideo finish();

 private:
  // The indices into stamps_ of one connection.
  struct Span {
    std::size_t begin = 0;
    std::size_t end = 0;
  };
  [[nodiscard]] std::vector<Span> connections() const;
  // The time of row 0 for each frame of the connection, on a steady clock if there is one.
  [[nodiscard]] std::vector<double> times_of(Span span);
  [[nodiscard]] std::vector<double> all_times();
  void remark_clock();
  // Numbers the points of a symmetric pattern the same way in all images.
  void undo_half_turns();

  const std::string name_;
  const KnownPattern pattern_;
  // Used by note().
  std::vector<FrameStamp> stamps_;       // of all frames except repeated ones
  std::optional<std::uint64_t> before_;  // digest of the image before
  int width_ = 0;
  int height_ = 0;
  int repeated_ = 0;
  int to_look_at_ = 0;
  bool interlaced_ = false;
  // Used by look().
  PatternDetector detector_;
  PatternVideo video_;
  std::vector<std::int64_t> looked_;  // FrameStamp::frame of each of video_.data.frames
  // Used by finish().
  bool unsteady_ = false;
  bool stamps_left_out_ = false;
  double worst_scatter_ = 0;  // share of a period
  double scatter_s_ = 0;      // s, of the same connection
  double period_s_ = 0;       // s, of the same connection
};

}  // namespace alidade
