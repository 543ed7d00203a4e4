#pragma once
// Between rosbags (Image or CompressedImage, and JointState) and recordings.
//
// Angles: a joint position turns about REP-103's axes (pan +z up, tilt +y left), Alidade's angle the other
// way, so that sign -1 undoes it exactly; drivers that count otherwise are told by +1.
//
// Times. A bag has two for each message: the header's stamp, which the driver gave, and the time at which the
// recorder got the message. From a bag, by Stamps:
//   kHeader   receive_time_s = header stamp. For drivers that stamp frames and angles themselves, by one
//             clock, which is what ROS asks for.
//   kBag      receive_time_s = time in the bag; sender_time_s (of frames) and device_time_s (of samples) =
//             header stamp. For headers of clocks of their own: the clock filter maps them.
// Into a bag: the time in the bag is receive_time_s. A header's stamp is the best guess of when the content
// was true: sender_time_s + c, c the least receive_time_s - sender_time_s of all frames (so that the first
// ones are not late), without it receive_time_s; device_time_s + c likewise, without it the middle of
// earliest_time_s and receive_time_s. ROS knows no time before 1970, so times that are not positive are all
// moved by one whole number of seconds.
// So a recording comes back through kBag with its times to the nanosecond, but for that number and c, both
// without meaning to what reads it. Not kept: sequence, restarted, sender_utc_s, earliest_time_s, and what is
// beside the tables.
//
// What is wrong is thrown as std::runtime_error with one line.

#include <sensor_msgs/Image.h>

#include <cstdint>
#include <string>
#include <vector>

namespace alidade_ros {

enum class Stamps { kHeader, kBag };

struct BagOptions {
  std::string image_topic;  // empty: the bag's only one
  std::string joint_topic;  // likewise
  std::string pan_joint;    // empty: the only one whose name contains "pan"
  std::string tilt_joint;   // likewise, "tilt"
  int pan_sign = -1;        // Alidade's angle = sign * joint position
  int tilt_sign = -1;
};

struct BagCounts {
  std::size_t frames = 0;
  std::size_t samples = 0;
  std::int64_t moved_by_s = 0;     // times in the bag - times in the recording
  std::size_t frames_without = 0;  // rows of frames.csv beyond the end of the video
};

[[nodiscard]] BagCounts bag_to_recording(const std::string& bag, const std::string& directory,
                                         const BagOptions& options, Stamps stamps);

// Pictures that are JPEG or PNG go unchanged into CompressedImages on <image_topic>/compressed; others, or all if
// raw, as mono8 Images. Empty names: image, joint_states, pan_joint, tilt_joint. The joint of the zoom, if there
// is one, is `zoom`, in device units.
[[nodiscard]] BagCounts recording_to_bag(const std::string& directory, const std::string& bag,
                                         const BagOptions& options, bool raw);

// The image's luma, row after row.
[[nodiscard]] std::vector<std::uint8_t> luma_of(const sensor_msgs::Image& image);

}  // namespace alidade_ros
