// The compiler's vectors against the same in scalar code: equal to the bit on every processor, SSE2 and NEON alike.

#include "core/realtime/image/byte_vector.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <random>

namespace alidade::test {
namespace {

using Bytes = std::array<std::uint8_t, kByteLanes>;

ByteVector vector_of(const Bytes& bytes) { return load<ByteVector>(bytes.data()); }

Bytes bytes_of(ByteVector v) {
  Bytes bytes;
  store(v, bytes.data());
  return bytes;
}

// All 65,536 pairs of bytes, sixteen at a time.
template <class Compare>
void for_all_pairs(const Compare& compare) {
  for (int a = 0; a < 256; ++a) {
    for (int first = 0; first < 256; first += kByteLanes) {
      Bytes as, bs;
      as.fill(static_cast<std::uint8_t>(a));
      for (std::size_t i = 0; i < bs.size(); ++i)
        bs[i] = static_cast<std::uint8_t>(first + static_cast<int>(i));
      ASSERT_NO_FATAL_FAILURE(compare(as, bs));
    }
  }
}

TEST(ByteVector, MaximumMinimumAndSaturatedDifferenceEqualTheScalarOnes) {
  for_all_pairs([](const Bytes& a, const Bytes& b) {
    const Bytes greatest = bytes_of(max(vector_of(a), vector_of(b)));
    const Bytes least = bytes_of(min(vector_of(a), vector_of(b)));
    const Bytes difference = bytes_of(subtract_saturated(vector_of(a), vector_of(b)));
    for (std::size_t i = 0; i < a.size(); ++i) {
      ASSERT_EQ(greatest[i], std::max(a[i], b[i]));
      ASSERT_EQ(least[i], std::min(a[i], b[i]));
      ASSERT_EQ(difference[i], a[i] > b[i] ? a[i] - b[i] : 0);
    }
  });
}

TEST(ByteVector, FindsASingleGreaterLane) {
  for (std::size_t lane = 0; lane < kByteLanes; ++lane) {
    for (const int value : {0, 1, 127, 128, 254}) {
      const ByteVector level = broadcast(static_cast<std::uint8_t>(value));
      Bytes bytes = bytes_of(level);
      EXPECT_FALSE(any_greater(vector_of(bytes), level));
      bytes[lane] = static_cast<std::uint8_t>(value + 1);
      EXPECT_TRUE(any_greater(vector_of(bytes), level));
      EXPECT_FALSE(any_greater(level, vector_of(bytes)));
    }
  }
}

// Pages after which there is nothing: reading or writing one byte too many ends the test.
class PageEnd {
 public:
  PageEnd() : page_(static_cast<std::size_t>(sysconf(_SC_PAGESIZE))) {
    memory_ = mmap(nullptr, 2 * page_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory_ == MAP_FAILED) std::abort();
    if (mprotect(static_cast<std::uint8_t*>(memory_) + page_, page_, PROT_NONE) != 0) std::abort();
  }
  ~PageEnd() { munmap(memory_, 2 * page_); }
  PageEnd(const PageEnd&) = delete;
  PageEnd& operator=(const PageEnd&) = delete;
  // The last bytes of the page.
  [[nodiscard]] std::uint8_t* last(std::size_t bytes) const {
    return static_cast<std::uint8_t*>(memory_) + page_ - bytes;
  }

 private:
  std::size_t page_;
  void* memory_;
};

TEST(ByteVector, LoadsAndStoresSixteenBytesAtAnyAddressAndNoMore) {
  const PageEnd page;
  for (std::size_t offset = kByteLanes; offset < 2 * kByteLanes; ++offset) {
    std::uint8_t* at = page.last(offset);
    for (std::size_t i = 0; i < offset; ++i) at[i] = static_cast<std::uint8_t>(i + offset);
    const Bytes bytes = bytes_of(load<ByteVector>(at));
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), at));
    store(broadcast(7), at);
    for (std::size_t i = 0; i < offset; ++i) EXPECT_EQ(at[i], i < kByteLanes ? 7 : i + offset);
  }
}

TEST(ByteVector, ShufflesLanesOfTwoVectors) {
  Bytes first, second;
  for (std::size_t i = 0; i < first.size(); ++i) {
    first[i] = static_cast<std::uint8_t>(i);
    second[i] = static_cast<std::uint8_t>(100 + i);
  }
  const Bytes shuffled = bytes_of(shuffle<15, 16, 0, 31, 1, 1, 17, 18, 2, 3, 4, 5, 6, 7, 8, 9>(
      vector_of(first), vector_of(second)));
  const Bytes expected = {15, 100, 0, 115, 1, 1, 101, 102, 2, 3, 4, 5, 6, 7, 8, 9};
  EXPECT_EQ(shuffled, expected);
}

TEST(FloatVector, LoadsEightBytesAtAnyAddressAndNoMore) {
  const PageEnd page;
  for (std::size_t offset = 8; offset < 16; ++offset) {
    std::uint8_t* at = page.last(offset);
    const std::array<std::uint8_t, 8> values = {0, 1, 127, 128, 254, 255, 3, 77};
    std::copy(values.begin(), values.end(), at);
    const EightFloats eight = load_eight(at);
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(eight.low[i], values[static_cast<std::size_t>(i)]);
      EXPECT_EQ(eight.high[i], values[static_cast<std::size_t>(i + 4)]);
    }
  }
}

TEST(FloatVector, LoadsFourBytesAndFourFloatsAtAnyAddressAndNoMore) {
  const PageEnd page;
  for (std::size_t offset = 4; offset < 8; ++offset) {
    std::uint8_t* at = page.last(offset);
    const std::array<std::uint8_t, 4> values = {0, 1, 128, 255};
    std::copy(values.begin(), values.end(), at);
    const FloatVector four = load_four(at);
    for (int i = 0; i < 4; ++i) EXPECT_EQ(four[i], values[static_cast<std::size_t>(i)]);
  }
  float floats[5] = {0.F, 1.5F, -2.F, 1e-38F, 3e38F};
  for (int first = 0; first < 2; ++first) {
    const FloatVector four = load_four(floats + first);
    for (int i = 0; i < 4; ++i) EXPECT_EQ(four[i], floats[first + i]);
  }
}

TEST(FloatVector, ArithmeticAndSumEqualTheScalarOnesToTheBit) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(-255, 255);
  for (int k = 0; k < 1000; ++k) {
    float a[4], b[4];
    for (float& x : a) x = value(random);
    for (float& x : b) x = value(random);
    const FloatVector product = load_four(a) * load_four(b);
    const FloatVector difference = load_four(a) - load_four(b);
    for (int i = 0; i < 4; ++i) {
      ASSERT_EQ(product[i], a[i] * b[i]);
      ASSERT_EQ(difference[i], a[i] - b[i]);
    }
    ASSERT_EQ(sum(load_four(a)), (a[0] + a[1]) + (a[2] + a[3]));
  }
}

}  // namespace
}  // namespace alidade::test
