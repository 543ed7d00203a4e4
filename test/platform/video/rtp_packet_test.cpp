// Headers of RTP packets, and what they say about the ends of pictures.

#include "platform/video/rtp_packet.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "platform/video/picture_ends.h"

namespace alidade {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::optional<RtpHeader> parse(const Bytes& bytes) {
  return parse_rtp_header(bytes.data(), bytes.size());
}

void append(Bytes* to, const Bytes& bytes) { to->insert(to->end(), bytes.begin(), bytes.end()); }

// Version 2, marker, payload type 96, sequence 0x1234, timestamp 0x89ABCDEF.
const Bytes kPlain = {0x80, 0xE0, 0x12, 0x34, 0x89, 0xAB, 0xCD, 0xEF,
                      1,    2,    3,    4,    'd',  'a',  't',  'a'};

// With two contributing sources and the extension at 2023-11-14 22:13:20.25 UTC.
Bytes with_extension() {
  Bytes bytes(kPlain.begin(), kPlain.begin() + 12);
  bytes[0] = 0x92;
  append(&bytes, {0, 0, 0, 7, 0, 0, 0, 8, 0xAB, 0xAC, 0, 3});
  append(&bytes, {0xE8, 0xFE, 0x6F, 0x80, 0x40, 0, 0, 0, 0xA0, 5, 0, 0});
  append(&bytes, {'d', 'a', 't', 'a'});
  return bytes;
}

TEST(RtpPacket, TellsMarkerSequenceAndTimestamp) {
  const auto header = parse(kPlain);
  ASSERT_TRUE(header);
  EXPECT_TRUE(header->marker);
  EXPECT_EQ(header->sequence, 0x1234);
  EXPECT_EQ(header->timestamp, 0x89ABCDEFU);
  EXPECT_EQ(header->capture_utc_s, std::nullopt);
  Bytes other = kPlain;
  other[1] = 26;  // JPEG, not the last packet
  EXPECT_FALSE(parse(other)->marker);
}

TEST(RtpPacket, ReadsTheCaptureTimeBehindContributingSources) {
  const auto header = parse(with_extension());
  ASSERT_TRUE(header);
  ASSERT_TRUE(header->capture_utc_s);
  EXPECT_EQ(*header->capture_utc_s, 1'700'000'000.25);
}

TEST(RtpPacket, CountsOnWhenNtpsSecondsWrapIn2036) {
  Bytes bytes = with_extension();
  for (std::size_t i = 24; i < 32; ++i) bytes[i] = i == 27 ? 1 : 0;
  EXPECT_EQ(parse(bytes)->capture_utc_s, 4'294'967'296.0 - 2'208'988'800.0 + 1);
}

TEST(RtpPacket, GivesNoTimeThatTheSenderDoesNotSay) {
  Bytes unknown = with_extension();
  for (std::size_t i = 24; i < 32; ++i) unknown[i] = 0;
  EXPECT_EQ(parse(unknown)->capture_utc_s, std::nullopt);
  Bytes other = with_extension();
  other[20] = 0xBE;  // another extension
  EXPECT_EQ(parse(other)->capture_utc_s, std::nullopt);
  Bytes shorter = with_extension();
  shorter[23] = 2;
  EXPECT_EQ(parse(shorter)->capture_utc_s, std::nullopt);
}

TEST(RtpPacket, TakesNoTimeFromAnExtensionThatIsCutOff) {
  const Bytes whole = with_extension();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto header = parse_rtp_header(whole.data(), size);
    EXPECT_EQ(header.has_value(), size >= 12) << size;
    if (header) {
      EXPECT_EQ(header->capture_utc_s.has_value(), size >= 36) << size;
    }
  }
}

TEST(RtpPacket, IsNotRtcpNorAnotherVersion) {
  for (const int type : {192, 200, 201, 202, 203, 204, 223}) {
    Bytes rtcp = kPlain;
    rtcp[1] = static_cast<std::uint8_t>(type);
    EXPECT_FALSE(parse(rtcp)) << type;
  }
  Bytes stun = kPlain;
  stun[0] = 0;
  EXPECT_FALSE(parse(stun));
  EXPECT_FALSE(parse({}));
}

// A sender report that says NTP 1.0 at this timestamp, and a description behind it.
Bytes report(std::uint8_t high, std::uint8_t low) {
  return {0x80, 200, 0, 6, 0, 0, 0, 7, 0,    0,   0, 1, 0, 0, 0, 0, high, 0, 0, low,
          0,    0,   0, 1, 0, 0, 0, 1, 0x81, 202, 0, 2, 0, 0, 0, 7, 1,    0, 0, 0};
}

Bytes at_timestamp(std::uint8_t each_byte) {
  Bytes packet = kPlain;
  for (std::size_t i = 4; i < 8; ++i) packet[i] = each_byte;
  return packet;
}

TEST(BearableTimestamps, AreMovedByASecondWhereTheFirstIsZero) {
  BearableTimestamps timestamps;
  Bytes packet = at_timestamp(0);
  const Bytes first = packet;
  timestamps.move(packet.data(), packet.size());
  EXPECT_EQ(parse(packet)->timestamp, 90'000U);
  EXPECT_EQ(Bytes(packet.begin() + 8, packet.end()), Bytes(first.begin() + 8, first.end()));
  Bytes next = kPlain;
  timestamps.move(next.data(), next.size());
  EXPECT_EQ(parse(next)->timestamp, 0x89ABCDEFU + 90'000U);
  Bytes before_wrap = at_timestamp(0xFF);
  timestamps.move(before_wrap.data(), before_wrap.size());
  EXPECT_EQ(parse(before_wrap)->timestamp, 89'999U);
  Bytes rtcp = report(0, 1);
  Bytes moved = rtcp;
  moved[17] = 0x01;  // 90'001
  moved[18] = 0x5F;
  moved[19] = 0x91;
  timestamps.move(rtcp.data(), rtcp.size());
  EXPECT_EQ(rtcp, moved);
}

TEST(BearableTimestamps, CountFromAReportThatComesBeforeThePictures) {
  BearableTimestamps timestamps;
  Bytes rtcp = report(0, 0);
  timestamps.move(rtcp.data(), rtcp.size());
  EXPECT_NE(rtcp, report(0, 0));
  Bytes packet = kPlain;
  timestamps.move(packet.data(), packet.size());
  EXPECT_EQ(parse(packet)->timestamp, 0x89ABCDEFU + 90'000U);
}

TEST(BearableTimestamps, AreLeftAloneWhereTheyBeginElsewhere) {
  BearableTimestamps timestamps;
  Bytes packet = kPlain;
  timestamps.move(packet.data(), packet.size());
  EXPECT_EQ(packet, kPlain);
  Bytes rtcp = report(0, 0);
  timestamps.move(rtcp.data(), rtcp.size());
  EXPECT_EQ(rtcp, report(0, 0));
}

TEST(BearableTimestamps, AreNeverTheLargest) {
  BearableTimestamps timestamps;
  for (const int i : {0, 1}) {
    Bytes packet = at_timestamp(0xFF);
    timestamps.move(packet.data(), packet.size());
    EXPECT_EQ(parse(packet)->timestamp, 0xFFFF'FFFEU) << i;
  }
}

TEST(BearableTimestamps, AreNotSoughtInWhatIsCutOffOrOfAnotherKind) {
  for (std::size_t size = 0; size < 20; ++size) {
    BearableTimestamps timestamps;
    Bytes rtcp = report(0, 0);
    timestamps.move(rtcp.data(), size);
    EXPECT_EQ(rtcp, report(0, 0)) << size;
  }
  BearableTimestamps timestamps;
  Bytes receiver = report(0, 0);
  receiver[1] = 201;
  const Bytes before = receiver;
  timestamps.move(receiver.data(), receiver.size());
  EXPECT_EQ(receiver, before);
}

// Packets of pictures, whose pieces come out at once, as libavformat does in order.
class PictureEndsInOrder : public ::testing::Test {
 protected:
  // One packet in, its piece out.
  PictureEnds::Piece pass(std::uint32_t timestamp, bool marker,
                          std::optional<double> utc_s = std::nullopt) {
    in(timestamp, marker, utc_s);
    return out(timestamp);
  }
  void in(std::uint32_t timestamp, bool marker, std::optional<double> utc_s = std::nullopt) {
    RtpHeader header;
    header.marker = marker;
    header.sequence = sequence_++;
    header.timestamp = timestamp;
    header.capture_utc_s = utc_s;
    ends_.packet_in(header);
  }
  // libavformat's stamps are 64 bits, and 700 ticks from the packets'.
  PictureEnds::Piece out(std::uint32_t timestamp) {
    return ends_.piece_out((std::int64_t{5} << 32) + timestamp - 700);
  }
  PictureEnds ends_;
  std::uint16_t sequence_ = 65'533;  // wraps soon
};

TEST_F(PictureEndsInOrder, AreAtTheMarkersOnceOneWasSeen) {
  EXPECT_FALSE(pass(1000, false).last);
  EXPECT_FALSE(pass(1000, true).last) << "its beginning was not seen";
  for (std::uint32_t picture = 2; picture < 40; ++picture) {
    for (int i = 0; i < 4; ++i) EXPECT_FALSE(pass(1000 * picture, false).last);
    EXPECT_TRUE(pass(1000 * picture, true).last);
  }
}

TEST_F(PictureEndsInOrder, AreSeenAcrossTheWrapOfTimestamps) {
  (void)pass(0xFFFF'0000, true);
  EXPECT_TRUE(pass(0xFFFF'FF00, true).last);
  EXPECT_FALSE(pass(0x100, false).last);
  EXPECT_TRUE(pass(0x100, true).last);
}

TEST_F(PictureEndsInOrder, AreUnknownInAPictureThatLostAPacket) {
  (void)pass(1000, true);
  EXPECT_FALSE(pass(2000, false).last);
  ++sequence_;
  EXPECT_FALSE(pass(2000, true).last);
  EXPECT_FALSE(pass(3000, false).last);
  EXPECT_TRUE(pass(3000, true).last) << "the next one is whole again";
}

TEST_F(PictureEndsInOrder, AreUnknownAfterALossOfTheMarker) {
  (void)pass(1000, true);
  EXPECT_FALSE(pass(2000, false).last);
  ++sequence_;
  EXPECT_FALSE(pass(3000, false).last);
  EXPECT_FALSE(pass(3000, true).last) << "the packet lost may have been its first";
  EXPECT_TRUE(pass(4000, true).last);
}

TEST_F(PictureEndsInOrder, AreUnknownAfterAPictureWithoutAMarker) {
  (void)pass(1000, true);
  EXPECT_FALSE(pass(2000, false).last);
  EXPECT_FALSE(pass(3000, true).last) << "this sender's markers are no ends";
  EXPECT_TRUE(pass(4000, true).last);
}

TEST_F(PictureEndsInOrder, WaitForPiecesThatAreHeldBack) {
  (void)pass(1000, true);
  in(2000, false);
  in(2000, true);
  EXPECT_FALSE(out(2000).last);
  EXPECT_TRUE(out(2000).last);
}

TEST_F(PictureEndsInOrder, AreUnknownWhereAPacketGaveNoPiece) {
  (void)pass(1000, true);
  in(2000, false);  // of a kind that libavformat leaves out
  EXPECT_FALSE(pass(2000, true).last);
  EXPECT_TRUE(pass(3000, true).last);
}

TEST_F(PictureEndsInOrder, AreNotBelievedOfASenderWithMarkersWithinPictures) {
  (void)pass(1000, true);
  EXPECT_TRUE(pass(2000, true).last) << "not known yet: parameter sets, say";
  EXPECT_FALSE(pass(2000, true).last);
  EXPECT_FALSE(pass(3000, true).last);
  EXPECT_FALSE(pass(3000, true).last);
}

TEST_F(PictureEndsInOrder, CarryTheCaptureTimeOfAnyPacketOfThePicture) {
  EXPECT_EQ(pass(1000, true, 5.5).capture_utc_s, 5.5);
  EXPECT_EQ(pass(2000, false).capture_utc_s, std::nullopt);
  EXPECT_EQ(pass(2000, false, 6.5).capture_utc_s, 6.5);
  EXPECT_EQ(pass(2000, true).capture_utc_s, 6.5);
  EXPECT_EQ(pass(3000, true).capture_utc_s, std::nullopt);
}

// What was lost of pictures, in the order in which they are asked about.
class PictureLosses : public PictureEndsInOrder {
 protected:
  // Pairs of within and before.
  using Said = std::pair<bool, bool>;
  Said loss_of(std::uint32_t timestamp) {
    const PictureEnds::Loss loss = ends_.loss_of((std::int64_t{5} << 32) + timestamp - 700);
    return {loss.within, loss.before};
  }
  // Two packets and the loss.
  Said picture(std::uint32_t timestamp) {
    (void)pass(timestamp, false);
    (void)pass(timestamp, true);
    return loss_of(timestamp);
  }
};

TEST_F(PictureLosses, AreNoneInOrder) {
  for (std::uint32_t i = 1; i < 40; ++i) EXPECT_EQ(picture(1000 * i), Said(false, false)) << i;
}

TEST_F(PictureLosses, AreWithinWhereAPacketOfThePictureIsMissing) {
  (void)picture(1000);
  (void)pass(2000, false);
  ++sequence_;
  (void)pass(2000, true);
  EXPECT_EQ(loss_of(2000), Said(true, false));
  EXPECT_EQ(picture(3000), Said(false, false)) << "the next came whole";
}

TEST_F(PictureLosses, AreWithinWhereTheLastPacketIsMissing) {
  (void)picture(1000);
  (void)pass(2000, false);
  ++sequence_;
  (void)pass(3000, false);  // shows that 2000 is over
  EXPECT_EQ(loss_of(2000), Said(true, false));
  (void)pass(3000, true);
  EXPECT_EQ(loss_of(3000), Said(false, true));
}

TEST_F(PictureLosses, AreBeforeAPictureWhereOthersAreMissing) {
  (void)picture(1000);
  sequence_ = static_cast<std::uint16_t>(sequence_ + 2);
  EXPECT_EQ(picture(3000), Said(false, true));
  EXPECT_EQ(picture(4000), Said(false, false));
}

TEST_F(PictureLosses, AreNoneWherePacketsOfAnotherKindCameBetween) {
  (void)picture(1000);
  in(1500, false);  // none of these gives a piece
  in(1500, false);
  in(1600, true);
  EXPECT_EQ(picture(2000), Said(false, false));
  in(2500, false);
  ++sequence_;
  EXPECT_EQ(picture(3000), Said(false, true)) << "one of them is lost";
}

TEST_F(PictureLosses, AreNoneOfASenderWithoutMarkers) {
  for (std::uint32_t i = 1; i < 10; ++i) {
    (void)pass(1000 * i, false);
    if (i > 1) {
      EXPECT_EQ(loss_of(1000 * (i - 1)), Said(false, false)) << i;
    }
    (void)pass(1000 * i, false);
  }
}

TEST_F(PictureLosses, AreNoneWherePacketsOvertookAndAllCameOut) {
  (void)picture(1000);
  ++sequence_;
  in(2000, true);
  sequence_ = static_cast<std::uint16_t>(sequence_ - 2);
  in(2000, false);
  (void)out(2000);
  (void)out(2000);
  EXPECT_EQ(loss_of(2000), Said(false, false));
}

TEST_F(PictureLosses, AreWithinWhereAPacketCameTooLateForLibavformat) {
  (void)picture(1000);
  ++sequence_;
  in(2000, true);
  (void)out(2000);
  sequence_ = static_cast<std::uint16_t>(sequence_ - 2);
  in(2000, false);
  EXPECT_EQ(loss_of(2000), Said(true, false));
}

TEST_F(PictureLosses, AreNoneWhereAPacketInOrderGaveNoPiece) {
  (void)picture(1000);
  in(2000, false);
  (void)pass(2000, true);
  EXPECT_EQ(loss_of(2000), Said(false, false));
}

TEST_F(PictureLosses, AreNoneBetweenTheHalvesOfAPictureWithAMarkerInIt) {
  (void)pass(1000, true);
  (void)pass(2000, true);
  EXPECT_EQ(loss_of(2000), Said(false, false)) << "not known yet to be a half";
  (void)pass(2000, true);
  (void)pass(3000, true);
  EXPECT_EQ(loss_of(2000), Said(false, false));
  (void)pass(3000, true);
  (void)pass(4000, true);
  EXPECT_EQ(loss_of(3000), Said(false, false));
}

TEST(PictureEnds, KnowNothingOfPiecesWithoutPackets) {
  PictureEnds ends;
  EXPECT_FALSE(ends.piece_out(0).last);
  EXPECT_FALSE(ends.piece_out(-1).last);
}

}  // namespace
}  // namespace alidade
