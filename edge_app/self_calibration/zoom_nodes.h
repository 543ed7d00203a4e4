#pragma once
// ZoomNodes: the calibrations of a camera that zooms, as they come one by one: the first alone, from the second reading on as
// the nodes of a zoom curve (core/calibration/zoom_fit.h). Each dwell between two movements of the zoom is a visit with a node of its own;
// later calibrations of the same visit make that sharper. What shares line delay, axes and clock offset beyond chance is added.
// A new connection has another clock offset: that of the nodes counts no more until one is added. Pure; allocates. One thread.

#include <optional>
#include <string>

#include "core/calibration/zoom_fit.h"
#include "core/model/calibration.h"

namespace alidade {

// As one that can be a node has.
[[nodiscard]] inline bool has_free_centre(const Calibration& c) {
  return c.covariance(index(Parameter::kCentreU), index(Parameter::kCentreU)) > 0;
}

// What a calibration makes of the nodes, and they of it.
struct ZoomAddition {
  ZoomCurve curve;          // empty: it is the first
  Calibration calibration;  // with what the others know
  std::optional<int> node;  // in the curve
};

class ZoomNodes {
 public:
  // What is stored: the curve, else perhaps a calibration with a free optical centre; made over another connection.
  void begin_with(const ZoomCurve& curve, const Calibration* first);

  [[nodiscard]] const ZoomCurve& curve() const { return curve_; }
  [[nodiscard]] bool empty() const { return curve_.empty() && !first_; }
  // Whether this visit is a node already.
  [[nodiscard]] bool has_visit() const { return visited_; }
  [[nodiscard]] bool clock_is_known() const { return clock_is_known_; }

  void leave();  // the zoom has moved
  void clock_began_anew() { clock_is_known_ = false; }

  // alone: from the data of this visit, and from none that was added before; its zoom set. options: the priors that went into
  // it. False and one line in *error: it is not of this camera, or of no curve.
  [[nodiscard]] bool add(const Calibration& alone, ZoomFitOptions options, ZoomAddition* addition,
                         std::string* error) const;
  // Makes it so.
  void take(const ZoomAddition& addition);
  // Forgets all others.
  void begin_anew(const Calibration& alone);

 private:
  ZoomCurve curve_;
  std::optional<Calibration> first_;  // until there is a curve
  bool visited_ = false;
  std::optional<int> node_;  // of this visit, in the curve
  bool clock_is_known_ = true;
};

}  // namespace alidade
