#include "core/model/nearest_angles.h"

#include <gtest/gtest.h>

#include <cmath>

#include "test/support/hard_values.h"

namespace alidade {
namespace {

using test::paper_mechanics;

TEST(NearestAngles, SayByHowMuchAMountCannotRoll) {
  const Mechanics<double> mechanics = paper_mechanics();
  for (const double pan : {-kPi, -2.0, 0.0, 3.1}) {
    for (const double tilt : {-1.5, 0.0, 0.8}) {
      for (const double roll : {-0.2, 0.0, 1e-3, 0.2}) {
        const Matrix3<double> R = R_base_from_camera(mechanics, PanTilt<double>{pan, tilt}) *
                                  exp_so3(Vector3<double>(0, 0, roll));
        const NearestAngles nearest = nearest_angles(mechanics, R);
        // Pan turns the picture by the sine of tilt, too, and a little roll can be had for a little aim.
        EXPECT_LE(nearest.off, std::abs(roll) + 1e-12);
        EXPECT_GE(nearest.off, 0.98 * std::abs(roll) * std::cos(tilt) - 1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace alidade
