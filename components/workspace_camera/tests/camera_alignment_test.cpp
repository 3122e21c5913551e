#include "components/workspace_camera/camera_alignment.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <functional>
#include <numbers>

#include "components/workspace_camera/model_watch.hpp"
#include "components/workspace_camera/tests/rig.hpp"
#include "tests/support/thorough.hpp"

namespace phantom::workspace_camera::camera_alignment_test {
namespace {

using namespace rig;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::StartsWith;

/// A table with two things, before a wall: all of it is the model's.
struct Scene {
  std::vector<ModelObject> objects{{1, "table", geometry::make_box({0.9, 0.6, 0.04})},
                                   {2, "box", geometry::make_box({0.16, 0.12, 0.2})},
                                   {3, "drum", geometry::make_cylinder(0.09, 0.24)},
                                   {4, "wall", geometry::make_box({2.0, 0.04, 2.0})}};
  std::vector<std::optional<geometry::Pose>> X_WO{
      geometry::Pose{Eigen::Matrix3d::Identity(), {0.0, 0.0, 0.1}},
      geometry::Pose{geometry::rotation_about(Eigen::Vector3d::UnitZ(), 0.4), {-0.2, 0.0, 0.22}},
      geometry::Pose{Eigen::Matrix3d::Identity(), {0.2, 0.05, 0.24}},
      geometry::Pose{Eigen::Matrix3d::Identity(), {0.0, 0.45, 0.4}}};

  fusion::CameraScene real(std::vector<geometry::TriangleMesh> others = {}) const {
    std::vector<fusion::CameraScene::Object> all;
    for (std::size_t i = 0; i < objects.size(); ++i)
      all.push_back({objects[i].mesh_O.transformed(*X_WO[i]), false});
    for (auto& other : others) all.push_back({std::move(other), false});
    return fusion::CameraScene(all);
  }
};

geometry::Pose knock(const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& shift_m) {
  geometry::Pose X{Eigen::Matrix3d::Identity(), shift_m};
  if (turn_rad.norm() > 0.0)
    X.rotation = Eigen::AngleAxisd(turn_rad.norm(), turn_rad.normalized()).toRotationMatrix();
  return X;
}

WorkspaceCameraConfig wide() {
  WorkspaceCameraConfig made = config();
  made.cameras[0].simulated.camera = {320, 240, 280.0, 280.0, 159.5, 119.5, 0.3, 4.0};
  return made;
}

/// Images of a camera that says it stands where it was mounted, and stands elsewhere.
class Eye {
 public:
  Eye(const fusion::CameraScene& scene, const geometry::Pose& X_knock, std::uint64_t seed = 1)
      : camera_(wide().cameras[0]), eye_(options(seed), camera_.X_FC * X_knock, scene, {}) {}

  const fusion::DepthImage& next() {
    time_s_ += 1.0 / 15.0;
    const core::Status taken =
        image_.load_mm({eye_.camera(), camera_.X_FC, time_s_}, eye_.image(time_s_, nullptr, nullptr));
    EXPECT_TRUE(taken) << taken.message();
    return image_;
  }

 private:
  SimulatedOptions options(std::uint64_t seed) const {
    SimulatedOptions made = camera_.simulated;
    made.seed = seed;
    return made;
  }
  CameraConfig camera_;
  SimulatedCamera eye_;
  fusion::DepthImage image_;
  double time_s_ = 0.0;
};

TEST(CameraAlignment, FindsByHowMuchACameraStandsElsewhere) {
  const Scene scene;
  const fusion::CameraScene real = scene.real();
  CameraAlignment alignment{fusion::DepthSigma{}};
  const CameraConfig camera = wide().cameras[0];
  alignment.set_model(camera.simulated.camera, camera.X_FC, scene.objects, scene.X_WO);
  for (const auto& [turn_rad, shift_m] :
       {std::pair<Eigen::Vector3d, Eigen::Vector3d>({0, 0, 0}, {0.012, 0, 0}),
        {{0, 0, 0}, {0, -0.01, 0.01}},
        {{0.009, 0, 0}, {0, 0, 0}},
        {{0, -0.009, 0}, {0, 0, 0}},
        {{0, 0, 0.012}, {0.005, 0, 0}}}) {
    Eye eye(real, knock(turn_rad, shift_m));
    const auto offset = alignment.offset(eye.next(), {});
    ASSERT_TRUE(offset);
    EXPECT_LT((offset->turn_rad - turn_rad).norm(), 0.002) << offset->turn_rad.transpose();
    EXPECT_LT((offset->shift_m - shift_m).norm(), 0.003)
        << offset->shift_m.transpose() << " instead of " << shift_m.transpose();
  }
}

TEST(CameraAlignment, WithoutEnoughOfTheModelInViewItSaysNothing) {
  const Scene scene;
  CameraAlignment alignment{fusion::DepthSigma{}};
  const CameraConfig camera = wide().cameras[0];
  const std::vector<std::optional<geometry::Pose>> nowhere(scene.objects.size());
  alignment.set_model(camera.simulated.camera, camera.X_FC, scene.objects, nowhere);
  const fusion::CameraScene real = scene.real();
  Eye eye(real, {});
  EXPECT_FALSE(alignment.offset(eye.next(), {}));
}

/// Seconds until a camera that is knocked after 2 s is reported; a negative number: not within 3 s.
double reported_after_s(const geometry::Pose& X_knock, std::uint64_t seed) {
  const Scene scene;
  const fusion::CameraScene real = scene.real();
  ModelWatch watch(wide(), scene.objects, scene.X_WO);
  Eye before(real, {}, seed), after(real, X_knock, seed + 100);
  for (int i = 0; i < 75; ++i) {
    const double time_s = i / 15.0;
    watch.take(0, time_s < 2.0 ? before.next() : after.next(), {}, core::from_seconds(10.0 + time_s));
    const auto said = watch.sentences();
    if (!said.empty() && said.front().starts_with("camera 'above' was knocked")) return time_s - 2.0;
  }
  return -1.0;
}

// Tries workspace_camera: a fixed camera is knocked, or most of what it sees moves
TEST(ModelWatch, SR28_ACameraThatIsKnockedByTenMillimetresOrHalfADegreeIsReportedWithinHalfASecond) {
  const double half_rad = 0.00873;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
    for (const geometry::Pose& X : {knock(half_rad * unit, {0, 0, 0}), knock({0, 0, 0}, 0.01 * unit)}) {
      const double reported_s = reported_after_s(X, 7 + static_cast<std::uint64_t>(axis));
      EXPECT_GE(reported_s, 0.0) << "axis " << axis;
      EXPECT_LE(reported_s, 0.5) << "axis " << axis;
    }
  }
}

// Tries workspace_camera: a fixed camera stands elsewhere than its pose says
TEST(ModelWatch, SR28_ACameraThatWasMountedThreeCentimetresOffIsReportedAtTheStart) {
  const Scene scene;
  const fusion::CameraScene real = scene.real();
  ModelWatch watch(wide(), scene.objects, scene.X_WO);
  Eye off(real, knock({0.0, 0.0, 0.0}, {0.03, 0.0, 0.0}));
  for (int i = 0; i < 30; ++i) watch.take(0, off.next(), {}, core::from_seconds(10.0 + i / 15.0));
  ASSERT_EQ(watch.sentences().size(), 1U);
  EXPECT_THAT(watch.sentences().front(), StartsWith("camera 'above' stands elsewhere than its pose says"));
}

/// From above a table leaves open how far the camera was shifted: what is beside the place of a thing that is
/// gone must not be taken for the thing.
TEST(ModelWatch, AThingThatIsGoneIsNoKnockOfACameraThatLooksStraightDown) {
  const std::vector<ModelObject> objects{{1, "table", geometry::make_box({1.2, 1.2, 0.04})},
                                         {2, "post", geometry::make_cylinder(0.05, 0.3)},
                                         {3, "crate", geometry::make_box({0.15, 0.2, 0.12})}};
  const auto at = [](double x_m, double y_m, double z_m) {
    return geometry::Pose{Eigen::Matrix3d::Identity(), {x_m, y_m, z_m}};
  };
  const std::vector<Place> X_WO{at(0.0, 0.0, 0.48), at(0.45, 0.35, 0.65), at(0.45, -0.3, 0.56)};
  WorkspaceCameraConfig down = wide();
  const geometry::Pose X_WC{geometry::rotation_about(Eigen::Vector3d::UnitX(), std::numbers::pi),
                            {0.0, 0.0, 1.5}};
  for (const std::size_t gone : {1U, 2U}) {
    std::vector<fusion::CameraScene::Object> there{
        {geometry::make_box({4.0, 4.0, 0.02}).transformed(at(0.0, 0.0, -0.04)), false}};
    for (std::size_t k = 0; k < objects.size(); ++k)
      if (k != gone) there.push_back({objects[k].mesh_O.transformed(*X_WO[k]), false});
    const fusion::CameraScene real(there);
    SimulatedCamera eye(down.cameras[0].simulated, X_WC, real, {});
    ModelWatch watch(down, objects, X_WO);
    for (int i = 0; i < 40; ++i) {
      fusion::DepthImage image;
      ASSERT_TRUE(image.load_mm({eye.camera(), X_WC, 0.1 * i}, eye.image(0.1 * i, nullptr, nullptr)));
      watch.take(0, image, {}, core::from_seconds(10.0) + i * ModelWatch::kKnockPeriod_ns);
      for (const std::string& said : watch.sentences())
        EXPECT_FALSE(said.starts_with("camera")) << objects[gone].name << " is gone: " << said;
    }
  }
}

/// In its long form eight hours: at most one false alarm.
TEST(ModelWatch, NeitherNoiseNorAHandLooksLikeAKnock) {
  const Scene scene;
  WorkspaceCameraConfig small = config();
  ModelWatch watch(small, scene.objects, scene.X_WO);
  Thing hand;
  hand.shape = Thing::Shape::kBall, hand.size_m = {0.16, 0.16, 0.16};
  hand.from_m = {-0.5, -0.3, 0.4}, hand.to_m = {0.5, -0.1, 0.3}, hand.trip_s = 2.0, hand.appears_s = 3.0;
  const CameraConfig camera = small.cameras[0];
  const fusion::CameraScene real = scene.real();
  SimulatedCamera eye(camera.simulated, camera.X_FC, real, {hand});
  fusion::DepthImage image;
  int alarms = 0;
  bool said_before = false;
  const int looks = test::thorough_or(500, 240'000);  // each kKnockPeriod_ns
  for (int i = 0; i < looks; ++i) {
    const double time_s = 0.12 * i;
    ASSERT_TRUE(image.load_mm({eye.camera(), camera.X_FC, time_s}, eye.image(time_s, nullptr, nullptr)));
    watch.take(0, image, {}, core::from_seconds(10.0) + i * ModelWatch::kKnockPeriod_ns);
    const auto said = watch.sentences();
    alarms += !said.empty() && !said_before ? 1 : 0;
    said_before = !said.empty();
    ASSERT_LE(alarms, looks > 500 ? 1 : 0) << time_s << " s: " << said.front();
  }
}

/// Seconds until a camera is reported as covered, after 1 s, and as open again, after 2 s.
std::pair<double, double> covered_and_open_s(WorkspaceCameraConfig config,
                                             const std::function<void(fusion::DepthImage&, int)>& cover) {
  const Scene scene;
  const fusion::CameraScene real = scene.real();
  ModelWatch watch(config, scene.objects, scene.X_WO);
  Eye eye(real, {});
  double covered_s = -1.0, open_s = -1.0;
  for (int i = 0; i < 45; ++i) {
    const double time_s = i / 15.0;
    fusion::DepthImage image = eye.next();
    if (time_s >= 1.0 && time_s < 2.0) cover(image, i);
    const bool changed = watch.take(0, image, {}, core::from_seconds(10.0 + time_s));
    const auto said = watch.sentences();
    const bool is_covered = !said.empty() && said.front().find("is covered") != std::string::npos;
    EXPECT_TRUE(is_covered || said.empty()) << said.front();
    const bool closes = is_covered && covered_s < 0.0,
               opens = !is_covered && covered_s >= 0.0 && open_s < 0.0;
    EXPECT_EQ(changed, closes || opens) << time_s << " s";
    if (closes) covered_s = time_s - 1.0;
    if (opens) open_s = time_s - 2.0;
  }
  return {covered_s, open_s};
}

void load(fusion::DepthImage& image, const std::function<std::uint16_t(std::size_t)>& pixel) {
  std::vector<std::uint16_t> depth_mm(image.camera().pixels());
  for (std::size_t i = 0; i < depth_mm.size(); ++i) depth_mm[i] = pixel(i);
  ASSERT_TRUE(image.load_mm(image.header(), depth_mm));
}

// Tries workspace_camera: a camera is covered
TEST(ModelWatch, SR29_ACameraThatIsCoveredIsReportedWithinHalfASecond) {
  const auto cap = [](fusion::DepthImage& image, int frame) {  // dark, but for a few pixels of noise
    load(image, [frame](std::size_t i) {
      return static_cast<std::uint16_t>((i + static_cast<std::size_t>(frame)) % 97 == 0 ? 700 : 0);
    });
  };
  const auto cloth = [](fusion::DepthImage& image, int frame) {
    load(image, [frame](std::size_t i) {
      return static_cast<std::uint16_t>(400 + (i + static_cast<std::size_t>(frame)) % 7);
    });
  };
  WorkspaceCameraConfig on_a_link = wide();
  on_a_link.cameras[0].link = "rod";
  for (const auto& [config, cover] :
       {std::pair<WorkspaceCameraConfig, std::function<void(fusion::DepthImage&, int)>>(wide(), cap),
        {wide(), cloth},
        {on_a_link, cap},
        {on_a_link, cloth}}) {
    const auto [covered_s, open_s] = covered_and_open_s(config, cover);
    EXPECT_GE(covered_s, 0.0);
    EXPECT_LE(covered_s, 0.5);
    EXPECT_GE(open_s, 0.0);
    EXPECT_LE(open_s, 0.5);
  }
}

/// On its way it sees the model from elsewhere in each image, in the end a box from near.
TEST(ModelWatch, ACameraOnALinkIsNotCoveredWhileItMovesUnlessItIs) {
  const Scene scene;
  const fusion::CameraScene real = scene.real();
  WorkspaceCameraConfig on_a_link = wide();
  on_a_link.cameras[0].link = "rod";
  for (const bool is_covered : {false, true}) {
    ModelWatch watch(on_a_link, scene.objects, scene.X_WO);
    for (int i = 0; i < 40; ++i) {
      const double way = i / 40.0;
      const geometry::Pose X_WC =
          looking_at({0.6 - 0.7 * way, -1.0 + 0.45 * way, 0.9 - 0.5 * way}, {0.2 - 0.4 * way, 0.0, 0.25});
      SimulatedCamera eye(on_a_link.cameras[0].simulated, X_WC, real, {});
      fusion::DepthImage image;
      ASSERT_TRUE(image.load_mm({eye.camera(), X_WC, 1.0 + way}, eye.image(0.0, nullptr, nullptr)));
      if (is_covered) load(image, [](std::size_t) { return std::uint16_t{310}; });
      watch.take(0, image, {}, core::from_seconds(10.0) + i * ModelWatch::kKnockPeriod_ns);
      if (i < 2) continue;
      const auto said = watch.sentences();
      EXPECT_EQ(!said.empty() && said.front().find("is covered") != std::string::npos, is_covered)
          << i << ": " << (said.empty() ? "" : said.front());
    }
  }
}

TEST(CoverWatch, OneImageIsNoCoverAndOneThatShowsTooLittleSaysNothing) {
  CoverWatch watch;
  watch.put({1000, 990});
  EXPECT_FALSE(watch.covered());
  watch.put({1000, 100});
  watch.put({1000, 990});
  watch.put({10, 10});
  EXPECT_FALSE(watch.covered());
  watch.put({1000, 990});
  EXPECT_TRUE(watch.covered());
  for (int i = 0; i < 10; ++i) watch.put({1000, 900});
  EXPECT_TRUE(watch.covered()) << "between the two shares it stays as it was";
  watch.put({1000, 800});
  watch.put({1000, 800});
  EXPECT_FALSE(watch.covered());
}

CameraOffset offset_of(const Eigen::Vector3d& shift_m) {
  CameraOffset offset;
  offset.shift_m = shift_m;
  offset.information = 1e8 * Eigen::Matrix<double, 6, 6>::Identity();
  return offset;
}

TEST(KnockWatch, ComparesWithTheFirstImagesAndNeedsTwoAlike) {
  KnockWatch watch;
  for (int i = 0; i < KnockWatch::kFirst; ++i) watch.put(offset_of({0.01, 0.0, 0.0}));
  watch.put(offset_of({0.01, 0.0, 0.0}));
  EXPECT_LT(watch.shift_m(), 1e-9) << "an error of the mounting, or of the model, is no knock";
  watch.put(offset_of({0.022, 0.0, 0.0}));
  EXPECT_FALSE(watch.knocked());
  watch.put(offset_of({0.01, 0.0, 0.0}));
  watch.put(offset_of({0.022, 0.0, 0.0}));
  EXPECT_FALSE(watch.knocked());
  watch.put(offset_of({0.022, 0.0, 0.0}));
  EXPECT_TRUE(watch.knocked());
  EXPECT_NEAR(watch.shift_m(), 0.012, 1e-9);
  for (int i = 0; i < 30; ++i) watch.put(offset_of({0.01, 0.0, 0.0}));
  EXPECT_FALSE(watch.knocked()) << "it was put back";
}

TEST(KnockWatch, AfterTheModelHasChangedTheNextImagesAreTheFirst) {
  KnockWatch watch;
  for (int i = 0; i < KnockWatch::kFirst + 3; ++i) watch.put(offset_of({0.0, 0.0, 0.0}));
  watch.restart();
  for (int i = 0; i < KnockWatch::kFirst + 3; ++i) watch.put(offset_of({0.03, 0.0, 0.0}));
  EXPECT_FALSE(watch.knocked() || watch.misplaced());
  for (int i = 0; i < KnockWatch::kConfirmations; ++i) watch.put(offset_of({0.0, 0.0, 0.0}));
  EXPECT_TRUE(watch.knocked());
}

TEST(KnockWatch, AWrongMountingIsTestedAgainOnceTheModelHasChanged) {
  KnockWatch watch;
  for (int i = 0; i < KnockWatch::kFirst; ++i) watch.put(offset_of({0.03, 0.0, 0.0}));
  EXPECT_TRUE(watch.misplaced());
  watch.restart();
  EXPECT_FALSE(watch.misplaced()) << "it may have been the model";
  for (int i = 0; i < KnockWatch::kFirst; ++i) watch.put(offset_of({0.001, 0.0, 0.0}));
  EXPECT_FALSE(watch.misplaced());
}

TEST(KnockWatch, ADirectionThatNothingDeterminesIsNoKnock) {
  KnockWatch watch;
  CameraOffset offset = offset_of({0.0, 0.0, 0.0});
  offset.information(3, 3) = 1.0;
  for (int i = 0; i < KnockWatch::kFirst; ++i) watch.put(offset);
  offset.shift_m.x() = 0.5;
  for (int i = 0; i < 5; ++i) watch.put(offset);
  EXPECT_FALSE(watch.knocked());
}

}  // namespace
}  // namespace phantom::workspace_camera::camera_alignment_test
