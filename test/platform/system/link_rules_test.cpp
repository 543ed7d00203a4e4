#include "platform/system/link_rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

using Redirects = LinkRules::Redirects;

Redirection judge(const std::string& configured_text, const std::string& told,
                  Redirects rule = Redirects::kSameHost) {
  Url configured;
  std::string error;
  EXPECT_TRUE(parse_url(configured_text, &configured, &error)) << error;
  return judge_redirection(configured, configured.bare, told, rule);
}

TEST(LinkRules, FollowARedirectionToTheSameHostPortAndScheme) {
  const struct {
    const char* configured;
    const char* told;
    const char* url;
  } cases[] = {
      {"rtsp://cam/a", "rtsp://cam/b?c=d", "rtsp://cam/b?c=d"},
      {"rtsp://cam/a", "rtsp://CAM:554/b", "rtsp://cam/b"},
      {"rtsp://cam:8554/a", "rtsp://cam:8554/b", "rtsp://cam:8554/b"},
      {"rtsps://cam:322/a", "rtsps://cam/b", "rtsps://cam:322/b"},
      {"http://cam/a/b", "/c", "http://cam/c"},
      {"http://cam/a/b", "c", "http://cam/a/c"},
      {"rtsp://cam/a/b", "/c", "rtsp://cam/c"},
      {"https://[::1]:8443/a", "https://eve:x@[::1]:8443/b", "https://[::1]:8443/b"},
  };
  for (const auto& which : cases) {
    for (const Redirects rule : {Redirects::kSameHost, Redirects::kAny}) {
      const Redirection result = judge(which.configured, which.told, rule);
      EXPECT_EQ(result.url, which.url) << which.told;
      EXPECT_TRUE(result.takes_login) << which.told;
      EXPECT_EQ(result.error, "") << which.told;
    }
  }
}

TEST(LinkRules, FollowOneElsewhereOnlyWhereTheUserSaysSoAndWithoutTheLogin) {
  const struct {
    const char* configured;
    const char* told;
    const char* says;
  } cases[] = {
      {"rtsp://cam/a", "rtsp://evil/b", "redirected to rtsp://evil/b, another host: refused"},
      {"rtsp://cam/a", "rtsp://cam:8554/b", "another port: refused"},
      {"http://cam/a", "https://cam/b", "another scheme: refused"},
      {"http://cam/a", "//evil/b", "redirected to http://evil/b, another host: refused"},
      {"rtsp://cam/a", "rtsp://cam.evil/b", "another host: refused"},
      {"rtsp://cam/a", "rtsp://cam@evil/b", "redirected to rtsp://evil/b, another host: refused"},
      {"rtsp://10.0.0.1/a", "rtsp://10.0.0.10/a", "another host: refused"},
  };
  for (const auto& which : cases) {
    const Redirection refused = judge(which.configured, which.told);
    EXPECT_EQ(refused.url, "") << which.told;
    EXPECT_THAT(refused.error, HasSubstr(which.says));
    const Redirection followed = judge(which.configured, which.told, Redirects::kAny);
    EXPECT_NE(followed.url, "") << which.told;
    EXPECT_THAT(followed.url, Not(HasSubstr("@")));
    EXPECT_FALSE(followed.takes_login) << which.told;
  }
}

TEST(LinkRules, FollowNoneAwayFromTlsOrToAnotherKindOfAddress) {
  const struct {
    const char* configured;
    const char* told;
    const char* says;
  } cases[] = {
      {"rtsps://cam/a", "rtsp://cam/a", "away from TLS: refused"},
      {"https://cam/a", "http://cam:443/a", "away from TLS: refused"},
      {"rtsp://cam/a", "file:///etc/passwd", "no address of this kind: refused"},
      {"rtsp://cam/a", "file:", "refused"},
      {"rtsp://cam/a", "http://cam/a", "no address of this kind: refused"},
      {"rtsp://cam/a", "rtspt://cam/a", "no address of this kind: refused"},
      {"http://cam/a", "ftp://cam/a", "no address of this kind: refused"},
      {"http://cam/a", "http://", "refused"},
      {"http://cam/a", "http://eve:se@cret@evil/", "refused"},
  };
  for (const auto& which : cases) {
    for (const Redirects rule : {Redirects::kSameHost, Redirects::kAny}) {
      const Redirection result = judge(which.configured, which.told, rule);
      if (std::string(which.told) == "file:" && result.takes_login)
        continue;  // a path of that name
      EXPECT_EQ(result.url, "") << which.told;
      EXPECT_FALSE(result.takes_login);
      EXPECT_THAT(result.error, HasSubstr(which.says));
      EXPECT_THAT(result.error, Not(HasSubstr("se@")));
    }
  }
}

TEST(LinkRules, ShowWhatWasToldWithNothingThatATerminalObeys) {
  const Redirection result = judge("http://cam/a", "ftp://\x1b[2J" + std::string(500, 'x'));
  EXPECT_THAT(result.error, Not(HasSubstr("\x1b")));
  EXPECT_LT(result.error.size(), 250U);
}

TEST(LinkRules, SendNoPasswordInClearUnlessTheUserSaysSo) {
  EXPECT_FALSE(LinkRules{}.permits_basic(false));
  EXPECT_TRUE(LinkRules{}.permits_basic(true));
  LinkRules rules;
  rules.auth = LinkRules::Auth::kAny;
  EXPECT_TRUE(rules.permits_basic(false));
  rules.auth = LinkRules::Auth::kDigest;
  EXPECT_FALSE(rules.permits_basic(true));
}

}  // namespace
}  // namespace alidade
