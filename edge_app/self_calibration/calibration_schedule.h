#pragma once
// CalibrationSchedule: when SelfCalibration does what. Times in s. "of data": the span of the data
// that the session holds, not the time that passes.

namespace alidade {

struct CalibrationSchedule {
  double first_try_s = 6;        // of data
  double next_try_s = 1.5;       // of new data
  int many_tries = 20;           // unsuccessful tries ...
  double slow_try_s = 5;         // ... after which the pause is this, of new data
  double watch_window_s = 12;    // of data for a calibration that tests another
  double first_watch_s = 12;     // doubles up to ...
  double longest_watch_s = 600;  // ... this
  double store_retry_s = 60;     // after the disk refused a calibration
  double zoom_arrives_s = 0.1;   // without a change; before that the zoom may just pass by
  double zoom_settles_s = 0.5;   // before anything is adjusted
  double zoom_glitch_s = 0.2;  // a reading that differs for less is ignored; no movement is shorter
  double zoom_silence_s = 5;   // without a reading, if there were some
  double silence_s = 2;        // without a frame or sample while the other stream goes on
  double worth_publishing = 0.75;  // a refinement must bring some parameter's sigma to this share
  double most_wander_s = 0.01;     // s, of the video's delay
};

}  // namespace alidade
