#include "test/accuracy/mot_text.h"

#include <cmath>
#include <set>
#include <sstream>
#include <utility>

#include "core/calibration/number_text.h"

namespace alidade::test {

namespace {

constexpr double kMostWhole = 9007199254740992.0;  // 2^53: whole numbers beyond are not told apart

std::string without_blanks(const std::string& cell) {
  const char* const blanks = " \t\r";
  const std::size_t first = cell.find_first_not_of(blanks);
  if (first == std::string::npos) return {};
  return cell.substr(first, cell.find_last_not_of(blanks) - first + 1);
}

// What is wrong with a line; empty: nothing.
std::string read_line(const std::string& line, bool truth, MotBox* box) {
  std::vector<double> numbers;
  std::istringstream cells(line + ',');
  for (std::string cell; std::getline(cells, cell, ',');) {
    const std::optional<double> number = number_of(without_blanks(cell));
    if (!number) return "'" + without_blanks(cell) + "' is no number";
    numbers.push_back(*number);
  }
  if (numbers.size() < 7 || numbers.size() > 10) {
    return std::to_string(numbers.size()) +
           " numbers; it takes frame, identity, left, top, width, height, confidence and up to "
           "three more";
  }
  const auto whole = [](double v) { return v == std::floor(v) && std::abs(v) < kMostWhole; };
  if (!whole(numbers[0]) || numbers[0] < 1) return "the frame must be a whole number from 1";
  if (!whole(numbers[1]) || numbers[1] < 0) {
    return "the identity must be a whole number from 0: detections without one cannot be judged";
  }
  if (!(numbers[4] > 0 && numbers[5] > 0)) return "width and height must be above 0";
  box->frame = static_cast<std::int64_t>(numbers[0]);
  box->identity = static_cast<std::int64_t>(numbers[1]);
  box->left = numbers[2];
  box->top = numbers[3];
  box->width = numbers[4];
  box->height = numbers[5];
  box->counts = !truth || numbers[6] >= 1;
  return {};
}

}  // namespace

bool parse_mot(const std::string& text, const std::string& name, bool truth,
               std::vector<MotBox>* boxes, std::string* error) {
  boxes->clear();
  std::set<std::pair<std::int64_t, std::int64_t>> known;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (without_blanks(line).empty()) continue;
    MotBox box;
    std::string problem = read_line(line, truth, &box);
    if (problem.empty() && !known.emplace(box.frame, box.identity).second) {
      problem = "identity " + std::to_string(box.identity) + " is there twice in frame " +
                std::to_string(box.frame);
    }
    if (!problem.empty()) {
      *error = name + ":" + std::to_string(number) + ": " + problem;
      return false;
    }
    boxes->push_back(box);
  }
  return true;
}

}  // namespace alidade::test
