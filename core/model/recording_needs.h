#pragma once
// What a recording must have for each purpose: the numbers by which the program accepts or refuses
// it, and those that it asks for, which leave a margin. One owner: the rules, their messages and
// the manual's table (docs/manual/how-to/move-it.md, which scripts/generate-manual makes) take them
// from here. A field of view is that of the picture's width or height. Constants only.

namespace alidade {

// A recording to calibrate from, at one zoom.
inline constexpr double kCalibrationAsked_s = 10;
inline constexpr double kCalibrationBetter_s = 60;
inline constexpr double kPanAsked_fields = 2;   // from one end of the figure to the other
inline constexpr double kTiltAsked_fields = 1;  // likewise
inline constexpr double kFieldFastest_s = 2;    // in which the figure crosses a field of view
inline constexpr double kFieldSlowest_s = 5;
inline constexpr double kLandmarkStep_s = 0.5;     // between two pictures that share landmarks
inline constexpr double kLandmarkStepMost = 0.5;   // of the picture, turned in that time
inline constexpr double kMinImageMotion_px = 5;    // in that time
inline constexpr double kMinTravelShare = 0.03;    // of the image's width, for each axis
inline constexpr double kGoodTravelShare = 0.25;   // asked for where there was less
inline constexpr double kMinRateVariation = 0.05;  // of the largest rate

// What a calibration must know to be published: standard deviations. An error of the clock offset
// acts at the mount's rate, one of the others over half an image.
inline constexpr double kMaxFocalLengthError = 0.05;  // relative
inline constexpr double kMaxClockOffsetError_s = 0.01;
inline constexpr double kMaxReadoutError_s = 5e-3;   // from the first to the last row
inline constexpr double kMaxDistortionError = 0.02;  // of the radius, in the corner

// Largest scatter between parts of a recording that contradict each other, in units of what noise
// explains, if no cause shows.
inline constexpr double kMaxScatter = 30;

// Recordings to calibrate several zooms from.
inline constexpr double kZoomRestLeast_s = 6;  // a shorter rest of the zoom is left out
inline constexpr int kZoomsAsked = 5;

// Recordings to build a scene map from.
inline constexpr double kSlowMotion_px = 10;  // "slowly": of the image, during the read-out
// The same with a calibration: the motion of each row is known, and only blur limits the speed.
inline constexpr double kSlowMotionCalibrated_px = 50;
inline constexpr double kMapOverlapAsked = 0.33;  // of two neighbouring views

// A recording to verify a calibration with.
inline constexpr double kVerificationLeast_s = 30;
inline constexpr double kVerificationAsked_s = 60;
inline constexpr double kVerificationRangeLeast = 0.5;  // fields of view, for each axis
inline constexpr double kVerificationRangeAsked = 1;    // likewise
inline constexpr int kReversalsLeast = 4;               // of pan and tilt together
inline constexpr double kReturnGapLeast_s = 1;          // until a place counts as seen again
inline constexpr double kReturnOverlapLeast = 0.3;      // of two pictures that are compared
inline constexpr int kReturnsLeast = 20;                // pairs of pictures

// The motion during `alidade check`.
inline constexpr double kCheckAsked_s = 10;
inline constexpr double kCheckBaseline_s = 0.3;
inline constexpr double kCheckMotionLeast_px = 2;  // root mean square over a baseline
inline constexpr int kCheckBaselinesLeast = 8;     // without overlap

}  // namespace alidade
