#pragma once
// Configuration of the virtual camera: one struct with defaults, read from a strictly checked YAML
// file. An unknown key, a wrong type or a value out of range is an error with file and line.
//
// Units: inside the program SI (rad, s, px); the keys of the file carry their unit in their name
// (docs/simulator.md lists them). File names are relative to the folder of the configuration.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "test/simulator/servers/simulated_head.h"
#include "test/simulator/zoom_config.h"

namespace alidade::simulator {

// The text is one line: file:line: what was wrong and what would be right.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct ImageConfig {
  int width = 1280;     // px
  int height = 720;     // px
  double rate_hz = 25;  // on the host clock
};

// f drifts by a factor: 1 + part * t / period until then, or 1 + part / 2 * sin(2 pi t / period).
struct Breathing {
  enum class Type { kLinear, kSine };
  Type type = Type::kLinear;
  double part = 0;
  double period = 12;  // s
};

// One swing of the mast: the base turns against the world about an axis of its own by amplitude
// sin(2 pi frequency t + phase).
struct Swing {
  enum class Axis { kForward, kRight, kDown };
  Axis axis = Axis::kRight;
  double amplitude = 0;  // rad
  double frequency = 1;  // Hz
  double phase = 0;      // rad
};

struct CameraConfig {
  double focal_length = 1500;                                 // px
  double aspect = 1;                                          // f_v / f_u
  double radial_distortion = 0;                               // k
  double line_delay = 0;                                      // s/row
  Eigen::Vector2d pan_axis_offset{Eigen::Vector2d::Zero()};   // rad along base x, y
  Eigen::Vector2d tilt_axis_offset{Eigen::Vector2d::Zero()};  // rad along base x, z
  double pan_scale = 1;                                       // measured / true
  double tilt_scale = 1;                                      // measured / true
  double clock_offset = 0;                                    // s, telemetry clock - image clock
  double radial_distortion_2 = 0;                             // k2, of r^4
  Eigen::Vector2d tangential{Eigen::Vector2d::Zero()};        // p1, p2
  Eigen::Vector2d centre{Eigen::Vector2d::Zero()};            // px, off the image's
  Breathing breathing;
  Eigen::Vector3d pupil{Eigen::Vector3d::Zero()};  // m, right, down, forward of where the axes meet
  std::vector<Swing> sway;
};

struct PathConfig {
  enum class Type { kTripleCosine, kSweep, kJerky, kCsv };
  Type type = Type::kTripleCosine;
  double amplitude = 1;      // 1 = the paper's path: three fields of view wide, one high
  double period = 10;        // s
  double stop = 0.5;         // s of rest after each move of a sweep
  double pan = 0, tilt = 0;  // rad, the centre
  // px, whose fields of view are meant; 0: the camera's, with a zoom the longest of its path.
  double focal_length = 0;
  bool follows_zoom = false;  // fields of view at the present zoom are meant
  std::filesystem::path file;
};

// What leaves in the wind do to a patch: its places are shifted by a field that changes.
struct FlutterConfig {
  double rms_px = 1;    // along each axis, at the longest focal length
  double size_px = 30;  // what moves as one
  double rate_hz = 1;   // of changes
};

// From where the axes meet (depth_map.h).
struct DistanceConfig {
  double nearest = 0, farthest = 0;  // m
  int layers = 0;                    // 0: smooth
  double length = 0.1;               // rad, over which it changes
};

// A rectangle on the sphere around a direction: a photo, generated texture, or one brightness.
struct PatchConfig {
  enum class Projection {
    kTangent,         // a rectilinear picture (gnomonic), less than 170 degrees
    kEquirectangular  // columns are longitudes, rows latitudes, about the patch's centre
  };
  std::filesystem::path file;                   // photo; empty for a generated patch
  double azimuth = 0;                           // rad, positive to the right
  double elevation = 0;                         // rad, positive up
  double width = 0, height = 0;                 // rad; a photo's height follows from its shape
  double azimuth_rate = 0, elevation_rate = 0;  // rad/s, moving objects only
  double brightness = 0.5;                      // flat areas and moving objects, 1 = white
  Projection projection = Projection::kTangent;
  std::optional<DistanceConfig> distance;  // nothing: infinitely far
  std::optional<FlutterConfig> flutter;
};

// A deck that drifts (clouds.h), in front of all else.
struct CloudsConfig {
  double fraction = 0.6;
  double rate = 0;     // rad/s; or
  double rate_px = 0;  // px/s at the longest focal length
  double heading = 0;  // rad, 0 right, a quarter turn up
  double size_px = 100;
  double brightness = 0.75, contrast = 0.12;
  double above = -1.5707963267948966;  // rad, elevation
};

// Waves below an elevation (clouds.h), behind the clouds and in front of the patches.
struct WaterConfig {
  double below = 0;     // rad
  double rate_px = 20;  // px/s at the longest focal length
  double size_px = 40;  // of the longest wave
  double brightness = 0.4, contrast = 0.1;
};

struct SceneConfig {
  double background = 0.5;  // where no patch lies, 1 = white
  double detail = 1;        // generated contrast at the scales a photo lacks, 1 = natural
  std::vector<PatchConfig> photos, procedural, flat, moving;
  std::optional<CloudsConfig> clouds;
  std::optional<WaterConfig> water;
};

struct SensorConfig {
  struct Step {
    double time = 0;    // s
    double factor = 1;  // from then on
  };
  struct Interval {
    double from = 0, to = 0;  // s
  };
  double exposure = 0;    // s, centred on the row's time
  double shot_noise = 0;  // grey levels per electron: variance = shot_noise * signal
  double read_noise = 0;  // grey levels
  double vignetting = 0;  // light lost in the corners, 0 to 1
  double boil = 0;        // px, standard deviation along each axis
  // Over so much its correlation falls to exp(-1/2); 0: the renderer's own choice.
  double boil_length = 0;        // px
  double boil_time = 0;          // s
  double noise_reduction = 0;    // part of the picture before (picture_filter.h)
  double sharpening = 0;         // of what an unsharp mask takes away
  double sharpening_radius = 1;  // px, its standard deviation
  int jpeg_quality = 90;
  std::vector<Step> brightness_steps;
  std::vector<Interval> covered;
};

// One part of a gear's error: what is reported is off by amplitude * sin(2 pi angle / period +
// phase).
struct GearHarmonic {
  double amplitude = 0;           // rad
  double period = 6.28318530718;  // rad, of the true angle
  double phase = 0;               // rad
};

// Backlash (played_path.h).
struct PlayConfig {
  enum class Encoder { kMotor, kOutput };
  double pan = 0, tilt = 0;  // rad
  Encoder encoder = Encoder::kMotor;
};

struct TelemetryConfig {
  double rate_hz = 30;                  // of a recording; live, the client polls as it likes
  double sigma = 0;                     // rad
  double quantum = 0;                   // rad
  double internal_rate_hz = 0;          // > 0: the device refreshes its value only so often
  double stale_repeat_probability = 0;  // a sample repeats its predecessor
  double latency = 0;                   // s, live only: age of the angle the device reports
  std::vector<GearHarmonic> pan_gear, tilt_gear;
  PlayConfig play;
};

struct JitterConfig {
  double sigma = 0;        // s, white and symmetric
  double exponential = 0;  // s, mean of a one-sided delay
  double burst = 0;        // s, longest one-sided delay of a burst
  double burst_probability = 0;
};

struct TimingConfig {
  JitterConfig image, telemetry;
  double frame_loss = 0;              // probability
  double image_clock_skew = 0;        // sender clock rate / host clock rate - 1
  double image_period_sigma = 0;      // s, of the one draw that noise.yaml tells
  double telemetry_period_sigma = 0;  // s, likewise
};

enum class VideoCodec { kMjpeg, kH264, kH265 };

// Of what is sent or kept.
struct EncodingConfig {
  VideoCodec codec = VideoCodec::kMjpeg;
  int kbit_s = 0;  // of H.264 and H.265; 0: as good as a quality takes
  int gop = 0;     // pictures from one that stands by itself to the next; 0: a second of them
};

struct RecordingConfig {
  enum class Images { kVideo, kPng, kPgm, kNone };
  Images images = Images::kVideo;                   // kNone: tracks.csv stands in place of images
  EncodingConfig encoding;                          // of kVideo
  double landmark_spacing = 0.1;                    // of tracks.csv, in horizontal fields of view
  double pixel_sigma = 0.3;                         // px, of tracks.csv
  std::optional<DistanceConfig> landmark_distance;  // of tracks.csv, drawn by ratio
};

struct LiveConfig {
  int rtsp_port = 0, http_port = 0;  // 0: any free one
  EncodingConfig encoding;
  std::string rtp_host;  // if set, plain RTP is sent there besides RTSP
  int rtp_port = 0;
  std::filesystem::path sdp_file;  // of the plain RTP stream
  std::string user, password;      // of RTSP and HTTP; empty: no login
  // Also: the pictures as MJPEG over HTTP, ONVIF, and a head that is asked. Ports: 0: any free one.
  std::optional<int> mjpeg_port, onvif_port;
  enum class Link { kSerial, kTcp, kUdp };
  const HeadModel* head = nullptr;  // of kHeadModels; null: none
  Link head_link = Link::kSerial;
};

// A printed pattern before a camera held by hand, in place of a scene and a head (pattern_board.h,
// pattern_camera.h).
struct PatternConfig {
  enum class Kind { kChessboard, kCircles, kSymmetricCircles, kAprilGrid, kCharuco };
  struct Lens {
    double focal_length_u = 600, focal_length_v = 602, centre_u = 380, centre_v = 236;  // px
    double k1 = -0.28, k2 = 0.08, p1 = 3e-4, p2 = -2e-4;
  };
  struct Hand {
    double distance = 0.55;         // m, of the pattern's middle
    double speed = 1;               // 0 = at rest
    double reach = 1;               // sideways; from about 2 on the pattern leaves the view in part
    Eigen::Vector3d turn{0, 0, 0};  // rad, about x, y and z, added to the hand's own
  };
  Kind kind = Kind::kChessboard;
  int columns = 9, rows = 6;
  double size = 0.03;          // m
  double gap = 0.3;            // AprilGrid: part of size
  int border = 2;              // AprilGrid: cells; kalibr's
  bool corner_squares = true;  // AprilGrid: kalibr's
  double marker = 0.022;       // m, ChArUco: a marker's side
  int dictionary = 0;          // ChArUco: OpenCV's number of a predefined one
  bool old_layout = false;     // ChArUco: as OpenCV drew it before 4.6
  std::filesystem::path
      page;  // an SVG as `calibrate-shutter --print` writes it: seen in place of the drawn board
  double black = 0.16, white = 0.82, table = 0.47;
  double finger = 0;  // m, diameter of what goes round on the board; 0 = nothing
  Lens lens;
  Hand hand;
};

struct Config {
  std::uint64_t seed = 1;
  double duration = 0;  // s; 0: live without end
  ImageConfig image;
  CameraConfig camera;
  PathConfig path;
  SceneConfig scene;
  SensorConfig sensor;
  TelemetryConfig telemetry;
  TimingConfig timing;
  RecordingConfig recording;
  LiveConfig live;
  std::optional<PatternConfig> pattern;
  std::optional<ZoomConfig> zoom;            // in place of the camera's focal length and distortion
  std::optional<double> guess_focal_length;  // px, of guess.yaml; default: the truth, rounded
  std::filesystem::path truth_dir;           // live: where truth.yaml and truth.csv go
};

// Throws ConfigError.
[[nodiscard]] Config load_config(const std::filesystem::path& file);

// Angle of the image's width seen through an undistorted lens, rad.
[[nodiscard]] double field_of_view(const ImageConfig& image, double focal_length);
// That of the path: the s of the paper's.
[[nodiscard]] double horizontal_field_of_view(const Config& config);

}  // namespace alidade::simulator
