// plane.yaml: what is written is read as the same plane, and every slip is refused in one line that names file and line.

#include "edge_app/storage/plane_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

PlaneEstimate some_plane() {
  PlaneEstimate out;
  out.plane.R_base_from_world = R_base_from_world_of(2.5, -0.21, 0.13);
  out.plane.position = {35 + 1 / 3.0, -20.1, 12.7};
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  PlaneCovariance factor;
  for (int i = 0; i < kPlaneParameterCount; ++i) {
    for (int j = 0; j < kPlaneParameterCount; ++j)
      factor(i, j) = normal(generator) * (i < 3 ? 1e-3 : 0.05);
  }
  out.plane.covariance = factor * factor.transpose();
  out.origin = GeodeticPosition{0.84, -0.2, 520.5};
  return out;
}

std::string plane_text() { return format_plane(some_plane(), PlaneFit()); }

std::string replaced_in(std::string text, const std::string& old, const std::string& by) {
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old << " in " << text;
  return at == std::string::npos ? text : text.replace(at, old.size(), by);
}

std::string plane_error_of(const std::string& text) {
  PlaneEstimate estimate;
  std::string error;
  EXPECT_FALSE(parse_plane(text, "plane.yaml", &estimate, &error)) << text;
  return error;
}

TEST(PlaneFile, IsReadAsItWasWritten) {
  const PlaneEstimate written = some_plane();
  PlaneEstimate read;
  std::string error;
  ASSERT_TRUE(parse_plane(plane_text(), "plane.yaml", &read, &error)) << error;
  EXPECT_LT(plane_minus(read.plane, written.plane).norm(), 1e-12);
  const PlaneCovariance& cov = written.plane.covariance;
  EXPECT_LT((read.plane.covariance - cov).norm(), 1e-12 * cov.norm());
  // The small part by itself.
  const PlaneCovariance off = read.plane.covariance - cov;
  EXPECT_LT((off.topLeftCorner<3, 3>()).norm(), 1e-9 * (cov.topLeftCorner<3, 3>()).norm());
  ASSERT_TRUE(read.origin.has_value());
  EXPECT_NEAR(read.origin->latitude, 0.84, 1e-15);
  EXPECT_NEAR(read.origin->longitude, -0.2, 1e-15);
  EXPECT_EQ(read.origin->height_m, 520.5);
}

TEST(PlaneFile, WhatTheCameraDefinesHasNoVarianceThereNorBack) {
  PlaneEvidence evidence;
  evidence.data = {camera_height(12, 0.05), base_level(0.2, -0.1, 2e-3)};
  const PlaneFit fit = fit_plane(evidence);
  ASSERT_EQ(fit.status, PlaneFitStatus::kOk) << fit.message;
  const std::string text = format_plane({fit.plane, {}}, fit);
  PlaneEstimate read;
  std::string error;
  ASSERT_TRUE(parse_plane(text, "plane.yaml", &read, &error)) << error << text;
  EXPECT_FALSE(read.origin.has_value());
  EXPECT_EQ(plane_values(fit.plane).covariance(0, 0), 0);
  EXPECT_NEAR(base_attitude(read.plane).pitch, 0.2, 1e-9);
  EXPECT_LT((read.plane.covariance - fit.plane.covariance).norm(), 1e-12);
  // The base tilts about its own two axes: two sigmas of 2e-3, and the heading follows.
  EXPECT_NEAR(std::sqrt(plane_values(fit.plane).covariance(1, 1)), 2e-3, 1e-9);
}

TEST(PlaneFile, RefusesEverySlipInOneLine) {
  const std::string text = plane_text();
  struct Slip {
    const char* old;
    const char* by;
    const char* says;
  };
  for (const Slip& slip :
       std::vector<Slip>{{"format: 1", "format: 2", "plane.yaml:1: format 2 is not known"},
                         {"height: {", "heigth: {", "unknown key heigth"},
                         {"value: 12.7", "value: -12.7", "give metres above the plane"},
                         {"value: 2.5", "value: 143", "give radians, clockwise from y"},
                         {"value: -20.1", "value: south", "a finite number is needed"},
                         {"latitude_deg: ", "latitude_deg: 1", "degrees from -90 to 90"},
                         {"latitude_deg", "latitude", "unknown key origin.latitude"},
                         {"names: [heading, ", "names: [azimuth, ", "unknown name"}}) {
    const std::string error = plane_error_of(replaced_in(text, slip.old, slip.by));
    EXPECT_THAT(error, StartsWith("plane.yaml:"));
    EXPECT_THAT(error, HasSubstr(slip.says));
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }
  EXPECT_THAT(plane_error_of(""), HasSubstr("format: 1"));
  EXPECT_THAT(plane_error_of("{"), StartsWith("plane.yaml:"));
  const std::string sigma_line = replaced_in(text, "sigma: ", "sigma: 7");
  EXPECT_THAT(plane_error_of(sigma_line), HasSubstr("sigma"));
}

TEST(PlaneFile, OneThatIsNotThereIsAnError) {
  PlaneEstimate estimate;
  std::string error;
  EXPECT_FALSE(load_plane("/no/such/plane.yaml", &estimate, &error));
  EXPECT_THAT(error, StartsWith("/no/such/plane.yaml: cannot be read"));
}

}  // namespace
}  // namespace alidade
