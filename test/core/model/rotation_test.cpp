#include "core/model/rotation.h"

#include <gtest/gtest.h>

TEST(Rotation, ExpOfZeroIsIdentity) {
  EXPECT_EQ(alidade::exp_so3<double>(alidade::Vector3<double>::Zero()),
            alidade::Matrix3<double>::Identity());
}
