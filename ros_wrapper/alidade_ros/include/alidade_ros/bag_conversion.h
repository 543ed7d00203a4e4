#pragma once
// Converts rosbags (Image or CompressedImage, and JointState) to recordings and back.
//
// Angles: a joint position turns about REP-103's axes (pan +z up, tilt +y left), Alidade's angle
// the other way. Sign -1 therefore converts exactly; sign +1 is for drivers that count otherwise.
// Times: see Stamps and docs/derivations.md. Not kept: sequence, restarted, sender_utc_s,
// earliest_time_s, and files other than the tables and pictures. Errors are thrown as
// std::runtime_error with one line.

#include <sensor_msgs/Image.h>

#include <cstdint>
#include <string>
#include <vector>

namespace alidade_ros {

// Times from a bag. kHeader: receive_time_s = header stamp; for drivers that stamp frames and
// angles by one clock, as ROS asks for. kBag: receive_time_s = time in the bag, and the header
// stamp is sender_time_s (frames) or device_time_s (samples); for headers stamped by clocks of
// their own, which the clock filter maps.
enum class Stamps { kHeader, kBag };

struct BagOptions {
  std::string image_topic;  // empty: the only one in the bag
  std::string joint_topic;  // the same
  std::string pan_joint;    // empty: the only one whose name contains "pan"
  std::string tilt_joint;   // the same, "tilt"
  int pan_sign = -1;        // Alidade's angle = sign * joint position
  int tilt_sign = -1;
};

struct BagCounts {
  std::size_t frames = 0;
  std::size_t samples = 0;
  std::int64_t moved_by_s = 0;     // time in the bag - time in the recording
  std::size_t frames_without = 0;  // rows of frames.csv after the end of the video
};

[[nodiscard]] BagCounts bag_to_recording(const std::string& bag, const std::string& directory,
                                         const BagOptions& options, Stamps stamps);

// JPEG and PNG pictures are copied unchanged to CompressedImages on <image_topic>/compressed.
// Others, or all if raw, become mono8 Images. Default names: image, joint_states, pan_joint,
// tilt_joint. A zoom becomes the joint `zoom`, in device units.
[[nodiscard]] BagCounts recording_to_bag(const std::string& directory, const std::string& bag,
                                         const BagOptions& options, bool raw);

// The image's luma, row after row without gaps.
[[nodiscard]] std::vector<std::uint8_t> luma_of(const sensor_msgs::Image& image);

}  // namespace alidade_ros
