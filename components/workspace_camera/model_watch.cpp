#include "components/workspace_camera/model_watch.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace phantom::workspace_camera {

ModelWatch::ModelWatch(const WorkspaceCameraConfig& config, std::vector<ModelObject> objects,
                       std::vector<Place> X_WO)
    : objects_(std::move(objects)), X_WO_(std::move(X_WO)), checker_(config.pose_check, objects_) {
  for (const CameraConfig& camera : config.cameras)
    cameras_.push_back({camera.name, camera.link.empty(), false, CameraAlignment(config.fusion.sigma), {}});
  for (std::size_t i = 0; i < objects_.size(); ++i) pass(i);
}

Place ModelWatch::place_of(std::size_t object) const {
  return carried_.contains(objects_[object].id) ? Place() : X_WO_[object];
}

std::vector<Place> ModelWatch::places() const {
  std::vector<Place> places;
  for (std::size_t i = 0; i < objects_.size(); ++i) places.push_back(place_of(i));
  return places;
}

void ModelWatch::pass(std::size_t object) {
  checker_.place(objects_[object].id, place_of(object));
  for (Camera& camera : cameras_) {
    camera.drawn = false;
    if (!camera.watch.knocked()) camera.watch.restart();
  }
}

void ModelWatch::place(std::uint16_t id, const Place& X_WO) {
  const auto found = std::ranges::find(objects_, id, &ModelObject::id);
  if (found == objects_.end()) return;
  const auto object = static_cast<std::size_t>(found - objects_.begin());
  if (is_same(std::exchange(X_WO_[object], X_WO), X_WO)) return;
  pass(object);
}

void ModelWatch::set_carried(const std::set<std::uint16_t>& ids) {
  const std::set<std::uint16_t> before = std::exchange(carried_, ids);
  for (std::size_t i = 0; i < objects_.size(); ++i)
    if (before.contains(objects_[i].id) != carried_.contains(objects_[i].id)) pass(i);
}

void ModelWatch::draw(Camera& camera, const fusion::DepthImage& image) const {
  if (camera.drawn && camera.alignment.is_for(image.camera(), image.X_WC())) return;
  camera.alignment.set_model(image.camera(), image.X_WC(), objects_, places());
  camera.drawn = true;
}

bool ModelWatch::take(std::size_t index, const fusion::DepthImage& image, std::span<const float> arm_depth_m,
                      core::Nanoseconds now_ns) {
  Camera& camera = cameras_[index];
  const auto is_wrong = [&camera] { return camera.watch.knocked() || camera.watch.misplaced(); };
  const bool was_wrong = is_wrong(), was_covered = camera.cover.covered();
  if (now_ns >= camera.due_ns) {
    camera.due_ns = now_ns + kKnockPeriod_ns;
    if (camera.fixed) {
      draw(camera, image);
      if (const auto offset = camera.alignment.offset(image, arm_depth_m)) camera.watch.put(*offset);
    }
    camera.cover.put(camera.fixed ? camera.alignment.view(image, arm_depth_m)
                                  : CameraAlignment::view_of_model(image, arm_depth_m, objects_, places()));
    if (was_wrong != is_wrong()) checker_.forget_camera(index);
  }
  if (!is_wrong()) checker_.offer(index, image, arm_depth_m, now_ns);
  return was_wrong != is_wrong() || was_covered != camera.cover.covered();
}

std::vector<std::string> ModelWatch::sentences() const {
  std::vector<std::string> all;
  for (const Camera& camera : cameras_) {
    if (camera.watch.misplaced())
      all.push_back(fmt::format(
          "camera '{}' stands elsewhere than its pose says, by {:.0f} mm where it looks and {:.1f}°: "
          "calibrate it, and start again",
          camera.name, 1e3 * camera.watch.shift_m(), 57.29578 * camera.watch.turn_rad()));
    if (camera.watch.knocked())
      all.push_back(fmt::format(
          "camera '{}' was knocked, or most of what it sees has moved: calibrate it, and start again",
          camera.name));
  }
  for (const Camera& camera : cameras_)
    if (camera.cover.covered())
      all.push_back(
          fmt::format("camera '{}' sees hardly anything of what is there: it is covered, or "
                      "something stands close before it",
                      camera.name));
  for (const ConfirmedFinding& one : findings())
    if (one.finding.verdict != PoseVerdict::kAgrees) all.push_back(sentence(one.finding));
  return all;
}

}  // namespace phantom::workspace_camera
