#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>
#include <sstream>

#include <gtest/gtest.h>

#include "test/accuracy/mot_metrics.h"
#include "test/accuracy/mot_text.h"
#include "test/accuracy/optimal_assignment.h"

namespace alidade::test {
namespace {

double cost_of(const Eigen::MatrixXd& cost, const std::vector<int>& columns) {
  double sum = 0;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i] >= 0) sum += cost(static_cast<Eigen::Index>(i), columns[i]);
  }
  return sum;
}

TEST(OptimalAssignment, CostsWhatTheBestOfAllDoes) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> value(-5, 5);
  for (int run = 0; run < 300; ++run) {
    const int rows = 1 + run % 5;
    const int columns = 1 + (run / 5) % 6;
    Eigen::MatrixXd cost(rows, columns);
    for (double& v : cost.reshaped()) v = run % 7 == 0 ? std::floor(value(random)) : value(random);
    const std::vector<int> assigned = optimal_assignment(cost);
    ASSERT_EQ(static_cast<int>(assigned.size()), rows);
    std::vector<int> used;
    for (const int c : assigned) {
      if (c >= 0) used.push_back(c);
    }
    EXPECT_EQ(static_cast<int>(used.size()), std::min(rows, columns));
    std::sort(used.begin(), used.end());
    EXPECT_EQ(std::adjacent_find(used.begin(), used.end()), used.end());

    const int most = std::max(rows, columns);
    std::vector<int> order(static_cast<std::size_t>(most));
    std::iota(order.begin(), order.end(), 0);
    double best = 1e9;
    do {
      double sum = 0;
      for (int i = 0; i < rows; ++i) {
        const int c = order[static_cast<std::size_t>(i)];
        if (c < columns) sum += cost(i, c);
      }
      best = std::min(best, sum);
    } while (std::next_permutation(order.begin(), order.end()));
    EXPECT_NEAR(cost_of(cost, assigned), best, 1e-9);
  }
}

std::string text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST(MotMetrics, AreThoseOfMotmetrics) {
  const std::string folder = ALIDADE_MOT_REFERENCE;
  const nlohmann::json table = nlohmann::json::parse(text_of(folder + "/expected.json"));
  ASSERT_EQ(table.size(), 6U);
  int compared = 0;
  for (const auto& [name, expected] : table.items()) {
    std::vector<MotBox> truth;
    std::vector<MotBox> result;
    std::string error;
    ASSERT_TRUE(parse_mot(text_of(folder + "/" + name + ".truth.txt"), name, true, &truth, &error))
        << error;
    ASSERT_TRUE(
        parse_mot(text_of(folder + "/" + name + ".result.txt"), name, false, &result, &error))
        << error;
    const MotMetrics metrics = mot_metrics(truth, result);
    for (const auto& [key, count] : counts_of(metrics)) {
      EXPECT_EQ(static_cast<double>(count), expected.at(key).get<double>()) << name << " " << key;
      ++compared;
    }
    for (const auto& [key, ratio] : ratios_of(metrics)) {
      EXPECT_NEAR(ratio, expected.at(key).get<double>(), 1e-12) << name << " " << key;
      ++compared;
    }
  }
  EXPECT_EQ(compared, 6 * 27);
}

std::vector<MotBox> walk(std::int64_t identity, std::int64_t from, std::int64_t to, double left) {
  std::vector<MotBox> boxes;
  for (std::int64_t k = from; k < to; ++k) boxes.push_back({k, identity, left, 0, 10, 10});
  return boxes;
}

std::vector<MotBox> joined(std::vector<MotBox> a, const std::vector<MotBox>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// Ten frames; the track is lost for two and comes back under another name, and a ghost is there twice.
TEST(MotMetrics, OneTargetByHand) {
  const std::vector<MotBox> truth = walk(1, 1, 11, 0);
  const std::vector<MotBox> result =
      joined(joined(walk(7, 1, 5, 0), walk(8, 7, 11, 0)), walk(9, 1, 3, 500));
  const MotMetrics m = mot_metrics(truth, result);
  EXPECT_EQ(m.num_misses, 2);
  EXPECT_EQ(m.num_false_positives, 2);
  EXPECT_EQ(m.num_switches, 1);
  EXPECT_EQ(m.num_fragmentations, 1);
  EXPECT_EQ(m.mostly_tracked, 1);
  EXPECT_DOUBLE_EQ(m.mota, 0.5);
  EXPECT_DOUBLE_EQ(m.motp, 0);
  EXPECT_DOUBLE_EQ(m.faf, 0.2);
  EXPECT_DOUBLE_EQ(m.idf1, 2 * 4.0 / 20);
  // DetA = 8 / 12; of each match 4 / 10 frames are shared.
  EXPECT_NEAR(m.hota, std::sqrt(8.0 / 12 * 0.4), 1e-12);
}

TEST(MotMetrics, OfNothingAreNoNumbersOrNothing) {
  const MotMetrics both = mot_metrics({}, {});
  EXPECT_EQ(both.num_frames, 0);
  EXPECT_TRUE(std::isnan(both.mota));
  const MotMetrics nothing_found = mot_metrics(walk(1, 1, 11, 0), {});
  EXPECT_DOUBLE_EQ(nothing_found.mota, 0);
  EXPECT_DOUBLE_EQ(nothing_found.hota, 0);
  EXPECT_EQ(nothing_found.mostly_lost, 1);
  const MotMetrics ghosts = mot_metrics({}, walk(1, 1, 11, 0));
  EXPECT_EQ(ghosts.num_false_positives, 10);
  EXPECT_DOUBLE_EQ(ghosts.hota, 0);
}

TEST(MotText, IsReadWithBlanksAndKnowsWhatDoesNotCount) {
  std::vector<MotBox> boxes;
  std::string error;
  const std::string text = "1,2, 3.5,4,5,6,1,1,0.5\r\n\n2, 2,3,4,5,6,0\n3,2,3,4,5,6,1,-1,-1,-1\n";
  ASSERT_TRUE(parse_mot(text, "t", true, &boxes, &error)) << error;
  ASSERT_EQ(boxes.size(), 3U);
  EXPECT_EQ(boxes[0].left, 3.5);
  EXPECT_TRUE(boxes[0].counts);
  EXPECT_FALSE(boxes[1].counts);
  EXPECT_EQ(boxes[2].frame, 3);
  EXPECT_TRUE(boxes[2].counts);
  ASSERT_TRUE(parse_mot(text, "t", false, &boxes, &error));
  EXPECT_TRUE(boxes[1].counts);
}

TEST(MotText, IsRefusedWithFileLineAndReason) {
  const std::pair<const char*, const char*> cases[] = {
      {"1,2,3,4,5,6,1\n1,2,3,4,5\n",
       "t.txt:2: 5 numbers; it takes frame, identity, left, top, width, height, "
       "confidence and up to three more"},
      {"1,2,3,x,5,6,1\n", "t.txt:1: 'x' is no number"},
      {"1,2,3,nan,5,6,1\n", "t.txt:1: 'nan' is no number"},
      {"1,2,3,,5,6,1\n", "t.txt:1: '' is no number"},
      {"0,2,3,4,5,6,1\n", "t.txt:1: the frame must be a whole number from 1"},
      {"1.5,2,3,4,5,6,1\n", "t.txt:1: the frame must be a whole number from 1"},
      {"1,-1,3,4,5,6,1\n",
       "t.txt:1: the identity must be a whole number from 0: detections without one cannot be "
       "judged"},
      {"1,1e300,3,4,5,6,1\n",
       "t.txt:1: the identity must be a whole number from 0: detections without one cannot be "
       "judged"},
      {"1,2,3,4,0,6,1\n", "t.txt:1: width and height must be above 0"},
      {"1,2,3,4,5,6,1\n\n1,2,9,9,5,6,1\n", "t.txt:3: identity 2 is there twice in frame 1"},
      {"1 2 3 4 5 6 1\n", "t.txt:1: '1 2 3 4 5 6 1' is no number"}};
  for (const auto& [text, expected] : cases) {
    std::vector<MotBox> boxes;
    std::string error;
    EXPECT_FALSE(parse_mot(text, "t.txt", true, &boxes, &error)) << text;
    EXPECT_EQ(error, expected);
  }
}

}  // namespace
}  // namespace alidade::test
