#include "platform/pan_tilt/onvif_messages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "platform/pan_tilt/device_clock_trial.h"
#include "platform/pan_tilt/onvif_time.h"
#include "test/simulator/servers/digest_check.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

std::string envelope(const std::string& body) {
  return R"(<?xml version="1.0"?><S:Envelope xmlns:S="http://www.w3.org/2003/05/soap-envelope"><S:Body>)" +
         body + "</S:Body></S:Envelope>";
}

std::string status_of(const std::string& content) {
  return envelope("<p:GetStatusResponse><p:PTZStatus>" + content +
                  "</p:PTZStatus></p:GetStatusResponse>");
}

std::string position(const std::string& attributes) {
  return status_of("<t:Position><t:PanTilt " + attributes + "/></t:Position>");
}

std::string error_of(const std::string& body) {
  OnvifStatus status;
  std::string error;
  EXPECT_FALSE(parse_onvif_status(body, &status, &error)) << body;
  EXPECT_THAT(error, Not(HasSubstr("\n")));
  return error;
}

TEST(OnvifStatus, HoldsPositionZoomAndTime) {
  OnvifStatus status;
  std::string error;
  ASSERT_TRUE(parse_onvif_status(status_of(R"(<t:Position><t:PanTilt x="-0.5" y=" 0.25 "
                   space="http://www.onvif.org/ver10/tptz/PanTiltSpaces/PositionGenericSpace"/>
                   <t:Zoom x="0.75"/></t:Position><t:UtcTime> 2026-11-21T16:00:00.250Z
                   </t:UtcTime>)"),
                                 &status, &error))
      << error;
  EXPECT_EQ(status.space, "http://www.onvif.org/ver10/tptz/PanTiltSpaces/PositionGenericSpace");
  EXPECT_EQ(status.pan, -0.5);
  EXPECT_EQ(status.tilt, 0.25);
  EXPECT_EQ(status.zoom, 0.75);
  EXPECT_EQ(status.utc_s, 1795276800.25);
}

TEST(OnvifStatus, NeedsNeitherPrefixesNorSpaceNorZoomNorTime) {
  OnvifStatus status;
  std::string error;
  ASSERT_TRUE(parse_onvif_status(
      "<Envelope><Body><GetStatusResponse><PTZStatus><Position><PanTilt y='1e-1' x='1'/></Position>"
      "<UtcTime>now</UtcTime></PTZStatus></GetStatusResponse></Body></Envelope>",
      &status, &error))
      << error;
  EXPECT_EQ(status.space, "");
  EXPECT_EQ(status.pan, 1);
  EXPECT_EQ(status.tilt, 0.1);
  EXPECT_FALSE(status.zoom);
  EXPECT_FALSE(status.utc_s);
}

TEST(OnvifStatus, SaysWhatIsWrong) {
  EXPECT_THAT(error_of(""), HasSubstr("no answer to GetStatus"));
  EXPECT_THAT(error_of("<html>\n<body>Login</body></html>"),
              AllOf(HasSubstr("'<html>'"), HasSubstr("is it an ONVIF service?")));
  EXPECT_THAT(error_of(envelope("<GetProfilesResponse/>")), HasSubstr("no answer to GetStatus"));
  EXPECT_THAT(error_of(status_of("")), HasSubstr("without a position"));
  EXPECT_THAT(error_of(position(R"(x="left" y="1")")), HasSubstr("not a number"));
  EXPECT_THAT(error_of(position(R"(x="nan" y="1")")), HasSubstr("not a number"));
  EXPECT_THAT(error_of(position(R"(x="1")")), HasSubstr("not a number"));
}

TEST(OnvifStatus, RefusesOrReadsEveryDamagedAnswerInOneLine) {
  const std::string good = status_of(
      R"(<t:Position><t:PanTilt x="0.5" y="0.25"/></t:Position><t:UtcTime>2026-11-21T16:00:00Z</t:UtcTime>)");
  std::mt19937 random(1);
  std::uniform_int_distribution<std::size_t> place(0, good.size() - 1);
  std::uniform_int_distribution<int> byte(0, 255);
  int read = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string bad = good;
    for (int n = i % 4; n >= 0; --n) {
      bad[place(random)] = static_cast<char>(byte(random));
    }
    bad.resize(i % 3 == 0 ? place(random) : bad.size());
    OnvifStatus status;
    std::string error;
    if (parse_onvif_status(bad, &status, &error)) {
      ++read;
      EXPECT_TRUE(std::isfinite(status.pan));
      EXPECT_TRUE(std::isfinite(status.tilt));
    } else {
      EXPECT_FALSE(error.empty());
      EXPECT_EQ(error.find_first_of("\r\n"), std::string::npos);
    }
    (void)parse_soap_fault(bad);
  }
  EXPECT_GT(read, 100);
}

TEST(SoapFault, TellsTheInnermostCodeAndTheReason) {
  const std::string inner =
      "<S:Fault><S:Code><S:Value>S:Sender</S:Value><S:Subcode><S:Value>ter:InvalidArgVal</S:Value>"
      "<S:Subcode><S:Value>ter:NoProfile</S:Value></S:Subcode></S:Subcode></S:Code>"
      "<S:Reason><S:Text>No such\nprofile</S:Text></S:Reason></S:Fault>";
  const std::optional<SoapFault> fault = parse_soap_fault(envelope(inner));
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->text, "ter:NoProfile: No such\\nprofile");
  EXPECT_FALSE(fault->not_authorized);
  EXPECT_TRUE(fault->of_a_service);
}

TEST(SoapFault, KnowsThatALoginIsMissing) {
  for (const char* code : {"ter:NotAuthorized", "wsse:FailedAuthentication", "NotAuthorized"}) {
    const std::optional<SoapFault> fault = parse_soap_fault(
        envelope(std::string("<S:Fault><S:Code><S:Value>S:Sender</S:Value><S:Subcode>"
                             "<S:Value>") +
                 code + "</S:Value></S:Subcode></S:Code></S:Fault>"));
    ASSERT_TRUE(fault);
    EXPECT_TRUE(fault->not_authorized) << code;
    EXPECT_FALSE(fault->of_a_service);
  }
}

TEST(SoapFault, KnowsByTheReasonThatALoginIsMissing) {
  for (const char* reason : {"Wsse authorized time check failed.", "Sender not Authorized"}) {
    const std::optional<SoapFault> fault =
        parse_soap_fault(envelope(std::string("<Fault><faultcode>SOAP-ENV:Client</faultcode>"
                                              "<faultstring>") +
                                  reason + "</faultstring></Fault>"));
    ASSERT_TRUE(fault);
    EXPECT_TRUE(fault->not_authorized) << reason;
  }
}

TEST(SoapFault, IsNoneInOtherAnswers) {
  EXPECT_FALSE(parse_soap_fault(""));
  EXPECT_FALSE(parse_soap_fault("<Fault/>"));
  EXPECT_FALSE(parse_soap_fault(envelope("<GetStatusResponse><Fault/></GetStatusResponse>")));
  EXPECT_TRUE(
      parse_soap_fault(envelope("<faultcode/><Fault><faultcode>S:Server</faultcode></Fault>")));
}

TEST(OnvifClock, IsReadAndMustBeWhole) {
  const auto answer = [](const std::string& year) {
    return envelope(
        "<d:GetSystemDateAndTimeResponse><d:SystemDateAndTime><t:UTCDateTime><t:Time><t:Hour>23</"
        "t:Hour>"
        "<t:Minute>59</t:Minute><t:Second>58</t:Second></t:Time><t:Date><t:Year>" +
        year +
        "</t:Year><t:Month>2</t:Month><t:Day>29</t:Day></t:Date></t:UTCDateTime>"
        "</d:SystemDateAndTime></d:GetSystemDateAndTimeResponse>");
  };
  OnvifClock clock;
  std::string error;
  ASSERT_TRUE(parse_onvif_clock(answer("2024"), &clock, &error)) << error;
  EXPECT_EQ(clock.utc_s, 1709251198);
  EXPECT_FALSE(clock.local_s);
  for (const char* year : {"", "x", "99999999999", "-3", "nan"}) {
    EXPECT_FALSE(parse_onvif_clock(answer(year), &clock, &error)) << year;
    EXPECT_THAT(error, HasSubstr("UTCDateTime"));
  }
}

TEST(OnvifClock, MayBeLocalTimeAlone) {
  OnvifClock clock;
  std::string error;
  ASSERT_TRUE(parse_onvif_clock(
      envelope("<GetSystemDateAndTimeResponse><SystemDateAndTime><UTCDateTime/><LocalDateTime>"
               "<Time><Hour>0</Hour><Minute>0</Minute><Second>50</Second></Time>"
               "<Date><Year>1979</Year><Month>11</Month><Day>30</Day></Date>"
               "</LocalDateTime></SystemDateAndTime></GetSystemDateAndTimeResponse>"),
      &clock, &error));
  EXPECT_FALSE(clock.utc_s);
  EXPECT_EQ(clock.local_s, 312768050);
}

TEST(OnvifServices, AreThoseOfGetServicesToo) {
  OnvifServices services;
  std::string error;
  const auto service = [](const char* name, const char* address) {
    return std::string("<Service><Namespace>") + name + "</Namespace><XAddr>" + address +
           "</XAddr></Service>";
  };
  ASSERT_TRUE(
      parse_onvif_services(envelope("<GetServicesResponse>" + service(kOnvifPtz, "http://a/p") +
                                    service(kOnvifDevice, "http://a/d") +
                                    service(kOnvifMedia, "http://a/m") + "</GetServicesResponse>"),
                           &services, &error));
  EXPECT_EQ(services.ptz, "http://a/p");
  EXPECT_EQ(services.media, "http://a/m");
  EXPECT_FALSE(
      parse_onvif_services(envelope("<GetServicesResponse>" + service(kOnvifMedia, "http://a/m") +
                                    "</GetServicesResponse>"),
                           &services, &error));
  EXPECT_EQ(services.media, "http://a/m");
}

TEST(OnvifServices, NeedAPtzService) {
  OnvifServices services;
  std::string error;
  ASSERT_TRUE(parse_onvif_services(
      envelope(
          "<GetCapabilitiesResponse><Capabilities><Media><XAddr> http://a/m\n</XAddr></Media><PTZ>"
          "<XAddr>http://a/p?x=1&amp;y</XAddr></PTZ></Capabilities></GetCapabilitiesResponse>"),
      &services, &error));
  EXPECT_EQ(services.ptz, "http://a/p?x=1&y");
  EXPECT_EQ(services.media, "http://a/m");
  EXPECT_FALSE(parse_onvif_services(
      envelope("<GetCapabilitiesResponse><Capabilities/></GetCapabilitiesResponse>"), &services,
      &error));
  EXPECT_THAT(error, HasSubstr("no PTZ service"));
}

TEST(OnvifProfile, IsTheFirstThatTurns) {
  OnvifProfile profile;
  std::string error;
  ASSERT_TRUE(parse_onvif_profile(
      envelope("<GetProfilesResponse><Profiles token='a'/><Profiles><PTZConfiguration/></Profiles>"
               "<Profiles token='b'><PTZConfiguration token='c'><NodeToken> n </NodeToken>"
               "</PTZConfiguration></Profiles></GetProfilesResponse>"),
      &profile, &error));
  EXPECT_EQ(profile.token, "b");
  EXPECT_EQ(profile.configuration, "c");
  EXPECT_EQ(profile.node, "n");
  EXPECT_FALSE(parse_onvif_profile(
      envelope("<GetProfilesResponse><Profiles token='a'/></GetProfilesResponse>"), &profile,
      &error));
  EXPECT_THAT(error, HasSubstr("none of the device's profiles has a PTZ configuration"));
}

std::string space_of(const std::string& x_range) {
  return "<AbsolutePanTiltPositionSpace><URI>u</URI><XRange>" + x_range +
         "</XRange><YRange><Min>0</Min><Max>180</Max></YRange></AbsolutePanTiltPositionSpace>";
}

TEST(OnvifRanges, AreThoseOfTheNodeOrOfAll) {
  const auto node = [](const std::string& token, const std::string& low) {
    return "<PTZNode token='" + token + "'><SupportedPTZSpaces><AbsoluteZoomPositionSpace/>" +
           space_of("<Min> " + low + " </Min><Max>360.0</Max>") + "</SupportedPTZSpaces></PTZNode>";
  };
  const std::string body =
      envelope("<GetNodesResponse>" + node("a", "-1") + node("b", "0.0") + "</GetNodesResponse>");
  std::vector<OnvifSpaceRange> ranges;
  std::string error;
  ASSERT_TRUE(parse_onvif_ranges(body, "b", &ranges, &error)) << error;
  ASSERT_EQ(ranges.size(), 1U);
  EXPECT_EQ(ranges[0].space, "u");
  EXPECT_EQ(ranges[0].pan->low, 0);
  EXPECT_EQ(ranges[0].pan->high, 360);
  EXPECT_EQ(ranges[0].tilt->high, 180);
  for (const char* unknown : {"", "c"}) {
    ASSERT_TRUE(parse_onvif_ranges(body, unknown, &ranges, &error));
    EXPECT_EQ(ranges.size(), 2U);
  }
}

TEST(OnvifRanges, MayBeThoseOfAConfigurationAndNotNumbers) {
  std::vector<OnvifSpaceRange> ranges;
  std::string error;
  const auto options = [](const std::string& spaces) {
    return envelope("<GetConfigurationOptionsResponse><PTZConfigurationOptions><Spaces>" + spaces +
                    "</Spaces></PTZConfigurationOptions></GetConfigurationOptionsResponse>");
  };
  ASSERT_TRUE(parse_onvif_ranges(options(space_of("<Min>INF</Min>")), "", &ranges, &error));
  EXPECT_FALSE(ranges[0].pan);
  EXPECT_TRUE(ranges[0].tilt);
  EXPECT_FALSE(parse_onvif_ranges(options(""), "", &ranges, &error));
  EXPECT_THAT(error, HasSubstr("declares no range"));
  EXPECT_FALSE(parse_onvif_ranges("<html/>", "", &ranges, &error));
}

// The example of the WS-UsernameToken chapter in ONVIF's programmer's guide.
TEST(OnvifRequest, HoldsTheTokenOfOnvifsOwnExample) {
  OnvifLogin login;
  login.user = "user";
  login.password = "userpassword";
  login.nonce = from_base64("LKqI6G/AikKCQrN0zqZFlg==");
  login.created_utc_s = 1284623445;
  const std::string text = onvif_request(kGetStatus, "", login);
  EXPECT_THAT(text, HasSubstr(">LKqI6G/AikKCQrN0zqZFlg==</w:Nonce>"));
  EXPECT_THAT(text, HasSubstr("<u:Created>2010-09-16T07:50:45.000Z</u:Created>"));
  // The example's own digest is of a Created without fractions of a second.
  EXPECT_EQ(base64(sha1(login.nonce + "2010-09-16T07:50:45Z" + login.password)),
            "tuOSpGlFlIXsozq4HFNeeGeFLEI=");
  EXPECT_THAT(
      text,
      HasSubstr(">" + base64(sha1(login.nonce + "2010-09-16T07:50:45.000Z" + login.password)) +
                "</w:Password>"));
}

TEST(OnvifRequest, EscapesWhatXmlMust) {
  OnvifLogin login;
  login.user = "a<b>&c";
  const std::string text = onvif_request(kGetStatus, "</ProfileToken>&", login);
  EXPECT_THAT(text, HasSubstr("<w:Username>a&lt;b&gt;&amp;c</w:Username>"));
  EXPECT_THAT(text, HasSubstr("<ProfileToken>&lt;/ProfileToken&gt;&amp;</ProfileToken>"));
  EXPECT_THAT(onvif_request(kGetProfiles, "", std::nullopt),
              AllOf(StartsWith("<?xml"), Not(HasSubstr("Header"))));
}

TEST(XmlTime, IsReadWithFractionsAndZones) {
  for (const auto& [text, utc_s] :
       std::vector<std::pair<const char*, double>>{{"1970-01-01T00:00:00Z", 0},
                                                   {"2026-11-21T16:32:31Z", 1795278751},
                                                   {" 2026-11-21T16:32:31.5Z\n", 1795278751.5},
                                                   {"2026-11-21T16:32:31", 1795278751},
                                                   {"2026-11-21T18:02:31.25+01:30", 1795278751.25},
                                                   {"2026-11-21T08:32:31-08:00", 1795278751},
                                                   {"2000-02-29T00:00:00Z", 951782400},
                                                   {"2016-12-31T23:59:60Z", 1483228800}}) {
    const std::optional<double> read = parse_xml_time(text);
    ASSERT_TRUE(read) << text;
    EXPECT_DOUBLE_EQ(*read, utc_s) << text;
  }
}

TEST(XmlTime, IsRefusedIfItIsNone) {
  for (const char* text :
       {"", "now", "2026-11-21", "2026-11-21 16:32:31Z", "2026-13-21T16:32:31Z",
        "2026-11-21T16:32:31.Z", "2026-11-21T16:32:31z", "2026-11-21T16:32:31+1",
        "26-11-21T16:32:31Z", "2026-11-21T16:61:31Z", "0000-00-00T00:00:00Z",
        "2026-11-21T16:32:31+01:00Z", "-2026-11-21T16:32:31Z", "2026-04-31T16:32:31Z",
        "2026-02-29T16:32:31Z", "1900-02-29T00:00:00Z", "2026-12-32T16:32:31Z"}) {
    EXPECT_FALSE(parse_xml_time(text)) << text;
  }
}

TEST(XmlTime, IsWrittenAsItIsRead) {
  std::mt19937_64 random(1);
  std::uniform_int_distribution<std::int64_t> milliseconds(0, 4'102'444'800'000);  // to 2100
  for (int i = 0; i < 10'000; ++i) {
    const double utc_s = 1e-3 * static_cast<double>(milliseconds(random));
    const std::optional<double> read = parse_xml_time(xml_time(utc_s));
    ASSERT_TRUE(read) << xml_time(utc_s);
    ASSERT_NEAR(*read, utc_s, 1e-6);
  }
  EXPECT_EQ(xml_time(-5), "1970-01-01T00:00:00.000Z");
  EXPECT_EQ(xml_time(1e300), "9999-12-31T23:59:59.000Z");
}

using Verdict = DeviceClockTrial::Verdict;

// The verdict on a clock that shows device_time(host time), asked each 0.1 s.
template <class DeviceTime>
Verdict verdict_on(DeviceTime device_time) {
  DeviceClockTrial trial;
  Verdict verdict = Verdict::kOpen;
  for (int i = 0; i < 50 && verdict == Verdict::kOpen; ++i) {
    verdict = trial.add(device_time(0.1 * i), 1000 + 0.1 * i);
  }
  return verdict;
}

TEST(DeviceClockTrial, TakesClocksThatAdvanceInFractionsOfSeconds) {
  using Time = std::optional<double>;
  EXPECT_EQ(verdict_on([](double t) { return Time(7.123 + t); }), Verdict::kUseful);
  EXPECT_EQ(verdict_on([](double t) { return Time(7.123 + 0.25 * std::floor(t / 0.25)); }),
            Verdict::kUseful);
  EXPECT_EQ(verdict_on([](double) { return Time(); }), Verdict::kUseless);
  EXPECT_EQ(verdict_on([](double) { return Time(7.5); }), Verdict::kUseless);
  EXPECT_EQ(verdict_on([](double t) { return Time(std::floor(7 + t)); }), Verdict::kUseless);
  EXPECT_EQ(verdict_on([](double t) { return Time(7.5 - t); }), Verdict::kUseless);
  EXPECT_EQ(verdict_on([](double t) { return Time(7.5 + 100 * t); }), Verdict::kUseless);
}

TEST(DeviceClockTrial, TakesNoClockThatFallsBehind) {
  DeviceClockTrial trial;
  EXPECT_EQ(trial.add(7.5, 100), Verdict::kOpen);
  EXPECT_EQ(trial.add(7.75, 101.5), Verdict::kUseless);
}

// One that tells milliseconds tells a whole second now and then.
TEST(DeviceClockTrial, TakesAClockThatOnceToldAFraction) {
  DeviceClockTrial trial;
  EXPECT_EQ(trial.add(7.5, 100), Verdict::kOpen);
  EXPECT_EQ(trial.add(8.0, 100.5), Verdict::kOpen);
  EXPECT_EQ(trial.add(9.0, 101.5), Verdict::kUseful);
}

}  // namespace
}  // namespace alidade
