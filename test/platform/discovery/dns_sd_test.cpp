// Answers of DNS-SD, made byte by byte after RFC 1035.

#include "platform/discovery/dns_sd.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace alidade {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const std::vector<std::string> kTypes = {"_axis-video._tcp.local", "_vapix-http._tcp.local"};
constexpr std::uint16_t kId = 0x1234;

std::string u16(unsigned value) {
  return {static_cast<char>(value >> 8U), static_cast<char>(value & 0xFFU)};
}

std::string name(const std::vector<std::string>& labels) {
  std::string bytes;
  for (const std::string& label : labels) bytes += static_cast<char>(label.size()) + label;
  return bytes + '\0';
}

std::string record(const std::string& owner, unsigned type, const std::string& data) {
  return owner + u16(type) + u16(0x8001) + std::string(2, '\0') + u16(120) +
         u16(static_cast<unsigned>(data.size())) + data;
}

std::string message(unsigned id, unsigned flags, const std::vector<std::string>& answers,
                    const std::vector<std::string>& additional = {}) {
  std::string bytes = u16(id) + u16(flags) + u16(0) + u16(static_cast<unsigned>(answers.size())) +
                      u16(0) + u16(static_cast<unsigned>(additional.size()));
  for (const std::string& each : answers) bytes += each;
  for (const std::string& each : additional) bytes += each;
  return bytes;
}

const std::string kService = name({"_axis-video", "_tcp", "local"});
const std::string kInstance = name({"AXIS Q6075 - ACCC8E012345", "_axis-video", "_tcp", "local"});
const std::string kHost = name({"axis-accc8e012345", "local"});

std::string camera() {
  return message(kId, 0x8400, {record(kService, 12, kInstance)},
                 {record(kInstance, 33, u16(0) + u16(0) + u16(8080) + kHost),
                  record(kInstance, 16, std::string("\x17macaddress=ACCC8E012345")),
                  record(kHost, 1, std::string("\xC0\x00\x02\x0A", 4)),
                  record(kHost, 28, std::string("\xFE\x80\0\0\0\0\0\0\0\0\0\0\0\0\0\x01", 16))});
}

std::vector<DnsService> services_of(const std::string& datagram, std::string* error) {
  std::vector<DnsService> services;
  error->clear();
  EXPECT_EQ(parse_dns_sd_answer(datagram, kTypes, kId, &services, error), error->empty());
  return services;
}

TEST(DnsSd, ReadsACamera) {
  std::string error;
  const auto services = services_of(camera(), &error);
  ASSERT_THAT(services, SizeIs(1)) << error;
  EXPECT_EQ(services[0].instance, "AXIS Q6075 - ACCC8E012345");
  EXPECT_EQ(services[0].type, "_axis-video._tcp.local");
  EXPECT_EQ(services[0].port, 8080);
  EXPECT_EQ(services[0].host, "axis-accc8e012345.local");
  EXPECT_THAT(services[0].addresses, ElementsAre("192.0.2.10", "fe80::1"));
}

// As mDNS responders send it: names point to those before them.
TEST(DnsSd, ReadsCompressedNames) {
  std::string bytes = u16(kId) + u16(0x8400) + u16(1) + u16(1) + u16(0) + u16(0);
  bytes += kService + u16(12) + u16(1);  // the question again, at 12
  bytes += record(u16(0xC00C), 12, std::string("\x0C") + "FrontYardCam" + u16(0xC00C));
  std::string error;
  const auto services = services_of(bytes, &error);
  ASSERT_THAT(services, SizeIs(1)) << error;
  EXPECT_EQ(services[0].instance, "FrontYardCam");
  EXPECT_EQ(services[0].port, 0);
}

TEST(DnsSd, OtherServicesAreLeftOut) {
  std::string error;
  const std::string printer = name({"_ipp", "_tcp", "local"});
  EXPECT_THAT(services_of(message(kId, 0x8400,
                                  {record(printer, 12, name({"Laser", "_ipp", "_tcp", "local"}))}),
                          &error),
              IsEmpty());
  EXPECT_THAT(error, IsEmpty());
}

TEST(DnsSd, RefusesWhatAnswersNothingAsked) {
  std::string error;
  services_of(message(kId, 0, {record(kService, 12, kInstance)}), &error);  // a question
  EXPECT_THAT(error, HasSubstr("answers nothing"));
  services_of(message(kId + 1, 0x8400, {record(kService, 12, kInstance)}), &error);
  EXPECT_THAT(error, HasSubstr("answers nothing"));
  services_of("", &error);
  EXPECT_THAT(error, HasSubstr("not a whole DNS message"));
}

TEST(DnsSd, EveryPieceOfAnAnswerIsReadOrRefused) {
  std::string error;
  const std::string whole = camera();
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_LE(services_of(whole.substr(0, size), &error).size(), 1U);
}

// A name that points to itself, and one beyond the end.
TEST(DnsSd, LoopsInNamesEnd) {
  std::string error;
  for (const unsigned target : {0xC000U + 12U, 0xFFFFU}) {
    const auto services =
        services_of(message(kId, 0x8400, {record(u16(target), 12, u16(target))}), &error);
    EXPECT_THAT(services, IsEmpty());
  }
  std::string loop = u16(kId) + u16(0x8400) + u16(0) + u16(1) + u16(0) + u16(0);
  loop += kService + u16(12) + u16(1) + std::string(4, '\0') + u16(2);
  loop += u16(0xC000U + static_cast<unsigned>(loop.size()));  // at itself
  EXPECT_THAT(services_of(loop, &error), IsEmpty());
}

TEST(DnsSd, NamesWithDotsAndOtherBytesStay) {
  std::string error;
  const std::string instance = name({"Gate 2.1 (N\xC3\xB6rd)", "_axis-video", "_tcp", "local"});
  const auto services = services_of(message(kId, 0x8400, {record(kService, 12, instance)}), &error);
  ASSERT_THAT(services, SizeIs(1)) << error;
  EXPECT_EQ(services[0].instance, "Gate 2.1 (N\xC3\xB6rd)");
}

TEST(DnsSd, IsBounded) {
  std::vector<std::string> answers;
  for (int i = 0; i < 500; ++i)
    answers.push_back(
        record(kService, 12, name({"c" + std::to_string(i), "_axis-video", "_tcp", "local"})));
  std::string error;
  EXPECT_THAT(services_of(message(kId, 0x8400, answers), &error), SizeIs(64));
}

TEST(DnsSd, TheQuestionIsOneForEachType) {
  const std::string question = dns_sd_question(kTypes, kId);
  EXPECT_EQ(question, u16(kId) + u16(0) + u16(2) + u16(0) + u16(0) + u16(0) + kService + u16(12) +
                          u16(1) + name({"_vapix-http", "_tcp", "local"}) + u16(12) + u16(1));
}

}  // namespace
}  // namespace alidade
