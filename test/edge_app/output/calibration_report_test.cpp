// The report as a reader's browser meets it: whole, self-contained, harmless, of bearable size.

#include "edge_app/output/calibration_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "edge_app/output/svg_plot.h"
#include "test/support/simulated_recording.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

struct Calibrated {
  explicit Calibrated(const test::Simulation& simulation) : input(test::simulate(simulation)) {
    result = calibrate(input, options);
  }
  [[nodiscard]] std::string report(const std::string& name = "recording") const {
    return calibration_report(
        {name, input, options, result, remarks, "1.2.3", "2026-03-01 12:00 UTC", untracked});
  }
  CalibrationInput input;
  CalibrationOptions options;
  CalibrationResult result;
  std::vector<std::string> remarks;
  std::optional<UntrackedFrames> untracked;
};

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

TEST(CalibrationReport, HoldsVerdictTablesAndEveryPlot) {
  const Calibrated run{test::Simulation()};
  ASSERT_TRUE(run.result.ok()) << run.result.message;
  const std::string page = run.report();
  for (const char* part :
       {"<strong>Calibrated</strong>", "Parameters", "focal_length", "nominal \u00b1 50",
        "Correlations", "Image residuals over time, u", "Image residuals over time, v",
        "Image residuals over the image", "Distribution", "Telemetry minus spline, pan",
        "Telemetry minus spline, tilt", "Stamps of the image", "Stamps of the telemetry",
        "Map in the base", "prefers-color-scheme: dark"}) {
    EXPECT_THAT(page, HasSubstr(part));
  }
  EXPECT_EQ(count(page, "<svg"), 11U);
}

TEST(CalibrationReport, SaysWhatMadeItWhenAndOfWhichPictures) {
  const Calibrated run{test::Simulation()};
  const std::string page = run.report();
  EXPECT_THAT(page,
              HasSubstr("alidade 1.2.3, 2026-03-01 12:00 UTC; pictures of 1920\u00d71080 px"));
  EXPECT_THAT(page, HasSubstr("frames, all there are"));
  EXPECT_THAT(page, Not(HasSubstr("class=\"gap\"")));
}

TEST(CalibrationReport, SaysInWordsWhatEachNumberMeansAndItsLimit) {
  Calibrated run{test::Simulation()};
  CalibrationQuality& quality = run.result.quality;
  quality.pixel_sigma_ratio = 1;
  quality.repetition = 1;
  const std::string good = run.report();
  EXPECT_THAT(good, HasSubstr("image errors are as the tracks state"));
  EXPECT_THAT(good, HasSubstr("image errors do not repeat"));
  EXPECT_THAT(good, HasSubstr("(limit 5 %)</span>"));
  EXPECT_THAT(good, HasSubstr("(limit 10 ms)</span>"));
  EXPECT_EQ(count(good, "<li class=\"weak\""), 0U);
  quality.pixel_sigma_ratio = 1.76;
  quality.repetition = 2;
  const std::string grown = run.report();
  EXPECT_THAT(grown, HasSubstr("image residuals / noise 1.76"));
  EXPECT_THAT(grown, HasSubstr("live, more than 4 is refused"));
  EXPECT_THAT(grown, HasSubstr("2.0 observations of a landmark count as one; sigmas grown by 1.4"));
  quality.pixel_sigma_ratio = 4.5;
  const int d = index(Parameter::kClockOffset);
  run.result.calibration.covariance(d, d) = 0.02 * 0.02;
  const std::string weak = run.report();
  EXPECT_THAT(weak, HasSubstr("<li class=\"weak\"><b>image residuals / noise 4.50"));
  EXPECT_THAT(weak, HasSubstr("<li class=\"weak\"><b>clock offset known to 20 ms"));
}

// Polled telemetry has no steady clock to hold stamps against; the motion tells when an angle was true.
TEST(CalibrationReport, ShowsByTheMotionHowLatePolledAnglesAre) {
  Calibrated run{test::Simulation()};
  run.options.telemetry_stamps = StampNoise::kOwnTimes;
  run.input.noise.telemetry_stamp_sigma_s = 0.01;
  // Each angle as it was 5 ms later than its stamp.
  for (TelemetryResidual& residual : run.result.telemetry_residuals)
    residual.error_rad = 0.005 * run.result.trajectory.rate(residual.time_s).vector();
  const std::string page = run.report();
  EXPECT_THAT(page, HasSubstr("<td>their own times: polled</td>"));
  const std::string figure = page.substr(page.find("<b>Stamps of the telemetry</b>"));
  EXPECT_THAT(figure, HasSubstr("angle - stamp, ms"));
  // All at one height: of the 186 px of the plot, that of 5 ms within +-30 ms.
  const std::string dots = figure.substr(figure.find("<path class=\"dots b\""));
  const std::string path = dots.substr(0, dots.find("/>"));
  const double height = 10 + 186 * (30.0 - 5) / 60;
  const std::string level = fmt::format(" {}h0", std::round(2 * height) / 2);
  EXPECT_GT(count(path, "h0"), 20U);
  EXPECT_EQ(count(path, level), count(path, "h0")) << level;
}

// Two seconds without a point, and one frame whose only point is an outlier.
TEST(CalibrationReport, ShowsAndExplainsFramesThatWereNotUsed) {
  Calibrated run{test::Simulation()};
  std::vector<FrameResult>& used = run.result.frames;
  const double begin_s = used[60].time_s;
  const double end_s = used[90].time_s;
  const std::int64_t first = used[61].frame;
  const std::int64_t last = used[89].frame;
  used.erase(used.begin() + 120);
  used.erase(used.begin() + 61, used.begin() + 90);
  std::vector<CalibrationObservation>& seen = run.input.observations;
  for (CalibrationObservation& one : seen) {
    if (one.frame >= first && one.frame <= last) one.frame = -1;  // of no frame that there is
  }
  const std::string page = run.report();
  EXPECT_THAT(page, HasSubstr(fmt::format("frames used, of {}", run.input.frames.size())));
  EXPECT_THAT(page, HasSubstr("<li>29 frames of which tracks.csv has no point"));
  EXPECT_THAT(page, HasSubstr("<li>1 frame of whose points none was used"));
  EXPECT_THAT(page, HasSubstr(fmt::format("<li>no frame from {:.2f} to {:.2f} s",
                                          begin_s - used[0].time_s, end_s - used[0].time_s)));
  // Errors in u and v, pan and tilt, and theirs.
  EXPECT_EQ(count(page, "class=\"gap\""), 6U);
  // Both trajectories and the optical axis go around the gap and not across it.
  EXPECT_EQ(count(page, "<path class=\"line a\" d=\"M"), 3U) << "pan in two pieces, a histogram";
  EXPECT_EQ(count(page, "<path class=\"line ink\" d=\"M") -
                count(Calibrated{test::Simulation()}.report(), "<path class=\"line ink\" d=\"M"),
            1U);
}

// Each of them, and no other: a frame that the limit left out is neither plain nor blurred.
TEST(CalibrationReport, NamesWhatLeftAFrameWithoutATrack) {
  Calibrated run{test::Simulation()};
  std::vector<FrameResult>& used = run.result.frames;
  const std::vector<Untracked> reasons = {Untracked::kNoPicture, Untracked::kNoTelemetry,
                                          Untracked::kNoPoint, Untracked::kTooShort,
                                          Untracked::kBeyondLimit};
  const std::vector<const char*> lines = {
      "frames whose picture is missing or could not be decoded", "frames outside the telemetry",
      "frames in which no point was followed",
      "frames whose points were followed through fewer than 5 frames",
      "frames whose points were left out, as more than 30000 observations take too long"};
  for (std::size_t why = 0; why < reasons.size(); ++why) {
    SCOPED_TRACE(lines[why]);
    Calibrated one = run;
    one.result.frames.erase(one.result.frames.begin() + 61, one.result.frames.begin() + 68);
    std::set<std::int64_t> without;
    for (std::size_t i = 61; i < 68; ++i) without.insert(used[i].frame);
    one.untracked.emplace();
    for (const std::int64_t frame : without) (*one.untracked)[frame] = reasons[why];
    for (CalibrationObservation& seen : one.input.observations) {
      if (without.count(seen.frame) > 0) seen.frame = -1;
    }
    const std::string page = one.report();
    for (std::size_t other = 0; other < lines.size(); ++other) {
      EXPECT_EQ(count(page, std::string("<li>7 ") + lines[other]), other == why ? 1U : 0U);
    }
  }
}

TEST(CalibrationReport, DrawsWhatTelemetryIsOffBy) {
  Calibrated run{test::Simulation()};
  TelemetryError& error = run.result.telemetry_error;
  const std::string without = run.report();
  EXPECT_THAT(without, Not(HasSubstr("Telemetry's own error")));
  error.pan.first_rad = -0.1;
  error.pan.spacing_rad = 0.02;
  error.pan.count = 11;
  for (std::size_t i = 0; i < 11; ++i) {
    error.pan.values[i] = i % 2 == 0 ? 2e-4 : -2e-4;
    error.pan.sigmas[i] = 3e-5;
  }
  error.pan.length_rad = 0.05;
  error.pan.unseen_sigma_rad = 2.5e-4;
  error.tilt_play = {5e-4, 2e-5, PlayKind::kOutput};
  const std::string page = run.report();
  EXPECT_EQ(count(page, "<svg"), count(without, "<svg") + 2);
  for (const char* part :
       {"Telemetry's own error",
        "<li>pan: 0.200 mrad (RMS) over 11.5 degrees, known to 0.030; elsewhere 0.250 of it is "
        "possible</li>",
        "<li>tilt: play of 0.500 +- 0.020 mrad, the encoder behind the gear</li>",
        "Telemetry's error over the angle, pan", "true pan, deg", "Play of tilt",
        "way of the camera, mrad"}) {
    EXPECT_THAT(page, HasSubstr(part));
  }
  EXPECT_THAT(page, Not(HasSubstr("nan")));
  EXPECT_EQ(count(page, "class=\"band\"") - count(without, "class=\"band\""), 2U);
  error = {};
  error.tilt.unseen_sigma_rad = 1e-3;
  EXPECT_THAT(run.report(),
              HasSubstr("<li>tilt: up to 1.000 mrad (one sigma), of unknown course</li>"));
  EXPECT_EQ(count(run.report(), "<svg"), count(without, "<svg"));
}

TEST(CalibrationReport, SaysForWhichDistancesItHolds) {
  Calibrated run{test::Simulation()};
  EXPECT_THAT(run.report(), HasSubstr("Holds for things farther than "));
  EXPECT_THAT(run.report(), Not(HasSubstr("Focal length of far things")));
  run.options.pupil.place_m.z() = 0.07;
  run.result.nearness = Nearness{1e-3, 2e-4};
  const std::string page = run.report();
  EXPECT_THAT(page, HasSubstr("a lens's pupil 12 cm before or behind the axes"));
  EXPECT_THAT(page, HasSubstr("Focal length of far things, as scene and pupil tell: "));
}

TEST(CalibrationReport, LoadsNothingAndRunsNothing) {
  const std::string page = Calibrated{test::Simulation()}.report();
  for (const char* part :
       {"http:", "https:", "src=", "href=", "url(", "<script", "@import", "nan", "inf\"", "inf "}) {
    EXPECT_THAT(page, Not(HasSubstr(part)));
  }
}

TEST(CalibrationReport, DrawsOnlyNumbersOfCoarseTelemetry) {
  test::Simulation simulation;
  simulation.angle_quantum_rad = 2e-4;
  const Calibrated run{simulation};
  ASSERT_TRUE(run.result.ok()) << run.result.message;
  EXPECT_THAT(run.report(), Not(HasSubstr("nan")));
}

TEST(CalibrationReport, ClosesEveryElementItOpens) {
  const std::string page = Calibrated{test::Simulation()}.report();
  std::vector<std::string> open;
  std::size_t seen = 0;
  for (std::size_t begin = page.find('<'); begin != std::string::npos;
       begin = page.find('<', begin + 1)) {
    const std::size_t end = page.find('>', begin);
    ASSERT_NE(end, std::string::npos);
    if (page[begin + 1] == '!') continue;  // the document's type
    const bool closes = page[begin + 1] == '/';
    const std::size_t name_begin = begin + (closes ? 2 : 1);
    const std::string name =
        page.substr(name_begin, page.find_first_of(" \n/>", name_begin) - name_begin);
    ++seen;
    if (name == "meta" || page[end - 1] == '/') continue;
    if (!closes) {
      open.push_back(name);
      continue;
    }
    ASSERT_FALSE(open.empty());
    EXPECT_EQ(open.back(), name);
    open.pop_back();
  }
  EXPECT_GT(seen, 300U);
  EXPECT_TRUE(open.empty());
}

TEST(CalibrationReport, EscapesWhatComesFromOutside) {
  Calibrated run{test::Simulation()};
  run.remarks = {"a <b> & 'c'"};
  const std::string page = run.report("<script>alert(\"x\")</script>");
  EXPECT_THAT(page, Not(HasSubstr("<script>")));
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;alert(&quot;x&quot;)&lt;/script&gt;"));
  EXPECT_THAT(page, HasSubstr("a &lt;b&gt; &amp; &#39;c&#39;"));
}

TEST(CalibrationReport, SaysThatAWeakResultIsNotWritten) {
  Calibrated run{test::Simulation()};
  run.result.status = CalibrationStatus::kWeak;
  run.result.message = "clock offset known to 30 ms only";
  const std::string page = run.report();
  EXPECT_THAT(page, HasSubstr("no calibration was written"));
  EXPECT_THAT(page, HasSubstr("clock offset known to 30 ms only"));
}

TEST(CalibrationReport, OfAHundredThousandObservationsStaysBelowTwoMegabytes) {
  Calibrated run{test::Simulation()};
  // The same run ten times over, each at its own error.
  const std::vector<CalibrationObservation> seen = run.input.observations;
  const std::vector<ObservationResidual> residuals = run.result.observation_residuals;
  for (int copy = 1; run.input.observations.size() < 100000; ++copy) {
    for (ObservationResidual residual : residuals) {
      residual.observation += static_cast<std::size_t>(copy) * seen.size();
      residual.error_px *= 1 + 0.01 * copy;
      run.result.observation_residuals.push_back(residual);
    }
    run.input.observations.insert(run.input.observations.end(), seen.begin(), seen.end());
  }
  EXPECT_GT(run.result.observation_residuals.size(), 95000U);
  EXPECT_LT(run.report().size(), 2000000U);
}

TEST(SvgPlot, PutsPointsBeyondTheRangeOnItsEdge) {
  SvgPlot plot(200, 100, {0, 10, "x"}, {-1, 1, "y"});
  plot.dots({{5, 100}}, "a");
  plot.dots({{5, -100}}, "b");
  const std::string svg = plot.svg("test");
  EXPECT_THAT(svg, HasSubstr("M126 10h0"));
  EXPECT_THAT(svg, HasSubstr("M126 56h0"));
}

TEST(SvgPlot, LabelsItsAxesWithRoundNumbersAndUnits) {
  const SvgPlot plot(400, 200, {-0.03, 0.11, "angle <1>, rad"}, {0, 1, "y"});
  const std::string svg = plot.svg("a & b");
  for (const char* part : {">0.00<", ">0.05<", ">0.10<", "angle &lt;1&gt;, rad", "a &amp; b"}) {
    EXPECT_THAT(svg, HasSubstr(part));
  }
}

// Numbers on an axis, by the labels along y: they stand at the right end of their place.
std::size_t labels_of_y(const SvgPlot& plot) { return count(plot.svg(""), "text-anchor=\"end\">"); }

TEST(SvgPlot, EveryAxisHasThreeLabelsOrMoreAndRoomForThem) {
  for (const int height : {140, 160, 196, 240}) {
    for (double reach = 1e-4; reach < 1e4; reach *= 1.07) {
      const SvgPlot plot(1040, height, {0, 10, "x"}, {-reach, reach, "y"});
      EXPECT_GE(labels_of_y(plot), 3U) << height << " px, " << reach;
      EXPECT_LE(labels_of_y(plot), static_cast<std::size_t>(height) / 16) << reach;
    }
  }
  const std::string svg = SvgPlot(1040, 196, {0, 10, "x"}, {-0.48, 0.48, "y"}).svg("");
  for (const char* label : {">\u22120.4<", ">\u22120.2<", ">0.0<", ">0.2<", ">0.4<"}) {
    EXPECT_THAT(svg, HasSubstr(label));
  }
  EXPECT_THAT(SvgPlot(400, 200, {0, 10, "x"}, {-3e-7, 3e-7, "y"}).svg(""), HasSubstr(">2e-07<"));
}

TEST(SvgPlot, SaysThatThereIsNothingToShow) {
  SvgPlot plot(200, 100, {0, 10, "x"}, {-1, 1, "y"});
  plot.level(0);
  plot.band(-0.5, 0.5);
  plot.dots({{std::nan(""), 1}, {11, 0}}, "a");
  plot.line({}, "a");
  EXPECT_THAT(plot.svg(""), HasSubstr(">no data<"));
  plot.dots({{5, 0}}, "a");
  EXPECT_THAT(plot.svg(""), Not(HasSubstr("no data")));
}

TEST(SvgPlot, DrawsDotsThatCoverEachOtherOnce) {
  SvgPlot plot(200, 100, {0, 10, "x"}, {-1, 1, "y"});
  plot.dots(std::vector<PlotPoint>(1000, {5, 0}), "a");
  EXPECT_EQ(count(plot.svg("test"), "h0"), 1U);
}

}  // namespace
}  // namespace alidade
