// What a verification says where nothing can be judged; that its JSON and its page are well formed.

#include "edge_app/verify/verification.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "edge_app/verify/verification_json.h"
#include "edge_app/verify/verification_report.h"
#include "edge_app/verify/verification_words.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Verification, OfNoFramesIsNotJudgedAndSaysWhatWouldServe) {
  const std::vector<SeenFrame> frames;
  const Verification verification = verify({"film", "lens.yaml", frames, {}, 1e-4, 20});
  EXPECT_EQ(verification.verdict, Verdict::kNotJudged);
  EXPECT_THAT(verification.sentence, HasSubstr("not judged: 0 pairs"));
  ASSERT_FALSE(verification.advice.empty());
  EXPECT_THAT(verification.advice.front(), HasSubstr("record for"));
}

TEST(Verification, OfAHeadAtRestAsksForMotion) {
  std::vector<SeenFrame> frames(3);
  for (SeenFrame& frame : frames) {
    FrameOrientation& is = frame.by_telemetry;
    is.mode = OrientationMode::kPt;
    is.calibration.camera = {1000, 1, {}, 64, 48};
    frame.by_all_samples = is;
    frame.luma.assign(64 * 48, 100);
  }
  const Verification verification = verify({"film", "lens.yaml", frames, {}, 1e-4, 20});
  EXPECT_EQ(verification.verdict, Verdict::kNotJudged);
  EXPECT_THAT(verification_text(verification), HasSubstr("advice: pan over 3.7 degrees"));
}

// The advice is for the zoom with most pictures: a range at the wide end would be none at the tele end.
TEST(Verification, SaysWhichZoomItsDeparturesAreOf) {
  std::vector<SeenFrame> frames(7);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    FrameOrientation& is = frames[i].by_telemetry;
    is.mode = OrientationMode::kPt;
    is.calibration.camera = {i < 2 ? 100.0 : 1000.0, 1, {}, 64, 48};
    is.angle.pan = i < 2 ? static_cast<double>(i) : 0.01 * static_cast<double>(i);
    frames[i].by_all_samples = is;
    frames[i].luma.assign(64 * 48, 100);
  }
  const Verification verification = verify({"film", "lens.yaml", frames, {}, 1e-4, 20});
  const std::string text = verification_text(verification);
  EXPECT_THAT(text, HasSubstr("returns: of pictures at f 100 to 1000 px"));
  EXPECT_THAT(text, HasSubstr("of the 5 pictures at f 1000 px"));
  EXPECT_THAT(text, HasSubstr("advice: tilt over 2.8 degrees"));
  EXPECT_THAT(text, Not(HasSubstr("advice: pan over")));
  const auto json = nlohmann::json::parse(verification_json(verification, {}));
  EXPECT_EQ(json["zooms"]["model_frames"], 5);
  EXPECT_NEAR(json["zooms"]["most_px"].get<double>(), 1000, 1e-9);
  const std::string page = verification_report(verification, {"film", "1", "today"});
  EXPECT_THAT(page, HasSubstr("of the 5 pictures at f 1000 px"));
}

TEST(Verification, HoldsInWordsAlsoWithoutReturnsThatAreJudged) {
  Verification verification;
  verification.verdict = Verdict::kHolds;
  verification.pairs = 33;
  EXPECT_EQ(summary_of(verification), "sigmas hold: 33 pairs of pictures show no departure");
}

// A wrong value need not show in the directions of this recording.
TEST(Verification, SaysThatDirectionsAgreeThoughACauseIsFound) {
  Verification verification;
  verification.verdict = Verdict::kContradicted;
  DepartureTest cause;
  cause.departure = Departure::kLineDelay;
  cause.size = {2e-6};
  cause.sigma = {4.6e-7};
  verification.found = {cause};
  ClaimComparison claim;
  claim.verdict = Verdict::kHolds;
  claim.result.ratio = 0.8;
  claim.result.low = 0.7;
  verification.claims = {claim};
  EXPECT_THAT(
      summary_of(verification),
      HasSubstr("a cause is found, though directions of the same place differ by 0.80 times"));
  verification.claims.front().verdict = Verdict::kContradicted;
  EXPECT_THAT(summary_of(verification), Not(HasSubstr("though")));
}

TEST(Verification, NoiseThatPtModesSigmasCoverIsNoCause) {
  const auto improbable = [](Departure departure) {
    ModelComparison out;
    out.verdict = Verdict::kContradicted;
    out.test.departure = departure;
    out.test.size = {3e-4};
    out.test.sigma = {2e-5};
    return out;
  };
  const auto judged = [&](double ratio, Verdict verdict) {
    Verification out;
    ClaimComparison claim;
    claim.from = OrientationFrom::kTelemetry;
    claim.verdict = verdict;
    claim.result.ratio = ratio;
    out.claims = {claim};
    for (const Departure departure :
         {Departure::kAngleNoise, Departure::kPanGear, Departure::kLineDelay})
      out.model.push_back(improbable(departure));
    out.found = {out.model[0].test, out.model[2].test};
    leave_out_covered_noise(&out);
    return out;
  };
  const Verification covered = judged(0.6, Verdict::kHolds);
  ASSERT_EQ(covered.found.size(), 1U);
  EXPECT_EQ(covered.found[0].departure, Departure::kLineDelay);
  EXPECT_EQ(covered.model[0].verdict, Verdict::kHolds);
  EXPECT_EQ(covered.model[1].verdict, Verdict::kHolds) << "the noise explains it";
  EXPECT_EQ(covered.model[2].verdict, Verdict::kContradicted);
  EXPECT_THAT(sentence_of(covered.model[0], covered.found),
              HasSubstr("RMS 0.3 +- 0.02 mrad beyond what is stated; PT mode's sigmas cover"));
  for (const Verification& open :
       {judged(1.05, Verdict::kHolds), judged(1.5, Verdict::kContradicted),
        judged(0.6, Verdict::kNotJudged)}) {
    EXPECT_EQ(open.found.size(), 2U);
    EXPECT_EQ(open.model[0].verdict, Verdict::kContradicted);
  }
}

TEST(Verification, HasJsonAndAPageWithEscapedNames) {
  Verification verification;
  verification.sentence = "not judged: <nothing>";
  verification.pairs = 1;
  const auto json = nlohmann::json::parse(verification_json(verification, {{"report", "a.html"}}));
  EXPECT_EQ(json["verdict"], "not judged");
  EXPECT_EQ(json["files"]["report"], "a.html");
  const std::string page = verification_report(verification, {"<film>", "1", "today"});
  EXPECT_THAT(page, HasSubstr("&lt;film&gt;"));
  EXPECT_THAT(page, Not(HasSubstr("<nothing>")));
}

// One error makes several departures improbable.
TEST(Verification, SaysOfADepartureThatIsNoCauseWhatExplainsIt) {
  const auto comparison_of = [](Departure departure) {
    ModelComparison out;
    out.verdict = Verdict::kContradicted;
    out.test.departure = departure;
    out.test.size = {2e-3};
    out.test.sigma = {1e-4};
    return out;
  };
  const ModelComparison offset = comparison_of(Departure::kClockOffset);
  const ModelComparison play = comparison_of(Departure::kPanPlay);
  EXPECT_EQ(sentence_of(offset, {}),
            "clock offset: contradicted; by this recording alone off by 2 +- 0.1 ms");
  EXPECT_EQ(sentence_of(offset, {offset.test}), sentence_of(offset, {}));
  EXPECT_EQ(sentence_of(play, {offset.test}),
            "play of pan: 2 +- 0.1 mrad if nothing else were wrong; explained by clock offset");
  EXPECT_EQ(sentence_of(play, {offset.test, comparison_of(Departure::kLineDelay).test}),
            "play of pan: 2 +- 0.1 mrad if nothing else were wrong; explained by clock offset and "
            "line delay");
}

TEST(Verification, TheSizeOfACurveIsThatOfTheKnotsThatAreShown) {
  DepartureTest test;
  test.departure = Departure::kPanDrift;
  test.size = {1e-3, -1e-3, 1e11, 1e-3, -1e-3};
  test.sigma = {1e-4, 1e-4, 1e11, 1e-4, 1e-4};
  EXPECT_EQ(size_of(test), "RMS 1 mrad, 10.0 sigmas at most");
}

TEST(Verification, NamesAllDeparturesAndReturns) {
  for (int i = 0; i < kDepartureCount; ++i)
    EXPECT_STRNE(name_of(static_cast<Departure>(i)), "unknown") << i;
  for (int i = 0; i < static_cast<int>(ReturnKind::kCount); ++i)
    EXPECT_STRNE(name_of(static_cast<ReturnKind>(i)), "unknown") << i;
}

}  // namespace
}  // namespace alidade
