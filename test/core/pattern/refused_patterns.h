#pragma once
// Names of patterns that are none.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "core/pattern/known_pattern.h"

namespace alidade::test {

// Each, and what the one line says that it is refused with.
inline void expect_refused(const std::vector<std::pair<const char*, const char*>>& cases) {
  for (const auto& [text, what] : cases) {
    std::string error;
    EXPECT_FALSE(parse_pattern(text, &error)) << text;
    EXPECT_THAT(error, ::testing::HasSubstr(what)) << text;
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }
}

}  // namespace alidade::test
