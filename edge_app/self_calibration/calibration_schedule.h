#pragma once
// CalibrationSchedule: when SelfCalibration does what. Times in s. "of data": the span of the data
// that the session holds, not the time that passes.

namespace alidade {

struct CalibrationSchedule {
  double first_try_s = 6;          // of data, for the first try
  double next_try_s = 1.5;         // of new data, for the next try
  int many_tries = 20;             // after so many tries without success ...
  double slow_try_s = 5;           // ... the next try needs this, of new data
  double watch_window_s = 12;      // of data, for a calibration that tests the published one
  double first_watch_s = 12;       // pause before such a test; it doubles up to ...
  double longest_watch_s = 600;    // ... this
  double store_retry_s = 60;       // after the disk refused a calibration
  double zoom_arrives_s = 0.1;     // without a change: the zoom does not just pass by
  double zoom_settles_s = 0.5;     // without a change: frames show the new zoom and can be used
  double zoom_glitch_s = 0.2;      // a shorter difference is ignored; no movement is shorter
  double zoom_silence_s = 5;       // without a reading after others: the readings have ceased
  double silence_s = 2;            // without a frame or sample while the other stream goes on: lost
  double worth_publishing = 0.75;  // a refinement must bring a parameter's sigma below this share
  double most_wander_s = 0.01;     // of the video's delay; more is a delay that wanders
};

}  // namespace alidade
