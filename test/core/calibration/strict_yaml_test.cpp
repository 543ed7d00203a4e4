#include "core/calibration/strict_yaml.h"

#include <gtest/gtest.h>

#include <cmath>
#include <locale>
#include <string>

#include "core/calibration/number_text.h"

namespace alidade {
namespace {

constexpr NotYaml kNotYaml = {"not YAML: ", "; mend it"};

std::optional<FaultyKey> fault_of(const std::string& text,
                                  const std::vector<std::string>& known = {}) {
  return find_faulty_key(YAML::Load(text), known);
}

TEST(StrictYaml, FindsTheFirstFaultyKeyAndItsLine) {
  EXPECT_FALSE(fault_of("{a: 1, b: 2}"));
  EXPECT_FALSE(fault_of("{a: 1, b: 2}", {"a", "b", "c"}));
  const auto doubled = fault_of("a: 1\nb: 2\na: 3\nz: 4\n", {"a", "b"});
  ASSERT_TRUE(doubled);
  EXPECT_EQ(doubled->fault, KeyFault::kDoubled);
  EXPECT_EQ(line_of(doubled->key), 3);
  const auto unknown = fault_of("a: 1\nz: 2\na: 3\n", {"a", "b"});
  ASSERT_TRUE(unknown);
  EXPECT_EQ(unknown->fault, KeyFault::kUnknown);
  EXPECT_EQ(unknown->key.Scalar(), "z");
  const auto no_word = fault_of("? [a, b]\n: 1\n");
  ASSERT_TRUE(no_word);
  EXPECT_EQ(no_word->fault, KeyFault::kNoWord);
}

TEST(StrictYaml, ANodeThatIsNotInTheTextHasNoLine) { EXPECT_FALSE(line_of(YAML::Node())); }

TEST(StrictYaml, SaysInOneLineWhatTheReaderOrTheParserDoesNotTake) {
  std::string error;
  EXPECT_TRUE(read_yaml(
      "a: 1", "file", kNotYaml, [](const YAML::Node&) {}, &error));
  EXPECT_FALSE(read_yaml(
      "a: 1", "file", kNotYaml, [](const YAML::Node&) { throw YamlError("file:1: a\nb"); },
      &error));
  EXPECT_EQ(error, "file:1: a?b");
  EXPECT_FALSE(read_yaml(
      "a: 1\nb: [", "file", kNotYaml, [](const YAML::Node&) {}, &error));
  EXPECT_EQ(error.rfind("file:2: not YAML: ", 0), 0u) << error;
  EXPECT_EQ(error.substr(error.size() - 9), "; mend it");
}

TEST(NumberText, TakesAFiniteDecimalNumberAndNothingElse) {
  EXPECT_EQ(number_of("-1.5e3"), -1500);
  EXPECT_EQ(number_of("+.5"), 0.5);
  for (const char* text :
       {"", "x", "1x", "1 2", " 1", "1e", "nan", "inf", "1e999", "0x10", "1,5", "--1", "1.2.3"}) {
    EXPECT_FALSE(number_of(text)) << text;
  }
}

TEST(NumberText, ExactTextIsShortAndReadsBackAsTheSameBits) {
  EXPECT_EQ(exact_text(55.4), "55.4");
  for (const double value : {1 / 3.0, 1e-300, -0.1 - 0.2, 123456789.123456789, 1 - 1e-16}) {
    EXPECT_EQ(number_of(exact_text(value)), value);
  }
  EXPECT_EQ(short_text(0.123456789), "0.123457");
}

TEST(NumberText, AnEstimateHasTheDigitsOfItsSigmaAndNoMinusBeforeZero) {
  EXPECT_EQ(value_text(939.99874, 0.0095), "939.9987");
  EXPECT_EQ(sigma_text(0.0095), "0.0095");
  EXPECT_EQ(estimate_text(939.99874, 0.0095, "px"), "939.9987 +- 0.0095 px");
  EXPECT_EQ(estimate_text(940, 34.4, "px"), "940 +- 34 px");
  EXPECT_EQ(estimate_text(-0.00001, 0.012, ""), "0.000 +- 0.012");
  EXPECT_EQ(estimate_text(12345, 1234.5, "px"), "12345 +- 1234 px");
  // Never +- 0.0, and what no estimate is has no sigma.
  EXPECT_EQ(estimate_text(1, 3e-9, ""), "1.0000000000 +- 3.0e-09");
  EXPECT_EQ(estimate_text(1, 0, "px"), "1 px, exact");
  // As seconds become microseconds.
  EXPECT_EQ(value_text(9.9999999999e-6 / 1e-6, 0), "10");
  EXPECT_EQ(value_text(14.2e-6 / 1e-6, 0), "14.2");
  EXPECT_EQ(value_text(-0.0, 0), "0");
  EXPECT_EQ(rounded_text(-0.00004, 4), "0.0000");
  EXPECT_EQ(rounded_text(-0.4, 0), "0");
  EXPECT_EQ(rounded_text(-0.06, 1), "-0.1");
  EXPECT_EQ(rounded_text(-10, 0), "-10");
}

}  // namespace
}  // namespace alidade
