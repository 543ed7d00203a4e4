// bag_tool: converts rosbags to recordings for `alidade calibrate` and `replay`, and back. Exit
// codes as of the edge executable: 0 ok, 1 failed, 2 bad usage; errors on stderr in one line.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <map>
#include <string>

#include "alidade_ros/bag_conversion.h"

namespace {

using alidade_ros::Stamps;

void add_options(CLI::App* command, alidade_ros::BagOptions* options) {
  command->add_option("--image-topic", options->image_topic, "Image or CompressedImage");
  command->add_option("--joint-topic", options->joint_topic, "JointState");
  command->add_option("--pan-joint", options->pan_joint, "name of the pan joint");
  command->add_option("--tilt-joint", options->tilt_joint, "name of the tilt joint");
  command
      ->add_option("--pan-sign", options->pan_sign,
                   "angle to the right = sign * joint position (REP-103: -1)")
      ->check(CLI::IsMember({-1, 1}))
      ->capture_default_str();
  command
      ->add_option("--tilt-sign", options->tilt_sign,
                   "angle upwards = sign * joint position (REP-103: -1)")
      ->check(CLI::IsMember({-1, 1}))
      ->capture_default_str();
}

void report(const alidade_ros::BagCounts& counts, const std::string& where) {
  std::fprintf(stderr, "%s: %zu frames, %zu samples\n", where.c_str(), counts.frames,
               counts.samples);
  if (counts.moved_by_s != 0) {
    std::fprintf(stderr, "times moved by %+lld s: ROS knows none before 1970\n",
                 static_cast<long long>(counts.moved_by_s));
  }
  if (counts.frames_without > 0) {
    std::fprintf(stderr, "%zu rows of frames.csv without a picture in the video were left out\n",
                 counts.frames_without);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Rosbags into recordings of Alidade, and back");
  app.require_subcommand(1);
  std::string bag;
  std::string directory;
  alidade_ros::BagOptions options;

  CLI::App* to_recording = app.add_subcommand("to-recording", "makes a recording of a bag");
  to_recording->add_option("BAG", bag)->required();
  to_recording->add_option("DIR", directory, "new or empty")->required();
  add_options(to_recording, &options);
  Stamps stamps = Stamps::kHeader;
  const std::map<std::string, Stamps> names = {{"header", Stamps::kHeader}, {"bag", Stamps::kBag}};
  to_recording
      ->add_option(
          "--stamps", stamps,
          "header: the headers' stamps are the times (default); bag: the recorder's are, the "
          "headers' are of clocks of their own")
      ->transform(CLI::CheckedTransformer(names));

  CLI::App* to_bag = app.add_subcommand("to-bag", "makes a bag of a recording");
  to_bag->add_option("DIR", directory)->required();
  to_bag->add_option("BAG", bag, "must not exist")->required();
  add_options(to_bag, &options);
  bool raw = false;
  to_bag->add_flag("--raw", raw, "mono8 Images only, no CompressedImages");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    if (to_recording->parsed()) {
      report(bag_to_recording(bag, directory, options, stamps), directory);
    } else {
      report(recording_to_bag(directory, bag, options, raw), bag);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bag_tool: %s\n", error.what());
    return 1;
  }
  return 0;
}
