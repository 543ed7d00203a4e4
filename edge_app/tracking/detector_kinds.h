#pragma once
// DetectorKind: the kinds of built-in detectors. Each is one row of kDetectorKinds. Configuration,
// log, /api/v1/status, /metrics and the status page follow from the row and from the switches over
// DetectorKind, which the compiler keeps complete. To add a kind: README.md of this folder.

#include <array>
#include <cstddef>

namespace alidade {

enum class DetectorKind { kMotion, kPeople, kOnnx, kCount };

inline constexpr auto kDetectorKindCount = static_cast<std::size_t>(DetectorKind::kCount);

struct DetectorKindRow {
  DetectorKind kind;
  const char* name;   // the key below `detectors`, and the name in all outputs
  bool needs_ground;  // requires tracking.plane
};

// The detectors look at a picture from the last row to the first. What the detector of a later row
// has found is left out of the findings of earlier rows.
inline constexpr std::array<DetectorKindRow, kDetectorKindCount> kDetectorKinds = {
    {{DetectorKind::kMotion, "motion", false},
     {DetectorKind::kPeople, "people", true},
     {DetectorKind::kOnnx, "onnx", false}}};

constexpr bool detector_kinds_are_in_order() {
  for (std::size_t i = 0; i < kDetectorKindCount; ++i) {
    if (static_cast<std::size_t>(kDetectorKinds[i].kind) != i) return false;
  }
  return true;
}
static_assert(detector_kinds_are_in_order());

// One value for each kind.
template <class T>
class OfDetectors {
 public:
  [[nodiscard]] T& operator[](DetectorKind kind) { return values_[static_cast<std::size_t>(kind)]; }
  [[nodiscard]] const T& operator[](DetectorKind kind) const {
    return values_[static_cast<std::size_t>(kind)];
  }

 private:
  std::array<T, kDetectorKindCount> values_{};
};

}  // namespace alidade
