#include "test/support/target_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

namespace alidade::test {

namespace {

constexpr double kPersonHeight = 1.75;

Eigen::Matrix<double, 3, 4> projection(double camera_height, double pan, double tilt, double f) {
  Eigen::Matrix3d K;
  K << f, 0, kSceneWidth / 2, 0, f, kSceneHeight / 2, 0, 0, 1;
  const Eigen::Vector3d forward(std::sin(pan) * std::cos(tilt), std::cos(pan) * std::cos(tilt),
                                std::sin(tilt));
  const Eigen::Vector3d right(std::cos(pan), -std::sin(pan), 0);
  const Eigen::Vector3d down = forward.cross(right);
  Eigen::Matrix<double, 3, 4> P;
  P.row(0) << right.transpose(), 0;
  P.row(1) << down.transpose(), 0;
  P.row(2) << forward.transpose(), 0;
  P.col(3) = -camera_height * P.col(2);
  return K * P;
}

Eigen::Vector2d project(const Eigen::Matrix<double, 3, 4>& P, const Eigen::Vector2d& place,
                        double height) {
  const Eigen::Vector3d p = P * Eigen::Vector4d(place.x(), place.y(), height, 1);
  return p.head<2>() / p.z();
}

struct Person {
  Eigen::Vector2d place, velocity, goal;
  double speed = 1.3;
};

class Crowd {
 public:
  Crowd(const TargetSceneOptions& options, std::mt19937_64* random)
      : options_(options), random_(random), people_(static_cast<std::size_t>(options.targets)) {
    for (std::size_t i = 0; i < people_.size(); ++i) {
      people_[i].goal = new_goal(i);
      people_[i].place = new_goal(i);
      if (options_.kind == SceneKind::kCrossing) {
        people_[i].place.x() *= i % 2 == 0 ? 1 : -1;
        side_ = 1;
      }
      if (options_.kind == SceneKind::kGroup && i > 0) {
        people_[i].place = people_[0].place + Eigen::Vector2d(0.8 * static_cast<double>(i), 0);
      }
      people_[i].velocity.setZero();
      people_[i].speed = hockey() ? 4.5 + 1.5 * uniform(-1, 1) : 1.3 + 0.3 * uniform(-1, 1);
      if (options_.kind == SceneKind::kGroup || options_.kind == SceneKind::kCrossing) {
        people_[i].speed = 1.3;
      }
    }
    if (options_.kind == SceneKind::kModel) {
      for (Person& person : people_) person.velocity << 0.5 * normal(), 0.5 * normal();
    }
    puck_ = new_goal(0);
  }

  void move(double dt) {
    time_ += dt;
    if (hockey() && uniform(0, 1) < dt / 2.5) puck_ = new_goal(0);
    if (options_.kind == SceneKind::kCrossing && time_ > 14) {
      time_ = 0;
      side_ = -side_;
    }
    const std::vector<Person> before = people_;
    for (std::size_t i = 0; i < people_.size(); ++i) {
      Person& person = people_[i];
      if (options_.kind == SceneKind::kModel) {
        // A kick of velocity in the middle of the step.
        const Eigen::Vector2d kick =
            std::sqrt(kModelAccelerationDensity * dt) * Eigen::Vector2d(normal(), normal());
        person.place += dt * (person.velocity + kick / 2);
        person.velocity += kick;
        continue;
      }
      Eigen::Vector2d goal = person.goal;
      if (hockey()) goal = puck_ + 0.45 * (person.goal - Eigen::Vector2d(0, 28));
      if (options_.kind == SceneKind::kCrossing) goal = crossing_goal(i);
      if (options_.kind == SceneKind::kGroup && i > 0) {
        goal = before[0].place + 1.5 * before[0].velocity +
               Eigen::Vector2d(0.8 * static_cast<double>(i), 0);
      }
      const Eigen::Vector2d way = goal - person.place;
      if (way.norm() < 1 || uniform(0, 1) < dt / 15) {
        if (options_.kind != SceneKind::kGroup || i == 0) person.goal = new_goal(i);
      }
      Eigen::Vector2d wanted = way * std::min(person.speed / std::max(way.norm(), 1e-9), 1.0);
      if (options_.kind == SceneKind::kWalkers || hockey()) {
        for (std::size_t j = 0; j < people_.size(); ++j) {
          if (j != i) wanted += person.speed * aside(before[i], before[j]);
        }
      }
      const double relaxation = hockey() ? 1.0 : 0.7;
      const double restless = hockey() ? 0.8 : 0.3;
      person.velocity += dt / relaxation * (wanted - person.velocity) +
                         std::sqrt(dt) * restless * Eigen::Vector2d(normal(), normal());
      person.place += dt * person.velocity;
    }
    if (options_.kind != SceneKind::kModel) keep_bodies_apart();
  }

  [[nodiscard]] const std::vector<Person>& people() const { return people_; }

  [[nodiscard]] Eigen::Vector2d middle() const {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (const Person& person : people_) sum += person.place;
    return sum / static_cast<double>(people_.size());
  }

 private:
  // Who would come within 1.2 m of somebody in the next 1.5 s steps aside, as a share of his speed.
  [[nodiscard]] static Eigen::Vector2d aside(const Person& person, const Person& other) {
    constexpr double kRoom = 1.2;
    const Eigen::Vector2d apart = person.place - other.place;
    const Eigen::Vector2d closing = person.velocity - other.velocity;
    const double time = -apart.dot(closing) / std::max(closing.squaredNorm(), 1e-9);
    if (time < 0 || time > 1.5) return Eigen::Vector2d::Zero();
    const Eigen::Vector2d nearest = apart + time * closing;
    const double miss = nearest.norm();
    if (miss > kRoom) return Eigen::Vector2d::Zero();
    const Eigen::Vector2d across = Eigen::Vector2d(-closing.y(), closing.x()).normalized();
    return (1 - miss / kRoom) * (miss > 0.05 ? Eigen::Vector2d(nearest / miss) : across);
  }

  // Nobody stands within somebody else.
  void keep_bodies_apart() {
    const double body = hockey() ? 0.6 : options_.kind == SceneKind::kCrossing ? 0.35 : 0.5;
    for (std::size_t i = 0; i < people_.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const Eigen::Vector2d apart = people_[i].place - people_[j].place;
        const double distance = apart.norm();
        if (distance >= body || distance < 1e-6) continue;
        const Eigen::Vector2d push = (body - distance) / 2 * apart / distance;
        people_[i].place += push;
        people_[j].place -= push;
        // What drove them into each other is over.
        const double closing = (people_[i].velocity - people_[j].velocity).dot(apart) / distance;
        if (closing < 0) {
          people_[i].velocity -= closing / 2 * apart / distance;
          people_[j].velocity += closing / 2 * apart / distance;
        }
      }
    }
  }

  [[nodiscard]] bool hockey() const { return options_.kind == SceneKind::kHockey; }
  [[nodiscard]] double uniform(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(*random_);
  }
  [[nodiscard]] double normal() { return std::normal_distribution<double>()(*random_); }

  [[nodiscard]] Eigen::Vector2d new_goal(std::size_t i) {
    if (options_.kind == SceneKind::kCrossing) {
      const double row =
          static_cast<double>(i / 2) - 0.25 * (static_cast<double>(options_.targets) - 1);
      return {i % 2 == 0 ? -7.0 : 7.0, 22 + 2.5 * row + (i % 2 == 0 ? 0.2 : -0.2)};
    }
    if (hockey()) return {uniform(-25, 25), uniform(15, 41)};
    return {uniform(-10, 10), uniform(16, 34)};
  }

  [[nodiscard]] Eigen::Vector2d crossing_goal(std::size_t i) {
    Eigen::Vector2d goal = new_goal(i);
    goal.x() *= side_;
    return goal;
  }

  const TargetSceneOptions options_;
  std::mt19937_64* random_;
  std::vector<Person> people_;
  Eigen::Vector2d puck_;
  double time_ = 0;
  double side_ = 1;
};

}  // namespace

Eigen::Matrix3d SceneFrame::H_picture_from_plane() const {
  Eigen::Matrix3d H;
  H << P.col(0), P.col(1), P.col(3);
  return H;
}

SceneBox box_at(const SceneFrame& frame, const Eigen::Vector2d& place) {
  const Eigen::Vector2d foot = project(frame.P, place, 0);
  SceneBox box;
  box.height = foot.y() - project(frame.P, place, kPersonHeight).y();
  box.width = 0.4 * box.height;
  box.left = foot.x() - box.width / 2;
  box.top = foot.y() - box.height;
  return box;
}

std::vector<SceneFrame> simulate_targets(const TargetSceneOptions& options) {
  // What the detector does must not change where people go.
  std::mt19937_64 people(options.seed);
  std::mt19937_64 detector(options.seed + 1000003);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0, 1);
  std::poisson_distribution<int> alarms(options.false_alarms);
  Crowd crowd(options, &people);
  constexpr int kSubsteps = 4;
  const double dt = 1 / options.frame_rate;
  const bool hockey = options.kind == SceneKind::kHockey;
  const double height = hockey ? 12 : 7;
  Eigen::Vector2d looked_at = crowd.middle();
  std::vector<SceneFrame> frames;
  const int count = static_cast<int>(options.duration_s * options.frame_rate);
  for (int k = 0; k < count; ++k) {
    const double t = k * dt;
    for (int i = 0; i < kSubsteps; ++i) crowd.move(dt / kSubsteps);
    // Turns after them, late, and sways; the lens goes from wide to three quarters more and back.
    looked_at += dt / 0.8 * (crowd.middle() - looked_at);
    double pan = std::atan2(looked_at.x(), looked_at.y());
    double tilt = -std::atan2(height - 1, looked_at.norm());
    double f = hockey ? 600 : 1000;
    if (options.camera_moves) {
      pan += 0.04 * std::sin(0.9 * t);
      tilt += 0.015 * std::sin(1.3 * t);
      f *= 1.35 - 0.35 * std::cos(0.4 * t);
    } else {
      pan = 0;
      tilt = -0.24;
    }
    if (options.look_away_s > 0 && std::fmod(t, 15) > 15 - options.look_away_s) pan += 1.2;

    SceneFrame frame;
    frame.time_s = t;
    const Eigen::Matrix<double, 3, 4> P = projection(height, pan, tilt, f);
    Eigen::Vector2d off = Eigen::Vector2d::Zero();
    if (!options.camera_errors.empty()) {
      const auto second = std::min(static_cast<std::size_t>(t), options.camera_errors.size() - 1);
      frame.has_pose = options.camera_errors[second].has_value();
      off = options.camera_errors[second].value_or(off);
    }
    frame.P = projection(height, pan + off.x() + options.camera_noise_px / f * normal(detector),
                         tilt - off.y() + options.camera_noise_px / f * normal(detector), f);
    for (const Person& person : crowd.people()) {
      SceneTarget target;
      target.place = person.place;
      target.velocity = person.velocity;
      target.pixel = project(P, person.place, 0);
      const double in_front = P.row(2) * Eigen::Vector4d(person.place.x(), person.place.y(), 0, 1);
      target.in_view = in_front > 0 && target.pixel.x() > 0 && target.pixel.x() < kSceneWidth &&
                       target.pixel.y() > 0 && target.pixel.y() < kSceneHeight;
      if (target.in_view && unit(detector) < options.recall) {
        const Eigen::Vector2d noise(normal(detector), normal(detector));
        frame.detections.push_back(
            {target.pixel + options.noise_px * noise, static_cast<int>(frame.targets.size())});
      }
      frame.targets.push_back(target);
    }
    for (int i = alarms(detector); i > 0; --i) {
      frame.detections.push_back(
          {{kSceneWidth * unit(detector), kSceneHeight * unit(detector)}, -1});
    }
    std::shuffle(frame.detections.begin(), frame.detections.end(), detector);
    frames.push_back(frame);
  }
  return frames;
}

}  // namespace alidade::test
