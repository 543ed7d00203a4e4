// The report of a zoom calibration: its curves, what made them, and verdicts that follow the numbers.

#include "edge_app/output/zoom_report.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/calibration/number_text.h"
#include "test/support/zoom_by_formula.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

struct Zooms {
  explicit Zooms(const std::vector<double>& readings = {1000, 1250, 1500, 1750, 2000}) {
    std::vector<Calibration> calibrations;
    for (const double reading : readings) {
      calibrations.push_back(test::zoom_calibration(reading));
      dwells.push_back(
          {reading, calibrations.back(), fmt::format("report-{}.html", calibrations.size()), ""});
    }
    std::string error;
    EXPECT_TRUE(fit_zoom(calibrations, {}, &fit, &error)) << error;
  }
  [[nodiscard]] std::string page() const {
    return zoom_report({"a <zoom>", fit, dwells, movements, "1.2.3", "2026-03-01 12:00 UTC"});
  }
  ZoomFit fit;
  std::vector<ZoomReportDwell> dwells;
  std::vector<ZoomReportMovement> movements;
};

// A movement that saw log f at one reading.
ZoomReportMovement movement_at(double reading, double log_f, double sigma) {
  ZoomReportMovement movement;
  movement.from = 1000;
  movement.to = 2000;
  movement.seen.reading = {reading};
  movement.seen.log_focal_length = Eigen::Vector3d(0, 0, log_f);
  movement.seen.covariance = Eigen::Matrix3d::Identity() * sigma * sigma;
  movement.seen.frames = 40;
  movement.seen.landmarks = 77;
  movement.seen.pixel_sigma_ratio = 1.25;
  return movement;
}

TEST(ZoomReport, HoldsCurvesDwellsAndMovements) {
  Zooms zooms;
  zooms.movements.push_back(movement_at(1600, std::log(test::zoom_focal_length(1600)), 1e-3));
  const std::string page = zooms.page();
  for (const char* part :
       {"<title>Zoom calibration of a &lt;zoom&gt;</title>", "alidade 1.2.3, 2026-03-01 12:00 UTC",
        "focal length 1000 to 8000 px, from 5 dwells and 1 movement", "Focal length f",
        "Distortion k in the corner", "Optical centre, to the right", "Optical centre, below",
        "Residuals of the focal length", "<a href=\"report-5.html\">",
        "<td>1000 to 2000</td><td>40</td><td>77</td><td>1</td><td>1.25</td>"}) {
    EXPECT_THAT(page, HasSubstr(part));
  }
  // Each with its band of two sigmas.
  EXPECT_THAT(page, Not(HasSubstr("no data")));
  std::size_t bands = 0;
  for (auto at = page.find("class=\"area a\""); at != std::string::npos;
       at = page.find("class=\"area a\"", at + 1))
    ++bands;
  EXPECT_EQ(bands, 5U);
}

// As in the table that `calibrate` prints: one zoom must not seem to have another f here.
TEST(ZoomReport, HasTheFocalLengthOfAllTogetherBesideEachAlone) {
  Zooms zooms;
  zooms.dwells[2].own.camera.focal_length *= 1.001;
  const std::string page = zooms.page();
  const Calibration node = zooms.fit.curve.node(2);
  const double sigma = parameter_sigma(node, Parameter::kFocalLength);
  EXPECT_THAT(page,
              HasSubstr(fmt::format(
                  "<tr><td>{:g}</td><td>{}</td><td>{}</td><td>{}</td>", *node.zoom,
                  value_text(node.camera.focal_length, sigma), sigma_text(sigma),
                  value_text(zooms.dwells[2].own.camera.focal_length,
                             parameter_sigma(zooms.dwells[2].own, Parameter::kFocalLength)))));
}

TEST(ZoomReport, SaysThatAllIsWellOnlyIfItIs) {
  Zooms zooms;
  EXPECT_THAT(zooms.page(),
              AllOf(HasSubstr("the dwells agree in what all zooms share"),
                    HasSubstr("all dwells lie on one curve"), Not(HasSubstr("class=\"weak\""))));
  // 2 % longer than the curve, which is ten times what a lens comes back to.
  zooms.dwells[2].own.camera.focal_length *= 1.02;
  const std::string off = zooms.page();
  EXPECT_THAT(off, HasSubstr("sigmas off the curve, at reading 1500"));
  EXPECT_THAT(off, HasSubstr("this dwell does not lie on the curve of the others"));
  zooms.fit.chi_square =
      zooms.fit.degrees_of_freedom + 5 * std::sqrt(2.0 * zooms.fit.degrees_of_freedom);
  EXPECT_THAT(zooms.page(), HasSubstr("the dwells differ more than their sigmas say"));
}

TEST(ZoomReport, SaysWhatIsKnownTooLittleAndWhatWasLeftOut) {
  Zooms zooms({1000, 2000});
  zooms.dwells.push_back({1500, {}, "", "no motion: it <hardly> moved"});
  zooms.movements.push_back({2000, 1500, {}, "too fast"});
  const std::string page = zooms.page();
  EXPECT_THAT(page, HasSubstr("dwell there for some seconds, or record a zoom between"));
  EXPECT_THAT(page, HasSubstr("What would help"));
  EXPECT_THAT(page, HasSubstr("from 2 dwells and 0 movements; 1 dwell left out"));
  EXPECT_THAT(page, HasSubstr("left out: no motion: it &lt;hardly&gt; moved"));
  EXPECT_THAT(page, HasSubstr("left out: too fast"));
}

}  // namespace
}  // namespace alidade
