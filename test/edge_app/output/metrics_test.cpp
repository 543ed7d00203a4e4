#include "edge_app/output/metrics.h"

#include <gtest/gtest.h>

#include <limits>
#include <regex>
#include <sstream>

namespace alidade {
namespace {

TEST(MetricsText, WritesAFamilyWithItsHelpTypeAndLabels) {
  MetricsText out;
  out.counter("alidade_frames_total", "Video frames");
  out.add(std::int64_t{12});
  out.gauge("alidade_sigma_radians", "By axis");
  out.add(2.5e-5, {{"axis", "pan"}, {"component", "0"}});
  out.add(1.0, {{"axis", "til\"t\\\n"}});
  EXPECT_EQ(out.text(),
            "# HELP alidade_frames_total Video frames\n"
            "# TYPE alidade_frames_total counter\n"
            "alidade_frames_total 12\n"
            "# HELP alidade_sigma_radians By axis\n"
            "# TYPE alidade_sigma_radians gauge\n"
            "alidade_sigma_radians{axis=\"pan\",component=\"0\"} 2.5e-05\n"
            "alidade_sigma_radians{axis=\"til\\\"t\\\\\\n\"} 1\n");
}

TEST(MetricsText, WritesWhatIsNotFiniteAsTheFormatWantsIt) {
  MetricsText out;
  out.gauge("x", "y");
  out.add(std::numeric_limits<double>::quiet_NaN());
  out.add(std::numeric_limits<double>::infinity());
  out.add(-std::numeric_limits<double>::infinity());
  EXPECT_EQ(out.text(), "# HELP x y\n# TYPE x gauge\nx NaN\nx +Inf\nx -Inf\n");
}

TEST(MetricsText, AHistogramsBucketsAreCumulativeAndHoldWhatIsNoLonger) {
  LatencyHistogram histogram;
  for (const double seconds : {0.0, 1e-7, 3e-6, 1e-3, 2e-3, 0.5, 1e4}) histogram.add(seconds);
  MetricsText out;
  out.histogram("h_seconds", "H");
  out.add(histogram, {{"stage", "s"}});
  std::istringstream lines(out.text());
  std::string line;
  std::getline(lines, line);
  std::getline(lines, line);
  EXPECT_EQ(line, "# TYPE h_seconds histogram");
  const std::regex bucket(R"re(h_seconds_bucket\{stage="s",le="([^"]+)"\} (\d+))re");
  double last_edge = 0;
  int buckets = 0;
  std::smatch match;
  while (std::getline(lines, line) && std::regex_match(line, match, bucket)) {
    const bool last = match[1] == "+Inf";
    const double edge = last ? std::numeric_limits<double>::infinity() : std::stod(match[1]);
    EXPECT_GT(edge, last_edge);
    int expected = 0;
    for (const double seconds : {0.0, 1e-7, 3e-6, 1e-3, 2e-3, 0.5, 1e4})
      expected += seconds <= edge ? 1 : 0;
    EXPECT_EQ(std::stoi(match[2]), expected) << line;
    last_edge = edge;
    ++buckets;
  }
  EXPECT_EQ(buckets, 25);
  EXPECT_TRUE(std::isinf(last_edge));
  EXPECT_EQ(line.rfind("h_seconds_sum{stage=\"s\"} 10000.503", 0), 0u) << line;
  std::getline(lines, line);
  EXPECT_EQ(line, "h_seconds_count{stage=\"s\"} 7");
  EXPECT_FALSE(std::getline(lines, line));
}

}  // namespace
}  // namespace alidade
