// The drawing thread as a whole, without topics: what goes into the inbox, what comes out for those who look.
#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>
#include <opencv2/core.hpp>

#include "common/core/errors.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "components/synthetic_viewer/samples/tests/mesh_chunks.hpp"
#include "components/synthetic_viewer/tests/loop_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

using ::testing::HasSubstr;

using test::eventually;
using test::Loop;

// Tries synthetic_viewer: a mesh that does not come
TEST_F(Loop, AMeshThatNeverArrivesIsNamedAndThePicturesGoOn) {
  content_.view(View::kMain).image.followers = 1;
  start();
  inbox_.put(ObjectSample{4, "boiler", 0xABCD, {}, {0.5F, 0.5F, 0.5F}});
  ASSERT_TRUE(eventually([&] {
    send_pose();
    return loop_->health().message.find("waiting for the meshes of boiler") != std::string::npos;
  })) << loop_->health().message;
  config_.staleness.meshes_s = 0;  // so long have they been waited for
  start();
  inbox_.put(ObjectSample{4, "boiler", 0xABCD, {}, {0.5F, 0.5F, 0.5F}});
  ASSERT_TRUE(eventually([&] {
    send_pose();
    return loop_->health().message.find("shown without what has no mesh: boiler") != std::string::npos;
  })) << loop_->health().message;
  std::uint64_t seen = 0;
  EXPECT_TRUE(content_.view(View::kMain).image.next(seen, std::chrono::seconds(60)));
  EXPECT_EQ(loop_->health().state, core::ComponentState::kReady);
}

TEST_F(Loop, NothingIsDrawnForThoseWhoDrawByThemselves) {
  content_.scene.followers = 1;
  start();
  std::uint64_t seen = 0;
  web::Broadcast<SceneBase>::Content base;
  ASSERT_TRUE(eventually([&] {
    send_pose();
    base = content_.scene.next(seen, std::chrono::milliseconds(100));
    return base && base->state.arm.received_ns != 0;
  }));
  EXPECT_EQ(base->scene->links.size(),
            base->scene->items(base->state, config_.staleness, base->state.arm.received_ns).size());
  for (const LinkBody& part : base->scene->links) EXPECT_TRUE(content_.meshes.packed(part.body.hash));
  for (const View view : kViews) {
    EXPECT_FALSE(content_.view(view).image.newest()) << name_of(view);
    EXPECT_FALSE(content_.view(view).jpeg.newest()) << name_of(view);
  }
}

// Tries synthetic_viewer: no slave yet
// Tries synthetic_viewer: slave silent
TEST_F(Loop, IsReadyWithoutASlaveAndDegradedOnceItIsSilent) {
  config_.staleness.slave_s = 1.0;
  start();
  const auto reaches = [&](core::ComponentState state, bool with_poses) {
    return eventually([&] {
      if (with_poses) send_pose();
      return loop_->health().state == state;
    });
  };
  EXPECT_TRUE(reaches(core::ComponentState::kReady, false));
  ASSERT_TRUE(eventually([&] {
    send_pose();
    return !content_.main_png().empty();
  }));
  EXPECT_TRUE(reaches(core::ComponentState::kDegraded, false));
  EXPECT_TRUE(reaches(core::ComponentState::kReady, true)) << "waiting for the cell's objects still";
}

// Tries synthetic_viewer: a damaged mesh
TEST_F(Loop, ADamagedMeshIsCountedAndItsObjectLeftOut) {
  config_.staleness.meshes_s = 0;
  start();
  const geometry::TriangleMesh box = geometry::make_box({0.1, 0.1, 0.1});
  inbox_.put(ObjectSample{4, "box", box.content_hash(), {}, {0.5F, 0.5F, 0.5F}});
  MeshChunkSample damaged = test::chunks_of(box, 1 << 17).front();
  damaged.data.back() ^= 1U;
  inbox_.put(std::move(damaged));
  ASSERT_TRUE(eventually([&] {
    send_pose();
    return figure("meshes_refused") == 1;
  }));
  EXPECT_TRUE(eventually([&] {
    send_pose();
    return loop_->health().message.find("shown without what has no mesh: box") != std::string::npos;
  })) << loop_->health().message;
  EXPECT_EQ(figure("meshes"), 0);
}

TEST_F(Loop, EveryAlertGetsItsFirstPictureAlsoWhileAnotherIsShown) {
  start();
  send_pose();
  for (std::uint32_t number = 1; number <= 3; ++number) inbox_.put(alert(number, {0.6, 0.1 * number, 1.2}));
  for (std::uint32_t number = 1; number <= 3; ++number) {
    EXPECT_TRUE(eventually([&] { return !content_.hit_picture(number).empty(); })) << number;
  }
  EXPECT_TRUE(eventually([&] { return figure("alert_to_picture_max") > 0; }));
  EXPECT_EQ(content_.hit_picture(4), "");
}

// A busy host may draw an alert's first picture seconds after it came, and the arm has moved on or fallen
// silent meanwhile: the picture is the same as if it had been drawn at once.
TEST_F(Loop, AnAlertsFirstPictureShowsTheArmAsItWasWhenTheAlertCame) {
  const auto first_picture = [&](double turned_rad, double late_s, std::optional<double> turned_now_rad) {
    start();
    inbox_.put(Command{.kind = CommandKind::kViewNode,
                       .value = 11});  // so that the node does not hang on what stands where
    if (turned_now_rad) send_pose(*turned_now_rad);
    HitSample hit = alert(9, {0.6, 0.1, 1.2});
    hit.received_ns -= core::from_seconds(late_s);
    hit.arm = pose(turned_rad);
    hit.arm.received_ns = hit.received_ns;
    inbox_.put(hit);
    EXPECT_TRUE(eventually([&] { return !content_.hit_picture(9).empty(); }));
    return content_.hit_picture(9);
  };
  const std::string at_once = first_picture(0.3, 0.0, 0.3);
  EXPECT_EQ(first_picture(0.3, 3.0, std::nullopt), at_once) << "late, and nobody tells a pose any more";
  EXPECT_EQ(first_picture(0.3, 3.0, -0.8), at_once) << "late, and the arm is elsewhere by now";
  EXPECT_NE(first_picture(0.5, 0.0, 0.3), at_once) << "the arm is in the picture at all";
}

// What the operator waits for comes before views that may wait, also before those that are being drawn; they
// go on all the same.
TEST_F(Loop, AnAlertBreaksOffTheViewsThatAreBeingDrawnButStarvesNone) {
  config_.main_view.format = {1280, 720, 8, true};
  config_.frame_rate_hz = 120;
  content_.view(View::kMain).image.followers = 1;
  start();
  std::uint32_t number = 0;
  double turned_rad = 0;
  ASSERT_TRUE(eventually([&] {
    send_pose(turned_rad += 0.01);  // so that every round has something to draw
    inbox_.put(alert(++number, {0.6, 0.1, 1.2}));
    return figure("rounds_broken_off") >= 3;
  }));
  std::uint64_t seen = 0;
  for (int k = 0; k < 3; ++k) {  // a flood of alerts, and the main view still moves
    ASSERT_TRUE(eventually([&] {
      send_pose(turned_rad += 0.01);
      inbox_.put(alert(++number, {0.6, 0.1, 1.2}));
      return content_.view(View::kMain).image.next(seen, std::chrono::milliseconds(1)) != nullptr;
    }));
  }
  EXPECT_TRUE(eventually([&] { return !content_.hit_picture(number).empty(); }));
}

// Tries synthetic_viewer: more events come
TEST_F(Loop, AnAlertDoesNotQueueBehindMeshes) {
  constexpr int kMeshes = 24;
  start();
  ASSERT_TRUE(eventually([&] { return figure("meshes") == 0; }));
  std::vector<MeshChunkSample> chunks;
  for (int k = 0; k < kMeshes; ++k) {
    for (MeshChunkSample& chunk : test::chunks_of(geometry::make_sphere(0.1 + 0.01 * k, 5), 1 << 17))
      chunks.push_back(std::move(chunk));
  }
  for (MeshChunkSample& chunk : chunks) inbox_.put(std::move(chunk));
  inbox_.put(alert(1, {0.6, 0.1, 1.2}));
  double meshes = 0;  // that had been unpacked before the picture was there
  ASSERT_TRUE(eventually([&] {
    const double now = figure("meshes");
    if (!content_.hit_picture(1).empty()) return true;
    meshes = now;
    return false;
  }));
  EXPECT_LT(meshes, kMeshes / 2);
  EXPECT_TRUE(eventually([&] { return figure("meshes") == kMeshes; }));
}

// What the listener of audio_percept follows.
TEST_F(Loop, TellsHowTheViewStandsThatTheOperatorLooksAt) {
  EXPECT_EQ(content_.view_pose.newest_or_default().made_ns, 0);
  start();
  send_pose();
  ASSERT_TRUE(eventually([&] { return content_.view_pose.newest_or_default().made_ns != 0; }));
  ViewPoseSample view = content_.view_pose.newest_or_default();
  EXPECT_FALSE(view.hit_zone);
  EXPECT_EQ(view.node, 0);
  EXPECT_TRUE(view.X_WC.rotation.col(2).isApprox(
      percept::direction_at(config_.main_view.azimuth_rad, config_.main_view.elevation_rad), 1e-9));
  inbox_.put(ViewRequest{.view = View::kMain, .azimuth_rad = 0.5});
  EXPECT_TRUE(eventually([&] {
    return content_.view_pose.newest_or_default().X_WC.rotation.col(2).isApprox(
        percept::direction_at(config_.main_view.azimuth_rad + 0.5, config_.main_view.elevation_rad), 1e-9);
  }));
  inbox_.put(alert(1, {0.6, 0.1, 1.2}));
  ASSERT_TRUE(eventually([&] { return content_.view_pose.newest_or_default().hit_zone; }));
  view = content_.view_pose.newest_or_default();
  EXPECT_TRUE(view.automatic);
  ASSERT_GE(view.node, 1);
  EXPECT_TRUE(view.X_WC.rotation.col(2).isApprox(
      percept::node_direction(static_cast<percept::ViewNode>(view.node)), 1e-9));
  EXPECT_EQ(view.look_at_m, (Vector3{0.6, 0.1, 1.2}));
  inbox_.put(Command{.kind = CommandKind::kViewNode, .value = 9});
  ASSERT_TRUE(eventually([&] { return content_.view_pose.newest_or_default().node == 9; }));
  EXPECT_FALSE(content_.view_pose.newest_or_default().automatic);
  inbox_.put(ViewRequest{.view = View::kHit, .azimuth_rad = 0.5});
  EXPECT_TRUE(eventually([&] { return content_.view_pose.newest_or_default().node == 0; }))
      << "turned by hand: at no node";
}

TEST_F(Loop, ASnapshotIsDrawnForTheOneWhoAsks) {
  start();
  EXPECT_EQ(content_.main_png().substr(1, 3), "PNG");
}

TEST_F(Loop, TheOperatorTurnsAViewAndBringsItHome) {
  auto& output = content_.view(View::kMain).image;
  output.followers = 1;
  start();
  const auto picture = [&] {
    std::uint64_t seen = 0;
    return output.next(seen, std::chrono::seconds(60));
  };
  // Without a slave nothing else moves in the picture.
  const auto first = picture();
  ASSERT_TRUE(first);
  inbox_.put(ViewRequest{.view = View::kMain, .azimuth_rad = 1.0});
  ASSERT_TRUE(eventually([&] { return cv::norm(*output.newest(), *first) != 0; }));
  inbox_.put(ViewRequest{.view = View::kMain, .home = true});
  EXPECT_TRUE(eventually([&] { return cv::norm(*output.newest(), *first) == 0; }));
}

TEST_F(Loop, RecordsOnRequestAndSaysWhere) {
  start();
  inbox_.put(ViewRequest{.view = View::kMain, .record = true});
  ASSERT_TRUE(eventually([&] { return content_.switches.newest_or_default().recording; }));
  ASSERT_TRUE(
      eventually([&] { return std::filesystem::exists(folder_) && !std::filesystem::is_empty(folder_); }));
  inbox_.put(ViewRequest{.view = View::kMain, .record = false});
  ASSERT_TRUE(eventually([&] { return !content_.switches.newest_or_default().recording; }));
  EXPECT_GT(std::filesystem::file_size(std::filesystem::directory_iterator(folder_)->path()), 0U);
}

// Tries synthetic_viewer: a recording that cannot be written
TEST_F(Loop, AnUnwritableRecordingIsSaidInTheStatusAndThePicturesGoOn) {
  config_.recording.folder = "/proc/nowhere";
  start();
  const geometry::TriangleMesh box = geometry::make_box({0.1, 0.1, 0.1});
  inbox_.put(ObjectSample{4, "box", box.content_hash(), {}, {0.5F, 0.5F, 0.5F}});
  for (MeshChunkSample& chunk : test::chunks_of(box, 1 << 17)) inbox_.put(std::move(chunk));
  ASSERT_TRUE(eventually([&] {
    send_pose();
    const core::Health health = loop_->health();
    return health.state == core::ComponentState::kRunning && health.message.empty();
  })) << loop_->health().message;
  inbox_.put(ViewRequest{.view = View::kMain, .record = true});
  ASSERT_TRUE(eventually([&] {
    send_pose();
    return loop_->health().message.find("recording: cannot make the folder /proc/nowhere") == 0;
  })) << loop_->health().message;
  EXPECT_FALSE(content_.switches.newest_or_default().recording);
  EXPECT_EQ(content_.main_png().substr(1, 3), "PNG");
}

TEST_F(Loop, TheReportHasFramesPerSecondAndThePagesAddress) {
  report_dir_ = folder_;
  start();
  ASSERT_TRUE(eventually([&] { return loop_->health().loops.at(0).ticks >= 2; }));
  loop_->finish("http://127.0.0.1:8080/");
  const auto json = nlohmann::json::parse(std::ifstream(folder_ / "synthetic_viewer.json"));
  const double frames = json.at("frames");
  EXPECT_GE(frames, 2);
  EXPECT_NEAR(json.at("fps").get<double>(), frames / json.at("seconds").get<double>(), 1e-9);
  EXPECT_EQ(json.at("page"), "http://127.0.0.1:8080/");
}

// A display that is not there, whatever this machine has.
// Tries synthetic_viewer: no OpenGL
TEST_F(Loop, WithoutOpenGlTheReasonReachesTheCaller) {
  setenv("EGL_PLATFORM", "x11", 1);
  setenv("DISPLAY", ":no_such_display", 1);
  config_.graphics = GraphicsPlatform::kDisplay;
  start();
  ASSERT_TRUE(eventually([&] { return !loop_->running(); }));
  unsetenv("EGL_PLATFORM");
  unsetenv("DISPLAY");
  try {
    loop_->finish("");
    FAIL() << "no graphics, and nothing said";
  } catch (const core::MissingError& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("no OpenGL to render with: display "));
    EXPECT_THAT(problem.what(), HasSubstr("libgl1-mesa-dri"));
  }
}

// What the pictures say.
class LocalizedText : public Loop {
 protected:
  LocalizedText()
      : scene_(runtime::load_arm(cell_.arm()), cell_.min_m, cell_.max_m),
        compositor_(config_, "cell", scene_) {
    const geometry::TriangleMesh wall = geometry::make_box({0.4, 0.4, 0.4});
    scene_.meshes[9] = {kNoMesh, std::make_shared<RayMesh>(wall)};
    state_.objects[7] = {7, "bellows", 9, {Eigen::Matrix3d::Identity(), {0.6, 0.6, 1.0}}, {}};
    objects_ = scene_.obstacles(state_, false);
    hit_.alert = 1;
    hit_.situation.look_at_m = {0.6, 0, 1.0};
  }
  Compositor::Picture picture() const {
    return compositor_.hit_picture({state_, objects_, objects_, core::kNsPerSecond}, hit_);
  }
  CellScene scene_;
  Compositor compositor_;
  ViewerState state_;
  RayScene objects_;
  HitView hit_;
};

// Tries synthetic_viewer: a view into a wall
TEST_F(LocalizedText, AViewIntoAWallIsSaidAndTakenFromTheNearestFreePlace) {
  hit_.eye_m = {0.6, 0.6, 1.0};  // in the middle of the bellows, which begin at y = 0.4
  const auto into = picture();
  EXPECT_THAT(into.hud.subtitle, HasSubstr("bellows is in the way at 0.60 m: seen from 0.37 m"));
  EXPECT_NEAR(into.frame.camera.eye_m.y(), 0.37, 1e-6);
  hit_.eye_m = {0.6, 0.2, 1.0};
  EXPECT_EQ(picture().hud.subtitle, "");
  // The operator zooms into it himself.
  state_.cameras.take({.view = View::kHit, .zoom = 2.5});
  EXPECT_THAT(picture().hud.subtitle, HasSubstr("bellows is in the way at 0.50 m"));
}

TEST_F(LocalizedText, TheHudTellsLinkQualityModelAgeAndVoxelError) {
  state_.workspace = {3, workspace::VoxelSize(0.005).half_diagonal_m()};
  core::Nanoseconds now_ns = core::kNsPerSecond;
  for (const std::uint64_t second : {0U, 1U, 2U}) {
    state_.arm.received_ns = now_ns - 42'000'000;
    state_.arm.arrived = 1000 * second;
    state_.arm.lost = 10 * second;
    state_.link_quality.take(state_.arm, now_ns);
    now_ns += core::kNsPerSecond;
  }
  now_ns -= core::kNsPerSecond;
  state_.master.received_ns = now_ns;
  state_.master.round_trip_s = 0.0021;
  const Hud hud = compositor_.main_picture({state_, objects_, objects_, now_ns}, {}).hud;
  EXPECT_EQ(hud.link_quality, "99.0 % 2.1 ms");
  EXPECT_EQ(hud.model_age, "40 ms");
  EXPECT_EQ(hud.voxel_error, "4.3 mm");
}

TEST_F(LocalizedText, TheHudTellsClosenessSpeedMotionAndWhatIsNearestWhileThePerceptCounts) {
  constexpr core::Nanoseconds kNow_ns = 10 * core::kNsPerSecond;
  state_.percept = {};
  state_.percept.received_ns = kNow_ns;
  state_.percept.valid = true;
  state_.percept.closeness = 0.75;
  state_.percept.speed_m_s = 0.12;
  state_.percept.motion = MotionClass::kDangerous;
  state_.percept.link = 2;
  state_.percept.object = 7;
  const auto hud = [&](core::Nanoseconds now_ns) {
    return compositor_.main_picture({state_, objects_, objects_, now_ns}, {}).hud;
  };
  EXPECT_TRUE(hud(kNow_ns).gauges);
  EXPECT_TRUE(hud(kNow_ns).closeness_known);
  EXPECT_EQ(hud(kNow_ns).closeness, 0.75);
  EXPECT_EQ(hud(kNow_ns).speed_m_s, 0.12);
  EXPECT_EQ(hud(kNow_ns).motion, MotionClass::kDangerous);
  EXPECT_EQ(hud(kNow_ns).nearest, scene_.link_name(2) + " - bellows");
  EXPECT_FALSE(hud(2 * kNow_ns).closeness_known) << "stale";
  EXPECT_EQ(hud(2 * kNow_ns).nearest, "-");
  state_.percept.valid = false;
  EXPECT_FALSE(hud(kNow_ns).closeness_known);
}

TEST_F(LocalizedText, AreOfTheLanguageOfTheConfiguration) {
  ViewerConfig config = config_;
  config.language = Language::kGerman;
  const Compositor german(config, "cell", scene_);
  state_.arm.received_ns = core::kNsPerSecond;
  state_.arm.state = LinkState::kCoupled;
  state_.arm.contact = true;
  state_.arm.contact_object = 7;
  const Compositor::Moment now{state_, objects_, objects_, core::kNsPerSecond};
  hit_.node = ViewNode::kTop;
  hit_.eye_m = {0.6, 0.6, 1.0};
  const Hud main = german.main_picture(now, {}).hud, hit = german.hit_picture(now, hit_).hud;
  EXPECT_EQ(main.language, Language::kGerman);
  EXPECT_EQ(main.link_state, "GEKOPPELT");
  EXPECT_THAT(main.banner, testing::StartsWith("KEINE ANNÄHERUNGSHILFE"));
  EXPECT_THAT(hit.title, testing::StartsWith("GEFAHRENSTELLE - von "));
  EXPECT_THAT(hit.subtitle, HasSubstr("bellows ist bei 0.60 m im Weg: aus 0.37 m gesehen"));
  EXPECT_EQ(german.tool_picture(now).hud.title, "GREIFERBLICK");
  EXPECT_EQ(compositor_.tool_picture(now).hud.title, "END EFFECTOR");
}

TEST_F(LocalizedText, WhatIsNotKnownIsNotShownAsANumber) {
  const Hud hud = compositor_.main_picture({state_, objects_, objects_, core::kNsPerSecond}, {}).hud;
  EXPECT_EQ(hud.link_quality, "-");
  EXPECT_EQ(hud.model_age, "-");
  EXPECT_EQ(hud.voxel_error, "-");
}

}  // namespace
}  // namespace phantom::synthetic_viewer
