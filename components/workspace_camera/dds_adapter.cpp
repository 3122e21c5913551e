#include "components/workspace_camera/dds_adapter.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>

#include "common/dds/admission/refusal_log.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/object_subscriber.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/status_reporter.hpp"
#include "common/messages/topic_receiver.hpp"

namespace phantom::workspace_camera {

struct DdsAdapter::Impl {
  Impl(const core::NetworkOptions& network, const std::string& name, const std::vector<std::string>& cameras,
       const robot::SerialArm* arm, ArmHistory& history)
      : participant("workspace_camera", network),
        names(cameras),
        receivers(cameras.size()),
        waiting(cameras.size()),
        changes(participant, dds::kOccupancyChange),
        views(participant, dds::kSpaceView),
        findings(participant, dds::kPoseFinding),
        status(participant, name) {
    if (arm != nullptr) {
      slave.emplace(participant, dds::kSlaveState, messages::bounds_of(*arm),
                    [&history](const messages::Received<messages::SlaveState>& state) {
                      history.put(state.received_ns, state.position);
                    });
      gripper.emplace(participant, dds::kGripperState, messages::ArmBounds(),
                      [&history](const messages::Received<messages::GripperState>& state) {
                        history.set_closing(1.0 - state.sense.width_m / state.widest_m);
                      });
    }
    placed.emplace(participant, [this](const auto& changed, const auto& now_carried) {
      const std::lock_guard lock(mutex);
      for (const messages::WorkspaceObject& object : changed) objects.insert_or_assign(object.id, object);
      carried = now_carried;
    });
    if (!cameras.empty())
      images.emplace(participant, dds::kDepthImage,
                     [this](const msg::DepthImage& message, const dds::SampleInfo& info) {
                       return take(message, info);
                     });
  }

  bool take(const msg::DepthImage& message, const dds::SampleInfo& info) {
    const auto found = std::ranges::find(names, std::string(message.camera().c_str()));
    if (found == names.end()) {
      refusals.refused("no camera of that name is configured with driver: topic", info.received_ns);
      return false;
    }
    const auto camera = static_cast<std::size_t>(found - names.begin());
    auto image = receivers[camera].take(message, info.received_ns);
    if (!image) {
      refusals.refused(image.status().message(), info.received_ns);
      return false;
    }
    const std::lock_guard lock(mutex);
    waiting[camera] = *std::move(image);
    arrived.notify_one();
    return true;
  }

  dds::Participant participant;
  const std::vector<std::string> names;
  std::mutex mutex;
  std::condition_variable arrived;
  std::vector<messages::TopicReceiver<msg::DepthImage>> receivers;  // by camera; the middleware's thread
  std::vector<std::optional<messages::Received<messages::DepthImage>>> waiting;  // guarded by mutex
  std::optional<std::vector<messages::CarriedObject>> carried;                   // likewise
  std::map<std::uint16_t, messages::WorkspaceObject> objects;                    // that changed; likewise
  std::size_t turn = 0;
  bool woken = false;  // guarded by mutex
  dds::RefusalLog refusals{"depth_image"};
  messages::Publisher<messages::OccupancyChange> changes;
  messages::Publisher<messages::SpaceView> views;
  dds::Writer<msg::PoseFinding> findings;
  std::uint32_t served = 0;  // readers that have got a whole occupancy
  messages::StatusReporter status;
  std::optional<messages::TopicSubscriber<msg::SlaveState>> slave;
  std::optional<messages::TopicSubscriber<msg::GripperState>> gripper;
  std::optional<messages::ObjectSubscriber> placed;
  std::optional<dds::Reader<msg::DepthImage>> images;
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const std::string& name,
                       const std::vector<std::string>& cameras, const robot::SerialArm* arm,
                       ArmHistory& history)
    : impl_(std::make_unique<Impl>(network, name, cameras, arm, history)) {}
DdsAdapter::~DdsAdapter() = default;

std::optional<DdsAdapter::Image> DdsAdapter::next_image(double wait_s) {
  std::unique_lock lock(impl_->mutex);
  const auto some_waits = [this] {
    return std::ranges::any_of(impl_->waiting, [](const auto& image) { return image.has_value(); });
  };
  impl_->arrived.wait_for(lock, std::chrono::duration<double>(std::max(0.0, wait_s)),
                          [&] { return impl_->woken || some_waits(); });
  impl_->woken = false;
  if (!some_waits()) return std::nullopt;
  while (!impl_->waiting[impl_->turn]) impl_->turn = (impl_->turn + 1) % impl_->waiting.size();
  Image image{*std::move(impl_->waiting[impl_->turn]), impl_->turn};
  impl_->waiting[impl_->turn].reset();
  impl_->turn = (impl_->turn + 1) % impl_->waiting.size();
  return image;
}

void DdsAdapter::wake() {
  const std::lock_guard lock(impl_->mutex);
  impl_->woken = true;
  impl_->arrived.notify_one();
}

std::optional<std::vector<messages::CarriedObject>> DdsAdapter::carried() {
  const std::lock_guard lock(impl_->mutex);
  return std::exchange(impl_->carried, std::nullopt);
}

std::vector<messages::WorkspaceObject> DdsAdapter::objects() {
  const std::lock_guard lock(impl_->mutex);
  std::vector<messages::WorkspaceObject> changed;
  for (auto& [id, object] : impl_->objects) changed.push_back(std::move(object));
  impl_->objects.clear();
  return changed;
}

bool DdsAdapter::has_newcomer() const { return impl_->changes.matched() > impl_->served; }

bool DdsAdapter::publish(const messages::OccupancyChange& change) {
  const std::uint32_t readers = impl_->changes.matched();
  const bool sent = impl_->changes.publish(change);
  if (change.whole && sent) {
    impl_->served = readers;
  } else {
    impl_->served = std::min(impl_->served, readers);
  }
  return sent && !has_newcomer();
}

void DdsAdapter::publish(const messages::SpaceView& view) { impl_->views.publish(view); }

void DdsAdapter::publish(const messages::PoseFinding& finding) {
  if (!impl_->findings.write(messages::to_idl(finding)))
    spdlog::error("a finding of object {} could not be published (pose_finding)", finding.id);
}

void DdsAdapter::report(const core::Health& health) {
  const core::Nanoseconds now_ns = core::monotonic_ns();
  core::Health published = health;
  if (impl_->slave && impl_->slave->source().has_second(now_ns))
    published = dds::with_rival(std::move(published), "slave_state");
  for (const auto& receiver : impl_->receivers)
    if (receiver.source().has_second(now_ns))
      published = dds::with_rival(std::move(published), "depth_image");
  impl_->status.publish(published);
}

}  // namespace phantom::workspace_camera
