// The shipped hot cell: what stands elsewhere than the model has it is found there.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <random>

#include "components/workspace_camera/confirmed_findings.hpp"
#include "components/workspace_camera/loaded_cell.hpp"
#include "components/workspace_camera/pose_check.hpp"
#include "tests/support/thorough.hpp"

namespace phantom::workspace_camera::pose_check_cell_test {
namespace {

struct HotCell {
  const std::string folder = PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/";
  const WorkspaceCameraConfig config = load_config(folder + "workspace_camera.yaml");
  const LoadedCell loaded = load_cell(config, folder + "cell.yaml");
  std::vector<ModelObject> objects;
  std::vector<Place> X_WO;

  HotCell() {
    for (std::size_t i = 0; i < loaded.meshes.size(); ++i) {
      const auto& object = loaded.cell.objects[i];
      objects.push_back({object.id, object.name, loaded.meshes[i].second});
      X_WO.emplace_back(object.X_WO);
    }
  }
  const CameraConfig& above() const { return config.cameras.front(); }

  /// What a camera sees from `X_WC` of the objects at these places.
  fusion::DepthImage image_of(const std::vector<geometry::Pose>& real_WO, const geometry::Pose& X_WC) const {
    std::vector<fusion::CameraScene::Object> real;
    for (std::size_t i = 0; i < objects.size(); ++i)
      real.push_back({objects[i].mesh_O.transformed(real_WO[i]), false});
    const fusion::CameraScene scene(real);
    SimulatedCamera eye(above().simulated, X_WC, scene, {});
    fusion::DepthImage image;
    const core::Status taken = image.load_mm({eye.camera(), X_WC, 1.0}, eye.image(0.0, nullptr, nullptr));
    EXPECT_TRUE(taken) << taken.message();
    return image;
  }
};

std::string text_of(const PoseFinding& finding) {
  return finding.name + ": " + std::to_string(finding.agree) + " of " + std::to_string(finding.pixels) +
         " pixels agree, " + std::to_string(finding.through) + " seen through; " + sentence(finding);
}

void expect_agrees(const PoseFinding& finding) {
  if (finding.verdict == PoseVerdict::kUnseen) return;
  EXPECT_EQ(finding.verdict, PoseVerdict::kAgrees) << text_of(finding);
}

const geometry::Pose kFromTheSide = looking_at({0.2, -1.9, 1.6}, {0.5, -0.5, 0.4});
const geometry::Pose kFromTheWindow = looking_at({-0.9, -1.2, 1.5}, {0.0, 0.0, 0.5});

TEST(PoseOfHotCell, ADrumTenCentimetresElsewhereIsFoundAndNothingElse) {
  const HotCell cell;
  std::vector<geometry::Pose> real_WO;
  for (const auto& object : cell.loaded.cell.objects) {
    real_WO.push_back(object.X_WO * object.X_deviation);
    if (object.name == "waste_drum") real_WO.back().translation_m.x() -= 0.1;
  }
  PoseCheck check(cell.config.pose_check, cell.objects);
  const auto from = std::chrono::steady_clock::now();
  const auto findings = check.judge(cell.image_of(real_WO, kFromTheSide), {}, cell.X_WO);
  RecordProperty(
      "seconds",
      std::to_string(std::chrono::duration<double>(std::chrono::steady_clock::now() - from).count()));
  std::size_t judged = 0;
  for (const PoseFinding& finding : findings) {
    judged += finding.verdict == PoseVerdict::kUnseen ? 0 : 1;
    if (finding.name != "waste_drum") {
      expect_agrees(finding);
      continue;
    }
    ASSERT_EQ(finding.verdict, PoseVerdict::kElsewhere) << text_of(finding);
    EXPECT_LT((finding.shift_m - Eigen::Vector3d(-0.1, 0.0, 0.0)).norm(), 0.015) << text_of(finding);
  }
  EXPECT_GE(judged, 4U);
}

/// ./scripts/demo --live: somebody moves a pipe.
TEST(PoseOfHotCell, ThePipeOfTheDemoIsFoundOnceItWasMovedBesideTheArm) {
  const HotCell cell;
  PoseCheck check(cell.config.pose_check, cell.objects);
  const geometry::Pose& X_WC = cell.above().X_FC;
  SimulatedCamera eye(cell.above().simulated, X_WC, *cell.loaded.simulated, cell.config.things,
                      cell.loaded.displaced);
  ArmPose home;
  std::ranges::copy(cell.loaded.cell.arm().home, home.q.begin());
  const auto findings_at = [&](double time_s) {
    fusion::DepthImage image;
    const core::Status taken =
        image.load_mm({eye.camera(), X_WC, time_s}, eye.image(time_s, cell.loaded.arm.get(), &home));
    EXPECT_TRUE(taken) << taken.message();
    std::vector<float> arm_depth_m;
    cell.loaded.arm->draw(home, image.camera(), image.X_WC(), arm_depth_m);
    return check.judge(image, arm_depth_m, cell.X_WO);
  };
  for (double time_s = 0.0; time_s < 40.0; time_s += 1.7)
    for (const PoseFinding& finding : findings_at(time_s)) expect_agrees(finding);
  bool found = false;
  for (const PoseFinding& finding : findings_at(41.0)) {
    if (finding.name != "pipe_elbow") {
      expect_agrees(finding);
      continue;
    }
    found = true;
    ASSERT_EQ(finding.verdict, PoseVerdict::kElsewhere) << text_of(finding);
    EXPECT_LT((finding.shift_m - cell.config.displaced.front().by_m).norm(), 0.01) << text_of(finding);
  }
  EXPECT_TRUE(found);
}

/// Moves of 4 to 12 cm on the floor, some turned by up to 11°.
class Moves {
 public:
  geometry::Pose next(const ModelObject& object, const geometry::Pose& X_WO, bool turned) {
    do {
      shift_m = {0.12 * unit_(random_), 0.12 * unit_(random_), 0.0};
    } while (shift_m.norm() < 0.04 || shift_m.norm() > 0.12);
    const geometry::BoundingBox box = object.mesh_O.bounding_box();
    const Eigen::Vector3d middle_m = X_WO * (0.5F * (box.min_m + box.max_m)).cast<double>();
    const Eigen::Matrix3d R =
        geometry::rotation_about(Eigen::Vector3d::UnitZ(), turned ? 0.2 * unit_(random_) : 0.0);
    return {R * X_WO.rotation, middle_m + R * (X_WO.translation_m - middle_m) + shift_m};
  }
  Eigen::Vector3d shift_m;

 private:
  std::mt19937_64 random_{7};
  std::uniform_real_distribution<double> unit_{-1.0, 1.0};
};

/// The noise is simulated. Of a whole run 98 of 111 that were in view were found: 1.8 mm off in the middle,
/// 5 mm nine times of ten; of thirteen, most moved in their own planes, the image says that they agree.
TEST(PoseAccuracy, AnObjectThatIsMovedIsFoundWithinMillimetresOrSaidToBeHardlySeen) {
  const HotCell cell;
  const std::vector<geometry::Pose> cameras{cell.above().X_FC, kFromTheSide, kFromTheWindow};
  const std::size_t every = test::thorough_or<std::size_t>(24, 1);
  std::vector<geometry::Pose> model_WO;
  for (const Place& place : cell.X_WO) model_WO.push_back(*place);
  Moves moves;
  std::vector<double> errors_m;
  std::size_t missed = 0, tried = 0;
  for (const geometry::Pose& X_WC : cameras) {
    for (std::size_t moved = 0; moved < cell.objects.size(); ++moved) {
      for (int k = 0; k < 3; ++k) {
        auto real_WO = model_WO;
        real_WO[moved] = moves.next(cell.objects[moved], model_WO[moved], k > 0);
        if (tried++ % every != 0) continue;
        PoseCheck check(cell.config.pose_check, cell.objects);
        for (const PoseFinding& finding : check.judge(cell.image_of(real_WO, X_WC), {}, cell.X_WO)) {
          if (finding.id != cell.objects[moved].id) {
            expect_agrees(finding);
            continue;
          }
          missed += finding.verdict == PoseVerdict::kAgrees ? 1 : 0;
          if (finding.verdict == PoseVerdict::kAgrees || finding.verdict == PoseVerdict::kUnseen) continue;
          ASSERT_EQ(finding.verdict, PoseVerdict::kElsewhere) << text_of(finding);
          errors_m.push_back((finding.shift_m - moves.shift_m).norm());
          EXPECT_LT(errors_m.back(), finding.open.empty() ? 0.015 : 0.06)
              << text_of(finding) << "; it was moved by " << moves.shift_m.transpose();
        }
      }
    }
  }
  std::ranges::sort(errors_m);
  ASSERT_GE(errors_m.size(), test::thorough_or<std::size_t>(4, 90));
  EXPECT_LT(errors_m[errors_m.size() / 2], 0.004);
  EXPECT_LT(errors_m[9 * errors_m.size() / 10], test::thorough_or(0.015, 0.008));
  EXPECT_LE(missed, errors_m.size() / 4);
}

}  // namespace
}  // namespace phantom::workspace_camera::pose_check_cell_test
