#include "components/workspace_camera/local_cameras.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <limits>

namespace phantom::workspace_camera {
namespace {

constexpr core::Nanoseconds kArmSilent_ns = 100 * core::kNsPerMillisecond;  // then images are refused
constexpr core::Nanoseconds kReading_ns = 2 * core::kNsPerMillisecond;      // while a file is being read

}  // namespace

LocalCameras::LocalCameras(const WorkspaceCameraConfig& config, const LoadedCell& loaded,
                           const ArmHistory& history)
    : config_(config), loaded_(loaded), history_(history), start_ns_(core::monotonic_ns()) {
  for (std::size_t i = 0; i < config.cameras.size(); ++i) {
    const CameraConfig& camera = config.cameras[i];
    switch (camera.driver) {
      case CameraDriver::kTopic:
        break;
      case CameraDriver::kFiles:
        played_.push_back({{i, core::from_seconds(1.0 / camera.files.rate_hz), start_ns_},
                           std::make_unique<FileCamera>(camera.files)});
        break;
      case CameraDriver::kOpenNi:
        if (camera.openni.is_recording() && !std::filesystem::exists(camera.openni.device))
          throw core::MissingError(camera.place + ".openni.device: " + camera.openni.device +
                                   " is not there");
        attached_.push_back(
            {i, core::from_seconds(camera.openni.latency_s), std::make_unique<OpenNiCamera>(camera.openni)});
        break;
      case CameraDriver::kSimulated:
        const SimulatedOptions& options = camera.simulated;
        simulated_.push_back(
            {{i, core::from_seconds(1.0 / options.rate_hz), start_ns_},
             SimulatedCamera(options, camera.X_FC, *loaded.simulated, config.things, loaded.displaced),
             core::from_seconds(options.latency_s)});
    }
  }
}

void LocalCameras::start(const std::function<void()>& arrived) {
  for (const Played& one : played_)
    spdlog::info("camera {}: plays {} clouds of {}", config_.cameras[one.camera].name, one.player->files(),
                 config_.cameras[one.camera].files.folder.string());
  for (const Attached& one : attached_) one.device->start(arrived);
}

void LocalCameras::take_due(const Sink& fuse) {
  for (Simulated& one : simulated_) simulate(one, fuse);
  for (Played& one : played_) play(one, fuse);
}

std::vector<ArrivedImage> LocalCameras::arrived() {
  std::vector<ArrivedImage> images;
  for (const Attached& one : attached_) {
    if (auto image = one.device->take())
      images.push_back({one.camera, image->camera, image->received_ns - one.latency_ns, image->received_ns,
                        std::move(image->depth_mm)});
  }
  return images;
}

std::vector<std::string> LocalCameras::troubles() const {
  std::vector<std::string> sentences;
  for (const Attached& one : attached_) {
    if (const std::string trouble = one.device->trouble(); !trouble.empty())
      sentences.push_back("camera '" + config_.cameras[one.camera].name + "': OpenNI: " + trouble +
                          "; it is opened again each second");
  }
  return sentences;
}

core::Nanoseconds LocalCameras::due_ns() const {
  core::Nanoseconds due_ns = std::numeric_limits<core::Nanoseconds>::max();
  for (const Simulated& one : simulated_) due_ns = std::min(due_ns, one.next_ns);
  for (const Played& one : played_)
    if (!one.player->at_end()) due_ns = std::min(due_ns, one.next_ns);
  return due_ns;
}

/// Returns the time of an exposure, but while the arm is heard none after its newest state: it would stand
/// elsewhere in the image than it then did.
core::Nanoseconds LocalCameras::newest_known_ns(core::Nanoseconds exposed_ns) const {
  const bool comes = loaded_.arm && exposed_ns - history_.newest_ns() < kArmSilent_ns;
  return comes ? std::min(exposed_ns, history_.newest_ns()) : exposed_ns;
}

/// Makes the image that is due: what was there when it was exposed.
void LocalCameras::simulate(Simulated& one, const Sink& fuse) {
  const core::Nanoseconds now_ns = core::monotonic_ns();
  if (now_ns < one.next_ns) return;
  // A late image is left out, not made later: the newest counts.
  one.next_ns += std::max<core::Nanoseconds>(1, (now_ns - one.next_ns) / one.period_ns + 1) * one.period_ns;
  const core::Nanoseconds exposed_ns = newest_known_ns(now_ns - one.latency_ns);
  const auto pose = loaded_.arm ? history_.at(exposed_ns) : std::nullopt;
  const auto pixels =
      one.simulator.image(core::seconds(exposed_ns - start_ns_), loaded_.arm.get(), pose ? &*pose : nullptr);
  fuse({one.camera, one.simulator.camera(), exposed_ns, pixels});
}

/// Takes the cloud that is due as if it were measured now.
void LocalCameras::play(Played& one, const Sink& fuse) {
  const core::Nanoseconds now_ns = core::monotonic_ns();
  if (now_ns < one.next_ns || one.player->at_end()) return;
  const auto image = one.player->next();
  if (image && !*image) {  // it is still being read
    one.next_ns = now_ns + kReading_ns;
    return;
  }
  one.next_ns = std::max(one.next_ns + one.period_ns, now_ns);
  if (!image) return file_refusals_.refused(image.status().message());
  fuse({one.camera, one.player->camera(), newest_known_ns(now_ns), **image});
  if (one.player->at_end())
    spdlog::info("camera {}: all its clouds were played", config_.cameras[one.camera].name);
}

}  // namespace phantom::workspace_camera
