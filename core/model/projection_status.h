#pragma once
// Result of a projection or back-projection: ok, or why there is none. Outputs are valid with kOk
// only.

namespace alidade {

enum class ProjectionStatus {
  kOk,
  kBehindCamera,           // the direction has no positive component along the optical axis
  kBeyondDistortionLimit,  // radial_distortion < 0, at or beyond where the model turns back
  kNoRow,                  // rolling shutter: no unique row, as the motion overtakes the read-out
  kNotFinite               // an argument is not finite, or the result is too large to represent
};

[[nodiscard]] constexpr const char* to_string(ProjectionStatus status) {
  switch (status) {
    case ProjectionStatus::kOk:
      return "ok";
    case ProjectionStatus::kBehindCamera:
      return "behind the camera";
    case ProjectionStatus::kBeyondDistortionLimit:
      return "beyond the radius where the distortion model is invertible";
    case ProjectionStatus::kNoRow:
      return "no unique row of the rolling shutter sees it";
    case ProjectionStatus::kNotFinite:
      return "not finite";
  }
  return "unknown status";
}

}  // namespace alidade
