#include "components/workspace_camera/pose_checker.hpp"

#include <algorithm>

namespace phantom::workspace_camera {
namespace {

std::vector<std::uint16_t> ids_of(const std::vector<ModelObject>& objects) {
  std::vector<std::uint16_t> ids;
  for (const ModelObject& object : objects) ids.push_back(object.id);
  return ids;
}

}  // namespace

PoseChecker::PoseChecker(const PoseCheckRules& rules, std::vector<ModelObject> objects)
    : rules_(rules),
      check_(rules, std::move(objects)),
      ids_(ids_of(check_.objects())),
      places_(ids_.size()),
      confirmed_(rules.tolerance_m),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

PoseChecker::~PoseChecker() {
  thread_.request_stop();
  wanted_.notify_all();
}

void PoseChecker::place(std::uint16_t id, const Place& X_WO) {
  const auto found = std::ranges::find(ids_, id);
  if (found == ids_.end()) return;
  const std::lock_guard lock(mutex_);
  Place& place = places_[static_cast<std::size_t>(found - ids_.begin())];
  if (is_same(place, X_WO)) return;
  place = X_WO;
  confirmed_.forget(id);
}

void PoseChecker::forget_camera(std::size_t camera) {
  const std::lock_guard lock(mutex_);
  confirmed_.forget_camera(camera);
  forgotten_ = forgotten_ || (busy_ && camera_ == camera);
}

void PoseChecker::offer(std::size_t camera, const fusion::DepthImage& image,
                        std::span<const float> arm_depth_m, core::Nanoseconds now_ns) {
  if (camera >= due_ns_.size()) due_ns_.resize(camera + 1);
  if (now_ns < due_ns_[camera]) return;
  const std::lock_guard lock(mutex_);
  if (busy_) return;
  due_ns_[camera] = now_ns + core::from_seconds(rules_.every_s);
  busy_ = true;
  camera_ = camera;
  image_ = image;
  arm_depth_m_.assign(arm_depth_m.begin(), arm_depth_m.end());
  wanted_.notify_all();
}

std::vector<ConfirmedFinding> PoseChecker::findings() const {
  const std::lock_guard lock(mutex_);
  return confirmed_.reported();
}

void PoseChecker::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (wanted_.wait(lock, stop, [this] { return busy_; })) {
    const auto places = places_;
    lock.unlock();
    const auto findings = check_.judge(image_, arm_depth_m_, places);  // nobody writes the image while busy
    lock.lock();
    // What has moved meanwhile is judged with the next image.
    std::vector<PoseFinding> valid;
    for (const PoseFinding& finding : findings) {
      const auto i = static_cast<std::size_t>(std::ranges::find(ids_, finding.id) - ids_.begin());
      if (is_same(places_[i], places[i])) valid.push_back(finding);
    }
    if (!forgotten_) confirmed_.take(camera_, valid);
    busy_ = forgotten_ = false;
  }
}

}  // namespace phantom::workspace_camera
