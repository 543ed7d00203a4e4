#include "alidade_ros/bag_conversion.h"

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <stdexcept>

#include "alidade_ros/conversions.h"
#include "alidade_ros/recording_files.h"

namespace alidade_ros {
namespace {

namespace encodings = sensor_msgs::image_encodings;
using Bytes = std::vector<std::uint8_t>;

[[noreturn]] void fail(const std::string& what) { throw std::runtime_error(what); }

std::string list_of(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list.empty() ? "none" : list;
}

double seconds(const ros::Time& time) {
  return static_cast<double>(time.sec) + 1e-9 * static_cast<double>(time.nsec);
}

// The name `wanted`, or else the only one of names.
std::string choose(const std::string& wanted, const std::vector<std::string>& names,
                   const std::string& what, const std::string& option) {
  if (wanted.empty() && names.size() == 1) return names.front();
  if (!wanted.empty() && std::find(names.begin(), names.end(), wanted) != names.end()) {
    return wanted;
  }
  fail((wanted.empty() ? "which " + what + "? name it with " + option
                       : "there is no " + what + " " + wanted) +
       "; there are: " + list_of(names));
}

std::vector<std::string> topics_of(const rosbag::Bag& bag, const std::set<std::string>& types) {
  rosbag::View view(bag);
  std::set<std::string> topics;
  for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
    if (types.count(connection->datatype) > 0) topics.insert(connection->topic);
  }
  return {topics.begin(), topics.end()};
}

// Joint names are known from the first message.
class Joints {
 public:
  explicit Joints(const BagOptions& options) : options_(options) {}

  // nullopt: the message has other joints.
  std::optional<RecordedSample> sample(const sensor_msgs::JointState& message) {
    if (pan_.empty()) choose_joints(message.name);
    const auto pan = position(message, pan_);
    const auto tilt = position(message, tilt_);
    if (!pan || !tilt) return std::nullopt;
    RecordedSample sample;
    sample.pan_rad = options_.pan_sign * *pan;
    sample.tilt_rad = options_.tilt_sign * *tilt;
    sample.zoom = position(message, "zoom");
    return sample;
  }

 private:
  void choose_joints(const std::vector<std::string>& names) {
    const auto with = [&names](const std::string& part) {
      std::vector<std::string> found;
      for (const std::string& name : names) {
        if (name.find(part) != std::string::npos) found.push_back(name);
      }
      return found;
    };
    pan_ = choose(options_.pan_joint, options_.pan_joint.empty() ? with("pan") : names, "pan joint",
                  "--pan-joint");
    tilt_ = choose(options_.tilt_joint, options_.tilt_joint.empty() ? with("tilt") : names,
                   "tilt joint", "--tilt-joint");
  }

  static std::optional<double> position(const sensor_msgs::JointState& message,
                                        const std::string& joint) {
    const auto found = std::find(message.name.begin(), message.name.end(), joint);
    const auto index = static_cast<std::size_t>(found - message.name.begin());
    if (index >= message.position.size() || !std::isfinite(message.position[index])) {
      return std::nullopt;
    }
    return message.position[index];
  }

  const BagOptions& options_;
  std::string pan_;
  std::string tilt_;
};

struct Picture {
  PictureType type;
  Bytes bytes;
  int width;
  int height;
};

Picture picture_of(const sensor_msgs::Image& image) {
  Picture picture{
      PictureType::kPng, {}, static_cast<int>(image.width), static_cast<int>(image.height)};
  Bytes luma = luma_of(image);
  cv::imencode(".png", cv::Mat(picture.height, picture.width, CV_8U, luma.data()), picture.bytes,
               {cv::IMWRITE_PNG_COMPRESSION, 1});
  return picture;
}

cv::Mat decode(const Bytes& bytes) {
  const cv::Mat picture = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  if (picture.empty()) fail("a picture cannot be decoded");
  return picture;
}

Picture picture_of(const sensor_msgs::CompressedImage& image) {
  const auto type = picture_type(image.data);
  if (!type) fail("a compressed image is neither JPEG nor PNG, but \"" + image.format + "\"");
  const cv::Mat decoded = decode(image.data);
  return {*type, image.data, decoded.cols, decoded.rows};
}

// Times of a message, from its header and the bag.
struct Times {
  double receive_time_s;
  std::optional<double> own_s;
};

Times times_of(const std_msgs::Header& header, const rosbag::MessageInstance& message,
               Stamps stamps) {
  if (stamps == Stamps::kBag) {
    return {seconds(message.getTime()),
            header.stamp.isZero() ? std::nullopt : std::optional<double>(seconds(header.stamp))};
  }
  if (header.stamp.isZero()) {
    fail(message.getTopic() + ": the header's stamp is 0; take the bag's times with --stamps bag");
  }
  return {seconds(header.stamp), std::nullopt};
}

// The least receive time minus own time (docs/derivations.md); rows without an own time do not
// count.
template <typename Row>
double own_clock_offset(const std::vector<Row>& rows, std::optional<double> Row::*own) {
  double least = std::numeric_limits<double>::infinity();
  for (const Row& row : rows) {
    if (row.*own) least = std::min(least, row.receive_time_s - *(row.*own));
  }
  return least;
}

double header_time(const RecordedFrame& frame, double offset) {
  return frame.sender_time_s ? *frame.sender_time_s + offset : frame.receive_time_s;
}

double header_time(const RecordedSample& sample, double offset) {
  if (sample.device_time_s) return *sample.device_time_s + offset;
  return (sample.earliest_time_s.value_or(sample.receive_time_s) + sample.receive_time_s) / 2;
}

}  // namespace

std::vector<std::uint8_t> luma_of(const sensor_msgs::Image& image) {
  const int rows = static_cast<int>(image.height);
  const int columns = static_cast<int>(image.width);
  const std::string& encoding = image.encoding;
  struct Format {
    std::string encoding;
    int type;
    int gray;     // code for cvtColor; -1: none
    int channel;  // the channel with the luma, if gray is -1
  };
  static const std::vector<Format> kFormats = {{encodings::MONO8, CV_8UC1, -1, 0},
                                               {encodings::TYPE_8UC1, CV_8UC1, -1, 0},
                                               {encodings::BGR8, CV_8UC3, cv::COLOR_BGR2GRAY, 0},
                                               {encodings::RGB8, CV_8UC3, cv::COLOR_RGB2GRAY, 0},
                                               {encodings::BGRA8, CV_8UC4, cv::COLOR_BGRA2GRAY, 0},
                                               {encodings::RGBA8, CV_8UC4, cv::COLOR_RGBA2GRAY, 0},
                                               {encodings::YUV422, CV_8UC2, -1, 1},  // U Y V Y
                                               {"yuv422_yuy2", CV_8UC2, -1, 0}};     // Y U Y V
  const auto format = std::find_if(kFormats.begin(), kFormats.end(),
                                   [&](const Format& f) { return f.encoding == encoding; });
  if (format == kFormats.end()) {
    std::vector<std::string> known;
    for (const Format& f : kFormats) known.push_back(f.encoding);
    fail("image encoding " + encoding + " is none of " + list_of(known));
  }
  const std::size_t pixel_bytes = static_cast<std::size_t>(CV_MAT_CN(format->type));
  if (rows <= 0 || columns <= 0 || image.step < image.width * pixel_bytes ||
      image.data.size() < std::size_t{image.step} * image.height) {
    fail("an image's data do not fill its " + std::to_string(columns) + "x" + std::to_string(rows) +
         " pixels");
  }
  // OpenCV takes no constant data, but does not change what it only reads.
  const cv::Mat whole(rows, columns, format->type, const_cast<std::uint8_t*>(image.data.data()),
                      image.step);
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(rows) *
                                  static_cast<std::size_t>(columns));
  cv::Mat luma(rows, columns, CV_8UC1, bytes.data());
  if (format->gray >= 0) {
    cv::cvtColor(whole, luma, format->gray);
  } else {
    cv::extractChannel(whole, luma, format->channel);
  }
  return bytes;
}

BagCounts bag_to_recording(const std::string& bag_path, const std::string& directory,
                           const BagOptions& options, Stamps stamps) {
  rosbag::Bag bag(bag_path, rosbag::bagmode::Read);
  const std::string image_topic = choose(
      options.image_topic, topics_of(bag, {"sensor_msgs/Image", "sensor_msgs/CompressedImage"}),
      "image topic", "--image-topic");
  const std::string joint_topic =
      choose(options.joint_topic, topics_of(bag, {"sensor_msgs/JointState"}), "joint topic",
             "--joint-topic");
  make_recording_directory(directory);
  RecordingTables tables;
  Joints joints(options);
  const auto add_frame = [&](const auto& image, const rosbag::MessageInstance& message) {
    const Times times = times_of(image.header, message, stamps);
    const Picture picture = picture_of(image);
    if (tables.frames.empty()) {
      tables.width = picture.width;
      tables.height = picture.height;
    } else if (tables.width != picture.width || tables.height != picture.height) {
      fail(image_topic + ": the images change their size");
    }
    const auto number = static_cast<std::int64_t>(tables.frames.size());
    write_picture(directory, number, picture.type, picture.bytes);
    tables.frames.push_back({number, times.receive_time_s, times.own_s});
  };
  rosbag::View view(bag, rosbag::TopicQuery(std::vector<std::string>{image_topic, joint_topic}));
  for (const rosbag::MessageInstance& message : view) {
    if (const auto joint_state = message.instantiate<sensor_msgs::JointState>()) {
      std::optional<RecordedSample> sample = joints.sample(*joint_state);
      if (!sample) continue;
      const Times times = times_of(joint_state->header, message, stamps);
      sample->receive_time_s = times.receive_time_s;
      sample->device_time_s = times.own_s;
      tables.samples.push_back(*sample);
    } else if (const auto image = message.instantiate<sensor_msgs::Image>()) {
      add_frame(*image, message);
    } else if (const auto compressed = message.instantiate<sensor_msgs::CompressedImage>()) {
      add_frame(*compressed, message);
    }
  }
  if (tables.frames.empty()) fail(image_topic + ": there is no image in the bag");
  if (tables.samples.empty()) fail(joint_topic + ": no message holds both joints");
  write_tables(directory, tables,
               "from " + std::filesystem::path(bag_path).filename().string() + ", " + image_topic +
                   " and " + joint_topic);
  return {tables.frames.size(), tables.samples.size(), 0, 0};
}

BagCounts recording_to_bag(const std::string& directory, const std::string& bag_path,
                           const BagOptions& options, bool raw) {
  const auto or_default = [](const std::string& name, const char* fallback) {
    return name.empty() ? std::string(fallback) : name;
  };
  const std::string image_topic = or_default(options.image_topic, "image");
  const std::string joint_topic = or_default(options.joint_topic, "joint_states");
  const RecordingTables tables = read_tables(directory);
  const double sender_offset = own_clock_offset(tables.frames, &RecordedFrame::sender_time_s);
  const double device_offset = own_clock_offset(tables.samples, &RecordedSample::device_time_s);

  double earliest = std::numeric_limits<double>::infinity();
  for (const RecordedFrame& frame : tables.frames) {
    earliest = std::min({earliest, frame.receive_time_s, header_time(frame, sender_offset)});
  }
  for (const RecordedSample& sample : tables.samples) {
    earliest = std::min({earliest, sample.receive_time_s, header_time(sample, device_offset)});
  }
  BagCounts counts;
  if (earliest <= 0) counts.moved_by_s = std::llround(std::floor(1 - earliest));
  const auto moved = [&counts](double time_s) {
    return ros_time(time_s + static_cast<double>(counts.moved_by_s));
  };

  if (std::filesystem::exists(bag_path)) fail(bag_path + " exists already; name another bag");
  rosbag::Bag bag(bag_path, rosbag::bagmode::Write);
  // In order of time, as readers of the bag expect it.
  const auto write_samples_before = [&](double receive_time_s) {
    for (; counts.samples < tables.samples.size(); ++counts.samples) {
      const RecordedSample& sample = tables.samples[counts.samples];
      if (sample.receive_time_s >= receive_time_s) return;
      sensor_msgs::JointState message;
      message.header.stamp = moved(header_time(sample, device_offset));
      message.name = {or_default(options.pan_joint, "pan_joint"),
                      or_default(options.tilt_joint, "tilt_joint")};
      message.position = {options.pan_sign * sample.pan_rad, options.tilt_sign * sample.tilt_rad};
      if (sample.zoom) {
        message.name.push_back("zoom");
        message.position.push_back(*sample.zoom);
      }
      bag.write(joint_topic, moved(sample.receive_time_s), message);
    }
  };
  read_pictures(directory, tables, [&](const RecordedFrame& frame, const Bytes& bytes) {
    write_samples_before(frame.receive_time_s);
    std_msgs::Header header;
    header.stamp = moved(header_time(frame, sender_offset));
    const auto type = picture_type(bytes);
    if (!raw && type && *type != PictureType::kPgm) {
      sensor_msgs::CompressedImage message;
      message.header = header;
      message.format = *type == PictureType::kJpeg ? "jpeg" : "png";
      message.data = bytes;
      bag.write(image_topic + "/compressed", moved(frame.receive_time_s), message);
    } else {
      const cv::Mat picture = decode(bytes);
      sensor_msgs::Image message;
      message.header = header;
      message.width = static_cast<std::uint32_t>(picture.cols);
      message.height = static_cast<std::uint32_t>(picture.rows);
      message.encoding = encodings::MONO8;
      message.step = message.width;
      message.data.assign(picture.datastart, picture.dataend);
      bag.write(image_topic, moved(frame.receive_time_s), message);
    }
    ++counts.frames;
  });
  write_samples_before(std::numeric_limits<double>::infinity());
  bag.close();
  counts.frames_without = tables.frames.size() - counts.frames;
  return counts;
}

}  // namespace alidade_ros
