// alidade_people: PersonDetector at the known scale against all scales, on pictures in which people were marked by hand.
//   alidade_people DIR [--people vtest_people.txt]     DIR/N.png is frame N of vtest.avi (Debian's opencv-doc)
// A box finds a person when they overlap by 0.4; each finds one.
// The camera of vtest.avi is known by its people's heights alone: f 1000 px, 6.5 m above the ground, looking 19 degrees down.
// Exit status: 0 all figures are as they should be, 1 some are not (listed last) or pictures are missing, 2 wrong usage.

#include <CLI/CLI.hpp>
#include <ctime>
#include <fstream>
#include <iostream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "core/detection/person_detector.h"
#include "core/model/trigonometry.h"
#include "test/accuracy/table.h"

namespace alidade::test {
namespace {

struct Person {
  DetectionBox box;
  bool counts;
};

struct Picture {
  cv::Mat image;
  std::vector<Person> people;
};

struct Tally {
  int people = 0, found = 0, false_alarms = 0;
  double cpu_s = 0;
};

double cpu_now_s() {
  std::timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::map<int, Picture> read(const std::string& people, const std::string& folder) {
  std::map<int, Picture> pictures;
  std::ifstream in(people);
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    int frame = 0;
    double middle = 0, top = 0, foot = 0;
    bool counts = false;
    if (!(fields >> frame >> middle >> top >> foot >> counts)) {
      throw std::runtime_error(people + ": not a person: " + line);
    }
    Picture& picture = pictures[frame];
    if (picture.image.empty()) {
      const std::string file = folder + "/" + std::to_string(frame) + ".png";
      picture.image = cv::imread(file, cv::IMREAD_GRAYSCALE);
      if (picture.image.empty()) throw std::runtime_error(file + ": cannot be read");
    }
    const double height = foot - top;
    picture.people.push_back({{middle - 0.2 * height, top, 0.4 * height, height, 0, 0}, counts});
  }
  if (pictures.empty()) throw std::runtime_error(people + ": nobody in it");
  return pictures;
}

FrameOrientation looking_down(double f, int width, int height) {
  Calibration calibration;
  calibration.camera = {f, 1, {0}, width, height};
  FrameOrientation frame;
  if (!make_frame_orientation(calibration, 0, OrientationMode::kPt, 0, FrameMotion<double>(),
                              MotionCovariance::Zero(), Sensitivity<6>::Zero(), &frame)) {
    throw std::runtime_error("no orientation");
  }
  return frame;
}

void list(int frame, const char* what, const DetectionBox& box) {
  std::cerr << "frame " << frame << ": " << what << " at " << box.u << ", " << box.v << ", "
            << box.width << " x " << box.height << " px, " << number(box.score) << "\n";
}

void judge(int frame, const Picture& picture, const std::vector<DetectionBox>& boxes, bool listed,
           Tally* tally) {
  constexpr double kLeastOverlap = 0.4;
  std::vector<bool> taken(picture.people.size());
  for (const DetectionBox& box : boxes) {
    double best = kLeastOverlap;
    std::size_t which = picture.people.size();
    for (std::size_t i = 0; i < picture.people.size(); ++i) {
      const double common = overlap(picture.people[i].box, box);
      if (common > best && !(taken[i] && picture.people[i].counts)) {
        best = common;
        which = i;
      }
    }
    if (which == picture.people.size()) {
      ++tally->false_alarms;
      if (listed) list(frame, "false alarm", box);
    } else {
      if (picture.people[which].counts) ++tally->found;
      taken[which] = true;
    }
  }
  for (std::size_t i = 0; i < picture.people.size(); ++i) {
    const Person& person = picture.people[i];
    tally->people += person.counts ? 1 : 0;
    if (listed && person.counts && !taken[i]) list(frame, "missed", person.box);
  }
}

Tally run(const std::map<int, Picture>& pictures, bool known_scale, double threshold, bool listed) {
  PersonOptions options;
  options.threshold = threshold;
  PersonDetector detector(options);
  Tally tally;
  for (const auto& [frame_number, picture] : pictures) {
    const cv::Mat& image = picture.image;
    const ImageView view{image.data, image.cols, image.rows,
                         static_cast<std::ptrdiff_t>(image.step)};
    const FrameOrientation frame = looking_down(1000, image.cols, image.rows);
    WorldPlane plane;
    plane.R_base_from_world = R_base_from_world_of(0, -19 * kPi / 180, 0);
    plane.position = {0, 0, 6.5};
    const double before = cpu_now_s();
    const PersonStatus status =
        known_scale ? detector.find(view, frame, plane) : detector.find_at_all_scales(view);
    tally.cpu_s += cpu_now_s() - before;
    if (status != PersonStatus::kOk) throw std::runtime_error(to_string(status));
    judge(frame_number, picture, detector.boxes(), listed && known_scale, &tally);
  }
  return tally;
}

}  // namespace
}  // namespace alidade::test

int main(int argc, char** argv) {
  using namespace alidade::test;
  CLI::App app("People by HOG at the scale that the world plane tells, and at all scales");
  std::string folder;
  std::string people = ALIDADE_PEOPLE;
  std::vector<double> thresholds{0, 0.2, 0.4};
  app.add_option("pictures", folder, "folder with N.png for each frame N")->required();
  app.add_option("--people", people, "who is in them");
  app.add_option("--thresholds", thresholds, "of the SVM");
  bool listed = false;
  app.add_flag("--list", listed, "what is missed and what is wrong at the known scale");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  std::vector<std::string> missed;
  try {
    const auto pictures = read(people, folder);
    Table table{"HOG at the known scale, and at all scales; " + std::to_string(pictures.size()) +
                    " pictures",
                {"threshold", "recall", "false alarms/picture", "CPU ms", "all: recall",
                 "false alarms/picture", "CPU ms"},
                {},
                {}};
    const auto count = static_cast<double>(pictures.size());
    for (const double threshold : thresholds) {
      const Tally one = run(pictures, true, threshold, listed);
      const Tally all = run(pictures, false, threshold, listed);
      const auto cells = [&](const Tally& t) {
        return std::vector<std::string>{number(static_cast<double>(t.found) / t.people),
                                        number(t.false_alarms / count),
                                        number(1e3 * t.cpu_s / count)};
      };
      std::vector<std::string> row{number(threshold)};
      for (const Tally& tally : {one, all}) {
        for (const std::string& cell : cells(tally)) row.push_back(cell);
      }
      table.rows.push_back(row);
      // Marks are of the options as they are.
      if (threshold != alidade::PersonOptions().threshold) continue;
      const std::string at = "threshold " + number(threshold) + ": ";
      if (one.found < all.found) missed.push_back(at + "recall is lower than at all scales");
      if (3 * one.false_alarms > all.false_alarms)
        missed.push_back(at + "more than a third of the false alarms");
      if (3 * one.cpu_s > all.cpu_s) missed.push_back(at + "more than a third of the time");
    }
    table.print(std::cout);
  } catch (const std::exception& error) {
    std::cerr << "alidade_people: " << error.what() << "\n";
    return 1;
  }
  for (const std::string& what : missed) std::cout << "MISSED: " << what << "\n";
  return missed.empty() ? 0 : 1;
}
