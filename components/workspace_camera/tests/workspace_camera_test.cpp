#include "components/workspace_camera/workspace_camera.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/core/errors.hpp"
#include "components/workspace_camera/tests/rig.hpp"

namespace phantom::workspace_camera::component_test {
namespace {

using namespace rig;
using enum messages::DepthCameraState;
using testing::Each;
using testing::HasSubstr;

const Eigen::Vector3d kPlace{0.1, 0.0, 0.3};

core::JointArray at(double x_m) {
  core::JointArray q{};
  q[0] = x_m;
  return q;
}

/// Puts changes together as a receiver does.
class Receiver {
 public:
  void take(const messages::OccupancyChange& change) {
    if (change.whole) blocks_.clear();
    for (const auto& block : change.blocks) blocks_[{block.x, block.y, block.z}] = block.bits;
  }
  bool get(workspace::Index3 v) const {
    const auto found =
        blocks_.find({static_cast<std::uint16_t>(v.x >> 3), static_cast<std::uint16_t>(v.y >> 3),
                      static_cast<std::uint16_t>(v.z >> 3)});
    return found != blocks_.end() &&
           (found->second[static_cast<std::size_t>(v.z & 7)] >> (8 * (v.y & 7) + (v.x & 7)) & 1) != 0;
  }
  std::size_t count() const {
    std::size_t bits = 0;
    for (const auto& [place, words] : blocks_)
      for (const std::uint64_t word : words) bits += static_cast<std::size_t>(std::popcount(word));
    return bits;
  }

 private:
  std::map<std::array<std::uint16_t, 3>, std::array<std::uint64_t, 8>> blocks_;
};

void expect_same(const Receiver& receiver, const WorkspaceCamera& camera) {
  EXPECT_EQ(receiver.count(), camera.fusion().occupied().count());
  std::size_t missing = 0;
  workspace::VoxelBox::of(camera.fusion().grid()).for_each([&](workspace::Index3 v) {
    missing += camera.fusion().occupied().get(v) && !receiver.get(v) ? 1 : 0;
  });
  EXPECT_EQ(missing, 0U);
}

TEST(WorkspaceCamera, AThingThatIsPutThereComesAndGoes) {
  const ArmHistory history;
  WorkspaceCamera camera(config(), "source", "cell", grid(), nullptr, history);
  Thing box;
  box.size_m = {0.12, 0.12, 0.12}, box.from_m = kPlace, box.appears_s = 0.5, box.stays_s = 1.0;
  Film film(scene(), {box});
  while (film.now_ns() < kStart + 450 * kMs) ASSERT_TRUE(camera.take(film.next(), film.now_ns()));
  EXPECT_EQ(occupied_near(camera, kPlace, 0.08), 0U);
  while (film.now_ns() < kStart + 800 * kMs) ASSERT_TRUE(camera.take(film.next(), film.now_ns()));
  EXPECT_GT(occupied_near(camera, kPlace, 0.08), 200U);
  while (film.now_ns() < kStart + 2500 * kMs) ASSERT_TRUE(camera.take(film.next(), film.now_ns()));
  EXPECT_EQ(occupied_near(camera, kPlace, 0.08), 0U);
}

TEST(WorkspaceCamera, TellsHowLongAgoEachPartOfTheSpaceWasSeen) {
  const ArmHistory history;
  WorkspaceCamera camera(config(), "source", "cell", grid(), nullptr, history);
  const auto age_at = [&](const Eigen::Vector3d& place_m, core::Nanoseconds now_ns) -> int {
    const messages::SpaceView view = camera.space_view(now_ns);
    EXPECT_EQ(view.cell, "cell");
    EXPECT_DOUBLE_EQ(view.cube_m, 0.32);
    EXPECT_EQ(view.ages.size(), 4U * 4U * 3U);
    const Eigen::Vector3d cube = (place_m - messages::eigen(view.origin_m)) / view.cube_m;
    return view.ages.at(static_cast<std::size_t>(cube.x()) +
                        view.size_x * (static_cast<std::size_t>(cube.y()) +
                                       view.size_y * static_cast<std::size_t>(cube.z())));
  };
  const Eigen::Vector3d before_wall{0.0, 0.0, 0.4}, in_box{0.3, 0.0, 0.16};
  EXPECT_EQ(age_at(before_wall, kStart), messages::kSpaceNeverSeen);
  const geometry::TriangleMesh box = geometry::make_box({0.42, 0.44, 0.44});
  Film film(scene({box.transformed({Eigen::Matrix3d::Identity(), in_box})}));
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(camera.take(film.next(), film.now_ns()));
  EXPECT_LE(age_at(before_wall, film.now_ns()), 2) << "a block that is free is looked at in one of 8 images";
  EXPECT_EQ(age_at(in_box, film.now_ns()), messages::kSpaceNeverSeen);
  EXPECT_NEAR(age_at(before_wall, film.now_ns() + 10'000 * kMs), 41, 1);
  EXPECT_EQ(age_at(before_wall, film.now_ns() + 100'000 * kMs), messages::kSpaceAgeMax);
}

TEST(WorkspaceCamera, WhereTheArmIsNothingNeedsToBeSeen) {
  ArmView view = arm_view();
  ArmHistory history;
  WorkspaceCameraConfig wide = config();
  wide.fusion.masks.arm_margin_m = 0.3;  // of whole cubes
  const WorkspaceCamera camera(wide, "source", "cell", grid(), &view, history);
  const auto ages = [&] { return camera.space_view(kStart).ages; };
  EXPECT_THAT(ages(), Each(messages::kSpaceNeverSeen)) << "where it is is not known";
  core::JointArray q{};
  q[0] = -0.3;
  history.put(kStart, q);
  const std::vector<std::uint8_t> now = ages();
  ASSERT_EQ(now.size(), 4U * 4U * 3U);
  EXPECT_EQ(now[0 + 4 * (1 + 4 * 1)], 0) << "all of it is the arm's";
  EXPECT_EQ(now[3 + 4 * (1 + 4 * 1)], messages::kSpaceNeverSeen);
}

TEST(WorkspaceCamera, ChangesOneAfterTheOtherMakeTheWhole) {
  const ArmHistory history;
  WorkspaceCamera camera(config(), "source", "cell", grid(), nullptr, history);
  Thing ball;
  ball.shape = Thing::Shape::kBall, ball.size_m = {0.1, 0.1, 0.1};
  ball.from_m = {-0.2, 0.0, 0.3}, ball.to_m = {0.2, 0.0, 0.3}, ball.trip_s = 3.0;
  Film film(scene(), {ball});
  Receiver of_changes, of_wholes;
  of_changes.take(camera.change(true, film.now_ns()));
  for (int i = 0; i < 40; ++i) {
    ASSERT_TRUE(camera.take(film.next(), film.now_ns()));
    of_changes.take(camera.change(false, film.now_ns()));
  }
  expect_same(of_changes, camera);
  of_wholes.take(camera.change(true, film.now_ns()));
  expect_same(of_wholes, camera);
}

TEST(WorkspaceCamera, AChangeTellsItsSourceGridAndTheAgeOfItsImage) {
  const ArmHistory history;
  WorkspaceCamera camera(config(), "source", "cell", grid(), nullptr, history);
  Film film(scene());
  EXPECT_EQ(camera.change(true, kStart).image_age_s, -1.0);
  ASSERT_TRUE(camera.take(film.next(), film.now_ns()));
  const auto change = camera.change(false, film.now_ns() + 20 * kMs);
  EXPECT_EQ(change.source, "source");
  EXPECT_EQ(change.cell, "cell");
  EXPECT_EQ(change.grid.size_vox, grid().size_vox);
  EXPECT_NEAR(change.image_age_s, 0.02, 1e-9);
  EXPECT_EQ(camera.change(false, film.now_ns()).image_age_s, -1.0);
  ASSERT_EQ(change.cameras.size(), 1U);
  EXPECT_EQ(change.cameras[0].name, "above");
  EXPECT_EQ(change.cameras[0].state, kLive);
}

TEST(WorkspaceCamera, TheArmIsNoMatterWhileItMoves) {
  ArmView view = arm_view();
  ArmHistory history;
  WorkspaceCamera camera(config(), "source", "cell", grid(), &view, history);
  // The image is 40 ms old when it comes: masked where the arm is now, the arm would be seen beside its mask.
  for (int i = 0; i < 100; ++i) {
    const core::Nanoseconds exposed_ns = kStart + i * 50 * kMs;
    const double x_m = 0.3 * std::sin(0.1 * i);
    for (int step = 0; step < 50; ++step)
      history.put(exposed_ns + step * kMs, at(0.3 * std::sin(0.1 * (i + step / 50.0))));
    SimulatedCamera eye(config().cameras[0].simulated, config().cameras[0].X_FC, scene({rod_W(x_m)}), {});
    // Another seed each time: a camera's images are never the same.
    auto pixels = eye.image(0.0, nullptr, nullptr);
    std::vector<std::uint16_t> noisy(pixels.begin(), pixels.end());
    noisy[static_cast<std::size_t>(i)] = 0;
    ASSERT_TRUE(camera.take({0, eye.camera(), exposed_ns, noisy}, exposed_ns + 40 * kMs)) << i;
  }
  EXPECT_EQ(occupied_near(camera, {0.0, -0.05, 0.45}, 0.3), 0U);
}

// Tries workspace_camera: slave_state does not come
TEST(WorkspaceCamera, AnImageOfAFileMayComeAgainAndOneOfACameraNot) {
  for (const CameraDriver driver : {CameraDriver::kFiles, CameraDriver::kTopic}) {
    WorkspaceCameraConfig played = config();
    played.cameras[0].driver = driver;
    const ArmHistory history;
    WorkspaceCamera camera(played, "source", "cell", grid(), nullptr, history);
    Film film(scene());
    CameraImage image = film.next();
    EXPECT_TRUE(camera.take(image, film.now_ns()));
    image.exposed_ns += 50 * kMs;
    EXPECT_EQ(static_cast<bool>(camera.take(image, film.now_ns() + 50 * kMs)),
              driver == CameraDriver::kFiles);
  }
}

TEST(WorkspaceCamera, WithoutTheArmsPoseAnImageIsNotFused) {
  ArmView view = arm_view();
  ArmHistory history;
  WorkspaceCamera camera(config(), "source", "cell", grid(), &view, history);
  Film film(scene({rod_W(0.0)}));
  const core::Status refused = camera.take(film.next(), film.now_ns());
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.message(), HasSubstr("slave_state does not come: images are not fused"));
  EXPECT_EQ(camera.fused_images(), 0U);
  const core::Health health = camera.health(film.now_ns());
  EXPECT_EQ(health.state, core::ComponentState::kDegraded);
  EXPECT_THAT(health.message, HasSubstr("slave_state does not come"));
  history.put(film.now_ns() + 49 * kMs, at(0.0));
  EXPECT_TRUE(camera.take(film.next(), film.now_ns()));
}

// Tries workspace_camera: an image whose header is none
TEST(WorkspaceCamera, AnImageThatIsNoneIsRefusedAndChangesNothing) {
  const ArmHistory history;
  WorkspaceCamera camera(config(), "source", "cell", grid(), nullptr, history);
  Film film(scene());
  ASSERT_TRUE(camera.take(film.next(), film.now_ns()));
  const std::size_t before = camera.fusion().occupied().count();
  CameraImage odd = film.next();
  odd.pinhole.fx_px = std::nan("");
  EXPECT_THAT(camera.take(odd, film.now_ns()).message(), HasSubstr("fx"));
  odd = film.next();
  odd.depth_mm = odd.depth_mm.first(100);
  EXPECT_FALSE(camera.take(odd, film.now_ns()));
  EXPECT_EQ(camera.fusion().occupied().count(), before);
  EXPECT_EQ(camera.fused_images(), 1U);
}

/// A camera that has seen a box dies.
std::size_t matter_after_death(OnLoss on_loss, core::Health& health) {
  const ArmHistory history;
  WorkspaceCamera camera(config(on_loss), "source", "cell", grid(), nullptr, history);
  Film film(scene({box_at(kPlace)}));
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(camera.take(film.next(), film.now_ns()));
  EXPECT_TRUE(camera.watch(film.now_ns()));
  EXPECT_FALSE(camera.watch(film.now_ns() + 100 * kMs));
  EXPECT_GT(occupied_near(camera, kPlace, 0.08), 200U);
  Receiver receiver;
  receiver.take(camera.change(true, film.now_ns()));
  EXPECT_TRUE(camera.watch(film.now_ns() + 401 * kMs));
  receiver.take(camera.change(false, film.now_ns() + 401 * kMs));
  expect_same(receiver, camera);
  health = camera.health(film.now_ns() + 401 * kMs);
  return occupied_near(camera, kPlace, 0.08);
}

// Tries workspace_camera: a camera sends no images any more
TEST(WorkspaceCamera, TheMatterOfADeadCameraIsKept) {
  core::Health health;
  EXPECT_GT(matter_after_death(OnLoss::kKeep, health), 200U);
  EXPECT_EQ(health.state, core::ComponentState::kDegraded);
  EXPECT_THAT(health.message, HasSubstr("camera 'above' is dead"));
}

TEST(WorkspaceCamera, OrEndsByConfiguration) {
  core::Health health;
  EXPECT_EQ(matter_after_death(OnLoss::kEnd, health), 0U);
  EXPECT_THAT(health.message, HasSubstr("its matter has ended"));
}

/// The space behind the box is unknown: its region decides what is published of it.
TEST(WorkspaceCamera, UnknownSpaceFollowsThePolicyOfItsRegion) {
  const ArmHistory history;
  WorkspaceCameraConfig regions = config();
  const Eigen::Vector3d inside = kPlace + Eigen::Vector3d(0.0, 0.06, -0.04), before(0.0, -0.3, 0.5);
  regions.unknown_regions = {
      {Eigen::Vector3d::Constant(-1e300), Eigen::Vector3d::Constant(1e300), fusion::UnknownPolicy::kOccupied},
      {{-1.0, -1.0, 0.6}, {1.0, 1.0, 0.8}, fusion::UnknownPolicy::kFree}};
  WorkspaceCamera camera(regions, "source", "cell", grid(), nullptr, history);
  const std::size_t all = occupied_near(camera, inside, 0.02);
  EXPECT_GE(all, 100U) << "before the first image, too";
  EXPECT_GE(occupied_near(camera, before, 0.02), 100U);
  EXPECT_EQ(occupied_near(camera, {0.0, 0.0, 0.75}, 0.02), 0U);
  Receiver receiver;
  receiver.take(camera.change(true, kStart));
  expect_same(receiver, camera);
  Film film(scene({box_at(kPlace)}));
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(camera.take(film.next(), film.now_ns()));
  EXPECT_EQ(occupied_near(camera, inside, 0.02), all) << "the box hides it";
  EXPECT_EQ(occupied_near(camera, before, 0.02), 0U) << "it was seen to be free";
  receiver.take(camera.change(false, film.now_ns()));
  expect_same(receiver, camera);
}

// Tries workspace_camera: a camera on a link that the arm does not have
TEST(WorkspaceCamera, ACameraOnALinkThatIsNotThereIsRefused) {
  ArmView view = arm_view();
  const ArmHistory history;
  WorkspaceCameraConfig odd = config();
  odd.cameras[0].link = "hand";
  EXPECT_THROW(WorkspaceCamera(odd, "source", "cell", grid(), &view, history), core::ConfigError);
  odd.cameras[0].link = "rod";
  EXPECT_NO_THROW(WorkspaceCamera(odd, "source", "cell", grid(), &view, history));
}

TEST(SimulatedCamera, EqualInputsGiveEqualImages) {
  Thing ball;
  ball.shape = Thing::Shape::kBall;
  Film one(scene(), {ball}), other(scene(), {ball});
  for (int i = 0; i < 3; ++i) {
    const auto a = one.next().depth_mm, b = other.next().depth_mm;
    EXPECT_TRUE(std::ranges::equal(a, b)) << i;
  }
}

}  // namespace
}  // namespace phantom::workspace_camera::component_test
