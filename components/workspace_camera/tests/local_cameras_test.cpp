#include "components/workspace_camera/local_cameras.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/core/errors.hpp"
#include "components/workspace_camera/tests/rig.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::workspace_camera::local_cameras_test {
namespace {

using namespace rig;
using testing::HasSubstr;

TEST(LocalCameras, ARecordingThatIsNotThereIsNamedAtTheStart) {
  WorkspaceCameraConfig played = config();
  played.cameras[0].driver = CameraDriver::kOpenNi;
  played.cameras[0].place = "cameras.yaml:3: cameras[0]";
  played.cameras[0].openni.device = "/nowhere/cell.oni";
  const LoadedCell loaded;
  const ArmHistory history;
  EXPECT_THAT([&] { LocalCameras(played, loaded, history); },
              testing::ThrowsMessage<core::MissingError>(
                  HasSubstr("cameras.yaml:3: cameras[0].openni.device: /nowhere/cell.oni is not there")));
}

/// When a simulated camera's image was exposed, if the newest state of the arm is so old.
core::Nanoseconds exposed_before_now_ns(core::Nanoseconds age_ns) {
  const WorkspaceCameraConfig simulated = config();
  LoadedCell loaded;
  loaded.arm = std::make_unique<ArmView>(arm_view());
  loaded.simulated = std::make_unique<const fusion::CameraScene>(scene());
  ArmHistory history;
  LocalCameras cameras(simulated, loaded, history);
  const core::Nanoseconds now_ns = core::monotonic_ns();
  history.put(now_ns - age_ns, {});
  core::Nanoseconds exposed_ns = 0;
  cameras.take_due([&](const CameraImage& image) { exposed_ns = image.exposed_ns; });
  EXPECT_NE(exposed_ns, 0);
  return now_ns - exposed_ns;
}

/// A camera whose arm is silent goes on, so that its images are refused for that, and it is not called dead.
TEST(LocalCameras, ASimulatedImageIsNoneAfterTheArmsNewestStateUnlessTheArmIsSilent) {
  EXPECT_TRUE(test::eventually([] { return exposed_before_now_ns(70 * kMs) == 70 * kMs; }));
  EXPECT_LT(exposed_before_now_ns(60'000 * kMs), 59'000 * kMs);
}

}  // namespace
}  // namespace phantom::workspace_camera::local_cameras_test
