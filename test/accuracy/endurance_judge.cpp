#include "test/accuracy/endurance_judge.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "core/model/lens/camera.h"
#include "core/model/mechanics.h"
#include "core/model/rotation.h"
#include "edge_app/output/svg_plot.h"
#include "test/accuracy/statistics.h"

namespace alidade::test {
namespace {

Eigen::Matrix3d turn_of(const OrientationRecord::Orientation& orientation) {
  const auto& q = orientation.q_base_from_camera;
  return Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix();
}

void judge_pixels(const VirtualDay& day, std::size_t frame, const Answer& answer,
                  JudgedRecord* judged) {
  const OrientationRecord::Orientation& orientation = *answer.record.orientation;
  const Camera<double>& camera = answer.calibration.camera;
  for (std::size_t i = 0; i < judged->pixel_error_px.size(); ++i) {
    const double row = camera.height * static_cast<double>(i) / 2;
    const Eigen::Vector2d u(camera.width / 2.0, row);
    const double t = row * answer.record.camera.line_delay;
    const PanTilt<double> angle{orientation.pan_rad + orientation.pan_rate_rad_s * t +
                                    orientation.pan_acceleration_rad_s2 * t * t / 2,
                                orientation.tilt_rad + orientation.tilt_rate_rad_s * t +
                                    orientation.tilt_acceleration_rad_s2 * t * t / 2};
    Eigen::Vector3d ray;
    if (unproject(camera, u, &ray) != ProjectionStatus::kOk) continue;
    const Eigen::Matrix3d turn = R_base_from_camera(answer.calibration.mechanics, angle);
    const Eigen::Vector3d error = turn.transpose() * day.direction(frame, u) - ray;
    judged->pixel_error_px.at(i) = camera.focal_length * error.norm();
    // A turn about x moves what is near the optical axis along y, and the other way round.
    judged->pixel_sigmas =
        std::max({judged->pixel_sigmas, std::abs(error.x()) / orientation.sigma_rad[1],
                  std::abs(error.y()) / orientation.sigma_rad[0]});
  }
}

}  // namespace

JudgedRecord judge(const VirtualDay& day, std::size_t frame, const Answer& answer) {
  const OrientationRecord& record = answer.record;
  JudgedRecord judged;
  judged.time_s = day.time(frame);
  judged.mode = record.mode;
  judged.status = record.status;
  judged.calibrated = record.calibrated;
  judged.landmarks = record.landmarks;
  judged.says_so = !record.calibrated || !record.orientation ||
                   record.status != RecordStatus::kOk ||
                   record.calibration.activity == CalibrationActivity::kDoubtful;
  if (!record.orientation) return judged;
  const Eigen::Matrix3d error =
      turn_of(*record.orientation).transpose() * day.base_from_camera(frame, 0);
  const Eigen::Vector3d xi = log_so3<double>(error);
  for (std::size_t i = 0; i < 3; ++i) {
    const double size = std::abs(xi[static_cast<Eigen::Index>(i)]);
    const double sigma = record.orientation->sigma_rad[i];
    const double sigmas = size / sigma;
    judged.nees += sigmas * sigmas / 3;
    // What is not a number must not pass for small.
    if (sigmas <= judged.sigmas) continue;
    judged.sigmas = std::isnan(sigmas) ? std::numeric_limits<double>::infinity() : sigmas;
    judged.error_rad = size;
    judged.sigma_rad = sigma;
  }
  judge_pixels(day, frame, answer, &judged);
  return judged;
}

void EnduranceJudge::add(const JudgedRecord& record) {
  records_.push_back(record);
  const bool silent = record.sigmas > kWorst && !record.says_so;
  if (silent) {
    if (!in_episode_) episodes_.push_back({record.time_s, 0, record});
    Episode& episode = episodes_.back();
    ++episode.frames;
    if (record.sigmas > episode.worst.sigmas) episode.worst = record;
  }
  in_episode_ = silent;
}

int EnduranceJudge::longest_episode() const {
  int longest = 0;
  for (const Episode& episode : episodes_) longest = std::max(longest, episode.frames);
  return longest;
}

double EnduranceJudge::time_until(std::size_t mark, RecordMode mode) const {
  const double from = marks_[mark].time_s;
  const double to =
      mark + 1 < marks_.size() ? marks_[mark + 1].time_s : std::numeric_limits<double>::infinity();
  for (const JudgedRecord& record : records_) {
    if (record.time_s < from || !record.calibrated) continue;
    if (record.time_s >= to) break;
    if (record.mode == mode && record.status == RecordStatus::kOk) return record.time_s - from;
  }
  return -1;
}

std::string EnduranceJudge::since_mark(double time_s) const {
  const DayMark* last = &marks_.front();
  for (const DayMark& mark : marks_) {
    if (mark.time_s <= time_s) last = &mark;
  }
  return last->name + " + " + number(time_s - last->time_s) + " s";
}

void EnduranceJudge::report(Report* report) const {
  struct Group {
    std::vector<double> nees, sigmas, sigma, pixel;
    int beyond = 0, silent = 0;
  };
  std::map<std::string, Group> groups;
  for (const JudgedRecord& record : records_) {
    Group& group = groups[std::string(to_string(record.mode)) + ", " + to_string(record.status) +
                          (record.calibrated ? "" : ", not calibrated")];
    if (record.mode == RecordMode::kNone) {
      group.nees.push_back(std::nan(""));
      continue;
    }
    group.nees.push_back(record.nees);
    group.sigmas.push_back(record.sigmas);
    group.sigma.push_back(record.sigma_rad);
    group.pixel.push_back(record.pixel_error_px[1]);
    group.beyond += record.sigmas > kWorst ? 1 : 0;
    group.silent += record.sigmas > kWorst && !record.says_so ? 1 : 0;
  }
  Table modes;
  modes.title = "Records";
  modes.header = {"mode, status", "frames", "mean NEES",   "median",        "worst, sigmas",
                  "beyond 5",     "silent", "sigma, mrad", "middle row, px"};
  for (const auto& [name, group] : groups) {
    double sum = 0;
    double worst = 0;
    for (const double nees : group.nees) sum += nees;
    for (const double sigmas : group.sigmas) worst = std::max(worst, sigmas);
    modes.rows.push_back({name, std::to_string(group.nees.size()),
                          number(sum / static_cast<double>(group.nees.size())),
                          number(median(group.nees)), number(worst), std::to_string(group.beyond),
                          std::to_string(group.silent), number(1e3 * median(group.sigma)),
                          number(median(group.pixel))});
  }
  modes.notes = {"sigma and px: medians; silent: beyond 5 sigmas, and nothing says so"};
  report->add(modes);

  Table settling;
  settling.title = "From each event to a calibrated record that is ok, s";
  settling.header = {"event", "at, s", "PT or OE", "OE"};
  for (std::size_t i = 0; i < marks_.size(); ++i) {
    const double oe = time_until(i, RecordMode::kOe);
    const double pt = time_until(i, RecordMode::kPt);
    const auto text = [](double time) { return time < 0 ? std::string("-") : number(time); };
    settling.rows.push_back({marks_[i].name, number(marks_[i].time_s, 4),
                             text(oe < 0 || pt < 0 ? std::max(oe, pt) : std::min(oe, pt)),
                             text(oe)});
  }
  report->add(settling);

  Table silent;
  silent.title = "Silent episodes: beyond 5 sigmas, and nothing says so";
  silent.header = {"at, s",       "frames", "worst, sigmas", "error, mrad",
                   "sigma, mrad", "mode",   "landmarks",     "after"};
  constexpr std::size_t kMost = 40;
  for (const Episode& episode : episodes_) {
    if (silent.rows.size() == kMost) break;
    const JudgedRecord& worst = episode.worst;
    silent.rows.push_back({number(episode.time_s, 5), std::to_string(episode.frames),
                           number(worst.sigmas), number(1e3 * worst.error_rad),
                           number(1e3 * worst.sigma_rad), to_string(worst.mode),
                           std::to_string(worst.landmarks), since_mark(episode.time_s)});
  }
  silent.notes = {std::to_string(episodes_.size()) + " episodes, longest " +
                  std::to_string(longest_episode()) + " frames; " +
                  std::to_string(kLongestEpisode) + " allowed"};
  report->add(silent);
  if (longest_episode() > kLongestEpisode) {
    report->fail("a silent episode of " + std::to_string(longest_episode()) + " frames");
  }
}

nlohmann::json EnduranceJudge::to_json() const {
  nlohmann::json all;
  for (const DayMark& mark : marks_)
    all["marks"].push_back({{"name", mark.name}, {"s", mark.time_s}});
  for (const JudgedRecord& record : records_) {
    all["time_s"].push_back(record.time_s);
    all["mode"].push_back(to_string(record.mode));
    all["status"].push_back(to_string(record.status));
    all["calibrated"].push_back(record.calibrated);
    all["says_so"].push_back(record.says_so);
    all["landmarks"].push_back(record.landmarks);
    all["sigmas"].push_back(record.sigmas);
    all["sigma_rad"].push_back(record.sigma_rad);
    all["nees"].push_back(record.nees);
    all["pixel_error_px"].push_back(record.pixel_error_px);
    all["pixel_sigmas"].push_back(record.pixel_sigmas);
  }
  return all;
}

void EnduranceJudge::write_plot(const std::string& file, const std::string& title) const {
  constexpr double kMinute = 60;
  const double end = records_.empty() ? 1 : records_.back().time_s / kMinute;
  constexpr int kWidth = 1200;
  constexpr int kHeight = 320;
  std::vector<PlotPoint> silent, said, sigma_oe, sigma_pt;
  for (const JudgedRecord& record : records_) {
    if (record.mode == RecordMode::kNone || !(record.sigma_rad > 0)) continue;
    const double minute = record.time_s / kMinute;
    (record.says_so ? said : silent).push_back({minute, record.sigmas});
    (record.mode == RecordMode::kOe ? sigma_oe : sigma_pt)
        .push_back({minute, std::log10(1e3 * record.sigma_rad)});
  }
  std::vector<double> marks;
  std::string legend;
  for (const DayMark& mark : marks_) {
    marks.push_back(mark.time_s / kMinute);
    legend += (legend.empty() ? "" : "; ") + number(mark.time_s / kMinute) + " " + mark.name;
  }
  SvgPlot errors(kWidth, kHeight, {0, end, "minutes"}, {0, 8, "error / sigma, worst axis"});
  errors.level(kWorst);
  errors.dots(said, "soft");
  errors.dots(silent, "a");
  errors.ticks(marks, "bad");
  SvgPlot sigmas(kWidth, kHeight, {0, end, "minutes"}, {-2.5, 2, "log10 (sigma / mrad)"});
  sigmas.dots(sigma_pt, "b");
  sigmas.dots(sigma_oe, "a");
  sigmas.ticks(marks, "bad");
  std::ofstream page(file);
  page << "<!doctype html>\n<meta charset=\"utf-8\">\n<title>" << escape_html(title)
       << "</title>\n<style>body{font:14px sans-serif;max-width:1240px;margin:2em auto}"
          "svg path{fill:none}.dots{stroke-linecap:round}.grid{stroke:#ddd}.frame,.ink{stroke:#222}"
          ".level{stroke:#c62828;stroke-dasharray:6 4}.a{stroke:#1f6fb2}.b{stroke:#c05a10}"
          ".bad{stroke:#c62828;stroke-width:2}.soft{stroke:#aaa}text{font-size:12px}</style>\n<h1>"
       << escape_html(title)
       << "</h1>\n<p>Error in units of the record's own sigma; grey: the record "
       << "says that it is not to be trusted, or is not calibrated. Points at the top edge lie "
          "beyond.</p>\n"
       << errors.svg("error in sigmas over time")
       << "<p>The sigma itself: blue OE, orange PT.</p>\n"
       << sigmas.svg("sigma over time")
       << "<p>Events (red strokes), minutes: " << escape_html(legend) << "</p>\n";
  if (!page.flush()) throw std::runtime_error(file + ": cannot be written");
}

}  // namespace alidade::test
