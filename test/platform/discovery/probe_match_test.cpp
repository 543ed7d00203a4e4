// Answers of WS-Discovery: as devices send them, and as nobody should.

#include "platform/discovery/probe_match.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "platform/pan_tilt/onvif_xml.h"

namespace alidade {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const std::vector<std::string> kAsked = {"uuid:11111111-2222-4333-8444-555555555555",
                                         "urn:uuid:aaaaaaaa-bbbb-4ccc-8ddd-eeeeeeeeeeee"};

// soap: the prefix of the envelope; d: of WS-Discovery's names.
std::string answer(const std::string& soap, const std::string& d, const std::string& relates_to,
                   const std::string& matches) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<" + soap + ":Envelope xmlns:" + soap +
         "=\"http://www.w3.org/2003/05/soap-envelope\" xmlns:" + d +
         "=\"http://schemas.xmlsoap.org/ws/2005/04/discovery\" "
         "xmlns:wsa=\"http://schemas.xmlsoap.org/ws/2004/08/addressing\"><" +
         soap + ":Header><wsa:RelatesTo>" + relates_to + "</wsa:RelatesTo></" + soap + ":Header><" +
         soap + ":Body><" + d + ":ProbeMatches>" + matches + "</" + d + ":ProbeMatches></" + soap +
         ":Body></" + soap + ":Envelope>";
}

std::string match(const std::string& d, const std::string& endpoint, const std::string& types,
                  const std::string& scopes, const std::string& addresses) {
  return "<" + d + ":ProbeMatch><wsa:EndpointReference><wsa:Address>" + endpoint +
         "</wsa:Address></wsa:EndpointReference><" + d + ":Types>" + types + "</" + d + ":Types><" +
         d + ":Scopes>" + scopes + "</" + d + ":Scopes><" + d + ":XAddrs>" + addresses + "</" + d +
         ":XAddrs><" + d + ":MetadataVersion>1</" + d + ":MetadataVersion></" + d + ":ProbeMatch>";
}

std::vector<ProbeMatch> matches_of(const std::string& datagram, std::string* error) {
  std::vector<ProbeMatch> matches;
  error->clear();
  EXPECT_EQ(parse_probe_matches(datagram, kAsked, &matches, error), error->empty());
  return matches;
}

// The forms of three makers' answers: prefixes, lists over several lines, escapes, IPv6.
TEST(ProbeMatch, ReadsWhatAnAxisDeviceSays) {
  std::string error;
  const auto matches = matches_of(
      answer("SOAP-ENV", "d", "uuid:11111111-2222-4333-8444-555555555555",
             match("d", "urn:uuid:e83a0086-3fdc-4d87-b8c4-83c0a16ad9f4",
                   "tds:Device dn:NetworkVideoTransmitter",
                   "onvif://www.onvif.org/Profile/Streaming onvif://www.onvif.org/Profile/G\n"
                   "   onvif://www.onvif.org/hardware/M2036-LE "
                   "onvif://www.onvif.org/name/AXIS%20M2036-LE\n"
                   "   onvif://www.onvif.org/location/",
                   "http://192.168.0.90/onvif/device_service "
                   "https://192.168.0.90/onvif/device_service\n"
                   "   http://169.254.209.66/onvif/device_service "
                   "https://169.254.209.66/onvif/device_service")),
      &error);
  ASSERT_THAT(matches, SizeIs(1)) << error;
  EXPECT_EQ(matches[0].endpoint, "urn:uuid:e83a0086-3fdc-4d87-b8c4-83c0a16ad9f4");
  EXPECT_THAT(matches[0].types, ElementsAre("Device", "NetworkVideoTransmitter"));
  EXPECT_EQ(matches[0].name, "AXIS M2036-LE");
  EXPECT_EQ(matches[0].hardware, "M2036-LE");
  EXPECT_THAT(matches[0].addresses, SizeIs(4));
  EXPECT_TRUE(matches[0].is_onvif);
}

TEST(ProbeMatch, ReadsWhatAHikvisionDeviceSays) {
  std::string error;
  const auto matches =
      matches_of(answer("env", "wsdd", "urn:uuid:AAAAAAAA-BBBB-4CCC-8DDD-EEEEEEEEEEEE",
                        match("wsdd", "urn:uuid:44444444-5555-4666-8777-888888888888",
                              "dn:NetworkVideoTransmitter",
                              "onvif://www.onvif.org/type/video_encoder "
                              "onvif://www.onvif.org/MAC/c4%3A2f%3A90%3Aab%3Acd%3Aef "
                              "onvif://www.onvif.org/hardware/DS-2CD2143G0-I "
                              "onvif://www.onvif.org/name/HIKVISION%20DS-2CD2143G0-I",
                              "http://192.168.1.64/onvif/device_service "
                              "http://[fe80::eaa0:edff:fe3f:b4f7]/onvif/device_service")),
                 &error);
  ASSERT_THAT(matches, SizeIs(1)) << error;
  EXPECT_EQ(matches[0].name, "HIKVISION DS-2CD2143G0-I");
  EXPECT_THAT(matches[0].addresses,
              ElementsAre("http://192.168.1.64/onvif/device_service",
                          "http://[fe80::eaa0:edff:fe3f:b4f7]/onvif/device_service"));
}

TEST(ProbeMatch, ReadsWhatADahuaDeviceSays) {
  std::string error;
  const auto matches = matches_of(answer("s", "d", "11111111-2222-4333-8444-555555555555",
                                         match("d", "uuid:503b687a-b9d7-474f-a2d0-a18c8b25a464",
                                               "dn:NetworkVideoTransmitter tds:Device",
                                               "onvif://www.onvif.org/location/country/china "
                                               "onvif://www.onvif.org/name/Dahua "
                                               "onvif://www.onvif.org/hardware/IPC-HFW2228M-I1-V2 "
                                               "onvif://www.onvif.org/extension/unique_identifier",
                                               "http://192.168.1.45/onvif/device_service")),
                                  &error);
  ASSERT_THAT(matches, SizeIs(1)) << error;
  EXPECT_EQ(matches[0].name, "Dahua");
  EXPECT_EQ(matches[0].hardware, "IPC-HFW2228M-I1-V2");
}

// As the virtual camera ipycam sends it, against the standard.
TEST(ProbeMatch, ReadsAMatchThatStandsAlone) {
  std::string text =
      answer("s", "d", kAsked[0],
             match("d", "urn:uuid:1", "dn:NetworkVideoTransmitter", "", "http://192.0.2.9/a"));
  for (const char* tag : {"<d:ProbeMatches>", "</d:ProbeMatches>"})
    text.erase(text.find(tag), std::string(tag).size());
  std::string error;
  EXPECT_THAT(matches_of(text, &error), SizeIs(1)) << error;
}

TEST(ProbeMatch, APrinterIsNoCamera) {
  std::string error;
  const auto matches = matches_of(
      answer("s", "d", kAsked[0],
             match("d", "urn:uuid:1", "wprt:PrintDeviceType", "", "http://192.0.2.9:5357/print")),
      &error);
  ASSERT_THAT(matches, SizeIs(1)) << error;
  EXPECT_FALSE(matches[0].is_onvif);
}

TEST(ProbeMatch, AnAnswerOfNobodysQuestionIsTaken) {
  std::string error;
  EXPECT_THAT(matches_of(answer("s", "d", "",
                                match("d", "urn:uuid:1", "dn:NetworkVideoTransmitter", "",
                                      "http://192.0.2.9/a")),
                         &error),
              SizeIs(1));
}

TEST(ProbeMatch, RefusesWhatIsNoAnswerToUs) {
  std::string error;
  EXPECT_THAT(
      matches_of(answer("s", "d", "urn:uuid:99999999-2222-4333-8444-555555555555", ""), &error),
      IsEmpty());
  EXPECT_THAT(error, HasSubstr("a question of somebody else"));
  for (const char* bytes :
       {"", "<", "\xFF\xFE", "<a/>", "<s:Envelope><s:Body><d:Hello/></s:Body></s:Envelope>",
        "HTTP/1.1 200 OK\r\n\r\n"}) {
    EXPECT_THAT(matches_of(bytes, &error), IsEmpty()) << bytes;
    EXPECT_THAT(error, HasSubstr("an answer")) << bytes;
  }
  // The fault of some devices to an untyped probe.
  EXPECT_THAT(matches_of("<env:Envelope><env:Body><env:Fault/></env:Body></env:Envelope>", &error),
              IsEmpty());
  EXPECT_EQ(error, "an answer without ProbeMatches, but with 'env:Fault'");
}

TEST(ProbeMatch, EveryPieceOfAnAnswerIsReadOrRefused) {
  const std::string whole = answer("s", "d", kAsked[0],
                                   match("d", "urn:uuid:1", "dn:NetworkVideoTransmitter",
                                         "onvif://www.onvif.org/name/a%2", "http://192.0.2.9/a"));
  std::string error;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    for (const ProbeMatch& each : matches_of(whole.substr(0, size), &error))
      EXPECT_LE(each.addresses.size(), 1U);
  }
  ASSERT_THAT(matches_of(whole, &error), SizeIs(1));
  EXPECT_EQ(matches_of(whole, &error)[0].name, "a%2");
}

// Entities that a document defines are not expanded: a billion laughs stay one.
TEST(ProbeMatch, HostileXmlCostsNothing) {
  std::string laughs = "<?xml version=\"1.0\"?><!DOCTYPE l [<!ENTITY a \"ha\">";
  for (char c = 'b'; c < 'n'; ++c) {
    laughs += std::string("<!ENTITY ") + c + " \"";
    for (int i = 0; i < 10; ++i) laughs += std::string("&") + static_cast<char>(c - 1) + ";";
    laughs += "\">";
  }
  laughs += "]>" + answer("s", "d", kAsked[0],
                          match("d", "&m;", "dn:NetworkVideoTransmitter", "&m;", "http://a/&m;"))
                       .substr(39);
  std::string error;
  for (const ProbeMatch& each : matches_of(laughs, &error)) EXPECT_LT(each.endpoint.size(), 20U);
  std::string deep;
  for (int i = 0; i < 10'000; ++i) deep += "<a>";
  EXPECT_THAT(matches_of(deep, &error), IsEmpty());
}

TEST(ProbeMatch, IsBounded) {
  std::string matches;
  std::string addresses;
  for (int i = 0; i < 200; ++i) addresses += "http://192.0.2.1/" + std::to_string(i) + " ";
  addresses += "http://192.0.2.1/" + std::string(5000, 'x');
  for (int i = 0; i < 100; ++i)
    matches += match("d", "urn:uuid:1", "dn:NetworkVideoTransmitter", addresses, addresses);
  std::string error;
  const auto read_ones = matches_of(answer("s", "d", kAsked[0], matches), &error);
  EXPECT_THAT(read_ones, SizeIs(16)) << error;
  EXPECT_THAT(read_ones[0].addresses, SizeIs(64));
}

// In a URL nothing but http counts: no file, no script.
TEST(ProbeMatch, OtherSchemesAreLeftOut) {
  std::string error;
  const auto matches = matches_of(answer("s", "d", kAsked[0],
                                         match("d", "urn:uuid:1", "dn:NetworkVideoTransmitter", "",
                                               "file:///etc/passwd HTTP://192.0.2.1/a javascript:x "
                                               "gopher://192.0.2.1/")),
                                  &error);
  ASSERT_THAT(matches, SizeIs(1)) << error;
  EXPECT_THAT(matches[0].addresses, ElementsAre("HTTP://192.0.2.1/a"));
}

TEST(ProbeMessage, NamesItsActionAndWhatIsLookedFor) {
  for (const bool typed : {true, false}) {
    pugi::xml_document document;
    const std::string text = probe_message(kAsked[0], typed);
    ASSERT_TRUE(document.load_buffer(text.data(), text.size()));
    const pugi::xml_node envelope = xml_child(document.root(), "Envelope");
    EXPECT_EQ(xml_text(xml_descendant(envelope, {"Header", "MessageID"})), kAsked[0]);
    EXPECT_EQ(xml_text(xml_descendant(envelope, {"Header", "Action"})),
              "http://schemas.xmlsoap.org/ws/2005/04/discovery/Probe");
    EXPECT_EQ(xml_text(xml_descendant(envelope, {"Body", "Probe", "Types"})),
              typed ? "dn:NetworkVideoTransmitter" : "");
  }
}

}  // namespace
}  // namespace alidade
