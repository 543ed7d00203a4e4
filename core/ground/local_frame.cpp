#include "core/ground/local_frame.h"

#include <cmath>

namespace alidade {
namespace {

constexpr double kRadius_m = 6378137;  // a
constexpr double kFlattening = 1 / 298.257223563;
constexpr double kSquare = kFlattening * (2 - kFlattening);  // e^2

double normal_radius(double latitude) {
  const double sine = std::sin(latitude);
  return kRadius_m / std::sqrt(1 - kSquare * sine * sine);
}

Vector3<double> ecef_of(const GeodeticPosition& position) {
  const double n = normal_radius(position.latitude);
  const double out = (n + position.height_m) * std::cos(position.latitude);
  return {out * std::cos(position.longitude), out * std::sin(position.longitude),
          (n * (1 - kSquare) + position.height_m) * std::sin(position.latitude)};
}

}  // namespace

LocalFrame::LocalFrame(const GeodeticPosition& origin)
    : origin_(origin), origin_ecef_(ecef_of(origin)) {
  const double sin_lat = std::sin(origin.latitude);
  const double cos_lat = std::cos(origin.latitude);
  const double sin_lon = std::sin(origin.longitude);
  const double cos_lon = std::cos(origin.longitude);
  R_local_from_ecef_ << -sin_lon, cos_lon, 0,           //
      -sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat,  //
      cos_lat * cos_lon, cos_lat * sin_lon, sin_lat;
}

Vector3<double> LocalFrame::local(const GeodeticPosition& position) const {
  return R_local_from_ecef_ * (ecef_of(position) - origin_ecef_);
}

GeodeticPosition LocalFrame::geodetic(const Vector3<double>& local_m) const {
  const Vector3<double> x = origin_ecef_ + R_local_from_ecef_.transpose() * local_m;
  const double out = x.head<2>().norm();
  const double polar = 1 - kFlattening;  // b / a
  GeodeticPosition position;
  position.longitude = out > 0 ? std::atan2(x.y(), x.x()) : origin_.longitude;
  // tan of the parametric latitude as sine and cosine, so that the poles are no special case.
  double sine = x.z();
  double cosine = polar * out;
  for (int i = 0; i < 5; ++i) {
    const double norm = std::hypot(sine, cosine);
    const double s = sine / norm;
    const double c = cosine / norm;
    const double up = x.z() + kSquare / (1 - kSquare) * kRadius_m * polar * s * s * s;
    const double across = out - kSquare * kRadius_m * c * c * c;
    position.latitude = std::atan2(up, across);
    sine = polar * std::sin(position.latitude);
    cosine = std::cos(position.latitude);
  }
  const double n = normal_radius(position.latitude);
  const double sin_lat = std::sin(position.latitude);
  const double cos_lat = std::cos(position.latitude);
  position.height_m = out * cos_lat + x.z() * sin_lat - n * (1 - kSquare * sin_lat * sin_lat);
  return position;
}

}  // namespace alidade
