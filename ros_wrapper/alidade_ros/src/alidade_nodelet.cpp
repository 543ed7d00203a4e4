// The nodelet: an EdgeBridge in a nodelet manager.

#include <nodelet/nodelet.h>
#include <pluginlib/class_list_macros.hpp>

#include <memory>

#include "alidade_ros/edge_bridge.h"

namespace alidade_ros {

class AlidadeNodelet : public nodelet::Nodelet {
 private:
  // A wrong parameter throws: the manager reports it and does not load the nodelet.
  void onInit() override {
    bridge_ = std::make_unique<EdgeBridge>(getMTNodeHandle(), getPrivateNodeHandle(),
                                           read_options(getPrivateNodeHandle()));
  }

  std::unique_ptr<EdgeBridge> bridge_;
};

}  // namespace alidade_ros

PLUGINLIB_EXPORT_CLASS(alidade_ros::AlidadeNodelet, nodelet::Nodelet)
