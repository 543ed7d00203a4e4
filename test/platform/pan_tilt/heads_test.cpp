// What every head of the table has: a protocol that keeps the contract, a simulated device that it understands, a place
// in the documentation. What head_kinds.cpp says of a kind is held against the device, which is asked without a line.

#include "platform/pan_tilt/heads.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "test/platform/support/head_kinds.h"

namespace alidade {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr int kEnoughQueries = 2 * kQueriesPerFence;

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

TEST_P(EveryHead, IsSimulatedOnceUnderTheSameKey) {
  EXPECT_EQ(std::count_if(
                kHeadModels.begin(), kHeadModels.end(),
                [](const HeadModel& model) { return model.name == std::string(GetParam().key); }),
            1);
}

TEST_P(EveryHead, IsSimulatedWithAZoomIfOneOfItsKindsTellsIt) {
  const auto model = std::find_if(
      kHeadModels.begin(), kHeadModels.end(),
      [](const HeadModel& of_all) { return of_all.name == std::string(GetParam().key); });
  ASSERT_NE(model, kHeadModels.end());
  const std::vector<HeadKind> kinds = all_head_kinds();
  EXPECT_EQ(std::any_of(kinds.begin(), kinds.end(),
                        [](const HeadKind& kind) {
                          return kind.head->type == GetParam().type &&
                                 kind.head->abilities.tells_zoom;
                        }),
            model->tele_zoom != 0);
}

TEST_P(EveryHead, HasAKindOverEachLink) {
  using Link = HeadServer::Link;
  for (const Link link : {Link::kSerial, Link::kTcp, Link::kUdp}) {
    EXPECT_EQ(head_kinds_over(link).size(), kHeads.size());
  }
}

TEST_P(EveryHead, IsDocumentedForTheUser) {
  const std::string key = GetParam().key;
  std::istringstream page(text_of("docs/manual/how-to/serial-heads.md"));
  std::string row;
  while (std::getline(page, row) && row.rfind("| key |", 0) != 0) {
  }
  EXPECT_THAT(row, HasSubstr(" " + key + " |")) << "the table of what must be given";
  std::istringstream example(text_of("edge_app/examples/head_on_a_line.yaml"));
  std::string line;
  for (const char* begin : {"pan_tilt:", "  type: "}) {
    while (std::getline(example, line) && line.rfind(begin, 0) != 0) {
    }
  }
  EXPECT_THAT(line, HasSubstr(" " + key)) << "head_on_a_line.yaml";
}

// A head of a kind, asked without a line: each answer comes whole and at once.
class Conversation {
 public:
  struct Turn {
    Query query;
    std::string reply;
    Answer answer;
  };

  explicit Conversation(const HeadKind& kind, const HeadPosition& position = kPositionOfHeads)
      : position_(position),
        kind_(kind),
        head_(simulated_head(kind, [this] { return position_; })),
        protocol_(make_protocol(kind.head->options)) {
    head_->power_on();
    protocol_->restart();
  }
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;

  void turn_to(const HeadPosition& position) { position_ = position; }
  void doubt() { protocol_->doubt(); }

  // The head's reply, without looking for the answer in it.
  Turn ask() {
    Turn turn;
    turn.query = protocol_->next();
    for (const std::string& reply : head_->take(turn.query.bytes)) turn.reply += reply;
    return turn;
  }
  Answer find(const std::string& bytes) { return protocol_->find(bytes); }

  Turn next() {
    Turn turn = ask();
    turn.answer = find(turn.reply);
    if (turn.answer.kind == Answer::Kind::kNone) head_->take(protocol_->give_up());
    return turn;
  }

  static bool is_reading(const Answer& answer) {
    return answer.kind == Answer::Kind::kPan || answer.kind == Answer::Kind::kTilt ||
           answer.kind == Answer::Kind::kPanTilt;
  }

  // The next one with a reading; without one where the head is not understood.
  Turn reading() {
    Turn turn;
    for (int i = 0; i < kEnoughQueries; ++i) {
      turn = next();
      if (is_reading(turn.answer)) break;
    }
    return turn;
  }

  // The larger error of a reading's axes.
  [[nodiscard]] double error_deg(const Answer& answer) const {
    const auto error = [](double angle_deg, const AxisMapping& axis, double true_deg) {
      return std::abs(
          std::remainder(mapped_rad(angle_deg * kRadPerDeg, axis) / kRadPerDeg - true_deg, 360));
    };
    const double pan = error(answer.pan_deg, pan_axis_of(kind_), position_.pan_deg);
    const double tilt = error(answer.tilt_deg, tilt_axis_of(kind_), position_.tilt_deg);
    return answer.kind == Answer::Kind::kPan    ? pan
           : answer.kind == Answer::Kind::kTilt ? tilt
                                                : std::max(pan, tilt);
  }

 private:
  HeadPosition position_;
  HeadKind kind_;
  std::unique_ptr<SimulatedHead> head_;
  std::unique_ptr<QueryProtocol> protocol_;
};

class EveryHeadKind : public ::testing::TestWithParam<HeadKind> {
 protected:
  const HeadVariant& head_ = *GetParam().head;
  std::unique_ptr<QueryProtocol> protocol_ = make_protocol(head_.options);

  // The bytes that come in place of `reply`; `before` came last.
  using Damage =
      std::function<std::vector<std::string>(const std::string& before, const std::string& reply)>;

  // Whether a reading is found in them that is not true, be it after any of some queries.
  bool is_forged_by(const Damage& damage) {
    constexpr int kAccustomed = 24;  // queries: what is asked at first is past
    constexpr int kCycle = 4;        // both axes, and a query besides
    for (int lead = kAccustomed; lead < kAccustomed + kCycle; ++lead) {
      for (std::size_t i = 0;; ++i) {
        Conversation conversation(GetParam());
        Conversation::Turn before;
        for (int asked = 0; asked < lead; ++asked) before = conversation.next();
        conversation.turn_to({10, -20, 0x1234});
        const std::vector<std::string> came = damage(before.reply, conversation.ask().reply);
        if (i >= came.size()) break;
        const Answer answer = conversation.find(came[i]);
        if (Conversation::is_reading(answer) && conversation.error_deg(answer) > head_.step_deg) {
          return true;
        }
      }
    }
    return false;
  }
};

INSTANTIATE_TEST_SUITE_P(Heads, EveryHeadKind, ::testing::ValuesIn(all_head_kinds()),
                         [](const auto& tested) { return tested.param.name(); });

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

// One answer too many would make each answer that of the query before, for ever.
TEST_P(EveryHeadKind, AsksAFenceInDoubtAndNowAndThenWhereRepeatsDoNotShow) {
  if (head_.abilities.shows_repeats) return;
  Conversation conversation(GetParam());
  const auto is_fence = [&] {
    const Answer::Kind kind = conversation.next().answer.kind;
    return kind == Answer::Kind::kDone || kind == Answer::Kind::kZoom;
  };
  for (int lead = 0; lead < kQueriesPerFence; lead += 7) {
    for (int i = 0; i < lead; ++i) conversation.next();
    conversation.reading();
    conversation.doubt();
    EXPECT_TRUE(is_fence()) << lead << " queries later";
    EXPECT_FALSE(is_fence()) << "one fence is enough";
  }
  int without_fence = 0;
  for (int i = 0; i < 4 * kQueriesPerFence; ++i) {
    without_fence = is_fence() ? 0 : without_fence + 1;
    ASSERT_LE(without_fence, kQueriesPerFence);
  }
}

// What another program asked may still be answered.
TEST_P(EveryHeadKind, BeginsAConnectionWithWhatIsAnsweredOtherwiseWhereRepeatsDoNotShow) {
  if (head_.abilities.shows_repeats) return;
  Conversation conversation(GetParam());
  const Answer::Kind kind = conversation.next().answer.kind;
  EXPECT_TRUE(kind == Answer::Kind::kDone || kind == Answer::Kind::kZoom);
}

TEST_P(EveryHeadKind, FindsNothingInNoBytes) {
  for (int i = 0; i < kQueriesPerFence; ++i) {
    static_cast<void>(protocol_->next());
    EXPECT_EQ(protocol_->find({}).kind, Answer::Kind::kNone);
  }
}

// The signs of heads.h, the simulated head of that key, and the row of head_kinds.cpp are of one head.
TEST_P(EveryHeadKind, TellsTheSimulatedHeadsPositionInTheAxesOfTheModel) {
  EXPECT_EQ(head_.options.index(), static_cast<std::size_t>(head_.type));
  const UsualSigns& usual = head_of(head_.type).signs;
  EXPECT_EQ(usual.pan.value_or(head_.pan_sign), head_.pan_sign) << "kHeads and its device";
  EXPECT_EQ(usual.tilt.value_or(head_.tilt_sign), head_.tilt_sign) << "kHeads and its device";
  double worst_deg = 0;
  for (int i = -40; i <= 40; ++i) {
    const HeadPosition position{4.4321 * i, 2.1234 * i, 0x1234};
    Conversation conversation(GetParam(), position);
    for (int n = 0; n < 4; ++n) {
      const Conversation::Turn turn = conversation.reading();
      ASSERT_TRUE(Conversation::is_reading(turn.answer))
          << "its device in kHeadModels is not understood: " << turn.answer.problem;
      EXPECT_LT(turn.answer.begin, turn.reply.size());
      worst_deg = std::max(worst_deg, conversation.error_deg(turn.answer));
    }
  }
  EXPECT_LE(worst_deg, head_.step_deg);
  EXPECT_GE(worst_deg, head_.step_deg / 8) << "it is finer";
}

TEST_P(EveryHeadKind, TellsTheZoomIfItsRowSaysSo) {
  Conversation conversation(GetParam());
  std::vector<double> zooms;
  for (int i = 0; i < kEnoughQueries; ++i) {
    const Answer answer = conversation.next().answer;
    if (answer.kind == Answer::Kind::kZoom) zooms.push_back(answer.zoom);
  }
  EXPECT_EQ(!zooms.empty(), head_.abilities.tells_zoom);
  EXPECT_TRUE(std::all_of(zooms.begin(), zooms.end(),
                          [](double zoom) { return zoom == kPositionOfHeads.zoom; }));
}

TEST_P(EveryHeadKind, ShowsOfABadLineWhatItsRowSays) {
  const auto changed_bytes = [](const std::string& /*before*/, const std::string& reply) {
    std::vector<std::string> all;
    for (std::size_t i = 0; i < reply.size(); ++i) {
      for (unsigned bit = 1; bit < 256; bit *= 2) {
        all.push_back(reply);
        all.back()[i] = static_cast<char>(static_cast<unsigned char>(reply[i]) ^ bit);
      }
    }
    return all;
  };
  const auto lost_bytes = [](const std::string& /*before*/, const std::string& reply) {
    std::vector<std::string> all;
    for (std::size_t i = 0; i < reply.size(); ++i) {
      all.push_back(reply);
      all.back().erase(i, 1);
    }
    return all;
  };
  const auto repeat = [](const std::string& before, const std::string& /*reply*/) {
    return std::vector<std::string>{before};
  };
  EXPECT_EQ(!is_forged_by(changed_bytes), head_.abilities.shows_changed_bytes) << "a bit changed";
  EXPECT_EQ(!is_forged_by(lost_bytes), head_.abilities.shows_lost_bytes) << "a byte lost";
  EXPECT_EQ(!is_forged_by(repeat), head_.abilities.shows_repeats) << "the answer before";
}

class EveryHeadOnASerialLine : public EveryHeadKind {};

std::vector<HeadKind> kinds_on_serial_lines() {
  std::vector<HeadKind> kinds = all_head_kinds();
  kinds.erase(
      std::remove_if(kinds.begin(), kinds.end(),
                     [](const HeadKind& kind) { return kind.link != HeadServer::Link::kSerial; }),
      kinds.end());
  return kinds;
}

INSTANTIATE_TEST_SUITE_P(Heads, EveryHeadOnASerialLine,
                         ::testing::ValuesIn(kinds_on_serial_lines()),
                         [](const auto& tested) { return tested.param.head->name; });

// From these follow how often a line is asked, and how long an answer is waited for.
TEST_P(EveryHeadOnASerialLine, TakesOfTheLineWhatItsProtocolSays) {
  Conversation conversation(GetParam());
  for (int i = 0; i < 4; ++i) static_cast<void>(conversation.reading());
  double readings = 0;
  double polls = 0;
  double bytes = 0;
  while (readings < 2 * kReadingsPerZoom) {
    const Conversation::Turn turn = conversation.reading();
    ASSERT_TRUE(Conversation::is_reading(turn.answer));
    EXPECT_TRUE(turn.query.paced);
    readings += turn.answer.kind == Answer::Kind::kPanTilt ? 1 : 0.5;
    ++polls;
    bytes += static_cast<double>(turn.query.bytes.size() + turn.reply.size());
  }
  EXPECT_EQ(protocol_->polls_per_reading(), polls / readings);
  // Other positions and other models have a few digits more.
  EXPECT_GE(protocol_->bytes_per_reading(), bytes / readings);
  EXPECT_LE(protocol_->bytes_per_reading(), 1.25 * bytes / readings);
  EXPECT_STRNE(protocol_->name(), "");
}

TEST_P(EveryHeadOnASerialLine, HasItsRatesInTheTableOfTheDocumentation) {
  constexpr double kBitsOfAByte = 10;
  std::string rates;
  for (const double baud : {2400, 4800, 9600, 19200, 38400, 115200}) {
    const double rate_hz = ceiling_hz(*protocol_, kBitsOfAByte / baud);
    char text[32];
    std::snprintf(text, sizeof text, rate_hz < 10 ? " | %.1f" : " | %.0f", rate_hz);
    rates += text;
  }
  std::vector<std::string> rows;
  std::istringstream table(text_of("docs/manual/how-to/serial-heads.md"));
  for (std::string line; std::getline(table, line);) {
    // The name alone, or with one of its modes.
    const std::string begin = std::string("| ") + protocol_->name();
    if (line.rfind(begin + " |", 0) == 0 || line.rfind(begin + ", ", 0) == 0) rows.push_back(line);
  }
  EXPECT_THAT(rows, Contains(HasSubstr(rates + " |")));
}

}  // namespace
}  // namespace alidade
