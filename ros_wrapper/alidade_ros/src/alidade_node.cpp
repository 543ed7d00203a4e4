// The node: an EdgeBridge in its own process.

#include <ros/ros.h>

#include <cstdlib>
#include <stdexcept>

#include "alidade_ros/edge_bridge.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "alidade");
  const ros::NodeHandle handle;
  const ros::NodeHandle private_handle("~");
  try {
    const alidade_ros::EdgeBridge bridge(handle, private_handle,
                                         alidade_ros::read_options(private_handle));
    ros::AsyncSpinner spinner(2);  // a service that waits for the edge must not block another
    spinner.start();
    ros::waitForShutdown();
  } catch (const std::invalid_argument& error) {
    ROS_FATAL("%s", error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
