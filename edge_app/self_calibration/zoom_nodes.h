#pragma once
// ZoomNodes: the calibrations of a camera that zooms, as they come. The first one stands alone;
// from the second reading on they are the nodes of a zoom curve (core/calibration/zoom_fit.h). Each
// dwell between two zoom movements has a node of its own, which later calibrations of the same
// dwell sharpen. A calibration is added only if line delay, axes and clock offset agree with the
// others within chance. A new connection has another clock offset: that of the nodes is ignored
// until a calibration is added. Pure; allocates. One thread.

#include <optional>
#include <string>

#include "core/calibration/zoom_fit.h"
#include "core/model/calibration.h"

namespace alidade {

// Whether a calibration has a free optical centre, as a node needs.
[[nodiscard]] inline bool has_free_centre(const Calibration& c) {
  return c.covariance(index(Parameter::kCentreU), index(Parameter::kCentreU)) > 0;
}

// The result of adding a calibration.
struct ZoomAddition {
  ZoomCurve curve;          // empty: it is the first
  Calibration calibration;  // the new one, sharpened by the others
  std::optional<int> node;  // its index in the curve
};

class ZoomNodes {
 public:
  // What is stored: the curve, else perhaps a calibration with a free optical centre. It is of
  // another connection.
  void begin_with(const ZoomCurve& curve, const Calibration* first);

  // All nodes that were taken, also while they are doubted.
  [[nodiscard]] const ZoomCurve& curve() const { return curve_; }
  // What may be used: the curve, or an empty one while it is doubted.
  [[nodiscard]] const ZoomCurve& believed_curve() const { return is_doubted_ ? none_ : curve_; }
  [[nodiscard]] bool empty() const { return curve_.empty() && !first_; }
  // Whether this dwell has a node already.
  [[nodiscard]] bool has_visit() const { return visited_; }
  [[nodiscard]] bool clock_is_known() const { return clock_is_known_; }

  void leave();  // the zoom has moved
  void clock_began_anew() { clock_is_known_ = false; }
  // A calibration of the curve was withdrawn. All nodes share axes and clock, so none is believed
  // until a new calibration has been found to agree with them (take()), or stands alone.
  void doubt() { is_doubted_ = true; }

  // alone: from the data of this dwell, none of which was added before; its zoom is set. options:
  // the priors that went into it. False, with one line in *error: it does not belong to this
  // camera, or makes no curve.
  [[nodiscard]] bool add(const Calibration& alone, ZoomFitOptions options, ZoomAddition* addition,
                         std::string* error) const;
  // Accepts the addition.
  void take(const ZoomAddition& addition);
  // Forgets all others.
  void begin_anew(const Calibration& alone);

 private:
  ZoomCurve curve_;
  std::optional<Calibration> first_;  // until there is a curve
  bool visited_ = false;
  std::optional<int> node_;  // index in the curve, of this visit
  bool clock_is_known_ = true;
  bool is_doubted_ = false;
  ZoomCurve none_;
};

}  // namespace alidade
