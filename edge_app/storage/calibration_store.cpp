#include "edge_app/storage/calibration_store.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <system_error>
#include <utility>

#include "edge_app/storage/calibration_file.h"
#include "edge_app/storage/map_file.h"
#include "platform/system/text.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExtension = ".yaml";

bool is_there(const fs::path& path) {
  std::error_code error;
  return fs::symlink_status(path, error).type() != fs::file_type::not_found;
}

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

bool begins_with(const std::string& text, const std::string& begin) {
  return text.compare(0, begin.size(), begin) == 0;
}

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// The names in a folder, sorted. False with the reason in *error if it cannot be read.
bool list(const fs::path& folder, std::vector<std::string>* names, std::string* error) {
  std::error_code failure;
  fs::directory_iterator at(folder, failure);
  for (; !failure && at != fs::directory_iterator(); at.increment(failure)) {
    names->push_back(at->path().filename().string());
  }
  std::sort(names->begin(), names->end());
  if (failure) *error = folder.string() + ": cannot be read: " + failure.message();
  return !failure;
}

// The maps written for a yaml: the current one, and those that a power cut left behind.
constexpr const char* kMapMark = ".map-";
constexpr const char* kMapExtension = ".bin";

// Another content gets another name. (The checksum over the whole file, which ends with its own,
// would always be the same.)
fs::path map_path(const fs::path& yaml, const std::string& content) {
  const auto check = static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const unsigned char*>(content.data()), content.size() - 4));
  return folder_of(yaml) /
         fmt::format("{}{}{:08x}{}", yaml.stem().string(), kMapMark, check, kMapExtension);
}

std::vector<fs::path> maps_of(const fs::path& yaml) {
  constexpr std::size_t kDigits = 8;
  const std::string begin = yaml.stem().string() + kMapMark;
  std::vector<std::string> names;
  std::string ignored;
  static_cast<void>(list(folder_of(yaml), &names, &ignored));
  std::vector<fs::path> maps;
  for (const std::string& name : names) {
    if (begins_with(name, begin) && ends_with(name, kMapExtension) &&
        name.size() == begin.size() + kDigits + std::strlen(kMapExtension)) {
      maps.push_back(folder_of(yaml) / name);
    }
  }
  return maps;
}

// Whether a file is a calibration of the store, or its map.
bool is_of_store(const fs::path& file, const std::string& name) {
  const std::string stem = file.stem().string();
  const bool is_ours = begins_with(name, stem + ".zoom-") || begins_with(name, stem + kMapMark);
  return name == file.filename() ||
         (is_ours && (ends_with(name, kExtension) || ends_with(name, kMapExtension)));
}

// Renames an unusable file, if possible, and says what was done.
std::string set_aside(const fs::path& path, const char* as = ".damaged") {
  fs::path aside = path.string() + as;
  for (int i = 1; is_there(aside); ++i) aside = fmt::format("{}{}.{}", path.string(), as, i);
  std::error_code error;
  fs::rename(path, aside, error);
  if (error) return "not used; cannot be set aside: " + error.message();
  return "set aside as " + aside.filename().string();
}

// Also renames the maps of the calibration, which another calibration would otherwise replace.
std::string set_aside_with_maps(const fs::path& yaml, const char* as = ".damaged") {
  for (const fs::path& map : maps_of(yaml)) static_cast<void>(set_aside(map, as));
  return set_aside(yaml, as);
}

// The map that a calibration, parsed before, names; an empty path if it names none. False with one
// line if that map does not exist, or cannot be a map.
bool find_map(const fs::path& yaml, const std::string& text, fs::path* map, std::string* error) {
  map->clear();
  const YAML::Node root = YAML::Load(text);
  const fs::path name = root["landmarks"] ? root["landmarks"].Scalar() : "";
  if (name.empty()) return true;
  const fs::path path = folder_of(yaml) / name;
  if (name.filename() != name) {
    *error = fmt::format("{}: its map {} is not a file beside it: not used", yaml.string(),
                         name.string());
  } else if (name.extension() != kMapExtension) {
    // A file that is no map would be set aside. That must not happen to another file named by
    // mistake, such as the configuration.
    *error =
        fmt::format("{}: its map {} does not end in .bin: not used", yaml.string(), name.string());
  } else if (!is_there(path)) {
    *error = fmt::format("{}: its map {} is missing", yaml.string(), name.string());
  } else {
    *map = path;
  }
  return !map->empty();
}

constexpr const char* kWouldSetAside = "not used; run would set it aside";

void load_map_beside(const fs::path& yaml, const std::string& text, CalibrationStore::Use use,
                     StoredCalibration* stored, std::vector<std::string>* lines) {
  fs::path path;
  MapContent content;
  std::string error;
  if (!find_map(yaml, text, &path, &error)) {
    lines->push_back(error);
  } else if (!path.empty() && !load_map(path.string(), stored->calibration, &content, &error)) {
    lines->push_back(fmt::format(
        "{}; {}", error, use == CalibrationStore::Use::kLook ? kWouldSetAside : set_aside(path)));
  }
  stored->map = std::move(content.map);
}

std::string zoom_text(std::optional<double> zoom) {
  return zoom ? fmt::format("zoom {}", *zoom) : "any zoom";
}

// Of a folder's names, those of calibrations of zooms beside the configured file.
std::vector<fs::path> files_of_zooms(const fs::path& file, const std::vector<std::string>& names) {
  std::vector<fs::path> files;
  const std::string begin = file.stem().string() + ".zoom-";
  for (const std::string& name : names) {
    if (name != file.filename() && begins_with(name, begin) && ends_with(name, kExtension))
      files.push_back(folder_of(file) / name);
  }
  return files;
}

}  // namespace

std::vector<std::string> calibrations_of_zooms(const std::string& file) {
  std::vector<std::string> names;
  std::string ignored;
  static_cast<void>(list(folder_of(file), &names, &ignored));
  std::vector<std::string> out;
  for (const fs::path& each : files_of_zooms(file, names)) {
    out.push_back(fs::path(file).has_parent_path() ? each.string() : each.filename().string());
  }
  return out;
}

CalibrationStore::CalibrationStore(std::string file, double zoom_tolerance)
    : file_(std::move(file)), zoom_tolerance_(std::max(zoom_tolerance, 0.0)) {}

FileLock::Result CalibrationStore::lock(std::string* why) {
  std::error_code ignored;  // a folder that cannot be made prevents the lock, which says so
  fs::create_directories(folder_of(file_), ignored);
  return lock_.take(file_, why);
}

std::vector<std::string> CalibrationStore::load(int width, int height, Use use) {
  use_ = use;
  entries_.clear();
  curve_ = {};
  curve_path_.clear();
  std::vector<std::string> lines;
  const fs::path file(file_);
  const fs::path folder = folder_of(file);
  if (!is_there(folder)) return lines;
  std::vector<std::string> names;
  std::string unreadable;
  if (!list(folder, &names, &unreadable)) lines.push_back(unreadable);
  if (use_ == Use::kKeep) {
    const int removed = remove_unfinished(
        folder.string(), [&file](const std::string& name) { return is_of_store(file, name); });
    if (removed > 0)
      lines.push_back(fmt::format("{}: {} of a killed process removed", file_,
                                  counted(removed, "unfinished file")));
  }
  std::vector<fs::path> files = files_of_zooms(file, names);
  if (is_there(file)) files.insert(files.begin(), file);
  for (const fs::path& path : files) load_file(path.string(), width, height, &lines);
  return lines;
}

std::string CalibrationStore::set_file_aside(const std::string& path) const {
  return use_ == Use::kLook ? kWouldSetAside : set_aside_with_maps(path);
}

void CalibrationStore::load_file(const std::string& path, int width, int height,
                                 std::vector<std::string>* lines) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) {
    lines->push_back(path + ": not a file: not used");
    return;
  }
  StoredCalibration stored;
  stored.path = path;
  std::string text;
  std::string error;
  ZoomCurve curve;
  if (!read_file(path, &text, &error) ||
      !parse_stored_calibration(text, path, &stored.calibration, &error, &curve,
                                &stored.notes.telemetry_error)) {
    lines->push_back(fmt::format("{}; {}", error, set_file_aside(path)));
    return;
  }
  const Camera<double>& camera = stored.calibration.camera;
  if ((width > 0 && camera.width != width) || (height > 0 && camera.height != height)) {
    lines->push_back(
        fmt::format("{}: for pictures of {}x{} px, but video.width and video.height are {} and "
                    "{}: not used; it stays until another calibration is stored",
                    path, camera.width, camera.height, width, height));
    other_size_.push_back(path);
    return;
  }
  const std::optional<double>& zoom = stored.calibration.zoom;
  for (const Entry& entry : entries_) {
    if (entry.stored.calibration.zoom == zoom) {
      lines->push_back(
          fmt::format("{}: for {}, as {} is: not used", path, zoom_text(zoom), entry.stored.path));
      return;
    }
  }
  if (!curve.empty() && curve_.empty()) {
    curve_ = curve;
    curve_path_ = path;
    lines->push_back(fmt::format("{}: zoom curve from reading {} to {}", path,
                                 curve.first_reading(), curve.last_reading()));
  }
  load_map_beside(path, text, use_, &stored, lines);
  lines->push_back(fmt::format("{}: calibration for {}, {} landmarks", path, zoom_text(zoom),
                               stored.map.landmarks.size()));
  entries_.push_back({std::move(stored), false});
}

std::optional<std::size_t> CalibrationStore::nearest(std::optional<double> zoom) const {
  std::optional<std::size_t> best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const std::optional<double>& its = entries_[i].stored.calibration.zoom;
    if (its.has_value() != zoom.has_value()) continue;
    const double distance = zoom ? std::abs(*zoom - *its) : 0;
    if (distance <= zoom_tolerance_ && distance < least) {
      least = distance;
      best = i;
    }
  }
  return best;
}

const StoredCalibration* CalibrationStore::find(std::optional<double> zoom) const {
  std::optional<std::size_t> found = nearest(zoom);
  if (!found && zoom && curve_.at(*zoom, &between_.calibration)) {
    between_.path = name_on_curve(curve_path_, curve_, *zoom);
    return &between_;
  }
  if (!found && !zoom && !curve_.empty()) {
    const auto holds_curve =
        std::find_if(entries_.begin(), entries_.end(),
                     [this](const Entry& entry) { return entry.stored.path == curve_path_; });
    if (holds_curve != entries_.end()) return &holds_curve->stored;
  }
  if (!found && zoom) found = nearest(std::nullopt);
  if (!found && !zoom && entries_.size() == 1) found = 0;
  return found ? &entries_[*found].stored : nullptr;
}

bool CalibrationStore::save(const StoredCalibration& calibration, std::string* error) {
  // Pictures have come in the configured size: it is right.
  for (const std::string& path : other_size_)
    static_cast<void>(set_aside_with_maps(path, ".replaced"));
  other_size_.clear();
  const std::optional<std::size_t> same = nearest(calibration.calibration.zoom);
  const std::size_t at = same.value_or(entries_.size());
  if (!same) entries_.emplace_back();
  Entry& entry = entries_[at];
  const std::string path = same ? entry.stored.path : "";
  entry = {calibration, true};
  entry.stored.path = path;
  if (calibration.notes.zoom_curve.empty()) return write(&entry, error);
  curve_ = calibration.notes.zoom_curve;
  for (Entry& other : entries_) {
    if (&other != &entry && !curve_path_.empty() && other.stored.path == curve_path_)
      other.pending = true;
  }
  return save_pending(error);
}

std::string CalibrationStore::set_zooms_aside() {
  std::string done;
  const auto is_of_a_zoom = [this](const Entry& entry) {
    return entry.stored.calibration.zoom ||
           (!curve_path_.empty() && entry.stored.path == curve_path_);
  };
  for (const Entry& entry : entries_) {
    if (!is_of_a_zoom(entry) || entry.stored.path.empty()) continue;
    done += fmt::format("{}{}: {}", done.empty() ? "" : "; ", entry.stored.path,
                        set_aside_with_maps(entry.stored.path, ".replaced"));
  }
  entries_.erase(std::remove_if(entries_.begin(), entries_.end(), is_of_a_zoom), entries_.end());
  curve_ = {};
  curve_path_.clear();
  return done;
}

bool CalibrationStore::has_pending() const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [](const Entry& entry) { return entry.pending; });
}

bool CalibrationStore::save_pending(std::string* error) {
  bool all = true;
  for (Entry& entry : entries_) {
    std::string problem;
    if (!entry.pending || write(&entry, &problem)) continue;
    if (all) *error = problem;
    all = false;
  }
  return all;
}

// A name for a new file that no other calibration has. A file's content counts, not its name.
std::string CalibrationStore::free_path(const StoredCalibration& stored) const {
  const std::optional<double>& zoom = stored.calibration.zoom;
  const fs::path file(file_);
  const fs::path begin = folder_of(file) / file.stem();
  const std::string named =
      fmt::format("{}.zoom-{}", begin.string(), zoom ? fmt::format("{}", *zoom) : "any");
  const bool brings_curve = curve_path_.empty() && !stored.notes.zoom_curve.empty();
  std::string path = zoom && !brings_curve ? named + kExtension : file_;
  const auto taken = [&] {
    return std::any_of(entries_.begin(), entries_.end(),
                       [&](const Entry& entry) { return entry.stored.path == path; });
  };
  if (brings_curve && taken()) path = named + kExtension;
  for (int i = 1; taken(); ++i) path = fmt::format("{}-{}{}", named, i, kExtension);
  return path;
}

// First the map is written, under a name of its own, then the calibration that names it; then the
// old map is removed. So at any moment the calibration on disk has its map beside it.
bool CalibrationStore::write(Entry* entry, std::string* error) {
  StoredCalibration& stored = entry->stored;
  const fs::path path = stored.path.empty() ? free_path(stored) : stored.path;
  std::error_code failure;
  fs::create_directories(folder_of(path), failure);
  if (failure) {
    *error = folder_of(path).string() + ": cannot be made: " + failure.message();
    return false;
  }
  fs::path map;
  bool map_is_new = false;
  std::string map_flaw;
  stored.notes.landmarks.clear();
  // A new calibration at one reading does not change the others' files.
  const bool holds_curve =
      curve_path_.empty() ? !stored.notes.zoom_curve.empty() : path == curve_path_;
  stored.notes.zoom_curve = holds_curve ? curve_ : ZoomCurve();
  if (!stored.map.landmarks.empty()) {
    const MapContent content{{}, stored.map};
    const std::string bytes = format_map(content, stored.calibration);
    map = map_path(path, bytes);
    map_is_new = !is_there(map);
    MapContent as_read;
    if (!parse_map(bytes, "refused to write " + map.string(), stored.calibration, &as_read,
                   &map_flaw)) {
      map.clear();
    } else if (!write_file_atomically(map.string(), bytes, error)) {
      return false;
    }
    stored.notes.landmarks = map.filename().string();
  }
  if (!save_calibration(path.string(), stored.calibration, stored.notes, error)) {
    if (map_is_new && !map.empty()) fs::remove(map, failure);
    return false;
  }
  stored.path = path.string();
  if (holds_curve) curve_path_ = stored.path;
  entry->pending = false;
  for (const fs::path& old : maps_of(path)) {
    if (old != map) fs::remove(old, failure);
  }
  if (!map_flaw.empty()) *error = map_flaw;
  return map_flaw.empty();
}

}  // namespace alidade
