#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "common/dds/admission/refusal_log.hpp"
#include "components/workspace_camera/file_camera.hpp"
#include "components/workspace_camera/held_images.hpp"
#include "components/workspace_camera/loaded_cell.hpp"
#include "components/workspace_camera/openni_camera.hpp"
#include "components/workspace_camera/simulated_camera.hpp"
#include "components/workspace_camera/workspace_camera.hpp"

namespace phantom::workspace_camera {

/// The cameras whose images do not come by depth_image: simulated ones, clouds of files, OpenNI devices.
/// One thread.
class LocalCameras {
 public:
  /// `loaded` and `history` must outlive this. Throws core::ConfigError, core::MissingError.
  LocalCameras(const WorkspaceCameraConfig& config, const LoadedCell& loaded, const ArmHistory& history);

  /// Begins to read devices. `arrived` is called on another thread when an image has come.
  void start(const std::function<void()>& arrived);
  /// Calls `fuse` with each image that is due of those that are made or played here.
  void take_due(const std::function<void(const CameraImage&)>& fuse);
  /// Returns the images that devices have sent since the last call.
  std::vector<ArrivedImage> arrived();
  /// Returns when the next image is due that does not arrive by itself.
  core::Nanoseconds due_ns() const;
  /// Returns a sentence for each device that sends no images.
  std::vector<std::string> troubles() const;
  std::size_t simulated() const { return simulated_.size(); }

 private:
  /// When a camera's next image is due.
  struct Schedule {
    std::size_t camera = 0;
    core::Nanoseconds period_ns = 0, next_ns = 0;
  };
  struct Simulated : Schedule {
    SimulatedCamera simulator;
    core::Nanoseconds latency_ns = 0;
  };
  struct Played : Schedule {
    std::unique_ptr<FileCamera> player;
  };
  struct Attached {
    std::size_t camera = 0;
    core::Nanoseconds latency_ns = 0;
    std::unique_ptr<OpenNiCamera> device;
  };
  using Sink = std::function<void(const CameraImage&)>;

  void simulate(Simulated& one, const Sink& fuse);
  void play(Played& one, const Sink& fuse);
  core::Nanoseconds newest_known_ns(core::Nanoseconds exposed_ns) const;

  const WorkspaceCameraConfig& config_;
  const LoadedCell& loaded_;
  const ArmHistory& history_;
  const core::Nanoseconds start_ns_;
  std::vector<Simulated> simulated_;
  std::vector<Played> played_;
  std::vector<Attached> attached_;
  dds::RefusalLog file_refusals_{"files of clouds"};
};

}  // namespace phantom::workspace_camera
