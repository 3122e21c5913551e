// What the scene stream says, read by a decoder of its own, against what the server draws.
#include "components/synthetic_viewer/stream/scene_encoder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/geometry/implicit/primitives.hpp"
#include "components/synthetic_viewer/page/page_state.hpp"
#include "components/synthetic_viewer/samples/tests/mesh_chunks.hpp"
#include "components/synthetic_viewer/stream/state_delta.hpp"
#include "components/synthetic_viewer/stream/tests/scene_decoder.hpp"
#include "components/synthetic_viewer/tests/loop_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

// Four int16 hold a rotation to 6e-5 rad.
constexpr double kExact = 1e-4;

class SceneOfACell : public test::DrawnCell {
 protected:
  void put_object(std::uint16_t id, const Eigen::Vector3d& at_m) {
    const geometry::TriangleMesh mesh = geometry::make_sphere(0.05 + 0.01 * id, 2);
    for (MeshChunkSample& chunk : test::chunks_of(mesh, 65536)) ASSERT_TRUE(drawing_.take(std::move(chunk)));
    ObjectSample object;
    object.id = id;
    object.name = "ball \"" + std::to_string(id) + "\"";
    object.mesh_hash = mesh.content_hash();
    object.X_WO = {geometry::rotation_about(Eigen::Vector3d(1, 2, 3).normalized(), 0.7), at_m};
    object.colour = {0.1F, 0.5F, 0.9F};
    state_.take(object, now_ns_);
  }
  /// The worst sensor near the arm's end, moving.
  void put_percept() {
    state_.percept.received_ns = now_ns_;
    state_.percept.valid = true;
    state_.percept.closeness = 0.6;
    state_.percept.speed_m_s = 0.2;
    state_.percept.position_m = {0.5, 0.12, 1.1};
    state_.percept.velocity_m_s = {-0.15, 0.1, 0.03};
    state_.percept.pgv = {0.01, 0.02, -0.005};
    state_.percept.pgs = 12.0;
    state_.percept.motion = MotionClass::kDangerous;
  }
  void put_skin(std::size_t count, float closeness = 0.8F) {
    SkinSample skin;
    skin.received_ns = now_ns_;
    skin.valid = true;
    skin.patch_m = 0.02;
    for (std::size_t i = 0; i < count; ++i) {
      const auto k = static_cast<float>(i);
      skin.felt.push_back({i % 4, {0.01F * k, -0.2F, 0.003F * k}, closeness});
    }
    drawing_.paint(skin);
    state_.skin = std::move(skin);
  }
  void send(bool base = true) {
    if (base) encoder_.take(std::make_shared<const SceneBase>(drawing_.scene_base()));
    encoder_.compose({state_.arm, state_.percept, state_.master, state_.gripper, state_.stops}, now_ns_);
  }
  /// Reads all that is new. Returns its octets, with those of the frames' headers.
  std::size_t read() {
    std::size_t octets = 0;
    const auto count = [&](const SceneMessage& message) {
      octets += message.octets.size() + (message.octets.size() < 126 ? 2 : 4);
    };
    while (const auto next = encoder_.board().next(seen_)) {
      count(*next);
      next->binary ? scene_.take_binary(next->octets) : scene_.take_text(next->octets);
    }
    if (encoder_.poses() == poses_) return octets;
    poses_ = encoder_.poses();
    count(*poses_);
    scene_.take_binary(poses_->octets);
    return octets;
  }
  std::uint64_t hash_of(MeshHandle handle) const {
    for (const auto& [hash, body] : drawing_.scene().meshes)
      if (body.picture == handle) return hash;
    for (const LinkBody& part : drawing_.scene().links)
      if (part.body.picture == handle) return part.body.hash;
    return 0;
  }
  /// Compares what was read with the frame of a view as it is drawn.
  void expect_same(View view) {
    const Frame frame = drawing_.picture(view).frame;
    const int bit = 1 << static_cast<int>(view);
    std::size_t bodies = 0, marks = 0;
    for (const DrawItem& drawn : frame.items) {
      const Eigen::Matrix4d W_from_mesh = drawn.W_from_mesh.cast<double>();
      const auto near = [&](const Eigen::Affine3d& told) {
        return (told.matrix() - W_from_mesh).cwiseAbs().maxCoeff() < kExact;
      };
      bool found = false;
      if (drawn.mesh < kFirstFreeHandle) {
        ++marks;
        for (const auto& mark : scene_.marks) {
          found = found || (mark.shape == static_cast<int>(drawn.mesh) && (mark.views & bit) != 0 &&
                            near(mark.X_WS) && std::abs(mark.own_light - drawn.own_light) < 0.003 &&
                            std::abs(mark.colour[3] - drawn.opacity) < 1e-4 &&
                            std::abs(mark.colour[0] - drawn.colour[0]) < 1e-4 &&
                            std::abs(mark.colour[1] - drawn.colour[1]) < 1e-4 &&
                            std::abs(mark.colour[2] - drawn.colour[2]) < 1e-4);
        }
      } else {
        ++bodies;
        const std::string hash = hash_text(hash_of(drawn.mesh));
        for (const auto& [id, item] : scene_.items) {
          const bool painted = drawn.paint != kNoPaint;
          const bool looks = item.at("mesh") == hash &&
                             std::abs(item.at("opacity").get<double>() - drawn.opacity) < 1e-6 &&
                             std::abs(item.at("colour").at(2).get<double>() - drawn.colour[2]) < 1e-6 &&
                             item.at("shadow") == drawn.casts_shadow;
          const bool paint = !painted || (item.contains("link") && (scene_.flags & 8) != 0 &&
                                          item.at("link") == drawn.paint &&
                                          (test::DecodedScene::matrix_of_json(item.at("paint")).matrix() -
                                           drawn.paint_from_mesh.cast<double>())
                                                  .cwiseAbs()
                                                  .maxCoeff() < 1e-6);
          found = found || (looks && paint && near(scene_.X_WM(item)));
        }
      }
      EXPECT_TRUE(found) << name_of(view) << ": mesh " << drawn.mesh << "\n" << W_from_mesh;
    }
    EXPECT_EQ(bodies, scene_.items.size()) << name_of(view);
    EXPECT_EQ(marks, static_cast<std::size_t>(std::ranges::count_if(
                         scene_.marks, [&](const auto& mark) { return (mark.views & bit) != 0; })))
        << name_of(view);
  }

  SceneEncoder encoder_{config_, config_.page.scene_Hz, "two plates"};
  test::DecodedScene scene_;
  std::uint64_t seen_ = 0;
  SceneMessageLog::Content poses_;
};

TEST_F(SceneOfACell, IsWhatTheServerDrawsInEveryView) {
  put_object(1, {0.4, 0.3, 0.9});
  put_object(2, {0.2, -0.3, 1.0});
  state_.arm = pose(0.3);
  now_ns_ = state_.arm.received_ns;
  state_.arm.contact = true;
  state_.arm.contact_force_N = 4.0;
  state_.arm.contact_point_m = {0.5, 0.1, 1.0};
  put_percept();
  put_skin(40);
  raise(alert(5, {0.5, 0.1, 1.1}));
  advance(0.01);
  send();
  read();
  ASSERT_EQ(scene_.marks.size(), 14U)
      << "two arrows, one with three heads, cone, plane, two look-at marks, contact";
  for (const View view : {View::kMain, View::kHit, View::kTool}) expect_same(view);
  EXPECT_EQ(scene_.items.at("object:1").at("name"), "ball \"1\"");
  EXPECT_EQ(scene_.cell.at("protocol"), 2);
  // Between the rounds of the drawing thread only the samples are newer.
  state_.arm.position[1] += 0.2;
  state_.percept.motion = MotionClass::kSafe;
  advance(0.01);
  send(false);
  read();
  for (const View view : {View::kMain, View::kHit, View::kTool}) expect_same(view);
}

TEST_F(SceneOfACell, WhatIsCarriedRidesOnItsLinkAndIsFadedWithTheArm) {
  put_object(1, {0.4, 0.3, 0.9});
  messages::CarriedObject carried;
  carried.id = 1;
  carried.arm = cell_.arm().name;
  carried.frame = arm_.links().back().name;
  carried.X_FO = {geometry::rotation_about(Eigen::Vector3d::UnitX(), 0.4), {0.0, 0.05, 0.1}};
  state_.workspace.carried = {carried};
  advance(0.01);
  send();
  read();
  EXPECT_EQ(scene_.items.count("object:1"), 0U) << "where it is is not known before the arm";
  EXPECT_TRUE(scene_.bodies.empty());
  EXPECT_EQ(scene_.flags & 1, 0);
  state_.arm = pose(-0.4);
  now_ns_ = state_.arm.received_ns;
  advance(0.01);
  send(false);
  read();
  expect_same(View::kMain);
  EXPECT_EQ(scene_.items.at("object:1").at("body"), static_cast<int>(arm_.links().size()) - 1);
  advance(1.0);
  send(false);
  read();
  expect_same(View::kMain);
  EXPECT_EQ(scene_.items.at("object:1").at("opacity").get<float>(), 0.4F);
  EXPECT_EQ(scene_.flags & 3, 3) << "heard, and out of date";
  EXPECT_NEAR(scene_.arm_age_s, 1.01, 1e-3);
  EXPECT_EQ(scene_.view.at("banner").at("key"), "banner.link_lost");
}

TEST_F(SceneOfACell, ARecordedMomentIsOfTheRecordingsClockAndNothingLiveComesIn) {
  const core::Nanoseconds then_ns = 1'700'000'000 * core::kNsPerSecond;
  state_.arm = pose(0.3);
  put_percept();
  state_.arm.received_ns = then_ns - core::from_seconds(0.02);
  state_.percept.received_ns = then_ns - core::from_seconds(0.04);
  drawing_.advance(then_ns, 0.0);
  SceneBase base = drawing_.scene_base();
  base.recorded_ns = then_ns;
  base.state.stops.alarm = true;
  encoder_.take(std::make_shared<const SceneBase>(std::move(base)));
  LiveSamples live;
  live.arm = pose(-0.4);
  live.percept = state_.percept;
  live.percept.closeness = 0.1;
  encoder_.compose(live, now_ns_);
  read();
  EXPECT_EQ(scene_.flags & 7, 1 + 4) << "heard, not out of date, percept known";
  EXPECT_NEAR(scene_.arm_age_s, 0.02, 1e-6);
  EXPECT_NEAR(scene_.percept_age_s, 0.04, 1e-6);
  EXPECT_NEAR(scene_.closeness, 0.6, 1e-6);
  EXPECT_NEAR(scene_.time_s, core::seconds(now_ns_), 1e-6) << "when it was sent is of now";
  EXPECT_EQ(scene_.view.at("alarm"), true);
  expect_same(View::kMain);
  expect_same(View::kTool);
}

TEST_F(SceneOfACell, OnlyWhatHasChangedIsToldAgain) {
  put_object(1, {0.4, 0.3, 0.9});
  put_object(2, {0.2, -0.3, 1.0});
  state_.arm = pose();
  now_ns_ = state_.arm.received_ns;
  advance(0.01);
  send();
  read();
  const std::uint64_t newest = encoder_.board().newest();
  advance(0.01);
  send();
  EXPECT_EQ(encoder_.board().newest(), newest);
  state_.objects.at(1).X_WO.translation_m.x() += 0.01;
  state_.objects.erase(2);
  advance(0.01);
  send();
  EXPECT_EQ(encoder_.board().newest(), newest + 2);
  read();
  EXPECT_EQ(scene_.items.count("object:2"), 0U);
  expect_same(View::kMain);
}

TEST_F(SceneOfACell, TheHitZonesViewNamesItsNodesWithTheFreeDistanceOfEach) {
  put_object(1, {0.4, 0.3, 0.9});
  state_.arm = pose();
  now_ns_ = state_.arm.received_ns;
  state_.chosen = ViewNode::kTop;
  raise(alert(5, {0.5, 0.1, 1.1}));
  advance(0.01);
  send();
  read();
  const auto& hit = scene_.view.at("hit");
  EXPECT_EQ(hit.at("alert"), 5);
  EXPECT_EQ(hit.at("node"), static_cast<int>(ViewNode::kTop));
  ASSERT_EQ(hit.at("free_m").size(), 14U);
  const Camera camera = drawing_.picture(View::kHit).frame.camera;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    EXPECT_NEAR(hit.at("eye_m").at(i).get<double>(), camera.eye_m[axis], 1e-5);
    const double at_node = hit.at("look_at_m").at(i).get<double>() +
                           hit.at("free_m").at(12).get<double>() *
                               scene_.cell.at("nodes").at(12).at("direction").at(i).get<double>();
    EXPECT_NEAR(at_node, camera.eye_m[axis], 1e-5);
    const Camera main = drawing_.picture(View::kMain).frame.camera;
    EXPECT_NEAR(scene_.view.at("main").at("eye_m").at(i).get<double>(), main.eye_m[axis], 1e-5);
  }
  const int link = scene_.cell.at("views").at("tool").at("link");
  const auto in_link = [&](const char* name) {
    const auto& v = scene_.cell.at("views").at("tool").at(name);
    return Eigen::Vector3d(v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>());
  };
  const Eigen::Vector3d eye = scene_.bodies.at(static_cast<std::size_t>(link)) * in_link("eye_m"),
                        look_at = scene_.bodies.at(static_cast<std::size_t>(link)) * in_link("look_at_m");
  const Eigen::Vector3d place = look_at + scene_.tool_free * (eye - look_at);
  EXPECT_LT((place - drawing_.picture(View::kTool).frame.camera.eye_m).norm(), kExact);
}

TEST_F(SceneOfACell, PaintSaysWhatTheSkinFeels) {
  state_.arm = pose();
  now_ns_ = state_.arm.received_ns;
  put_skin(50, 0.6F);
  advance(0.01);
  send();
  read();
  ASSERT_EQ(scene_.patches.size(), 50U);
  EXPECT_FLOAT_EQ(static_cast<float>(scene_.patch_m), 0.02F);
  for (std::size_t i = 0; i < 50; ++i) {
    const SkinPatchSample& felt = state_.skin.felt[i];
    EXPECT_EQ(static_cast<std::size_t>(scene_.patches[i].link), felt.link);
    EXPECT_NEAR(scene_.patches[i].closeness, felt.closeness, 0.002);
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(scene_.patches[i].middle_m[axis], felt.middle_m[static_cast<std::size_t>(axis)], 1e-5);
  }
  EXPECT_EQ(scene_.flags & 8, 8);
  advance(1.0);  // the skin is silent
  send(false);
  read();
  EXPECT_EQ(scene_.flags & 8, 0);
}

// All that can move at once, at 60 Hz, and the page's numbers with it, at 10 Hz: of six components, of which
// each tells its state twice a second, too.
TEST_F(SceneOfACell, AViewerCostsLessThanSixtyThousandOctetsASecond) {
  for (std::uint16_t id = 1; id <= 5; ++id) put_object(id, {0.1 * id, 0.3, 0.9});
  state_.arm = pose();
  now_ns_ = state_.arm.received_ns;
  raise(alert(5, {0.5, 0.1, 1.1}));
  advance(0.01);
  send();
  read();
  constexpr int kTicks = 600;
  std::size_t octets = 0, numbers_octets = 0;
  StateDelta numbers;
  std::uint64_t seen = 0;
  const PageFacts facts{"hot cell", true, true, 10.0, "llvmpipe (LLVM 15.0.6, 256 bits)", 0, {}, {}};
  const int before = scene_.poses_count;
  for (int tick = 0; tick < kTicks; ++tick) {
    now_ns_ += core::kNsPerSecond / 60;
    state_.arm.received_ns = now_ns_;
    for (std::size_t j = 0; j < arm_.joint_count(); ++j) state_.arm.position[j] += 0.001;
    state_.arm.contact = true;
    state_.arm.contact_force_N = 2.0;
    state_.arm.contact_point_m = {0.5 + 1e-4 * tick, 0.1, 1.0};
    put_percept();
    state_.percept.position_m[0] += 1e-4 * tick;
    if (tick % 3 == 0) put_skin(400, 0.5F + 1e-4F * static_cast<float>(tick));
    state_.objects.at(1).X_WO.translation_m.y() += 1e-4;  // somebody moves it, too
    drawing_.advance(now_ns_, 1.0 / 60);
    send(tick % 6 == 0);
    octets += read();
    if (tick % 6 != 0) continue;
    for (int k = 0; k < 6 && tick % 30 == 0; ++k) {
      ComponentSample component;
      component.component = "component_" + std::to_string(k);
      component.host = "slave-host";
      component.received_ns = now_ns_;
      component.message = k == 0 ? "a drive of a joint does not follow, and waits" : "";
      for (int loop = 0; loop < 3; ++loop)
        component.loops.push_back({"loop_" + std::to_string(loop), 0.001, 999.7 - 1e-3 * tick,
                                   55.0 + 0.01 * tick, 90.0 + 0.01 * tick, 400, 12, 40, 1000, 2,
                                   1e-6 * tick});
      state_.take(component);
    }
    state_.master.received_ns = now_ns_;
    state_.master.round_trip_s = 0.002 + 1e-6 * tick;
    for (std::size_t j = 0; j < arm_.joint_count(); ++j)
      state_.master.percept_torque_Nm[j] = state_.master.feedback_torque_Nm[j] = 1.0 / 3 + 0.001 * tick;
    if (tick % 60 == 0) state_.take(alert(100 + static_cast<std::uint32_t>(tick), {0.5, 0.1, 1.1}));
    numbers.put(page_state(state_, drawing_.scene(), drawing_.hit_view(), config_.staleness, facts, now_ns_));
    numbers_octets += numbers.since(seen).size() + 4;
  }
  octets += numbers_octets;
  std::printf("%.1f kB/s of them numbers\n", 1e-3 * static_cast<double>(numbers_octets) / 10);
  EXPECT_EQ(scene_.poses_count - before, kTicks) << "each tick has its poses";
  EXPECT_GE(scene_.paint_count, 10) << "still once a second";
  EXPECT_LT(octets, 600'000U) << "in ten seconds";
  std::printf("%.1f kB/s with all in motion\n", 1e-3 * static_cast<double>(octets) / 10);
  // At rest there is a heartbeat, and no more.
  octets = 0;
  const int moving = scene_.poses_count;
  for (int tick = 0; tick < kTicks; ++tick) {
    now_ns_ += core::kNsPerSecond / 60;
    state_.arm.received_ns = state_.percept.received_ns = state_.skin.received_ns = now_ns_;
    send(false);
    octets += read();
  }
  EXPECT_GE(scene_.poses_count - moving, 45) << "five a second, in ticks of a sixtieth";
  EXPECT_LT(octets, 40'000U) << "in ten seconds";
}

}  // namespace
}  // namespace phantom::synthetic_viewer
