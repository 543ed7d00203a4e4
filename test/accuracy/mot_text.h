#pragma once
// MOTChallenge files as text, read strictly: a line a box,
//   frame, identity, left, top, width, height, confidence[, class, visibility, ...]     7 to 10 numbers, commas between
// Frames count from 1, pixels too: the top-left pixel's centre is (1, 1), which matters for no metric. In a truth, a confidence below 1 marks what
// is not to be counted. Blanks around numbers, empty lines and a carriage return are taken. Pure.

#include <string>
#include <vector>

#include "test/accuracy/mot_metrics.h"

namespace alidade::test {

// False: *error is one line with name, line number, and what would be right. name stands for the file.
[[nodiscard]] bool parse_mot(const std::string& text, const std::string& name, bool truth,
                             std::vector<MotBox>* boxes, std::string* error);

}  // namespace alidade::test
