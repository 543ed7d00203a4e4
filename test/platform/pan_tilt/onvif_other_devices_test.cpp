// ONVIF devices that do not keep to the standard: their clocks, their addresses, their scales.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <regex>
#include <string>
#include <vector>

#include "core/model/trigonometry.h"
#include "platform/pan_tilt/onvif_addresses.h"
#include "platform/pan_tilt/onvif_login.h"
#include "platform/pan_tilt/onvif_scale.h"
#include "platform/pan_tilt/onvif_source.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/raw_server.h"
#include "test/simulator/servers/onvif_server.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

using DeviceLogin = OnvifDevice::Login;
using Way = OnvifLoginWays::Way;

constexpr double kTenHours_s = 36000;

OnvifSourceOptions options_for(const OnvifServer& server, const OnvifDevice& device) {
  OnvifSourceOptions options;
  options.url = server.url();
  if (device.login != DeviceLogin::kNone) {
    options.user = device.user;
    options.password = device.password;
  }
  options.pan_range = OnvifRange{-kPi, kPi};
  options.tilt_range = OnvifRange{-kPi / 2, kPi / 2};
  options.rate_hz = 1000;
  options.timeout_s = kDeadline_s;
  options.max_backoff_s = 0.01;
  return options;
}

OnvifDevice device_of(DeviceLogin login) {
  OnvifDevice device;
  device.login = login;
  return device;
}

OnvifDevice device_telling(const std::string& pan_tilt) {
  OnvifDevice device;
  device.position = [pan_tilt] { return "<tt:PanTilt " + pan_tilt + "/>"; };
  return device;
}

// Its notes after some samples.
std::vector<std::string> notes_of_samples(PanTiltSource& source, PanTiltSample* sample) {
  std::vector<std::string> notes;
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(source.read(*sample, kDeadline_s), ReadStatus::kOk) << source.error();
    for (const std::string& note : source.take_notes()) notes.push_back(note);
  }
  return notes;
}

// --- its clock

struct ToldClock {
  const char* name;
  double device_s;  // the clock that tokens are held against, less the host's
  double told_s;    // what is told as UTC less that
  double local_s;   // what is told as local time less that; 0: nothing
  int wrong_logins;
  const char* note;
};

void PrintTo(const ToldClock& clock, std::ostream* out) { *out << clock.name; }

class OnvifClocks : public ::testing::TestWithParam<ToldClock> {};

INSTANTIATE_TEST_SUITE_P(
    Each, OnvifClocks,
    ::testing::Values(ToldClock{"ItsLocalTimeAsUtc", 0, kTenHours_s, 0, 1,
                                "a UTC 600 min ahead of this host's"},
                      ToldClock{"AndBehind", 0, -kTenHours_s, -kTenHours_s, 1,
                                "a UTC 600 min behind this host's"},
                      ToldClock{"ItsLocalTimeHeldAgainst", kTenHours_s, -kTenHours_s, 1e-9, 1,
                                "accepts logins by its local time only"},
                      ToldClock{"AFalseClockHeldAgainst", -kTenHours_s, 0, 0, 0, ""},
                      ToldClock{"ATrueOne", 0, 0, 0, 0, ""}),
    [](const auto& tested) { return std::string(tested.param.name); });

TEST_P(OnvifClocks, AreTriedBeforeThePasswordIsBlamed) {
  const OnvifDevice device = device_of(DeviceLogin::kToken);
  OnvifServer server(device);
  server.clock_offset_s = GetParam().device_s;
  server.told_offset_s = GetParam().told_s;
  server.local_offset_s = GetParam().local_s;
  const auto source = open_onvif(options_for(server, device));
  PanTiltSample sample;
  const std::vector<std::string> notes = notes_of_samples(*source, &sample);
  EXPECT_EQ(server.wrong_logins, GetParam().wrong_logins);
  if (*GetParam().note == '\0') {
    EXPECT_THAT(notes, IsEmpty());
  } else {
    EXPECT_THAT(notes, ElementsAre(AllOf(StartsWith(server.url()), HasSubstr(GetParam().note))));
  }
  // It is remembered.
  server.status = 503;
  EXPECT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  server.status = 200;
  EXPECT_EQ(read_until(*source, sample, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_EQ(server.wrong_logins, GetParam().wrong_logins);
  EXPECT_THAT(source->take_notes(), IsEmpty());
}

TEST(OnvifOtherDevices, AWrongPasswordIsTriedByEachClockOnceAndThenBlamed) {
  const OnvifDevice device = device_of(DeviceLogin::kToken);
  OnvifServer server(device);
  server.told_offset_s = kTenHours_s;
  OnvifSourceOptions options = options_for(server, device);
  options.password = "guess";
  const auto source = open_onvif(options);
  PanTiltSample sample;
  ASSERT_EQ(read_until(*source, sample, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(
      source->error(),
      AllOf(StartsWith(server.url() + "/: wrong user or password"),
            HasSubstr("; tried by the clock that it reports (600 min ahead of this host's), "
                      "this host's clock"),
            Not(HasSubstr("guess"))));
  EXPECT_EQ(server.wrong_logins, 2);
}

TEST(OnvifOtherDevices, AWrongPasswordIsNeverTriedMoreThanThreeTimes) {
  const OnvifDevice device = device_of(DeviceLogin::kDigestMd5);
  OnvifServer server(device);
  server.told_offset_s = kTenHours_s;
  server.local_offset_s = -kTenHours_s;
  OnvifSourceOptions options = options_for(server, device);
  options.password = "guess";
  const auto source = open_onvif(options);
  PanTiltSample sample;
  ASSERT_EQ(read_until(*source, sample, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_LE(server.count("GetSystemDateAndTime") + server.wrong_logins, 1 + 3);
}

// One that restarts may refuse everybody for a while, and then wants other nonces.
TEST(OnvifOtherDevices, ADeviceInUseThatRefusesIsSaidAndAskedAgain) {
  for (const DeviceLogin login : {DeviceLogin::kToken, DeviceLogin::kDigestMd5}) {
    const OnvifDevice device = device_of(login);
    OnvifServer server(device);
    const auto source = open_onvif(options_for(server, device));
    PanTiltSample sample;
    ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
    server.password_changed = true;
    for (int i = 0; i < 4; ++i) {
      ASSERT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
      EXPECT_THAT(source->error(), AllOf(HasSubstr("/: the login is refused ("),
                                         HasSubstr("; it was right before")));
      server.renew_nonce();
    }
    server.password_changed = false;
    ASSERT_EQ(read_until(*source, sample, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  }
}

OnvifLoginWays ways_with(double utc_lead_s, std::optional<double> local_lead_s = {}) {
  OnvifLoginWays ways;
  OnvifClock clock;
  clock.utc_s = 1e9 + utc_lead_s;
  if (local_lead_s) clock.local_s = 1e9 + *local_lead_s;
  ways.set_clock(clock, 100, 1e9);
  return ways;
}

TEST(OnvifLoginWays, TryNoClockTwiceAndNoneThatIsTheSame) {
  OnvifLoginWays ways = ways_with(1, 3);
  EXPECT_EQ(ways.way(), Way::kDeviceClock);
  EXPECT_DOUBLE_EQ(ways.created_utc_s(101, 7), 1e9 + 2);
  EXPECT_TRUE(ways.refused(true));
  EXPECT_EQ(ways.way(), Way::kDigest);
  EXPECT_FALSE(ways.refused(true));
  EXPECT_EQ(ways.tried_text(), "");
}

TEST(OnvifLoginWays, TryTheHostsClockAndThenTheLocalTime) {
  OnvifLoginWays ways = ways_with(-3600, 3600);
  EXPECT_TRUE(ways.refused(false));
  EXPECT_EQ(ways.way(), Way::kHostClock);
  EXPECT_DOUBLE_EQ(ways.created_utc_s(101, 7), 7);
  EXPECT_TRUE(ways.refused(false));
  EXPECT_EQ(ways.way(), Way::kLocalClock);
  EXPECT_DOUBLE_EQ(ways.created_utc_s(101, 7), 1e9 + 3601);
  EXPECT_FALSE(ways.refused(false));
  EXPECT_EQ(ways.way(), Way::kDeviceClock);
}

TEST(OnvifLoginWays, TakeTheHostsClockForOneThatIsNotTold) {
  OnvifLoginWays ways;
  ways.set_clock({}, 100, 1e9);
  EXPECT_EQ(ways.way(), Way::kHostClock);
  EXPECT_FALSE(ways.refused(false));
}

TEST(OnvifLoginWays, TakeALocalTimeForNoUtc) {
  OnvifLoginWays ways;
  OnvifClock clock;
  clock.local_s = 1e9 + 19800;
  ways.set_clock(clock, 100, 1e9);
  EXPECT_TRUE(ways.refused(false));
  ways.accepted();
  EXPECT_EQ(ways.note(),
            "the device reports a local time and no UTC, but accepts logins by this host's clock "
            "only; that clock is used for logins");
}

// Of a device in use each pause brings one login: first that which was good.
TEST(OnvifLoginWays, BeginWithTheOneThatWasGood) {
  OnvifLoginWays ways = ways_with(kTenHours_s);
  EXPECT_TRUE(ways.refused(false));
  ways.accepted();
  std::vector<Way> tried;
  for (int i = 0; i < 6; ++i) {
    tried.push_back(ways.way());
    EXPECT_FALSE(ways.refused(false));
  }
  EXPECT_THAT(tried, ElementsAre(Way::kHostClock, Way::kHostClock, Way::kDeviceClock,
                                 Way::kDeviceClock, Way::kHostClock, Way::kHostClock));
}

// --- its addresses

TEST(OnvifAddresses, AreOfTheDeviceItselfWhateverItTells) {
  const auto first_of = [](const std::string& device_url, const std::string& told) {
    Url device;
    std::string error;
    EXPECT_TRUE(parse_url(device_url, &device, &error)) << error;
    const std::vector<std::string> all = onvif_addresses(device, told, OnvifService::kPtz, true);
    const std::string own = device.scheme + "://" + device.host;
    for (const std::string& address : all) EXPECT_THAT(address, StartsWith(own));
    EXPECT_THAT(all, ::testing::Contains(HasSubstr("/onvif/ptz_service")));
    return all.front();
  };
  const std::string device = "http://cam:81/onvif/device_service";
  EXPECT_EQ(first_of(device, "http:///onvif/p"), "http://cam:81/onvif/p");
  EXPECT_EQ(first_of(device, "http://0.0.0.0/onvif/p"), "http://cam:81/onvif/p");
  EXPECT_EQ(first_of(device, "http://127.0.0.1:80/onvif/p?x=1"), "http://cam:81/onvif/p?x=1");
  EXPECT_EQ(first_of(device, "http://u:p@10.0.0.5:99/p"), "http://cam:81/p");
  EXPECT_EQ(first_of(device, "http://[fe80::1]:99/p"), "http://cam:81/p");
  EXPECT_EQ(first_of(device, "https://cam/p"), "http://cam:81/p");
  EXPECT_EQ(first_of(device, "http://CAM:8080/p"), "http://cam:8080/p");
  EXPECT_EQ(first_of(device, "http://cam:80x/p"), "http://cam:81/p");
  EXPECT_EQ(first_of(device, "/p"), "http://cam:81/p");
  EXPECT_EQ(first_of(device, "p"), "http://cam:81/p");
  EXPECT_EQ(first_of(device, "http://evil"), "http://cam:81/");
  Url with_login;
  std::string ignored;
  ASSERT_TRUE(parse_url(device, &with_login, &ignored));
  EXPECT_EQ(onvif_addresses(with_login, "http://cam:8080/p", OnvifService::kPtz).front(),
            "http://cam:81/p")
      << "a login goes to the configured port only";
  EXPECT_EQ(onvif_address(with_login, ":8080/p"), "http://cam:8080/p");
  EXPECT_EQ(first_of(device, ""), "http://cam:81/onvif/ptz_service");
  EXPECT_EQ(first_of("http://proxy/cam1/onvif/device_service", "http://10.0.0.5/onvif/p"),
            "http://proxy/cam1/onvif/p");
  EXPECT_EQ(first_of("http://proxy/cam1/onvif/device_service", "http://x/cam1/onvif/p"),
            "http://proxy/cam1/onvif/p");
}

struct ToldAddresses {
  const char* name;
  std::string ptz;       // as it is told; PORT: the device's own
  std::string ptz_path;  // where it is
  bool knows_capabilities = true;
  bool knows_services = true;
  bool is_noted = true;
};

void PrintTo(const ToldAddresses& told, std::ostream* out) { *out << told.name; }

class OnvifToldAddresses : public ::testing::TestWithParam<ToldAddresses> {};

INSTANTIATE_TEST_SUITE_P(
    Each, OnvifToldAddresses,
    ::testing::Values(
        ToldAddresses{"NoHost", "http:///onvif/ptz", "/onvif/ptz", true, true, false},
        ToldAddresses{"NoHostAtAUsualPath", "http:///onvif/ptz_service", "/onvif/ptz_service", true,
                      true, false},
        ToldAddresses{"AnotherNetwork", "http://192.168.1.64:8080/onvif/ptz", "/onvif/ptz", true,
                      true, false},
        ToldAddresses{"AnyHost", "http://0.0.0.0/onvif/ptz", "/onvif/ptz", true, true, false},
        // No login goes to another port than the url's.
        ToldAddresses{"APortThatIsNotForwarded", "http://127.0.0.1:9/onvif/ptz", "/onvif/ptz", true,
                      true, false},
        ToldAddresses{"ThePathOfAnotherService", "http://10.0.0.1/onvif/media", "/onvif/PTZ"},
        ToldAddresses{"NoPtzAtAll", " ", "/onvif/ptz_service"},
        ToldAddresses{"ByGetServicesAlone", "http://10.0.0.1/odd/ptz", "/odd/ptz", false, true,
                      false},
        ToldAddresses{"Nothing", "", "/onvif/PTZ", false, false},
        ToldAddresses{"OnePathForAll", "http://10.0.0.1/gone", "/onvif/device_service"}),
    [](const auto& tested) { return std::string(tested.param.name); });

TEST_P(OnvifToldAddresses, AreNotFollowedBlindly) {
  OnvifDevice device = device_of(DeviceLogin::kToken);
  device.announced_ptz = GetParam().ptz;
  device.ptz_path = GetParam().ptz_path;
  device.knows_capabilities = GetParam().knows_capabilities;
  device.knows_services = GetParam().knows_services;
  OnvifServer server(device);
  const auto source = open_onvif(options_for(server, device));
  PanTiltSample sample;
  const std::vector<std::string> notes = notes_of_samples(*source, &sample);
  EXPECT_EQ(server.wrong_logins, 0);
  if (GetParam().is_noted) {
    EXPECT_THAT(notes, ElementsAre(HasSubstr("it is asked at " + server.url() + device.ptz_path)));
  } else {
    EXPECT_THAT(notes, IsEmpty());
  }
}

TEST(OnvifOtherDevices, APathThatNobodyCanGuessIsAKey) {
  OnvifDevice device;
  device.announced_ptz = "http:///gone";
  device.ptz_path = "/deep/inside";
  OnvifServer server(device);
  OnvifSourceOptions options = options_for(server, device);
  PanTiltSample sample;
  const auto guessing = open_onvif(options);
  ASSERT_EQ(read_until(*guessing, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(guessing->error(),
              AllOf(HasSubstr("ter:ActionNotSupported"), HasSubstr("pan_tilt.ptz_path")));
  options.ptz_path = "/deep/inside";
  const auto source = open_onvif(options);
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
}

// Nothing of what a device tells leads a login elsewhere.
TEST(OnvifOtherDevices, ALoginGoesToNoOtherHost) {
  RawServer other([](int) {});
  OnvifDevice device = device_of(DeviceLogin::kToken);
  device.announced_ptz = "http://localhost:" + std::to_string(other.port()) + "/onvif/ptz";
  OnvifServer server(device);
  const auto source = open_onvif(options_for(server, device));
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_EQ(other.connections(), 0);
}

TEST(OnvifOtherDevices, ALoginGoesToNoOtherPortUnlessTheUserNamesIt) {
  OnvifDevice device = device_of(DeviceLogin::kToken);
  OnvifServer other(device);
  const std::string port = std::to_string(other.port());
  device.announced_ptz = "http://127.0.0.1:" + port + "/onvif/ptz";
  OnvifServer server(device);
  OnvifSourceOptions options = options_for(server, device);
  PanTiltSample sample;
  const auto source = open_onvif(options);
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_EQ(other.count("GetStatus"), 0);
  options.ptz_path = ":" + port + "/onvif/ptz";
  const auto told = open_onvif(options);
  ASSERT_EQ(told->read(sample, kDeadline_s), ReadStatus::kOk) << told->error();
  EXPECT_GT(other.count("GetStatus"), 0);
}

// --- its scale

std::string declared(const std::string& x, const std::string& y) {
  return "<tt:SupportedPTZSpaces><tt:AbsolutePanTiltPositionSpace><tt:URI>http://www.onvif.org/"
         "ver10/tptz/"
         "PanTiltSpaces/PositionGenericSpace</tt:URI><tt:XRange>" +
         x + "</tt:XRange><tt:YRange>" + y +
         "</tt:YRange></tt:AbsolutePanTiltPositionSpace></tt:SupportedPTZSpaces>";
}

std::string ends(const std::string& low, const std::string& high) {
  return "<tt:Min>" + low + "</tt:Min><tt:Max>" + high + "</tt:Max>";
}

std::string node_declaring(const std::string& x, const std::string& y) {
  return "<tt:PTZNode token=\"n\">" + declared(x, y) + "</tt:PTZNode>";
}

TEST(OnvifOtherDevices, DeclaredDegreesInTheGenericSpaceAreDegrees) {
  OnvifDevice device = device_telling(R"(x="0.5" y="120")");
  device.nodes = node_declaring(ends("0", "360"), ends("0.0", "180.0"));
  OnvifServer server(device);
  OnvifSourceOptions options = options_for(server, device);
  options.pan_range.reset();
  options.tilt_range.reset();
  options.tilt.zero_deg = 90;
  const auto source = open_onvif(options);
  PanTiltSample sample;
  EXPECT_THAT(notes_of_samples(*source, &sample),
              ElementsAre(HasSubstr(
                  "declares pan 0..360 and tilt 0..180 in place of -1..1: taken as degrees")));
  EXPECT_NEAR(sample.pan_rad, 0.5 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(sample.tilt_rad, 30 * kRadPerDeg, 1e-12);
  EXPECT_EQ(server.count("GetNodes"), 1);
}

TEST(OnvifOtherDevices, ADeclaredRangeHasTheUsersAnglesAtItsEnds) {
  OnvifDevice device = device_telling(R"(x="750" y="-50")");
  device.options = "<tt:PTZConfigurationOptions><tt:Spaces>" +
                   declared(ends("0", "1000"), ends("-100", "100")) +
                   "</tt:Spaces></tt:PTZConfigurationOptions>";
  device.options = std::regex_replace(device.options, std::regex("</?tt:SupportedPTZSpaces>"), "");
  OnvifServer server(device);
  OnvifSourceOptions options = options_for(server, device);
  const auto source = open_onvif(options);
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_NEAR(sample.pan_rad, kPi / 2, 1e-12);
  EXPECT_NEAR(sample.tilt_rad, -kPi / 4, 1e-12);
  options.pan_range.reset();
  options.tilt_range.reset();
  const auto blind = open_onvif(options);
  ASSERT_EQ(read_until(*blind, sample, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(blind->error(),
              AllOf(HasSubstr("pan 0..1000 and tilt -100..100"), HasSubstr("pan_range_deg")));
}

TEST(OnvifOtherDevices, APositionThatNoRangeExplainsNamesTheKeysThatDo) {
  for (const std::string& nodes : {std::string(), node_declaring(ends("-1", "1"), ends("-1", "1")),
                                   node_declaring(ends("1", "1"), ends("INF", "INF"))}) {
    OnvifDevice device = device_telling(R"(x="181.5" y="20")");
    device.nodes = nodes;
    OnvifServer server(device);
    OnvifSourceOptions options = options_for(server, device);
    PanTiltSample sample;
    const auto blind = open_onvif(options);
    ASSERT_EQ(read_until(*blind, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_THAT(blind->error(),
                AllOf(HasSubstr("the position 181.5, 20 is outside its space, pan -1..1"),
                      HasSubstr("pan_scale and tilt_scale")));
    options.pan_scale = OnvifInterval{0, 360};
    options.tilt_scale = OnvifInterval{0, 180};
    options.pan_range = OnvifRange{0, 2 * kPi};
    options.tilt_range = OnvifRange{-kPi / 2, kPi / 2};
    const auto source = open_onvif(options);
    ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
    EXPECT_NEAR(sample.pan_rad, -178.5 * kRadPerDeg, 1e-12);
    EXPECT_NEAR(sample.tilt_rad, -70 * kRadPerDeg, 1e-12);
  }
}

// A device may not know the call at all, and say nothing.
TEST(OnvifOtherDevices, ASilenceAboutRangesCostsNoPosition) {
  OnvifDevice device;
  device.silent_about_nodes = true;
  OnvifServer server(device);
  const auto source = open_onvif(options_for(server, device));
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_DOUBLE_EQ(sample.pan_rad, kPi / 2);
}

OnvifStatus at(double pan, double tilt, const std::string& space = "") {
  OnvifStatus status;
  status.pan = pan;
  status.tilt = tilt;
  status.space = space;
  return status;
}

struct Scaled {
  OnvifScale::Outcome outcome = OnvifScale::Outcome::kOk;
  double pan_rad = 0;
  double tilt_rad = 0;
  std::string error;
};

Scaled scaled(const OnvifScale& scale, const OnvifStatus& status) {
  Scaled result;
  result.outcome = scale.angles(status, &result.pan_rad, &result.tilt_rad, &result.error);
  return result;
}

TEST(OnvifScale, IsOfDegreesWhereTheSpaceSaysSo) {
  const std::string degrees =
      "http://www.onvif.org/ver10/tptz/PanTiltSpaces/SphericalPositionSpaceDegrees";
  const OnvifScale scale({}, {});
  EXPECT_FALSE(scale.needs_ranges(at(0, 0, degrees)));
  EXPECT_NEAR(scaled(scale, at(179.5, -12, degrees)).pan_rad, 179.5 * kRadPerDeg, 1e-12);
  EXPECT_EQ(scaled(scale, at(400, 0, degrees)).outcome, OnvifScale::Outcome::kOutside);
  // A position need not name the only space that there is.
  const OnvifAxis axis{OnvifRange{-1, 1}, {}};
  OnvifScale unnamed(axis, axis);
  unnamed.set_ranges({{degrees, OnvifInterval{-180, 180}, OnvifInterval{-90, 90}}});
  EXPECT_NEAR(scaled(unnamed, at(181.5, -12)).pan_rad, 181.5 * kRadPerDeg, 1e-12);
  EXPECT_THAT(unnamed.note(at(181.5, -12)), HasSubstr("taken as degrees"));
  unnamed.set_ranges({{degrees, OnvifInterval{-180, 180}, OnvifInterval{-90, 90}},
                      {"", OnvifInterval{-1, 1}, OnvifInterval{-1, 1}}});
  EXPECT_DOUBLE_EQ(scaled(unnamed, at(0.5, 0)).pan_rad, 0.5);
}

TEST(OnvifScale, RefusesPositionsOutsideAndSpacesThatItDoesNotKnow) {
  const OnvifAxis axis{OnvifRange{-1, 1}, {}};
  const OnvifScale scale(axis, axis);
  EXPECT_EQ(scaled(scale, at(1.005, -1.005)).outcome, OnvifScale::Outcome::kOk);
  EXPECT_EQ(scaled(scale, at(1.5, 0)).outcome, OnvifScale::Outcome::kOutside);
  EXPECT_EQ(scaled(scale, at(0, -1.5)).outcome, OnvifScale::Outcome::kOutside);
  EXPECT_THAT(scaled(scale, at(1e300, 0)).error, HasSubstr("1e+300, 0 is outside"));
  const Scaled unknown = scaled(scale, at(0, 0, "http://vendor/Steps\n"));
  EXPECT_EQ(unknown.outcome, OnvifScale::Outcome::kOutside);
  EXPECT_THAT(unknown.error,
              AllOf(HasSubstr("the space 'http://vendor/Steps\\n'"), HasSubstr("pan_scale")));
  const OnvifAxis stated{OnvifRange{-1, 1}, OnvifInterval{-100, 100}};
  EXPECT_DOUBLE_EQ(scaled(OnvifScale(stated, stated), at(50, 0, "http://vendor/Steps")).pan_rad,
                   0.5);
}

// Stops within -1..1 do not move the angles at -1 and 1; steps and per cent are no degrees.
TEST(OnvifScale, TakesADeclaredRangeForWhatItCanBeAlone) {
  const OnvifAxis axis{OnvifRange{-1, 1}, {}};
  OnvifScale scale(axis, axis);
  scale.set_ranges({{"", OnvifInterval{-0.5, 0.5}, OnvifInterval{0, 1}}});
  EXPECT_DOUBLE_EQ(scaled(scale, at(0.5, 0)).pan_rad, 0.5);
  EXPECT_EQ(scale.note(at(0.5, 0)), "");
  // Half a turn of a pan is hardly a stop.
  scale.set_ranges({{"", OnvifInterval{0, 1}, OnvifInterval{0, 1}}});
  EXPECT_DOUBLE_EQ(scaled(scale, at(0.5, 0)).pan_rad, 0.5);
  EXPECT_THAT(scale.note(at(0.5, 0)), AllOf(HasSubstr("declares pan 0..1 and tilt 0..1, a part"),
                                            HasSubstr("pan_scale: [0, 1] and tilt_scale: [0, 1]")));
  OnvifScale half({}, {});
  half.set_ranges({{"", OnvifInterval{0, 1}, OnvifInterval{0, 1}}});
  EXPECT_THAT(scaled(half, at(0.5, 0)).error,
              HasSubstr("give the angles at these ends, as pan_range_deg and "
                        "tilt_range_deg, and pan_scale: [0, 1] and tilt_scale: [0, 1]"));
  for (const OnvifInterval& interval :
       {OnvifInterval{0, 100}, OnvifInterval{0, 255}, OnvifInterval{0, 36000}}) {
    OnvifScale unknown({}, {});
    unknown.set_ranges({{"", interval, interval}});
    EXPECT_EQ(scaled(unknown, at(50, 50)).outcome, OnvifScale::Outcome::kNeedsAngles);
  }
  OnvifScale turned({}, {});
  turned.set_ranges({{"", OnvifInterval{360, 0}, OnvifInterval{0, 180}}});
  EXPECT_EQ(scaled(turned, at(50, 50)).outcome, OnvifScale::Outcome::kOutside);
  EXPECT_THAT(turned.note(at(50, 50)),
              HasSubstr("declares pan 360..0 and tilt 0..180, which is not a range"));
}

}  // namespace
}  // namespace alidade
