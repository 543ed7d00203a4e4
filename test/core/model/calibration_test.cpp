#include "core/model/calibration.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace alidade {
namespace {

// A term of the distortion without an enumerator has a number, but the compiler misses no case.
TEST(Parameter, EachHasANameOfItsOwn) {
  std::set<std::string> names;
  for (int i = 0; i < kParameterCount; ++i) {
    const std::string name = to_string(static_cast<Parameter>(i));
    EXPECT_NE(name, "unknown parameter") << i;
    EXPECT_TRUE(names.insert(name).second) << i << ": " << name;
  }
}

TEST(Parameter, EachTermOfTheDistortionHasTheNameOfTheKind) {
  for (int term = 0; term < kDistortionCount; ++term) {
    EXPECT_STREQ(to_string(distortion_parameter(term)),
                 Distortion<double>::kNames[static_cast<std::size_t>(term)]);
  }
}

TEST(Parameter, IsOfTheDistortionIfItIsOneOfItsTerms) {
  int terms = 0;
  for (int i = 0; i < kParameterCount; ++i)
    terms += is_distortion(static_cast<Parameter>(i)) ? 1 : 0;
  EXPECT_EQ(terms, kDistortionCount);
  for (int term = 0; term < kDistortionCount; ++term)
    EXPECT_TRUE(is_distortion(distortion_parameter(term))) << term;
}

}  // namespace
}  // namespace alidade
