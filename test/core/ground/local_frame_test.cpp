#include "core/ground/local_frame.h"

#include <gtest/gtest.h>

#include "core/model/trigonometry.h"

namespace alidade::test {
namespace {

GeodeticPosition at_degrees(double latitude, double longitude, double height_m) {
  return {latitude * kPi / 180, longitude * kPi / 180, height_m};
}

struct KnownPlace {
  GeodeticPosition origin;
  GeodeticPosition place;
  Vector3<double> local;
};

// By pymap3d 3.2.0, geodetic2enu; the first also by PROJ 9, +proj=topocentric, to 1e-9 m.
const std::vector<KnownPlace>& known_places() {
  static const std::vector<KnownPlace> places = {
      {at_degrees(48.1351, 11.5820, 520),
       at_degrees(48.1402, 11.5761, 535),
       {-439.13208270038285, 567.1487562174997, 14.959670107235922}},
      {at_degrees(-33.8688, 151.2093, 20),
       at_degrees(-33.9, 151.25, 5),
       {3764.463769930753, -3461.461027334675, -17.052421530241872}},
      {at_degrees(89.9, 10, 0),
       at_degrees(89.95, -170, 100),
       {0, 16754.339465519028, 78.06860831330151}},
      {at_degrees(0, 179.999, 0),
       at_degrees(0.01, -179.999, -5),
       {222.63880364394078, 1105.7418800502567, -5.100379962024642}}};
  return places;
}

TEST(LocalFrame, AgreesWithOtherPrograms) {
  for (const KnownPlace& known : known_places())
    EXPECT_LT((LocalFrame(known.origin).local(known.place) - known.local).norm(), 1e-7);
}

TEST(LocalFrame, ThereAndBackIsTheSame) {
  for (const KnownPlace& known : known_places()) {
    const LocalFrame frame(known.origin);
    const GeodeticPosition back = frame.geodetic(known.local);
    EXPECT_NEAR(back.latitude, known.place.latitude, 1e-14);
    EXPECT_NEAR(back.longitude, known.place.longitude, 1e-11);  // near a pole it means less
    EXPECT_NEAR(back.height_m, known.place.height_m, 1e-7);
  }
  const LocalFrame pole(at_degrees(90, 0, 0));
  EXPECT_NEAR(pole.geodetic({0, 0, 30}).latitude, kPi / 2, 1e-9);
  EXPECT_NEAR(pole.geodetic({0, 0, 30}).height_m, 30, 1e-8);
}

}  // namespace
}  // namespace alidade::test
