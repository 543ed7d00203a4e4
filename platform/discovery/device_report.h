#pragma once
// What a device says of itself when it is asked: by ONVIF (onvif_inquiry.h) or VAPIX
// (vapix_inquiry.h). Text is the device's own.

#include <optional>
#include <string>
#include <vector>

#include "platform/system/link_rules.h"

namespace alidade {

// How to log in at a device; user empty: not at all.
struct DeviceLogin {
  std::string user;
  std::string password;
  LinkRules rules;
};

// One video stream that a device offers. 0 or empty: the device does not say.
struct VideoStream {
  // kNone: its profile has none. kPossible: its profile permits them.
  enum class BFrames { kUnknown, kNone, kPossible };

  std::string name;           // of the profile
  std::string token;          // ONVIF: of the profile
  std::string url;            // rtsp://..., without user and password before its host
  std::string codec;          // H264, H265, JPEG, or the device's own word
  std::string codec_profile;  // Baseline, Main, High, ...
  int width = 0;              // px
  int height = 0;
  double rate_hz = 0;
  int key_frame_distance = 0;  // pictures from one key frame to the next
  BFrames b_frames = BFrames::kUnknown;
  bool has_pan_tilt = false;  // its profile has pan and tilt
};

struct DeviceReport {
  std::string maker;
  std::string model;
  std::string firmware;
  std::vector<VideoStream> streams;
  std::optional<bool> has_pan_tilt;  // nullopt: it does not say
  bool wants_login = false;          // part of the above was refused
  std::vector<std::string> notes;    // one line each: what is odd about the device
  std::string error;                 // one line: why it says nothing, or not all
};

}  // namespace alidade
