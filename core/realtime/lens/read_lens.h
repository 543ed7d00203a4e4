#pragma once
// ReadLens: the lens that OE mode gets for each frame: the zoom curve's at the reading or, if the
// reading is not believed (reading_belief.h), at the focal length that landmarks showed.
// Order of calls for a frame:
//   begin_frame()   its time
//   look_up()       the lens to pass on; as_found() if there are no readings
//   note_found()    landmarks held;  judge() if the frame's reading was looked up
// Fixed memory; no allocation. One thread.

#include "core/realtime/lens/frame_lens.h"
#include "core/realtime/lens/reading_belief.h"
#include "core/realtime/lens/zoom_readings.h"

namespace alidade {

class ReadLens {
 public:
  // options: valid.
  explicit ReadLens(const ReadingBeliefOptions& options) : judge_(options) {}

  // s, telemetry time of the frame's middle row.
  void begin_frame(double time_s) { time_s_ = time_s; }
  [[nodiscard]] double time_s() const { return time_s_; }

  // readout_s: s, from the first row to the last. False: there are no readings, or the curve does
  // not reach them; *lens is then not to be used, here and below.
  [[nodiscard]] bool look_up(const ZoomCurve& curve, const ZoomReadings& readings, double readout_s,
                             FrameLens* lens);
  // The curve's lens at the focal length that landmarks showed lately, carried on at its rate.
  // False: landmarks showed no focal length lately, or lens_of_focal_length() has no lens for it.
  [[nodiscard]] bool as_found(const ZoomCurve& curve, FrameLens* lens) const;
  [[nodiscard]] double found_rate() const { return found_rate_; }  // 1/s, of log f

  // Landmarks of this frame show this lens. rate: 1/s, of log f.
  void note_found(const Calibration& found, double rate);
  // Judges the frame's reading by the lens of note_found(), to be called after that.
  void judge(const Calibration& found);
  // Belief in the reading that was judged last.
  [[nodiscard]] ReadingBelief belief() const { return judge_.belief(age_s()); }
  // What landmarks showed no longer counts.
  void forget();

 private:
  [[nodiscard]] double age_s() const { return time_s_ - found_time_s_; }

  ReadingJudge judge_;
  double time_s_ = 0;  // s, telemetry time, of the frame
  Calibration read_;   // by the readings, of the frame
  // The lens as landmarks last showed it. Focal length 0: they have not, or too long ago.
  double found_focal_length_ = 0;  // px
  double found_rate_ = 0;          // 1/s
  double found_time_s_ = 0;        // s, telemetry time
};

}  // namespace alidade
