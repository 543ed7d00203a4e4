// lens.yaml: what is written is read as the same bits, and every slip is refused in one line that names file and line.

#include "edge_app/storage/lens_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// With numbers that decimals cannot hold.
PatternCalibration some_pattern_calibration() {
  PatternCalibration calibration;
  calibration.lens << 600 + 1 / 3.0, 602 - 1e-13, 380.1, 236.7, -0.28, 0.08, 3e-4, -2e-4, 51.56e-6;
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  LensMatrix factor;
  for (int i = 0; i < kLensParameterCount; ++i) {
    for (int j = 0; j < kLensParameterCount; ++j) factor(i, j) = normal(generator);
  }
  LensVector sigmas;
  sigmas << 0.03, 0.03, 0.05, 0.06, 1e-4, 2e-4, 1e-5, 2e-5, 6e-8;
  const LensMatrix covariance = sigmas.asDiagonal() * (factor * factor.transpose()) *
                                sigmas.asDiagonal() / kLensParameterCount;
  calibration.covariance = (covariance + covariance.transpose()) / 2;
  return calibration;
}

std::string lens_text() {
  return format_lens(some_pattern_calibration(), {"chessboard:9x6:25mm", 752, 480});
}

std::string replaced(std::string text, const std::string& old, const std::string& by) {
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return at == std::string::npos ? text : text.replace(at, old.size(), by);
}

// The whole line that begins with this key.
std::string with_line_of(const std::string& key, const std::string& line) {
  std::string text = lens_text();
  const std::size_t begin = text.find("\n" + key + ":") + 1;
  return text.replace(begin, text.find('\n', begin) - begin, line);
}

TEST(LensFile, ReadsTheBitsThatWereWritten) {
  LensEstimate read;
  std::string error;
  ASSERT_TRUE(parse_lens(lens_text(), "lens.yaml", &read, &error)) << error;
  const PatternCalibration written = some_pattern_calibration();
  EXPECT_EQ(read.width, 752);
  EXPECT_EQ(read.height, 480);
  EXPECT_EQ(read.lens, written.lens);
  EXPECT_EQ(read.covariance, written.covariance);
}

TEST(LensFile, ReadsWhatWasFixedAsExact) {
  PatternCalibration written = some_pattern_calibration();
  written.covariance.row(index(LensParameter::kK2)).setZero();
  written.covariance.col(index(LensParameter::kK2)).setZero();
  LensEstimate read;
  std::string error;
  ASSERT_TRUE(parse_lens(format_lens(written, {"", 752, 480}), "lens.yaml", &read, &error))
      << error;
  EXPECT_EQ(read.covariance, written.covariance);
}

TEST(LensFile, RefusesEverySlipInOneLine) {
  const std::string good = lens_text();
  const auto refused = [](const std::string& text, const std::string& complaint) {
    LensEstimate read;
    std::string error;
    EXPECT_FALSE(parse_lens(text, "lens.yaml", &read, &error)) << complaint;
    EXPECT_THAT(error, StartsWith("lens.yaml:"));
    EXPECT_THAT(error, HasSubstr(complaint));
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  };
  refused("", "lens.yaml:1: not a lens; start with `format: 1`");
  refused("[1, 2]", "not a lens");
  refused("format: [1\n", "valid YAML is needed");
  refused(replaced(good, "format: 1", "format: 2"), "format 2 is not known");
  refused(replaced(good, "format: 1\n", ""), "format is missing");
  refused(good + "k3: {value: 0, sigma: 0}\n", "unknown key k3; known are format");
  refused(good + "k1: {value: 0, sigma: 0}\n", "k1 is given twice");
  refused(with_line_of("p2", ""), "p2 is missing; add it");
  refused(with_line_of("line_delay", ""), "line_delay is missing");
  refused(with_line_of("k1", "k1: {value: nan, sigma: 0}"), "lens.yaml:7: k1 is \"nan\"");
  refused(with_line_of("k1", "k1: {value: wide, sigma: 0}"), "k1 is \"wide\"; a finite number");
  refused(with_line_of("k1", "k1: 0.1"), "k1 is not a map; write {value: ..., sigma: ...}");
  refused(with_line_of("k1", "k1: {value: 0.1}"), "k1.sigma is missing");
  refused(with_line_of("k1", "k1: {sigma: 0.1}"), "k1.value is missing");
  refused(with_line_of("k1", "k1: {value: 0, sigma: -1e-4}"), "k1.sigma is -0.0001");
  refused(with_line_of("k1", "k1: {value: 0, sigma: inf}"), "k1.sigma is \"inf\"");
  refused(with_line_of("k1", "k1: {value: 0, sigma: 1, unit: 1}"), "unknown key k1.unit");
  refused(with_line_of("k1", "k1: {value: 0, sigma: 1}"),
          "sigma of k1 is 1, but by its covariance it is");
  refused(with_line_of("line_delay", "line_delay: {value: 51.56, sigma: 0.06}"),
          "give seconds a row; 14 microseconds are 14e-6");
  refused(with_line_of("focal_length_u", "focal_length_u: {value: 4.3, sigma: 0.03}"),
          "sees more than 157 degrees across the image; give pixels, not millimetres");
  refused(with_line_of("focal_length_v", "focal_length_v: {value: 1300, sigma: 0.03}"),
          "two focal lengths of one lens are about the same");
  refused(with_line_of("optical_centre_u", "optical_centre_u: {value: 960, sigma: 0.05}"),
          "optical_centre_u 960 lies outside the image of 752x480 px");
  refused(with_line_of("image", "image: {width: 752}"), "image.height is missing");
  refused(with_line_of("image", "image: {width: 752, height: 0}"), "image.height is 0");
  refused(with_line_of("image", "image: {width: 752.5, height: 480}"), "image.width is 752.5");
  refused(with_line_of("image", "image: 752x480"), "image is not a map");
  refused(good.substr(0, good.find("quality:")) + "quality: good\n", "quality is not a map");
  refused(replaced(good, "names:", "name:"), "unknown key covariance.name");
  refused(replaced(good, "[focal_length_u,", "[focal_length,"),
          "covariance.names has an unknown name");
  refused(replaced(good, "k1, k2,", "k1, k1,"), "covariance.names has k1 twice");
  refused(replaced(good, "k1, k2,", "k1,"), "covariance.matrix is not square");
  refused(good.substr(0, good.find("covariance:")), "covariance is missing; add it");
}

TEST(LensFile, RefusesAMatrixThatIsNoCovariance) {
  const auto refused = [](const PatternCalibration& calibration, const std::string& complaint) {
    LensEstimate read;
    std::string error;
    EXPECT_FALSE(parse_lens(format_lens(calibration, {"", 752, 480}), "lens.yaml", &read, &error));
    EXPECT_THAT(error, HasSubstr(complaint));
  };
  PatternCalibration bad = some_pattern_calibration();
  bad.covariance(0, 1) *= 1.01;
  refused(bad, "covariance.matrix is not symmetric; give both halves");
  bad = some_pattern_calibration();
  bad.covariance(0, 1) = bad.covariance(1, 0) =
      2 * std::sqrt(bad.covariance(0, 0) * bad.covariance(1, 1));
  refused(bad, "covariance.matrix is not positive semidefinite");
  bad = some_pattern_calibration();
  bad.covariance(4, 4) = 0;
  refused(bad, "one of which has no variance");
  bad = some_pattern_calibration();
  bad.covariance(3, 4) = std::nan("");
  refused(bad, "covariance.matrix is \"nan\"");
}

// Some rows may not be enough: what is left out would pass for exact.
TEST(LensFile, WantsTheCovarianceOfAllParameters) {
  const std::string text = lens_text();
  const std::size_t covariance = text.find("covariance:");
  LensEstimate read;
  std::string error;
  EXPECT_FALSE(parse_lens(
      text.substr(0, covariance) + "covariance: {names: [line_delay], matrix: [[3.6e-15]]}\n",
      "lens.yaml", &read, &error));
  EXPECT_THAT(error, HasSubstr("covariance.names lacks some of the parameters"));
}

TEST(LensFile, SaysWhyAFileCannotBeRead) {
  const TemporaryDirectory folder;
  LensEstimate read;
  std::string error;
  EXPECT_FALSE(load_lens(folder.path() + "/none.yaml", &read, &error));
  EXPECT_EQ(error, folder.path() + "/none.yaml: cannot be read: No such file or directory");
  EXPECT_FALSE(load_lens(folder.write("empty.yaml", ""), &read, &error));
  EXPECT_THAT(error, HasSubstr("empty.yaml:1: not a lens"));
  EXPECT_TRUE(load_lens(folder.write("lens.yaml", lens_text()), &read, &error)) << error;
}

}  // namespace
}  // namespace alidade
