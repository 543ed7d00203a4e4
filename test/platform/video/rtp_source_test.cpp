// Plain RTP: a sender in this process, each of whose pictures tells its number by its
// grey (rtp_sender.h).

#include "platform/video/rtp_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <thread>
#include <tuple>
#include <vector>

#include "platform/video/recording_copy.h"
#include "platform/video/recording_frame_source.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/rtp_relay.h"
#include "test/platform/support/rtp_sender.h"
#include "test/support/temporary_directory.h"
#include "test/support/udp_port_pair.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

using Codec = RtpSender::Codec;

RtpSourceOptions options_for(int port, Codec codec) {
  RtpSourceOptions options;
  options.url = "rtp://@:" + std::to_string(port);
  options.format = codec == Codec::kMjpeg ? "MJPG" : codec == Codec::kH264 ? "H264" : "H265";
  options.timeout_s = kDeadline_s;
  options.max_backoff_s = 0.01;
  return options;
}

// From here on no packet is lost.
void listen(FrameSource& source, int port) {
  Frame frame;
  ASSERT_EQ(source.read(frame, 0), ReadStatus::kTimeout);
  ASSERT_TRUE(eventually([port] { return rtp_port_taken(port); }));
}

// Sends until the source says something.
ReadStatus next(FrameSource& source, RtpSender& sender, Frame& frame) {
  const double end_s = monotonic_now_s() + kDeadline_s;
  ReadStatus status = ReadStatus::kTimeout;
  while (status == ReadStatus::kTimeout && monotonic_now_s() < end_s) {
    sender.send();
    status = source.read(frame, 0.05);
  }
  return status;
}

// The mean of all pixels: a wrong stride or a damaged edge shows.
double grey_of(const Frame& frame) {
  double sum = 0;
  for (int v = 0; v < frame.height; ++v) {
    for (int u = 0; u < frame.width; ++u) {
      sum += frame.luma[v * frame.stride + u];
    }
  }
  return sum / (frame.width * frame.height);
}

constexpr double kGreyTolerance = 3;  // neighbouring numbers differ by 7

// The picture's number by its stamp, if the first one's is 0.
double number_of(const Frame& frame, const FrameStamp& first) {
  return (*frame.stamp.sender_time_s - *first.sender_time_s) / RtpSender::kPeriod_s;
}

class RtpSourceWith : public ::testing::TestWithParam<Codec> {
 protected:
  const int port_ = test::udp_port_pair();
  RtpSourceOptions options_ = options_for(port_, GetParam());
};

INSTANTIATE_TEST_SUITE_P(Codecs, RtpSourceWith,
                         ::testing::Values(Codec::kMjpeg, Codec::kH264, Codec::kH265),
                         ::testing::PrintToStringParamName());

// Those whose pictures are coded from others.
class RtpSourceOfPredicted : public RtpSourceWith {};

INSTANTIATE_TEST_SUITE_P(Codecs, RtpSourceOfPredicted,
                         ::testing::Values(Codec::kH264, Codec::kH265),
                         ::testing::PrintToStringParamName());

TEST_P(RtpSourceWith, DeliversEveryPictureWithItsOwnStamp) {
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpSender sender(GetParam(), port_);
  FrameStamp first;
  FrameStamp last;
  for (int i = 0; i < 40; ++i) {
    Frame frame;
    ASSERT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
    first = i == 0 ? frame.stamp : first;
    EXPECT_EQ(frame.stamp.frame, i);
    EXPECT_EQ(frame.stamp.restarted, i == 0);
    EXPECT_EQ(frame.stamp.sequence, std::nullopt);
    ASSERT_TRUE(frame.stamp.sender_time_s);
    EXPECT_NEAR(number_of(frame, first), i, 1e-3);
    EXPECT_EQ(frame.width, RtpSender::kWidth);
    EXPECT_EQ(frame.height, RtpSender::kHeight);
    EXPECT_NEAR(grey_of(frame), RtpSender::grey_of(i), kGreyTolerance);
    EXPECT_TRUE(frame.decode_s);
    EXPECT_GE(frame.stamp.receive_time_s, last.receive_time_s);
    last = frame.stamp;
  }
  EXPECT_EQ(source->counters().damaged, 0);
  EXPECT_EQ(source->counters().dropped, 0);
}

TEST_P(RtpSourceWith, DeliversAPictureWithoutWaitingForTheNext) {
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpSender sender(GetParam(), port_);
  Frame frame;
  // Where an H.264 stream begins, only the second picture shows that the first was whole.
  ASSERT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
  while (frame.stamp.frame + 1 < sender.sent()) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  }
  for (int i = 0; i < 30; ++i) {
    sender.send();
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    EXPECT_EQ(frame.stamp.frame + 1, sender.sent());
    EXPECT_NEAR(grey_of(frame), RtpSender::grey_of(frame.stamp.frame), kGreyTolerance);
  }
}

TEST_P(RtpSourceWith, StampsAPictureOnItsOwnArrival) {
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpSender sender(GetParam(), port_);
  std::vector<double> sent_s;
  int on_time = 0;
  for (std::size_t i = 0; i < 20; ++i) {
    Frame frame;
    sent_s.push_back(monotonic_now_s());
    sender.send();
    if (source->read(frame, 0.05) == ReadStatus::kOk) {
      const auto number = static_cast<std::size_t>(frame.stamp.frame);
      ASSERT_LT(number, sent_s.size());
      EXPECT_GE(frame.stamp.receive_time_s, sent_s[number]);
      // The receiving thread may be kept waiting on a busy machine, but not always.
      on_time += number + 1 == sent_s.size() || frame.stamp.receive_time_s < sent_s[number + 1];
    }
  }
  EXPECT_GT(on_time, 0);
}

TEST_P(RtpSourceWith, ReadsASessionDescription) {
  RtpSender sender(GetParam(), port_);
  const TemporaryDirectory directory;
  directory.write("camera.sdp", sender.sdp());
  options_.url = directory.path() + "/camera.sdp";
  options_.format.clear();
  const auto source = open_rtp(options_);
  EXPECT_EQ(source->name(), options_.url);
  Frame frame;
  EXPECT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
  EXPECT_EQ(frame.width, RtpSender::kWidth);
}

// Sends picture after picture through the relay until the source gives the next one.
bool next(FrameSource& source, RtpSender& sender, RtpRelay& relay, Frame& frame) {
  return eventually([&] {
    sender.send();
    relay.forward();
    return source.read(frame, 0.02) == ReadStatus::kOk;
  });
}

class RtpSourceTimestamps : public ::testing::TestWithParam<std::tuple<Codec, std::int64_t, bool>> {
};

constexpr std::int64_t kWrap = std::int64_t{1} << 32;

INSTANTIATE_TEST_SUITE_P(
    FirstTimestamps, RtpSourceTimestamps,
    ::testing::Combine(::testing::Values(Codec::kMjpeg, Codec::kH264, Codec::kH265),
                       ::testing::Values(0, 90'000, kWrap - 60'000, kWrap - 60'001),
                       ::testing::Bool()));

TEST_P(RtpSourceTimestamps, AreUnwrappedAndGiveUtcFromTheFirstReportOn) {
  const auto [codec, first_timestamp, report_first] = GetParam();
  const int port = test::udp_port_pair();
  const auto source = open_rtp(options_for(port, codec));
  listen(*source, port);
  RtpRelay relay(port);
  relay.begin_at(static_cast<std::uint32_t>(first_timestamp));
  RtpSender sender(codec, relay.port());
  const double began_utc_s = std::floor(sender.began_utc_s());
  std::int64_t reported = std::numeric_limits<std::int64_t>::max();  // pictures sent before it
  std::int64_t enough = 40;
  const auto report = [&, timestamp = static_cast<std::uint32_t>(first_timestamp)] {
    relay.report(static_cast<std::uint64_t>(began_utc_s + 2'208'988'800.0) << 32U, timestamp);
    reported = std::min(reported, sender.sent());
    enough = std::max(enough, reported + 35);
  };
  if (report_first) report();
  FrameStamp first;
  int with_utc = 0;
  // On a busy machine many pictures may have come before the report that follows the sixth that is
  // read.
  for (int i = 0; i < enough; ++i) {
    Frame frame;
    ASSERT_TRUE(next(*source, sender, relay, frame)) << source->error();
    first = i == 0 ? frame.stamp : first;
    EXPECT_EQ(frame.stamp.frame, i);
    EXPECT_NEAR(grey_of(frame), RtpSender::grey_of(i), kGreyTolerance);
    ASSERT_TRUE(frame.stamp.sender_time_s);
    EXPECT_NEAR(number_of(frame, first), i, 1e-3);
    // The report and the picture after it come by two sockets, in either order.
    if (i - 1 > reported) EXPECT_TRUE(frame.stamp.sender_utc_s) << i;
    if (frame.stamp.sender_utc_s) {
      EXPECT_NEAR(*frame.stamp.sender_utc_s - began_utc_s, i * RtpSender::kPeriod_s, 2e-3);
      ++with_utc;
    }
    if (i == 5) report();
  }
  EXPECT_GE(with_utc, 30) << "of them, where the report is first, some before a wrap, all after it";
  EXPECT_EQ(source->counters().damaged, 0);
}

TEST_P(RtpSourceWith, GivesNoUtcOfReportsOfASenderWithoutAClock) {
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpRelay relay(port_);
  RtpSender sender(GetParam(), relay.port());
  // Unknown, and the time since the sender began (RFC 3550, 6.4.1).
  for (const std::uint64_t ntp : {std::uint64_t{0}, std::uint64_t{86'400} << 32U}) {
    for (int i = 0; i < 10; ++i) {
      Frame frame;
      relay.report(ntp, 90'000);
      ASSERT_TRUE(next(*source, sender, relay, frame)) << source->error();
      EXPECT_EQ(frame.stamp.sender_utc_s, std::nullopt);
    }
  }
}

TEST_P(RtpSourceWith, TakesTheCaptureTimeFromTheOnvifExtension) {
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpRelay relay(port_);
  RtpSender sender(GetParam(), relay.port());
  for (int i = 0; i < 20;) {
    const std::int64_t number = sender.sent();
    sender.send();
    relay.forward([number](RtpRelay::Packets& packets) {
      packets.front() =
          with_capture_time(packets.front(), 1.7e9 + static_cast<double>(number) / 16);
    });
    Frame frame;
    while (source->read(frame, 0.05) == ReadStatus::kOk) {
      EXPECT_EQ(frame.stamp.sender_utc_s, 1.7e9 + i / 16.0);
      EXPECT_NEAR(grey_of(frame), RtpSender::grey_of(i++), kGreyTolerance);
    }
  }
}

TEST_P(RtpSourceWith, PutsPacketsInOrderThatOvertookEachOther) {
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpRelay relay(port_);
  RtpSender sender(GetParam(), relay.port());
  int frames = 0;
  int overtaken = 0;
  while (frames < 20) {
    sender.send();
    // libavformat takes the order from the first packets, and sequence number 0 for none.
    if (sender.sent() % 2 == 1) {
      relay.forward([&](RtpRelay::Packets& packets) {
        const std::size_t count = packets.size();
        if (sender.sent() < 4) return;
        ASSERT_GE(count, 2U);
        std::swap(packets[count - 1], packets[count - 2]);
        ++overtaken;
      });
    }
    Frame frame;
    while (source->read(frame, 0.02) == ReadStatus::kOk) {
      EXPECT_NEAR(grey_of(frame), RtpSender::grey_of(frames++), kGreyTolerance);
    }
  }
  EXPECT_GT(overtaken, 5);
  EXPECT_EQ(source->counters().damaged, 0);
}

// However long before it the first ones came: an encoder may send each slice as soon as it is made.
TEST(RtpSourceSlices, LetAPictureBeStampedOnTheArrivalOfItsLastPacket) {
  constexpr int kSmallPacket = 40;  // bytes: several for each picture
  const int port = test::udp_port_pair();
  const auto source = open_rtp(options_for(port, Codec::kH264));
  listen(*source, port);
  RtpRelay relay(port);
  RtpSender sender(Codec::kH264, relay.port(), 1, kSmallPacket);
  Frame frame;
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(next(*source, sender, relay, frame)) << source->error();
  }
  while (frame.stamp.frame + 1 < sender.sent()) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  }
  for (int i = 0; i < 5; ++i) {
    sender.send();
    RtpRelay::Packet last;
    relay.forward([&last](RtpRelay::Packets& packets) {
      ASSERT_GE(packets.size(), 2U);
      last = packets.back();
      packets.pop_back();
    });
    ASSERT_EQ(source->read(frame, 0.05), ReadStatus::kTimeout);
    const double before_the_last_s = monotonic_now_s();
    relay.forward([&last](RtpRelay::Packets& packets) { packets = {last}; });
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    EXPECT_EQ(frame.stamp.frame + 1, sender.sent());
    EXPECT_GE(frame.stamp.receive_time_s, before_the_last_s);
  }
}

TEST_P(RtpSourceWith, BeginsAtAKeyFrame) {
  RtpSender sender(GetParam(), port_);
  for (int i = 0; i < 3; ++i) {
    sender.send();
  }
  const auto source = open_rtp(options_);
  listen(*source, port_);
  Frame frame;
  ASSERT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
  const int number = GetParam() == Codec::kMjpeg ? 3 : 10;
  EXPECT_NEAR(grey_of(frame), RtpSender::grey_of(number), kGreyTolerance);
  EXPECT_EQ(frame.stamp.frame, 0);
  EXPECT_EQ(source->counters().damaged, 0);
}

// Those whose decoders notice data that is cut off: that of H.265 makes up the rest.
class RtpSourceCutOff : public RtpSourceWith {};

INSTANTIATE_TEST_SUITE_P(Codecs, RtpSourceCutOff, ::testing::Values(Codec::kMjpeg, Codec::kH264),
                         ::testing::PrintToStringParamName());

TEST_P(RtpSourceCutOff, SkipsAndCountsADamagedPicture) {
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpSender sender(GetParam(), port_);
  Frame frame;
  ASSERT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
  const FrameStamp first = frame.stamp;
  const std::int64_t damaged = sender.sent();
  sender.send(GetParam() == Codec::kMjpeg ? 0.9 : 0.6);  // JPEG: within the picture, not its header
  std::set<std::int64_t> numbers;
  for (int i = 0; i < 25; ++i) {
    ASSERT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
    numbers.insert(std::llround(number_of(frame, first)));
  }
  EXPECT_EQ(numbers.count(damaged), 0U);
  EXPECT_GE(source->counters().damaged, 1);
  EXPECT_EQ(frame.stamp.frame, 25);
}

TEST_P(RtpSourceWith, DropsWhatASlowReaderLeavesAndGoesOnAtAKeyFrame) {
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpSender sender(GetParam(), port_);
  Frame frame;
  ASSERT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
  const FrameStamp first = frame.stamp;
  ASSERT_TRUE(eventually([&] {
    sender.send();
    return source->counters().dropped > 0;
  }));
  std::int64_t last = -1;
  for (int i = 1; i <= 60; ++i) {
    ASSERT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
    EXPECT_EQ(frame.stamp.frame, i);
    const std::int64_t number = std::llround(number_of(frame, first));
    EXPECT_GT(number, last);
    EXPECT_NEAR(grey_of(frame), RtpSender::grey_of(number), kGreyTolerance);
    last = number;
  }
}

// What comes beside a camera's pictures, in the same channel.
struct Foreign {
  const char* name;
  int payload_type;      // added to the pictures' own
  bool other_source;     // SSRC
  std::uint16_t begins;  // its numbering
  bool marked;
};

void PrintTo(const Foreign& foreign, std::ostream* out) { *out << foreign.name; }

class RtpSourceBeside : public ::testing::TestWithParam<std::tuple<Codec, Foreign>> {
 protected:
  // Bears the picture's own time stamp.
  RtpRelay::Packet foreign_to(RtpRelay::Packet packet) {
    const Foreign& kind = std::get<Foreign>(GetParam());
    const int own_type = packet[1] & 0x7F;
    packet[1] =
        static_cast<std::uint8_t>((own_type + kind.payload_type) % 128 | (kind.marked ? 0x80 : 0));
    packet[2] = static_cast<std::uint8_t>(number_ >> 8U);
    packet[3] = static_cast<std::uint8_t>(number_);
    ++number_;
    if (kind.other_source) packet[11] = static_cast<std::uint8_t>(packet[11] ^ 0x55U);
    packet.resize(40, 0x55);
    return packet;
  }

 private:
  std::uint16_t number_ = std::get<Foreign>(GetParam()).begins;
};

INSTANTIATE_TEST_SUITE_P(
    Streams, RtpSourceBeside,
    ::testing::Combine(::testing::Values(Codec::kMjpeg, Codec::kH264, Codec::kH265),
                       ::testing::Values(Foreign{"Metadata", 11, false, 7, true},
                                         Foreign{"ItsOwnSource", 1, true, 65'530, false},
                                         Foreign{"ASecondSender", 0, true, 17, false})),
    [](const auto& which) {
      return ::testing::PrintToString(std::get<Codec>(which.param)) +
             std::get<Foreign>(which.param).name;
    });

TEST_P(RtpSourceBeside, ForeignPacketsEveryPictureComesWhole) {
  const Codec codec = std::get<Codec>(GetParam());
  const int port = test::udp_port_pair();
  const auto source = open_rtp(options_for(port, codec));
  listen(*source, port);
  RtpRelay relay(port);
  RtpSender sender(codec, relay.port(), 1, codec == Codec::kMjpeg ? 1200 : 100);
  for (int frames = 0; frames < 30;) {
    ASSERT_LT(sender.sent(), 100) << "they come as fast as they are sent";
    sender.send();
    relay.forward([&](RtpRelay::Packets& packets) {
      RtpRelay::Packets all;
      for (const RtpRelay::Packet& packet : packets) {
        all.push_back(packet);
        all.push_back(foreign_to(packet));
      }
      packets = all;
    });
    Frame frame;
    while (source->read(frame, 0.02) == ReadStatus::kOk) {
      EXPECT_NEAR(grey_of(frame), RtpSender::grey_of(frames++), kGreyTolerance);
    }
  }
  EXPECT_EQ(source->counters().damaged, 0);
  EXPECT_GE(source->counters().foreign_packets, 29);
  EXPECT_THAT(source->remark(),
              HasSubstr("come between those of the video; the session did not announce"));
  EXPECT_EQ(source->remark(), "") << "said once";
}

TEST_P(RtpSourceWith, SaysWhichTypeComesInPlaceOfTheOneAgreedUpon) {
  options_.timeout_s = 0.3;
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpRelay relay(port_);
  RtpSender sender(GetParam(), relay.port());
  ReadStatus status = ReadStatus::kTimeout;
  while (status == ReadStatus::kTimeout) {
    sender.send();
    relay.forward([](RtpRelay::Packets& packets) {
      for (RtpRelay::Packet& packet : packets) {
        packet[1] = static_cast<std::uint8_t>(101 | (packet[1] & 0x80));
      }
    });
    Frame frame;
    status = source->read(frame, 0.02);
  }
  ASSERT_EQ(status, ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(),
              HasSubstr(GetParam() == Codec::kMjpeg ? "payload type 101 in place of 26"
                                                    : "payload type 101 in place of 96"));
}

// What becomes of the stamps of a sender whose time stamps are changed on their way.
class RtpSourceStamps : public RtpSourceWith {
 protected:
  // Plays so many pictures; in each, `ticks_off` is added to the time stamp.
  void play(int pictures, const std::function<std::uint32_t(std::int64_t)>& ticks_off,
            const std::function<void(const Frame&)>& look) {
    const auto source = open_rtp(options_);
    listen(*source, port_);
    RtpRelay relay(port_);
    relay.begin_at(400'000'000);
    RtpSender sender(GetParam(), relay.port());
    for (int frames = 0; frames < pictures;) {
      ASSERT_LT(sender.sent(), 2 * pictures);
      const std::uint32_t off = ticks_off(sender.sent());
      sender.send();
      relay.forward([off](RtpRelay::Packets& packets) {
        for (RtpRelay::Packet& packet : packets) {
          std::uint32_t ticks = 0;
          for (std::size_t i = 4; i < 8; ++i) ticks = ticks << 8U | packet[i];
          ticks += off;
          for (std::size_t i = 0; i < 4; ++i) {
            packet[4 + i] = static_cast<std::uint8_t>(ticks >> (24 - 8 * i));
          }
        }
      });
      Frame frame;
      for (auto status = ReadStatus::kOk; status == ReadStatus::kOk;) {
        status = source->read(frame, 0.02);
        ASSERT_NE(status, ReadStatus::kDisconnected) << source->error();
        if (status != ReadStatus::kOk) break;
        EXPECT_NEAR(grey_of(frame), RtpSender::grey_of(frames++), kGreyTolerance);
        look(frame);
      }
    }
    counters_ = source->counters();
    remark_ = source->remark();
  }
  FrameSourceCounters counters_;
  std::string remark_;
};

INSTANTIATE_TEST_SUITE_P(Codecs, RtpSourceStamps,
                         ::testing::Values(Codec::kMjpeg, Codec::kH264, Codec::kH265),
                         ::testing::PrintToStringParamName());

constexpr std::uint32_t kHour = 3600U * 90'000U;

TEST_P(RtpSourceStamps, ThatCannotBeTrueAreLeftOutPictureByPicture) {
  const std::vector<std::uint32_t> wrong = {2 * kHour,   0U - 2 * kHour, 0U - 10 * 90'000U,
                                            0x8000'0000, 7 * kHour,      0U - 400'000'000U,
                                            5 * 90'000U, 1'700'000'000U, 2'900'000'000U};
  const auto is_bad = [&](std::int64_t n) {
    // The last two in a row.
    return (n % 6 == 5 && n / 6 < 8) || n == 48;
  };
  FrameStamp first;
  play(
      60,
      [&](std::int64_t n) {
        return is_bad(n) ? wrong[n == 48 ? 8 : static_cast<std::size_t>(n / 6)] : 0;
      },
      [&](const Frame& frame) {
        const std::int64_t n = frame.stamp.frame;
        if (n == 0) first = frame.stamp;
        EXPECT_EQ(frame.stamp.restarted, n == 0) << n;
        ASSERT_EQ(frame.stamp.sender_time_s.has_value(), !is_bad(n)) << n;
        if (frame.stamp.sender_time_s) {
          EXPECT_NEAR(number_of(frame, first), static_cast<double>(n), 1e-3) << n;
        }
      });
  EXPECT_EQ(counters_.unstamped, 9);
  EXPECT_EQ(counters_.damaged, 0);
  EXPECT_THAT(remark_, HasSubstr("a picture's time stamp cannot be true: it is +7.2e+03 s off"));
}

TEST_P(RtpSourceStamps, OfAClockThatWasSetAreBelievedOnceSomeAgree) {
  for (const std::uint32_t step : {3 * kHour, 0U - 90'000U}) {
    std::optional<double> before_s;
    play(
        30, [step](std::int64_t n) { return n >= 12 ? step : 0; },
        [&](const Frame& frame) {
          const std::int64_t n = frame.stamp.frame;
          EXPECT_EQ(frame.stamp.sender_time_s.has_value(), n != 12 && n != 13) << n;
          EXPECT_EQ(frame.stamp.restarted, n == 0 || n == 14) << n;
          if (n > 14 && frame.stamp.sender_time_s && before_s) {
            EXPECT_NEAR(*frame.stamp.sender_time_s - *before_s, RtpSender::kPeriod_s, 1e-4);
          }
          before_s = frame.stamp.sender_time_s;
        });
  }
}

TEST_P(RtpSourceWith, BeginsAnewWithAnotherSender) {
  options_.timeout_s = 1;
  const auto source = open_rtp(options_);
  listen(*source, port_);
  Frame frame;
  {
    RtpSender sender(GetParam(), port_);
    for (int i = 0; i < 5; ++i) {
      ASSERT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
    }
  }
  RtpSender sender(GetParam(), port_, 1000);
  ReadStatus status = ReadStatus::kOk;
  while (status == ReadStatus::kOk) {
    status = next(*source, sender, frame);
  }
  ASSERT_EQ(status, ReadStatus::kDisconnected);
  const std::int64_t frames = frame.stamp.frame;
  ASSERT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
  EXPECT_TRUE(frame.stamp.restarted);
  EXPECT_EQ(frame.stamp.frame, frames + 1);
}

TEST_P(RtpSourceWith, ReportsThatNothingComesAnyMore) {
  options_.timeout_s = 0.1;
  const auto source = open_rtp(options_);
  listen(*source, port_);
  Frame frame;
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_EQ(source->error(),
            "rtp://0.0.0.0:" + std::to_string(port_) + "/: nothing received for 0.1 s");
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
}

TEST_P(RtpSourceWith, ReportsThatPacketsOfAnotherFormatComeOnly) {
  options_.timeout_s = 0.3;
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpSender sender(GetParam() == Codec::kMjpeg ? Codec::kH264 : Codec::kMjpeg, port_);
  Frame frame;
  ASSERT_EQ(next(*source, sender, frame), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), AllOf(HasSubstr("packets came, but no whole picture for 0.3 s"),
                                     HasSubstr("is what comes " + options_.format + "?")));
}

TEST_P(RtpSourceWith, ReportsThatOnlyReportsComeAnyMore) {
  options_.timeout_s = 1;
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpRelay relay(port_);
  RtpSender sender(GetParam(), port_);
  Frame frame;
  ASSERT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
  EXPECT_TRUE(eventually([&] {
    relay.report(0, 90'000);
    return source->read(frame, 0.02) == ReadStatus::kDisconnected;
  }));
  EXPECT_THAT(source->error(), HasSubstr(": packets came, but no whole picture for 1 s"));
  EXPECT_THAT(source->error(), Not(HasSubstr("?"))) << "the format was right";
}

TEST_P(RtpSourceOfPredicted, WaitsForAKeyFrameForAsLongAsItTakesAndSaysSo) {
  options_.timeout_s = 1;
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpRelay relay(port_);
  RtpSender sender(GetParam(), relay.port());
  const auto pass = [&](bool with_key_frames) {
    const bool key = sender.sent() % 10 == 0;
    sender.send();
    relay.forward([&](RtpRelay::Packets& packets) {
      if (key && !with_key_frames) packets.clear();
    });
  };
  Frame frame;
  ASSERT_TRUE(eventually([&] {
    pass(false);
    EXPECT_EQ(source->read(frame, 0.02), ReadStatus::kTimeout) << source->error();
    return !source->waiting().empty();
  }));
  EXPECT_EQ(source->waiting(), source->name() +
                                   ": waiting for a key frame since 3 s; set a shorter interval of "
                                   "key frames (GOP) in the camera");
  EXPECT_TRUE(eventually([&] {
    pass(true);
    return source->read(frame, 0.02) == ReadStatus::kOk;
  }));
  EXPECT_EQ(source->waiting(), "");
}

// What happens to the packets of picture `number` on the way.
using OnTheWay = std::function<void(std::int64_t number, RtpRelay::Packets&)>;

// The numbers of the pictures that come with luma, of `count` that are sent; of each the grey is right.
std::vector<std::int64_t> seen(FrameSource& source, RtpSender& sender, RtpRelay& relay,
                               std::int64_t count, const OnTheWay& change,
                               std::vector<std::int64_t>* unseen) {
  std::vector<std::int64_t> numbers;
  std::optional<FrameStamp> first;
  while (sender.sent() < count) {
    const std::int64_t number = sender.sent();
    sender.send();
    relay.forward([&](RtpRelay::Packets& packets) { change(number, packets); });
    Frame frame;
    // No later turn takes what comes late of the last.
    while (source.read(frame, sender.sent() < count ? 0.05 : 0.5) == ReadStatus::kOk) {
      if (!first) first = frame.stamp;
      const std::int64_t came = std::llround(number_of(frame, *first));
      (frame.luma == nullptr ? *unseen : numbers).push_back(came);
      if (frame.luma != nullptr) {
        EXPECT_NEAR(grey_of(frame), RtpSender::grey_of(came), kGreyTolerance) << came;
      }
    }
  }
  return numbers;
}

TEST_P(RtpSourceOfPredicted, ShowNoPictureThatIsCodedFromALostOne) {
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpRelay relay(port_);
  RtpSender sender(GetParam(), relay.port());
  std::vector<std::int64_t> unseen;
  const auto numbers = seen(
      *source, sender, relay, 26,
      [](std::int64_t number, RtpRelay::Packets& packets) {
        if (number == 14) packets.clear();
      },
      &unseen);
  EXPECT_THAT(numbers,
              ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 20, 21, 22, 23, 24, 25));
  EXPECT_THAT(unseen, ElementsAre(15, 16, 17, 18, 19)) << "their stamps are right";
  EXPECT_EQ(source->counters().damaged, 0) << "none that came";
}

TEST_P(RtpSourceOfPredicted, ShowNoPictureThatLostAPacketAndNoneThatIsCodedFromIt) {
  constexpr int kSmallPacket = 40;  // bytes: several for each key frame
  for (const int from_the_end : {1, 2}) {
    const int port = test::udp_port_pair();
    const auto source = open_rtp(options_for(port, GetParam()));
    listen(*source, port);
    RtpRelay relay(port);
    RtpSender sender(GetParam(), relay.port(), 1, kSmallPacket);
    std::vector<std::int64_t> unseen;
    const auto numbers = seen(
        *source, sender, relay, 24,
        [from_the_end](std::int64_t number, RtpRelay::Packets& packets) {
          if (number != 10) return;
          ASSERT_GE(packets.size(), 4U);
          packets.erase(packets.end() - from_the_end);
        },
        &unseen);
    EXPECT_THAT(numbers, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 20, 21, 22, 23)) << from_the_end;
    EXPECT_THAT(unseen, ElementsAre(11, 12, 13, 14, 15, 16, 17, 18, 19)) << from_the_end;
    EXPECT_EQ(source->counters().damaged, 1) << from_the_end;
  }
}

TEST_P(RtpSourceOfPredicted, GoOnAsManyPicturesAfterARecoveryPointAsItSays) {
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpRelay relay(port_);
  RtpSender sender(GetParam(), relay.port());
  // SEI with the payload "recovery point, right two pictures later".
  const std::string recovery_point = GetParam() == Codec::kH264
                                         ? std::string("\0\0\0\1\x06\x06\x01\x71\x80", 9)
                                         : std::string("\0\0\0\1\x4E\x01\x06\x01\x25\x80", 10);
  std::vector<std::int64_t> with_luma;
  std::vector<std::int64_t> without;
  while (sender.sent() < 10) {
    const std::int64_t number = sender.sent();
    sender.send(1, number == 5 ? recovery_point : "");
    relay.forward([&](RtpRelay::Packets& packets) {
      if (number == 3) packets.clear();
    });
    Frame frame;
    // No later turn takes what comes late of the last.
    while (source->read(frame, sender.sent() < 10 ? 0.05 : 0.5) == ReadStatus::kOk) {
      (frame.luma == nullptr ? without : with_luma).push_back(number);
    }
  }
  EXPECT_THAT(with_luma, ElementsAre(1, 1, 2, 7, 8, 9)) << "the first waits for the second";
  EXPECT_THAT(without, ElementsAre(5, 5, 6)) << "that of 4 waits for the next, behind a loss";
  EXPECT_EQ(source->counters().damaged, 0);
}

TEST_P(RtpSourceWith, DeliversStampsAndSizeWithoutDecoding) {
  options_.decode = false;
  const auto source = open_rtp(options_);
  listen(*source, port_);
  RtpSender sender(GetParam(), port_);
  FrameStamp first;
  for (int i = 0; i < 20; ++i) {
    Frame frame;
    ASSERT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
    first = i == 0 ? frame.stamp : first;
    EXPECT_EQ(frame.luma, nullptr);
    EXPECT_FALSE(frame.decode_s);
    EXPECT_EQ(frame.width, RtpSender::kWidth);
    EXPECT_EQ(frame.height, RtpSender::kHeight);
    EXPECT_NEAR(number_of(frame, first), i, 1e-3);
  }
}

TEST_P(RtpSourceWith, KeepsAPictureAliveBeyondItself) {
  auto source = open_rtp(options_);
  listen(*source, port_);
  RtpSender sender(GetParam(), port_);
  std::vector<Frame> frames(10);
  for (Frame& frame : frames) {
    ASSERT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
  }
  source.reset();
  for (int i = 0; i < 10; ++i) {
    EXPECT_NEAR(grey_of(frames[static_cast<std::size_t>(i)]), RtpSender::grey_of(i),
                kGreyTolerance);
  }
}

// Compares a recording with the greys that its frames must have.
void expect_recording(const std::string& directory, const std::vector<double>& greys,
                      std::size_t may_be_missing) {
  RecordingFrameSourceOptions options;
  options.directory = directory;
  const auto recording = open_recorded_frames(options);
  Frame frame;
  std::size_t i = 0;
  while (recording->read(frame, 0) == ReadStatus::kOk) {
    ASSERT_LT(i, greys.size());
    EXPECT_EQ(frame.stamp.frame, static_cast<std::int64_t>(i));
    EXPECT_NEAR(grey_of(frame), greys[i], kGreyTolerance);
    ++i;
  }
  ASSERT_EQ(recording->read(frame, 0), ReadStatus::kEnd) << recording->error();
  EXPECT_GE(i + may_be_missing, greys.size());
  EXPECT_EQ(recording->missing_frames(), static_cast<std::int64_t>(greys.size() - i));
  EXPECT_EQ(recording->damaged_frames(), 0);
}

class RtpSourceCopy : public RtpSourceWith {
 protected:
  // A source whose frames can be stored.
  std::unique_ptr<FrameSource> open() const {
    std::unique_ptr<FrameSource> source = open_rtp(options_);
    EXPECT_TRUE(source->keep_stream(true));
    return source;
  }

  TemporaryDirectory directory_;
  std::string error_;
};

INSTANTIATE_TEST_SUITE_P(Codecs, RtpSourceCopy,
                         ::testing::Values(Codec::kMjpeg, Codec::kH264, Codec::kH265),
                         ::testing::PrintToStringParamName());

// The camera's pictures from number `begin` on are kept; number 14 is lost. Returns the greys that
// the recording must have.
std::vector<double> greys_with_a_loss(FrameSource& source, int port, Codec codec,
                                      std::int64_t begin, RecordingCopy* copy) {
  RtpRelay relay(port);
  RtpSender sender(codec, relay.port());
  std::vector<double> greys;
  std::optional<FrameStamp> first;
  while (sender.sent() < 30) {
    const bool lost = sender.sent() == 14;
    if (sender.sent() == begin) EXPECT_TRUE(source.keep_stream(true));
    sender.send();
    relay.forward([&](RtpRelay::Packets& packets) {
      if (lost) packets.clear();
    });
    Frame frame;
    while (source.read(frame, sender.sent() < 30 ? 0.05 : 0.5) == ReadStatus::kOk) {
      if (!first) first = frame.stamp;
      std::string error;
      EXPECT_TRUE(copy->add(frame, &error)) << error;
      if (static_cast<std::int64_t>(greys.size()) < copy->frames())
        greys.push_back(RtpSender::grey_of(std::llround(number_of(frame, *first))));
    }
  }
  return greys;
}

TEST_P(RtpSourceCopy, HoldsOnlyWhatCanBeDecoded) {
  options_.decode = false;
  std::vector<double> greys;
  {
    RecordingCopy copy(directory_.path());
    const auto source = open_rtp(options_);
    listen(*source, port_);
    greys = greys_with_a_loss(*source, port_, GetParam(), 0, &copy);
    EXPECT_EQ(copy.left_out() > 0, GetParam() != Codec::kMjpeg);
  }
  EXPECT_EQ(greys.size(), GetParam() == Codec::kMjpeg ? 29U : 24U);
  expect_recording(directory_.path(), greys, 0);
}

// As `run` does when a recording is asked for.
TEST_P(RtpSourceCopy, BeginsInAStreamThatIsBeingDecodedAtAPictureWhereDecodingCanBegin) {
  std::vector<double> greys;
  {
    RecordingCopy copy(directory_.path());
    const auto source = open_rtp(options_);
    listen(*source, port_);
    greys = greys_with_a_loss(*source, port_, GetParam(), 7, &copy);
  }
  // Some pictures may come a read later. H.264 and H.265: 10 to 13, and from 20 on.
  EXPECT_GE(greys.size(), GetParam() == Codec::kMjpeg ? 20U : 13U);
  EXPECT_LE(greys.size(), GetParam() == Codec::kMjpeg ? 23U : 14U);
  expect_recording(directory_.path(), greys, 0);
}

TEST_P(RtpSourceCopy, HoldsTheFramesDeliveredAlsoAfterAKill) {
  options_.decode = false;
  std::vector<double> greys;
  {
    RecordingCopy copy(directory_.path());
    const auto source = open();
    listen(*source, port_);
    RtpSender sender(GetParam(), port_);
    for (int i = 0; i < 40; ++i) {
      Frame frame;
      ASSERT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
      ASSERT_TRUE(copy.add(frame, &error_)) << error_;
      greys.push_back(RtpSender::grey_of(i));
    }
    expect_recording(directory_.path(), greys, 31);  // the open file: up to a second may be missing
  }
  expect_recording(directory_.path(), greys, 0);
}

TEST_P(RtpSourceCopy, GoesOnOverAReconnection) {
  options_.timeout_s = 1;
  std::vector<double> greys;
  {
    RecordingCopy copy(directory_.path());
    const auto source = open();
    listen(*source, port_);
    auto sender = std::make_unique<RtpSender>(GetParam(), port_);
    int connections = 0;
    while (greys.size() < 40) {
      Frame frame;
      const ReadStatus status = next(*source, *sender, frame);
      if (status == ReadStatus::kOk) {
        EXPECT_EQ(copy.fault_of(frame), "");
        ASSERT_TRUE(copy.add(frame, &error_)) << error_;
        greys.push_back(grey_of(frame));
        connections += frame.stamp.restarted ? 1 : 0;
      } else {
        ASSERT_EQ(status, ReadStatus::kDisconnected) << source->error();
      }
      if (greys.size() == 20) {
        sender = std::make_unique<RtpSender>(GetParam(), port_, 1000 * (connections + 1));
      }
    }
    EXPECT_GE(connections, 2);
    EXPECT_EQ(copy.left_out(), 0);
    EXPECT_GT(copy.length_s(), 0);
  }
  expect_recording(directory_.path(), greys, 0);
}

// A reader of the file would decode what needs the lost pictures.
TEST_P(RtpSourceCopy, LeavesOutWhatNeedsAPictureThatTheCallerLost) {
  options_.decode = false;
  RecordingCopy copy(directory_.path());
  const auto source = open();
  listen(*source, port_);
  RtpSender sender(GetParam(), port_);
  for (int i = 0; i < 15; ++i) {
    Frame frame;
    ASSERT_EQ(next(*source, sender, frame), ReadStatus::kOk) << source->error();
    if (i == 5) continue;
    copy.go_on_after_loss(i == 6 ? 1 : 0);
    ASSERT_TRUE(copy.add(frame, &error_)) << error_;
  }
  // 5 is lost, 6 to 9 need it.
  EXPECT_EQ(copy.frames(), GetParam() == Codec::kMjpeg ? 14 : 10);
  EXPECT_EQ(copy.left_out(), GetParam() == Codec::kMjpeg ? 1 : 5);
}

TEST(RtpSourceOptions, ThatCannotWorkFailAtOnceAndShowNoPassword) {
  const TemporaryDirectory directory;
  directory.write("text.sdp", "this describes nothing");
  const struct {
    std::string url;
    std::string format;
    std::string says;
  } cases[] = {
      {"rtsp://user:se@cret@camera/x", "MJPG", "rtsp://...: not a URL"},
      {"http://user:secret@camera/x", "MJPG", "http://camera/x: not a video stream"},
      {"rtsps://camera/x", "UDP", "rtsps://camera/x: over TLS the pictures come within the"},
      {"rtp://@:5004", "HEVC", "unknown format 'HEVC'; plain RTP needs MJPG, H264 or H265"},
      {"rtp://239.1.1.1", "MJPG", "no port"},
      {directory.path() + "/none.sdp", "", "none.sdp: no usable SDP description: No such file"},
      {directory.path() + "/text.sdp", "", "text.sdp: there is no video in this stream"},
      {"", "", "no usable SDP description"},
  };
  for (const auto& which : cases) {
    RtpSourceOptions options;
    options.url = which.url;
    options.format = which.format;
    if (which.format == "UDP") options.transport = RtpSourceOptions::Transport::kUdp;
    const auto source = open_rtp(options);
    Frame frame;
    EXPECT_EQ(read_until(*source, frame, ReadStatus::kFailed), ReadStatus::kFailed) << which.url;
    EXPECT_THAT(source->error(), HasSubstr(which.says));
    EXPECT_THAT(source->error() + source->name(), Not(HasSubstr("cret")));
    EXPECT_EQ(source->read(frame, 0), ReadStatus::kFailed);
  }
}

TEST(RtpSourceReconnection, LeaksNoFileDescriptor) {
  RtpSourceOptions options = options_for(test::udp_port_pair(), Codec::kMjpeg);
  options.timeout_s = 0.001;
  const auto source = open_rtp(options);
  Frame frame;
  const auto open_files = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"),
                         std::filesystem::directory_iterator());
  };
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  const auto before = open_files();
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  }
  EXPECT_LE(open_files(),
            before + 3);  // a connection may be open: two sockets and a resolver's file
}

TEST(RtpSourceStop, EndsAReadThatWaitsForPackets) {
  const int port = test::udp_port_pair();
  RtpSourceOptions options = options_for(port, Codec::kMjpeg);
  options.timeout_s = kNever_s;
  const auto source = open_rtp(options);
  std::thread stopper([&] {
    eventually([&] { return rtp_port_taken(port); });
    source->stop();
  });
  Frame frame;
  EXPECT_EQ(source->read(frame, kNever_s), ReadStatus::kStopped);
  stopper.join();
}

TEST(RtpSourceStop, EndsAPause) {
  RtpSourceOptions options = options_for(test::udp_port_pair(), Codec::kMjpeg);
  options.timeout_s = 0.001;
  options.max_backoff_s = kNever_s;
  const auto source = open_rtp(options);
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  std::thread stopper([&] { source->stop(); });
  ReadStatus status = ReadStatus::kDisconnected;
  while (status == ReadStatus::kDisconnected) {
    status = source->read(frame, kNever_s);
  }
  EXPECT_EQ(status, ReadStatus::kStopped);
  stopper.join();
}

}  // namespace
}  // namespace alidade
