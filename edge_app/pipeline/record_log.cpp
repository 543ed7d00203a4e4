#include "edge_app/pipeline/record_log.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "platform/system/clock.h"
#include "platform/system/text.h"

namespace alidade {

bool RecordLog::Rarely::is_due() {
  const double now_s = monotonic_now_s();
  if (now_s < last_s + interval_s) return false;
  last_s = now_s;
  return true;
}

// Nothing else in the log says why such records have no telemetry: no connection is known to be
// lost.
void RecordLog::log_old_telemetry(const OrientationRecord& record) {
  if (record.status != RecordStatus::kTelemetryTooOld || !record.telemetry_age_s) return;
  if (!old_telemetry_.is_due()) return;
  constexpr double kReserve = 1.2;
  constexpr double kWorthTelling_s = 0.05;
  const double offset_s = record.camera.clock_offset;
  const std::string later =
      offset_s > kWorthTelling_s
          ? fmt::format(
                " ({:.0f} ms of it, the clock offset, telemetry comes later than the video)",
                1e3 * offset_s)
          : "";
  spdlog::warn(
      "{}: {} at frame {}: it lies {:.0f} ms beyond the newest angle that is trusted{}, and "
      "realtime.max_extrapolation_s is {:.0f} ms; raise it to {:.2f} or more if that does not "
      "grow, or raise pan_tilt.rate_hz, or lower pan_tilt.max_repeat_s as far as `alidade check` "
      "allows; the causes, by how telemetry_age_s moves: the manual, Statuses, \"Telemetry too "
      "old\"",
      pan_tilt_.name(), to_string(record.status), *record.frame, 1e3 * *record.telemetry_age_s,
      later, 1e3 * max_extrapolation_s_, kReserve * *record.telemetry_age_s + 0.005);
}

void RecordLog::log_clock(const OutputMessage& message) {
  const StepEvents& events = message.events;
  if (events.stamps_left_out) {
    const bool counts = events.stamps_count;
    spdlog::warn(
        "{}: its time stamps {} at {:.2f} % of the rate at which its pictures come, and are left "
        "out from frame {} on: a picture's time is known by its arrival, to {:.0f} ms{}; {}",
        video_.name(), counts ? "count pictures and tell no time: they run" : "run",
        100 * (1 + *events.stamps_left_out), *message.record.frame, 1e3 * video_stamp_sigma_s_,
        counts ? ", and less well behind one that is missing" : "",
        counts ? "set the camera to a rate that it keeps, or its stamps to its clock"
               : "a camera that counts its stamps at a rate it does not keep may be set to that "
                 "rate");
  } else if (events.video_clock_restarted) {
    spdlog::info("{}: clock filter restarted at frame {}: {}", video_.name(), *message.record.frame,
                 events.video_clock_restarted_by);
  }
  if (events.video_delay_stepped) {
    spdlog::warn(
        "{}: a step of the delay at frame {}: the video's least delay or the sender's clock moved "
        "by {:.1f} ms, which of the two cannot be told; a picture's time is known to that only, "
        "until the clock offset is found anew",
        video_.name(), *message.record.frame, 1e3 * events.video_moved_s);
  }
  if (events.zoom_contradicted) {
    spdlog::warn(
        "{}: its zoom reading is not the zoom that the pictures show from frame {} on: it stands "
        "still, or comes late; pictures are believed as long as landmarks hold",
        pan_tilt_.name(), *message.record.frame);
  }
  if (events.video_delay_wander_s == 0 || !wander_.is_due()) return;
  spdlog::warn(
      "{}: time stamps and arrivals of its pictures wander against each other, by {:.0f} ms at "
      "frame {}: a picture's time is known to that only; is a relay or Wi-Fi in between, or is the "
      "camera or this machine too busy?",
      video_.name(), 1e3 * events.video_delay_wander_s, *message.record.frame);
}

void RecordLog::log_delay(const OutputMessage& message) {
  const StepEvents& events = message.events;
  if (!events.link_delay_told || !events.link_delay) return;
  const double delay_ms = 1e3 * events.link_delay->delay_s;
  const double sigma_ms = 1e3 * events.link_delay->sigma_s;
  constexpr double kAlike = 3;     // standard deviations
  constexpr double kAlike_ms = 5;  // by which connections differ anyway
  if (std::abs(delay_ms) < std::max(kAlike_ms, kAlike * sigma_ms)) {
    spdlog::info(
        "{}: motion shows at frame {} that it comes as late against the pictures as when the "
        "camera was calibrated ({:+.1f} +- {:.1f} ms)",
        pan_tilt_.name(), *message.record.frame, delay_ms, sigma_ms);
    return;
  }
  spdlog::warn(
      "{}: it now comes {:.1f} +- {:.1f} ms {} against the pictures than when the camera was "
      "calibrated, as motion shows at frame {}: each connection has a delay of its own, as have "
      "codecs, relays and firmware; from here on it is looked up accordingly",
      pan_tilt_.name(), std::abs(delay_ms), sigma_ms, delay_ms > 0 ? "later" : "earlier",
      *message.record.frame);
}

void RecordLog::log_repeated(const OrientationRecord& record) {
  if (record.status != RecordStatus::kImageRepeated || !repeated_.is_due()) return;
  spdlog::warn(
      "{}: the picture of frame {} is the one before, sent again while the camera turned; such "
      "pictures are counted and left out; set the camera, converter or grabber to the rate at "
      "which it takes pictures",
      video_.name(), *record.frame);
}

void RecordLog::log_drops(const DropCounters& drops) {
  if (drops.total() == drops_logged_.total() || !drops_.is_due()) return;
  spdlog::warn("queues full: {}, {}, {} dropped so far", counted(drops.frames, "frame"),
               counted(drops.telemetry, "telemetry sample"), counted(drops.records, "record"));
  drops_logged_ = drops;
}

void RecordLog::add(const OutputMessage& message, const DropCounters& drops) {
  log_repeated(message.record);
  log_old_telemetry(message.record);
  log_clock(message);
  log_delay(message);
  log_drops(drops);
}

}  // namespace alidade
