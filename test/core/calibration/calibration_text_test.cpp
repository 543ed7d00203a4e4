#include "core/calibration/calibration_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstring>
#include <limits>
#include <locale>
#include <random>

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// The paper's calibration with numbers that decimals cannot hold.
Calibration paper_calibration() {
  Calibration calibration;
  calibration.camera = {32008 + 1 / 3.0, 1 - 1e-16, {55.4}, 1920, 1080};
  calibration.camera.set_centre_offset({-7.1, 1 / 3.0});
  calibration.line_delay = -14.2e-6;
  calibration.mechanics.pan_axis = Vector3<double>(-0.012, 0.001, 1).normalized();
  calibration.mechanics.tilt_axis = Vector3<double>(0.002, 1, 0.014).normalized();
  calibration.mechanics.pan_scale = 1.0 / 0.97;
  calibration.mechanics.tilt_scale = 1.06;
  calibration.clock_offset = -84.4e-3;
  calibration.zoom = 1234.1;
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  ParameterCovariance<double> factor;
  for (int i = 0; i < kParameterCount; ++i) {
    for (int j = 0; j < kParameterCount; ++j) factor(i, j) = normal(generator);
  }
  Matrix<double, kParameterCount, 1> sigmas;
  sigmas << 24, 0, 0.11, 3, 4, 7e-8, 1e-4, 2e-4, 3e-4, 1e-4, 0.07, 0.06, 1e-3;
  const ParameterCovariance<double> cov =
      sigmas.asDiagonal() * (factor * factor.transpose()) * sigmas.asDiagonal() / kParameterCount;
  calibration.covariance = (cov + cov.transpose()) / 2;
  return calibration;
}

// EXPECT_EQ takes -0 for 0; the file must not.
bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

template <class Derived>
bool same_bits(const Eigen::MatrixBase<Derived>& a, const Eigen::MatrixBase<Derived>& b) {
  for (int i = 0; i < a.rows(); ++i) {
    for (int j = 0; j < a.cols(); ++j) {
      if (!same_bits(a(i, j), b(i, j))) return false;
    }
  }
  return true;
}

void expect_same_bits(const Calibration& a, const Calibration& b) {
  EXPECT_TRUE(same_bits(a.camera.focal_length, b.camera.focal_length));
  EXPECT_TRUE(same_bits(a.camera.aspect, b.camera.aspect));
  EXPECT_TRUE(same_bits(a.camera.distortion.radial, b.camera.distortion.radial));
  EXPECT_TRUE(same_bits(a.camera.centre_offset(), b.camera.centre_offset()));
  EXPECT_EQ(a.camera.width, b.camera.width);
  EXPECT_EQ(a.camera.height, b.camera.height);
  EXPECT_TRUE(same_bits(a.line_delay, b.line_delay));
  EXPECT_TRUE(same_bits(a.mechanics.pan_axis, b.mechanics.pan_axis));
  EXPECT_TRUE(same_bits(a.mechanics.tilt_axis, b.mechanics.tilt_axis));
  EXPECT_TRUE(same_bits(a.mechanics.pan_scale, b.mechanics.pan_scale));
  EXPECT_TRUE(same_bits(a.mechanics.tilt_scale, b.mechanics.tilt_scale));
  EXPECT_TRUE(same_bits(a.clock_offset, b.clock_offset));
  EXPECT_EQ(a.zoom, b.zoom);
  EXPECT_TRUE(same_bits(a.covariance, b.covariance));
}

Calibration parsed(const std::string& text) {
  Calibration calibration;
  std::string error;
  EXPECT_TRUE(parse_calibration(text, "test.yaml", &calibration, &error)) << error;
  return calibration;
}

std::string refusal(const std::string& text) {
  Calibration calibration;
  std::string error;
  EXPECT_FALSE(parse_calibration(text, "test.yaml", &calibration, &error)) << text;
  EXPECT_EQ(error.find('\n'), std::string::npos) << "one line: " << error;
  return error;
}

// As a person writes it. Each fault below replaces one line.
const char* const kByHand =
    "format: 1\n"
    "image: {width: 1920, height: 1080}\n"
    "focal_length: {value: 32008, sigma: 24}\n"
    "aspect: {value: 1}\n"
    "radial_distortion: {value: 55.4, sigma: 0.11}\n"
    "line_delay: {value: -14.2e-6, sigma: 7e-8}\n"
    "pan_axis: {value: [-0.011999, 0, 0.999928], sigma: [1e-4, 2e-4]}\n"
    "tilt_axis: {value: [0, 0.999902, 0.013999]}\n"
    "pan_scale: {value: 1}\n"
    "tilt_scale: {value: 1}\n"
    "clock_offset: {value: -84.4e-3, sigma: 1e-3}\n";

std::string with_line(int number, const std::string& line) {
  std::string text = kByHand;
  std::size_t begin = 0;
  for (int i = 1; i < number; ++i) begin = text.find('\n', begin) + 1;
  return text.replace(begin, text.find('\n', begin) - begin, line);
}

TEST(CalibrationText, ErrorsStayOnOneLineWhateverTheFileHolds) {
  EXPECT_THAT(refusal("format: \"1\\n\\e[2J\"\n"),
              HasSubstr("\"1??[2J\"; a finite number is needed"));
  EXPECT_THAT(refusal("\"form\\nat\": 1\n"), HasSubstr("unknown key form?at;"));
}

TEST(CalibrationText, ReadsWhatAPersonWrote) {
  const Calibration calibration = parsed(kByHand);
  EXPECT_EQ(calibration.camera.width, 1920);
  EXPECT_EQ(calibration.camera.height, 1080);
  EXPECT_EQ(calibration.camera.focal_length, 32008);
  EXPECT_EQ(calibration.camera.distortion.radial, 55.4);
  EXPECT_EQ(calibration.line_delay, -14.2e-6);
  EXPECT_EQ(calibration.clock_offset, -84.4e-3);
  EXPECT_FALSE(calibration.zoom);
  ParameterCovariance<double> expected = ParameterCovariance<double>::Zero();
  expected(index(Parameter::kFocalLength), index(Parameter::kFocalLength)) = 24.0 * 24;
  expected(index(Parameter::kRadialDistortion), index(Parameter::kRadialDistortion)) = 0.11 * 0.11;
  expected(index(Parameter::kLineDelay), index(Parameter::kLineDelay)) = 7e-8 * 7e-8;
  expected(index(Parameter::kPanAxis0), index(Parameter::kPanAxis0)) = 1e-4 * 1e-4;
  expected(index(Parameter::kPanAxis1), index(Parameter::kPanAxis1)) = 2e-4 * 2e-4;
  expected(index(Parameter::kClockOffset), index(Parameter::kClockOffset)) = 1e-3 * 1e-3;
  EXPECT_EQ(calibration.covariance, expected);
}

TEST(CalibrationText, MakesARoundedAxisAUnitVector) {
  const Calibration calibration = parsed(kByHand);
  EXPECT_NEAR(calibration.mechanics.pan_axis.norm(), 1, 1e-15);
  EXPECT_NEAR(calibration.mechanics.tilt_axis.norm(), 1, 1e-15);
}

TEST(CalibrationText, AspectMayBeAbsent) { EXPECT_EQ(parsed(with_line(4, "")).camera.aspect, 1); }

TEST(CalibrationText, AcceptsQualityAndLandmarks) {
  EXPECT_EQ(parsed(std::string(kByHand) + "quality: {rms_px: 0.3, frames: 500}\n" +
                   "landmarks: map.bin\nzoom: 12.5\n")
                .zoom,
            12.5);
}

// Of a centre that is the image's middle exactly nothing is written: as before there were others.
TEST(CalibrationText, TellsForWhichDistancesItHolds) {
  Calibration calibration = paper_calibration();
  const int f = index(Parameter::kFocalLength);
  calibration.covariance(f, f) = std::pow(1e-3 * calibration.camera.focal_length, 2);
  CalibrationNotes notes;
  const std::string usual = format_calibration(calibration, notes);
  EXPECT_THAT(usual, HasSubstr("holds_beyond_m: 50 "));
  EXPECT_THAT(usual, Not(HasSubstr("pupil_m")));
  EXPECT_THAT(usual, Not(HasSubstr("far_focal_length")));
  notes.pupil.place_m = {0.01, -0.02, 0.075};
  notes.pupil.sigma_m.setConstant(0.005);
  notes.far_focal_length = CalibrationPrior{31990.5, 12};
  const std::string text = format_calibration(calibration, notes);
  EXPECT_THAT(text,
              HasSubstr("pupil_m: {value: [0.01, -0.02, 0.075], sigma: [0.005, 0.005, 0.005]}"));
  EXPECT_THAT(text, HasSubstr("far_focal_length: {value: 31990.5, sigma: 12}"));
  EXPECT_THAT(text, HasSubstr("holds_beyond_m: 80 "));
  expect_same_bits(parsed(text), calibration);
}

TEST(CalibrationText, RefusesDistancesThatAreNone) {
  const auto refused = [](const std::string& line) {
    return refusal(std::string(kByHand) + line + "\n");
  };
  EXPECT_EQ(refused("pupil_m: {value: [0, 0, 5], sigma: [0, 0, 0]}"),
            "test.yaml:12: pupil_m.value has 5; give metres, at most 1");
  EXPECT_THAT(refused("pupil_m: {value: [0, 0, 0.05]}"), HasSubstr("pupil_m.sigma is missing"));
  EXPECT_THAT(refused("pupil_m: 5"), StartsWith("test.yaml:12: pupil_m"));
  EXPECT_EQ(refused("holds_beyond_m: 0"),
            "test.yaml:12: holds_beyond_m is not more than 0; give metres");
  EXPECT_THAT(refused("far_focal_length: {value: -2, sigma: 1}"),
              HasSubstr("far_focal_length is -2; give pixels"));
  EXPECT_THAT(refused("far_focal_length: {value: 32000, sigma: -1}"),
              HasSubstr("far_focal_length.sigma is less than 0; give px"));
}

TEST(CalibrationText, TellsOfTheOpticalCentreWhereItIsNotTheMiddle) {
  const std::string with = format_calibration(paper_calibration());
  EXPECT_THAT(with, HasSubstr("centre_offset: {value: [-7.1, 0.3333333333333333], sigma: ["));
  EXPECT_THAT(with, HasSubstr("radial_distortion, centre_u, centre_v, line_delay"));
  Calibration middle = paper_calibration();
  middle.camera.set_centre_offset({0, 0});
  for (const Parameter p : {Parameter::kCentreU, Parameter::kCentreV}) {
    middle.covariance.row(index(p)).setZero();
    middle.covariance.col(index(p)).setZero();
  }
  const std::string without = format_calibration(middle);
  EXPECT_THAT(without, Not(HasSubstr("centre_")));
  expect_same_bits(parsed(without), middle);
}

TEST(CalibrationText, TellsTheErrorOfACentreThatIsExactByDefinition) {
  Calibration c = paper_calibration();
  for (const Parameter p : {Parameter::kCentreU, Parameter::kCentreV}) {
    c.covariance.row(index(p)).setZero();
    c.covariance.col(index(p)).setZero();
  }
  c.centre_error << 4e-4, -1e-4, -1e-4, 9e-4;
  const std::string text = format_calibration(c);
  EXPECT_THAT(text, HasSubstr("centre_error: {sigma: [0.02, 0.03], correlation: -0.166666666"));
  EXPECT_LT((parsed(text).centre_error - c.centre_error).norm(), 1e-15);
  EXPECT_TRUE(parsed(format_calibration(paper_calibration())).centre_error.isZero(0));
}

TEST(CalibrationText, RefusesACentreThatIsNone) {
  const auto refused = [](const std::string& line) {
    return refusal(std::string(kByHand) + line + "\n");
  };
  EXPECT_THAT(refused("centre_error: {sigma: [1, 0]}"),
              HasSubstr("centre_error.sigma has 0; give px"));
  EXPECT_THAT(refused("centre_error: {sigma: [1, 1], correlation: 1}"),
              HasSubstr("centre_error.correlation is 1; give more than -1"));
  EXPECT_THAT(refused("centre_error: {correlation: 0}"),
              HasSubstr("centre_error.sigma is missing"));
  EXPECT_THAT(
      refused("centre_offset: {value: [1, 2], sigma: [1, 1]}\ncentre_error: {sigma: [1, 1]}"),
      HasSubstr("centre_error is of a centre whose sigma is 0"));
  EXPECT_THAT(refused("centre_offset: {value: [1]}"),
              HasSubstr("centre_offset is not a list of 2 numbers"));
  EXPECT_THAT(refused("centre_offset: {value: [1, 20000]}"),
              HasSubstr("centre_offset has 20000; give pixels from the image's middle"));
  EXPECT_THAT(refused("centre_offset: {value: [1, .nan]}"), HasSubstr("finite number"));
  EXPECT_THAT(refused("centre_offset: {value: [1, 2], sigma: [1, -1]}"),
              HasSubstr("centre_offset.sigma is -1"));
  EXPECT_THAT(refused("centre_offset: [1, 2]"), HasSubstr("centre_offset is not a map"));
}

TEST(CalibrationText, RoundTripIsExactToTheBit) {
  expect_same_bits(parsed(format_calibration(paper_calibration())), paper_calibration());
  expect_same_bits(parsed(format_calibration(parsed(kByHand))), parsed(kByHand));
}

TEST(CalibrationText, RoundTripIsExactForAnyNumber) {
  std::mt19937_64 generator(4);
  std::uniform_real_distribution<double> exponent(-300, 11);
  int checked = 0;
  for (int i = 0; i < 200; ++i) {
    Calibration calibration = paper_calibration();
    calibration.camera.distortion.radial = std::pow(10, exponent(generator));
    calibration.line_delay = -0.0;
    calibration.zoom = -calibration.camera.distortion.radial;
    expect_same_bits(parsed(format_calibration(calibration)), calibration);
    ++checked;
  }
  EXPECT_EQ(checked, 200);
}

TelemetryError some_telemetry_error() {
  TelemetryError error;
  error.pan.first_rad = -0.7 / 3;
  error.pan.spacing_rad = 0.1 / 3;
  error.pan.count = 15;
  for (std::size_t i = 0; i < 15; ++i) {
    error.pan.values[i] = 1e-4 * std::sin(static_cast<double>(i)) / 3;
    error.pan.sigmas[i] = 1e-5 / (1.0 + static_cast<double>(i));
  }
  error.pan.length_rad = 1.0 / 7;
  error.pan.unseen_sigma_rad = 2e-4 / 3;
  error.tilt.unseen_sigma_rad = 1e-4 / 3;
  error.pan_play = {4e-4 / 3, 1e-5 / 3, PlayKind::kMotor};
  error.tilt_play = {5e-4 / 3, 2e-5 / 3, PlayKind::kOutput};
  return error;
}

TEST(CalibrationText, RoundTripsWhatTelemetryIsOffByToTheBit) {
  const TelemetryError written = some_telemetry_error();
  CalibrationNotes notes;
  notes.telemetry_error = written;
  Calibration calibration;
  TelemetryError read;
  std::string error;
  ASSERT_TRUE(parse_calibration(format_calibration(paper_calibration(), notes), "test.yaml",
                                &calibration, &error, nullptr, &read))
      << error;
  expect_same_bits(calibration, paper_calibration());
  for (const auto& [a, b] : {std::pair(&read.pan, &written.pan), {&read.tilt, &written.tilt}}) {
    EXPECT_EQ(a->first_rad, b->first_rad);
    EXPECT_EQ(a->spacing_rad, b->spacing_rad);
    EXPECT_EQ(a->count, b->count);
    EXPECT_EQ(a->values, b->values);
    EXPECT_EQ(a->sigmas, b->sigmas);
    EXPECT_EQ(a->length_rad, b->length_rad);
    EXPECT_EQ(a->unseen_sigma_rad, b->unseen_sigma_rad);
  }
  for (const auto& [a, b] :
       {std::pair(&read.pan_play, &written.pan_play), {&read.tilt_play, &written.tilt_play}}) {
    EXPECT_EQ(a->width_rad, b->width_rad);
    EXPECT_EQ(a->sigma_rad, b->sigma_rad);
    EXPECT_EQ(a->kind, b->kind);
  }
}

// Files of before have nothing of it, and nothing is written where there is nothing.
TEST(CalibrationText, HasNoErrorOfTelemetryUnlessItIsGiven) {
  Calibration calibration;
  TelemetryError read = some_telemetry_error();
  std::string error;
  ASSERT_TRUE(parse_calibration(kByHand, "test.yaml", &calibration, &error, nullptr, &read));
  EXPECT_FALSE(read.exists());
  EXPECT_THAT(format_calibration(paper_calibration()), Not(HasSubstr("_error")));
  EXPECT_THAT(format_calibration(paper_calibration()), Not(HasSubstr("_play")));
}

TEST(CalibrationText, RefusesAnErrorOfTelemetryThatIsNone) {
  const auto refused = [](const std::string& line) {
    return refusal(std::string(kByHand) + line + "\n");
  };
  const std::string knots = "pan_error: {unseen_sigma_rad: 1e-4, length_rad: 0.1, ";
  EXPECT_THAT(refused("pan_error: 3"), HasSubstr("pan_error is not a map"));
  EXPECT_THAT(refused("pan_error: {}"), HasSubstr("pan_error.unseen_sigma_rad is missing"));
  EXPECT_THAT(refused("tilt_error: {unseen_sigma_rad: -1}"), HasSubstr("is -1; 0 or more"));
  EXPECT_THAT(refused("tilt_error: {unseen_sigma_rad: 1, knot: 1}"), HasSubstr("unknown key"));
  EXPECT_THAT(refused(knots + "values_rad: [1e-4]}"), HasSubstr("pan_error.knots_rad is missing"));
  EXPECT_THAT(refused(knots + "knots_rad: [1], values_rad: [1e-4]}"),
              HasSubstr("pan_error.knots_rad is not a map"));
  EXPECT_THAT(refused(knots + "knots_rad: {first: 0, spacing: 0.1}, values_rad: []}"),
              HasSubstr("is not a list of 1 to 128 numbers"));
  EXPECT_THAT(refused(knots + "knots_rad: {first: 0, spacing: 0.1}, values_rad: [0, 1e-4], "
                              "sigma_rad: [1e-5]}"),
              HasSubstr("pan_error.sigma_rad is not a list of 2 numbers"));
  EXPECT_THAT(refused(knots + "knots_rad: {first: 0, spacing: 0.1}, values_rad: [0, .nan], "
                              "sigma_rad: [1e-5, 1e-5]}"),
              HasSubstr("finite number"));
  EXPECT_THAT(refused(knots + "knots_rad: {first: 0, spacing: 0.1}, values_rad: [0, 0.03], "
                              "sigma_rad: [1e-5, 1e-5]}"),
              HasSubstr("pan_error: "));
  EXPECT_THAT(refused("pan_play_rad: {value: 3e-4, sigma: 1e-5}"), HasSubstr("kind is missing"));
  EXPECT_THAT(refused("pan_play_rad: {value: 3e-4, sigma: 1e-5, kind: gear}"),
              HasSubstr("motor or output"));
  EXPECT_THAT(refused("pan_play_rad: {value: 0.3, sigma: 1e-5, kind: motor}"),
              HasSubstr("give radians"));
  EXPECT_THAT(refused("pan_play_rad: {value: -3e-4, sigma: 1e-5, kind: motor}"),
              HasSubstr("pan_play_rad is -3e-4; give radians, 0 or more"));
  EXPECT_THAT(refused("tilt_play_rad: [1]"), HasSubstr("tilt_play_rad is not a map"));
}

TEST(CalibrationText, WritesNumbersAsAPersonWould) {
  const std::string text = format_calibration(parsed(kByHand));
  EXPECT_THAT(text, HasSubstr("radial_distortion: {value: 55.4, sigma: 0.11}"));
  EXPECT_THAT(text, HasSubstr("telemetry clock = image clock + clock_offset"));
}

class GermanNumbers : public std::numpunct<char> {
 protected:
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(CalibrationText, DoesNotDependOnTheLocale) {
  const std::string text = format_calibration(paper_calibration());
  const std::locale before =
      std::locale::global(std::locale(std::locale::classic(), new GermanNumbers));
  const std::string german = format_calibration(paper_calibration());
  const Calibration calibration = parsed(text);
  std::locale::global(before);
  EXPECT_EQ(german, text);
  expect_same_bits(calibration, paper_calibration());
}

struct Fault {
  int line;
  const char* text;
  const char* complaint;
};

TEST(CalibrationText, RefusesAFaultyLineWithItsNumberAndARemedy) {
  const Fault faults[] = {
      {1, "format: 2", "reads format 1"},
      {1, "format: one", "format is \"one\"; a finite number"},
      {2, "image: {width: 0, height: 1080}", "image.width is 0; a whole number of pixels"},
      {2, "image: {width: 1920.5, height: 1080}", "a whole number of pixels"},
      {2, "image: {width: 1920, height: -1}", "image.height is -1"},
      {2, "image: {width: 1920}", "image.height is missing"},
      {2, "image: 1920x1080", "image is not a map"},
      {2, "image: {width: 1920, height: 1080, depth: 8}", "unknown key image.depth"},
      {3, "focal_length: {value: -32008, sigma: 24}", "focal_length is -32008; give pixels"},
      {3, "focal_length: {value: 0}", "give pixels, more than 0"},
      {3, "focal_length: {value: 129}", "not millimetres"},
      {3, "focal_length: {value: long}", "focal_length is \"long\"; a finite number"},
      {3, "focal_length: {value: 32008px}", "a finite number"},
      {3, "focal_length: {value: 32,008}", "known are value, sigma"},
      {3, "focal_length: {value: .inf}", "a finite number"},
      {3, "focal_length: {value: nan}", "a finite number"},
      {3, "focal_length: {value: 1e999}", "a finite number"},
      {3, "focal_length: {value: }", "is not a single value"},
      {3, "focal_length: 32008", "write {value: ..., sigma: ...}"},
      {3, "focal_length: {sigma: 24}", "focal_length.value is missing"},
      {3, "focal_length: {value: 32008, sigma: -24}", "focal_length.sigma is -24"},
      {3, "focal_length: {value: 32008, sigma: .nan}", "a finite number"},
      {3, "focal_length: {value: 32008, value: 32009}", "focal_length.value is given twice"},
      {3, "focal_length: {value: 32008, stddev: 24}", "unknown key focal_length.stddev"},
      {3, "focal_lenght: {value: 32008}", "unknown key focal_lenght; known are format"},
      {4, "aspect: {value: 16}", "a ratio near 1"},
      {5, "radial_distortion: {value: [1, 2]}", "is not a single value"},
      {6, "line_delay: {value: 14}", "line_delay is 14; give seconds a row; 14 microseconds"},
      {6, "line_delay: {value: -14.2e-6, sigma: 0.07}", "in the unit of the value"},
      {7, "pan_axis: {value: [0, 0, 1.1]}", "has length 1.1; a unit vector"},
      {7, "pan_axis: {value: [0, 0, 0]}", "has length 0; a unit vector"},
      {7, "pan_axis: {value: [0, 0, -1]}", "more than 60 degrees from its nominal [0, 0, 1]"},
      {7, "pan_axis: {value: [0, 1, 0]}", "more than 60 degrees"},
      {7, "pan_axis: {value: [0, 1]}", "a list of 3 numbers"},
      {7, "pan_axis: {value: 0.7}", "a list of 3 numbers"},
      {7, "pan_axis: {value: [0, 0, one]}", "pan_axis is \"one\"; a finite number"},
      {7, "pan_axis: {value: [0, 0, 1], sigma: 0.1}", "a list of 2 numbers"},
      {7, "pan_axis: {value: [0, 0, 1], sigma: [0.1, 2]}", "radians"},
      {8, "tilt_axis: {value: [1, 0, 0]}", "more than 60 degrees from its nominal [0, 1, 0]"},
      {9, "pan_scale: {value: 57.3}", "measured angle / true angle, near 1"},
      {10, "tilt_scale: {value: -1}", "near 1"},
      {11, "clock_offset: {value: -84.4, sigma: 1}", "84 milliseconds are 84e-3"},
      {11, "clock_offset: {value: 0", "valid YAML"},
  };
  int refused = 0;
  for (const Fault& fault : faults) {
    const std::string error = refusal(with_line(fault.line, fault.text));
    // YAML finds an open bracket where the file ends.
    const int line = std::string(fault.text) == "clock_offset: {value: 0" ? 12 : fault.line;
    EXPECT_THAT(error, StartsWith("test.yaml:" + std::to_string(line) + ": "));
    EXPECT_THAT(error, HasSubstr(fault.complaint));
    EXPECT_THAT(error, HasSubstr("; ")) << "says what would be right";
    ++refused;
  }
  EXPECT_EQ(refused, 43);
}

TEST(CalibrationText, NamesEveryMissingKey) {
  int refused = 0;
  for (const int line : {1, 2, 3, 5, 6, 7, 8, 9, 10, 11}) {
    const std::string text = kByHand;
    std::size_t begin = 0;
    for (int i = 1; i < line; ++i) begin = text.find('\n', begin) + 1;
    const std::string key = text.substr(begin, text.find(':', begin) - begin);
    EXPECT_EQ(refusal(with_line(line, "")), "test.yaml:" + std::to_string(line == 1 ? 2 : 1) +
                                                ": " + key + " is missing; add it");
    ++refused;
  }
  EXPECT_EQ(refused, 10);
}

TEST(CalibrationText, RefusesWhatIsNoCalibration) {
  for (const char* text :
       {"", "hello", "- 1\n- 2", "{{{", "\x01\x02", "&a [*a, *a]", "format: 1"}) {
    EXPECT_THAT(refusal(text), StartsWith("test.yaml:1: "));
  }
}

TEST(CalibrationText, RefusesAFaultyCovariance) {
  const auto with = [](const std::string& names, const std::string& matrix) {
    return std::string(kByHand) + "covariance:\n  names: " + names + "\n  matrix: " + matrix;
  };
  const std::string two = "[focal_length, radial_distortion]";
  const Calibration good = parsed(with(two, "[[576, 1.2], [1.2, 0.0121]]"));
  EXPECT_EQ(good.covariance(0, 2), 1.2);
  EXPECT_EQ(good.covariance(2, 0), 1.2);
  EXPECT_EQ(good.covariance(2, 2), 0.0121);
  EXPECT_EQ(good.covariance(index(Parameter::kLineDelay), index(Parameter::kLineDelay)),
            7e-8 * 7e-8)
      << "a parameter without a row keeps its sigma";

  EXPECT_THAT(refusal(with(two, "[[576, 1.2], [1.3, 0.0121]]")), HasSubstr("not symmetric"));
  EXPECT_THAT(refusal(with("[line_delay, pan_axis_0]", "[[1, 0], [0, 1e-8]]")),
              HasSubstr("sigma of line_delay is 1; the square of"));
  EXPECT_THAT(refusal(with("[pan_axis_0]", "[[1.1]]")), HasSubstr("sigma of pan_axis_0 is 1.04"));
  EXPECT_THAT(refusal(with(two, "[[-576, 0], [0, 0.0121]]")), HasSubstr("negative variance -576"));
  EXPECT_THAT(refusal(with(two, "[[576, 2.7], [2.7, 0.0121]]")),
              HasSubstr("not positive semidefinite"));
  EXPECT_THAT(refusal(with("[focal_length, aspect]", "[[576, 1e-9], [1e-9, 0]]")),
              HasSubstr("covariance.matrix ties focal_length to aspect"));
  EXPECT_THAT(
      refusal(with(two, "[[577, 0], [0, 0.0122]]")),
      HasSubstr("sigma of radial_distortion is 0.11, but by its covariance it is 0.110454"));
  EXPECT_THAT(refusal(with(two, "[[576, 0]]")), HasSubstr("a row for each of the 2 names"));
  EXPECT_THAT(refusal(with(two, "[[576], [0, 1]]")), HasSubstr("a list of 2 numbers"));
  EXPECT_THAT(refusal(with(two, "[[576, x], [0, 1]]")), HasSubstr("a finite number"));
  EXPECT_THAT(refusal(with("[focal_length, focal]", "[[576, 0], [0, 1]]")),
              HasSubstr("unknown name"));
  EXPECT_THAT(refusal(with("[aspect, aspect]", "[[0, 0], [0, 0]]")), HasSubstr("aspect twice"));
  EXPECT_THAT(refusal(with("focal_length", "[[576]]")), HasSubstr("names is not a list"));
  EXPECT_THAT(refusal(std::string(kByHand) + "covariance: {names: [aspect]}\n"),
              StartsWith("test.yaml:12: covariance.matrix is missing"));
}

TEST(CalibrationText, TellsPeopleOfTheRunAndReadsBackWithoutIt) {
  CalibrationNotes notes;
  notes.quality.emplace();
  notes.quality->pixel_sigma_ratio = 1.25;
  notes.quality->landmarks = 567;
  notes.quality->weakest_direction = "focal_length up: with \"pan_scale\" up";
  notes.quality->advice = {"turn: a whole circle", "#2"};
  notes.quality->contradiction = {"clock_offset", "runs of pan", 3.5};
  notes.quality->causes = {{"play", 270, 2, 0.25, "mrad"}};
  notes.excluded = {"2 observations that are outliers"};
  notes.priors = {{"aspect", {1, 0}}, {"pan_scale", {1, 1e-8}}};
  notes.landmarks = "map.bin";
  const std::string text = format_calibration(paper_calibration(), notes);
  for (const char* part :
       {"quality:", "pixel_sigma_ratio: 1.25", "landmarks: 567",
        "pan_scale: {value: 1, sigma: 1e-08}", "\"2 observations that are outliers\"", "\"#2\"",
        "contradiction: {parameter: clock_offset, between: runs of pan, scatter: 3.5}",
        "{cause: play, chi_square: 270, freedom: 2, size: 0.25, unit: mrad}",
        "landmarks: \"map.bin\""}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  Calibration read;
  std::string error;
  ASSERT_TRUE(parse_calibration(text, "test", &read, &error)) << error;
  expect_same_bits(read, paper_calibration());
}

}  // namespace
}  // namespace alidade
