#include "test/simulator/servers/digest_auth.h"

#include <gtest/gtest.h>

#include <set>

namespace alidade {
namespace {

constexpr const char* kTarget = "/axis-cgi/com/ptz.cgi?query=position";

// The nonce of a challenge.
std::string nonce_of(const std::string& challenge) {
  const std::string key = "nonce=\"";
  const std::size_t begin = challenge.find(key) + key.size();
  return challenge.substr(begin, challenge.find('"', begin) - begin);
}

std::string credentials(const std::string& user, const std::string& password,
                        const std::string& nonce, const std::string& nc,
                        const std::string& uri = kTarget) {
  return "Digest username=\"" + user + "\", realm=\"realm\", nonce=\"" + nonce + "\", uri=\"" +
         uri + "\", cnonce=\"abc\", nc=" + nc + ", qop=auth, response=\"" +
         digest_response(user, "realm", password, "GET", uri, nonce, nc, "abc") +
         "\", algorithm=MD5";
}

class DigestAuthTest : public testing::Test {
 protected:
  DigestStatus check(const std::string& authorization) {
    return auth_.check("GET", kTarget, authorization);
  }

  DigestAuth auth_{"root", "pass", "realm"};
  const std::string nonce_ = nonce_of(auth_.challenge(DigestStatus::kMissing));
};

TEST(DigestResponse, AgreesWithTheExampleOfRfc7616) {
  EXPECT_EQ(digest_response("Mufasa", "http-auth@example.org", "Circle of Life", "GET",
                            "/dir/index.html", "7ypf/xlj9XXwfDPEoM4URrv/xwf94BcCAzFZH4GiTo0v",
                            "00000001", "f2/wE4q74E6zIJEtWaHKaf5wv/H5QzzpXusqGemxURZJ"),
            "8ca523f5e9506fed4657c9700eebdbec");
}

TEST(DigestResponse, AgreesWithTheExampleOfRfc2617) {
  EXPECT_EQ(
      digest_response("Mufasa", "testrealm@host.com", "Circle Of Life", "GET", "/dir/index.html",
                      "dcd98b7102dd2f0e8b11d0f600bfb0c093", "00000001", "0a4f113b"),
      "6629fae49393a05397450978507c4ef1");
}

TEST_F(DigestAuthTest, AcceptsGrowingCountsOfOneNonce) {
  EXPECT_EQ(check(credentials("root", "pass", nonce_, "00000001")), DigestStatus::kOk);
  EXPECT_EQ(check(credentials("root", "pass", nonce_, "00000002")), DigestStatus::kOk);
  EXPECT_EQ(check(credentials("root", "pass", nonce_, "0000000a")), DigestStatus::kOk);
}

TEST_F(DigestAuthTest, CallsAReplayedCountStale) {
  const std::string first = credentials("root", "pass", nonce_, "00000002");
  EXPECT_EQ(check(first), DigestStatus::kOk);
  EXPECT_EQ(check(first), DigestStatus::kStale);
  EXPECT_EQ(check(credentials("root", "pass", nonce_, "00000001")), DigestStatus::kStale);
}

TEST_F(DigestAuthTest, CallsAnUnknownNonceStale) {
  EXPECT_EQ(check(credentials("root", "pass", "not-mine", "00000001")), DigestStatus::kStale);
}

TEST_F(DigestAuthTest, RejectsWrongCredentials) {
  EXPECT_EQ(check(credentials("root", "wrong", nonce_, "00000001")), DigestStatus::kRejected);
  EXPECT_EQ(check(credentials("who", "pass", nonce_, "00000001")), DigestStatus::kRejected);
  EXPECT_EQ(check(credentials("root", "pass", nonce_, "00000001", "/other")),
            DigestStatus::kRejected);
  EXPECT_EQ(check(credentials("root", "pass", nonce_, "1")), DigestStatus::kRejected);
  EXPECT_EQ(check(credentials("root", "pass", nonce_, "zzzzzzzz")), DigestStatus::kRejected);
  EXPECT_EQ(check("Digest nonsense"), DigestStatus::kRejected);
  // None of these used up the count.
  EXPECT_EQ(check(credentials("root", "pass", nonce_, "00000001")), DigestStatus::kOk);
}

TEST_F(DigestAuthTest, AsksForCredentialsWhenThereAreNone) {
  EXPECT_EQ(check(""), DigestStatus::kMissing);
  EXPECT_EQ(check("Basic cm9vdDpwYXNz"), DigestStatus::kMissing);
}

TEST_F(DigestAuthTest, SaysStaleOnlyWhenThePasswordIsNotToBlame) {
  EXPECT_EQ(auth_.challenge(DigestStatus::kMissing).find("stale"), std::string::npos);
  EXPECT_EQ(auth_.challenge(DigestStatus::kRejected).find("stale"), std::string::npos);
  EXPECT_NE(auth_.challenge(DigestStatus::kStale).find("stale=true"), std::string::npos);
}

TEST_F(DigestAuthTest, ForgetsTheOldestNonceFirst) {
  std::set<std::string> nonces{nonce_};
  std::string second;
  for (std::size_t i = 0; i < DigestAuth::kMaxNonces; ++i) {
    const std::string nonce = nonce_of(auth_.challenge(DigestStatus::kMissing));
    if (i == 0) second = nonce;
    EXPECT_TRUE(nonces.insert(nonce).second);
  }
  EXPECT_EQ(check(credentials("root", "pass", nonce_, "00000001")), DigestStatus::kStale);
  EXPECT_EQ(check(credentials("root", "pass", second, "00000001")), DigestStatus::kOk);
}

}  // namespace
}  // namespace alidade
