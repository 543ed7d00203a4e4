// Which of many answers is which device, and where it is asked.

#include "platform/discovery/found_devices.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const AnswerOrigin kFrom{"192.168.0.90", "eth0"};

ProbeMatch match_of(const std::string& endpoint, std::vector<std::string> addresses) {
  ProbeMatch match;
  match.endpoint = endpoint;
  match.addresses = std::move(addresses);
  match.is_onvif = true;
  return match;
}

std::string best_of(const std::vector<std::string>& addresses, const AnswerOrigin& from = kFrom) {
  int rank = 0;
  return best_address(addresses, from, &rank);
}

TEST(BestAddress, IsTheOneThatAnswered) {
  EXPECT_EQ(best_of({"https://192.168.0.90/onvif/device_service",
                     "http://169.254.209.66/onvif/device_service", "http://10.0.0.1/a",
                     "http://192.168.0.90/onvif/device_service"}),
            "http://192.168.0.90/onvif/device_service");
  EXPECT_EQ(best_of({"http://10.0.0.1:8080/a", "https://192.168.0.90/a"}),
            "https://192.168.0.90/a");
}

TEST(BestAddress, PrefersIpv4AndAvoidsLinkLocal) {
  EXPECT_EQ(best_of({"http://169.254.1.2/a", "http://camera.local/a", "http://10.0.0.1/a"}),
            "http://10.0.0.1/a");
  EXPECT_EQ(best_of({"http://[2001:db8::1]/a", "http://169.254.1.2/a"}), "http://169.254.1.2/a");
}

TEST(BestAddress, GivesALinkLocalIpv6AddressItsInterface) {
  EXPECT_EQ(best_of({"http://[fe80::1]/onvif/device_service"}, {"fe80::1%eth0", "eth0"}),
            "http://[fe80::1%25eth0]/onvif/device_service");
  EXPECT_EQ(best_of({"http://[fe80::1]/a", "http://[2001:db8::1]:81/a"}, {"fe80::1%eth0", "eth0"}),
            "http://[2001:db8::1]:81/a");
}

TEST(BestAddress, IsNoneOfThoseThatLeadNowhere) {
  EXPECT_EQ(best_of({"http://0.0.0.0/a", "http://127.0.0.1/a", "http://[::1]/a", "http:///a",
                     "http://localhost/a", "nonsense"}),
            "");
}

TEST(FoundDevices, ADeviceThatAnswersOftenIsOne) {
  FoundDevices found;
  for (int i = 0; i < 5; ++i) {
    found.add(match_of("urn:uuid:1", {"http://192.168.0.90/a"}), kFrom);
    found.add(match_of("URN:UUID:1", {"http://[fe80::1]/a"}), {"fe80::1%eth1", "eth1"});
  }
  ASSERT_THAT(found.list(), SizeIs(1));
  EXPECT_EQ(found.list()[0].onvif_url, "http://192.168.0.90/a");
  EXPECT_EQ(found.list()[0].interface, "eth0");
}

TEST(FoundDevices, TheBetterAddressOfTwoInterfacesStays) {
  FoundDevices found;
  found.add(match_of("urn:uuid:1", {"http://[fe80::1]/a"}), {"fe80::1%eth1", "eth1"});
  EXPECT_EQ(found.list()[0].onvif_url, "http://[fe80::1%25eth1]/a");
  EXPECT_EQ(found.list()[0].note, kLinkLocalOnly);
  found.add(match_of("urn:uuid:1", {"http://192.168.0.90/a"}), kFrom);
  ASSERT_THAT(found.list(), SizeIs(1));
  EXPECT_EQ(found.list()[0].host, "192.168.0.90");
  EXPECT_THAT(found.list()[0].note, IsEmpty());
}

TEST(FoundDevices, BothProtocolsOfADeviceAreOneInEitherOrder) {
  DnsService axis;
  axis.instance = "AXIS Q6075 - ACCC8E012345";
  axis.type = "_axis-video._tcp.local";
  axis.port = 80;
  axis.addresses = {"192.168.0.90"};
  for (const bool onvif_first : {true, false}) {
    FoundDevices found;
    ProbeMatch match = match_of("urn:uuid:1", {"http://192.168.0.90/onvif/device_service"});
    if (onvif_first) found.add(match, kFrom);
    found.add(axis, kFrom);
    if (!onvif_first) found.add(match, kFrom);
    ASSERT_THAT(found.list(), SizeIs(1)) << onvif_first;
    EXPECT_EQ(found.list()[0].name, "AXIS Q6075 - ACCC8E012345");
    EXPECT_EQ(found.list()[0].vapix_url, "http://192.168.0.90");
    EXPECT_EQ(found.list()[0].onvif_url, "http://192.168.0.90/onvif/device_service");
  }
}

TEST(FoundDevices, VapixIsAskedWhereTheAnswerCameFromIfNoAddressIsTold) {
  FoundDevices found;
  DnsService axis;
  axis.type = "_vapix-https._tcp.local";
  axis.port = 8443;
  found.add(axis, kFrom);
  ASSERT_THAT(found.list(), SizeIs(1));
  EXPECT_EQ(found.list()[0].vapix_url, "https://192.168.0.90:8443");
  axis.type = "_vapix-http._tcp.local";
  axis.port = 80;
  found.add(axis, kFrom);
  ASSERT_THAT(found.list(), SizeIs(1));
  EXPECT_EQ(found.list()[0].vapix_url, "http://192.168.0.90");
}

TEST(FoundDevices, SaysWhatIsOdd) {
  FoundDevices found;
  found.add(match_of("urn:uuid:1", {}), kFrom);
  found.add(match_of("urn:uuid:2", {"http://10.0.0.1/a"}), {"192.168.0.91", "eth0"});
  found.add(match_of("urn:uuid:3", {"http://192.168.0.92/a"}), {"192.168.0.92", "eth0"});
  const auto list = found.list();
  ASSERT_THAT(list, SizeIs(3));
  EXPECT_EQ(list[0].host, "10.0.0.1");
  EXPECT_THAT(list[0].note, HasSubstr("came from 192.168.0.91"));
  EXPECT_EQ(list[1].onvif_url, "http://192.168.0.90/onvif/device_service");
  EXPECT_THAT(list[1].note, HasSubstr("no address"));
  EXPECT_THAT(list[2].note, IsEmpty());
}

TEST(FoundDevices, TwoDevicesBehindOneAddressAreTwo) {
  FoundDevices found;
  found.add(match_of("urn:uuid:1", {"http://192.168.0.90:81/a"}), kFrom);
  found.add(match_of("urn:uuid:2", {"http://192.168.0.90:82/a"}), kFrom);
  EXPECT_THAT(found.list(), SizeIs(2));
}

TEST(FoundDevices, WhatIsNotOnvifIsLeftOutAndAFloodIsBounded) {
  FoundDevices found;
  ProbeMatch printer = match_of("urn:uuid:1", {"http://192.168.0.90/a"});
  printer.is_onvif = false;
  found.add(printer, kFrom);
  EXPECT_THAT(found.list(), IsEmpty());
  for (int i = 0; i < 1000; ++i)
    found.add(match_of("urn:uuid:" + std::to_string(i),
                       {"http://10.0." + std::to_string(i / 250) + "." + std::to_string(i % 250)}),
              kFrom);
  EXPECT_THAT(found.list(), SizeIs(FoundDevices::kMostDevices));
}

}  // namespace
}  // namespace alidade
