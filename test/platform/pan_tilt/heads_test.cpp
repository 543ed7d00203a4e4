// What every head of the table has: a protocol that keeps the contract, a rig, a simulated head, a fuzz target, a
// place in the documentation.

#include "platform/pan_tilt/heads.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <sstream>
#include <string>

#include "test/platform/support/head_rig.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(std::string(ALIDADE_SOURCE_DIR) + "/" + path).rdbuf();
  return text.str();
}

class EveryHead : public ::testing::TestWithParam<Head> {};

INSTANTIATE_TEST_SUITE_P(Heads, EveryHead, ::testing::ValuesIn(kHeads),
                         [](const auto& tested) { return std::string(tested.param.key); });

TEST_P(EveryHead, IsFoundByItsKey) {
  EXPECT_EQ(head_type_of(GetParam().key), GetParam().type);
  EXPECT_STREQ(head_of(GetParam().type).key, GetParam().key);
  EXPECT_EQ(std::count_if(kHeads.begin(), kHeads.end(),
                          [](const Head& head) { return head.key == GetParam().key; }),
            1);
}

TEST(Heads, AreNotFoundByAnotherKey) {
  for (const char* key : {"", "PTU", "pelco", "vapix"}) EXPECT_EQ(head_type_of(key), std::nullopt);
}

TEST_P(EveryHead, HasARigForEachLink) {
  using Link = HeadServer::Link;
  for (const Link link : {Link::kSerial, Link::kTcp, Link::kUdp}) {
    EXPECT_TRUE(std::any_of(kHeadKinds.begin(), kHeadKinds.end(), [&](const HeadKindRow& row) {
      return row.type == GetParam().type && row.link == link;
    }));
  }
  for (const HeadKindRow& row : kHeadKinds) EXPECT_EQ(row_of(row.kind).name, row.name);
}

TEST_P(EveryHead, IsSimulatedUnderTheSameName) {
  EXPECT_TRUE(std::any_of(kHeadModels.begin(), kHeadModels.end(), [](const NamedHeadModel& named) {
    return std::string(named.name) == GetParam().key;
  }));
}

TEST_P(EveryHead, IsFuzzedAndDocumented) {
  const std::string key = GetParam().key;
  EXPECT_TRUE(std::filesystem::exists(ALIDADE_SOURCE_DIR + ("/test/fuzz/" + key + "_fuzz.cpp")));
  EXPECT_THAT(text_of("test/fuzz/README.md"), HasSubstr("| `" + key + "` |"));
  EXPECT_THAT(text_of("platform/pan_tilt/README.md"), HasSubstr("`" + key + "_protocol`"));
  EXPECT_THAT(text_of("test/simulator/README.md"), HasSubstr("`" + key + "`"));
  EXPECT_THAT(text_of("edge_app/config/README.md"), HasSubstr(" " + key + " |"));
  std::istringstream example(text_of("edge_app/examples/head_on_a_line.yaml"));
  std::string line;
  while (std::getline(example, line) && line.rfind("  type: pelco_d", 0) != 0) {
  }
  EXPECT_THAT(line, HasSubstr(" " + key));
}

class EveryHeadKind : public ::testing::TestWithParam<HeadKind> {
 protected:
  std::unique_ptr<QueryProtocol> protocol_ = HeadRig(GetParam()).protocol();
};

INSTANTIATE_TEST_SUITE_P(Heads, EveryHeadKind, ::testing::ValuesIn(all_head_kinds()),
                         [](const auto& tested) { return to_string(tested.param); });

TEST_P(EveryHeadKind, NeverAsksWithoutBytes) {
  for (int life = 0; life < 3; ++life) {
    protocol_->restart();
    for (int i = 0; i < 3 * kQueriesPerFence; ++i) {
      EXPECT_FALSE(protocol_->next().bytes.empty());
      if (i % 5 == 1) static_cast<void>(protocol_->give_up());
      if (i % 7 == life) protocol_->doubt();
    }
  }
}

// So that an answer that comes after all is not taken for that to what is asked next.
TEST_P(EveryHeadKind, AsksSomethingElseAfterAQueryWithoutAnAnswer) {
  for (int before = 0; before < 3 * kQueriesPerFence; ++before) {
    protocol_->restart();
    for (int i = 0; i < before; ++i) static_cast<void>(protocol_->next());
    const std::string unanswered = protocol_->next().bytes;
    static_cast<void>(protocol_->give_up());
    EXPECT_NE(protocol_->next().bytes, unanswered) << "query " << before;
  }
}

TEST_P(EveryHeadKind, TellsHowMuchOfALineItsReadingsTake) {
  EXPECT_GT(protocol_->polls_per_reading(), 0);
  EXPECT_GT(protocol_->bytes_per_reading(), 0);
  EXPECT_STRNE(protocol_->name(), "");
}

}  // namespace
}  // namespace alidade
