// A headset's controller leads, from an emulated headset in a real Chromium to the samples of the topic
// haptic_device. What each button and each loss of the controller does: web/tests/scene/hand.test.mjs,
// headset_hand_test.cpp.
#include <atomic>
#include <mutex>
#include <optional>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"
#include "components/synthetic_viewer/tests/headset_rig.hpp"
#include "components/synthetic_viewer/topics/dds_adapter.hpp"

namespace phantom::synthetic_viewer {
namespace {

using Eigen::Vector3d;
using test::eventually;

constexpr double kHandSilent_s = 60.0;  // software draws a few frames a second: that is no silence here

class HandInHeadset : public test::SceneInHeadset {
 protected:
  HandInHeadset() {
    hand_ = &lead_;
    config_.page.headset_hand = true;
    adapter_.serve(lead_);
  }
  void TearDown() override {
    SceneInHeadset::TearDown();
    states_.reset();
  }
  /// Enters the headset, which sees its controllers: the emulator calls every place a guess.
  void enter_seen() {
    enter();
    browser_->run("Object.defineProperty(XRPose.prototype, 'emulatedPosition', { get: () => false })");
  }
  /// Does so with the controller in the right hand, as the page sees it in its next frames.
  void right(const std::string& what) {
    browser_->run("const c = headset.controllers.right; " + what);
    frames(2);
  }
  bool is(const std::string& word) {
    const bool came = eventually([&] { return truth("phantomScene.hand.state === '" + word + "'"); });
    EXPECT_TRUE(came) << of("h.hand.state") << " instead of " << word;
    return came;
  }
  msg::HapticDevice state() {
    const std::lock_guard lock(mutex_);
    return state_.value_or(msg::HapticDevice());
  }
  /// How often the device was let go: it was ready, and then not.
  int let_go() {
    const std::lock_guard lock(mutex_);
    return let_go_;
  }
  Vector3d place() {
    const msg::Vector3 p = state().X_DH().position_m();
    return {p.x(), p.y(), p.z()};
  }
  /// An axis of the room in W, as the eyes' camera stands, whose own axes are the room's.
  Vector3d axis_of_room(int axis) {
    Vector3d in_W;
    for (int i = 0; i < 3; ++i)
      in_W[i] = of("h.stage.renderer.xr.getCamera().cameras[0].matrixWorld.elements[" +
                   std::to_string(4 * axis + i) + "]")
                    .get<double>();
    return in_W.normalized();
  }
  /// Waits until the handle is as far from `from` as wanted.
  bool comes_to(const Vector3d& from, const Vector3d& moved_m) {
    const bool came = eventually([&] { return (place() - from - moved_m).norm() < 2e-3; });
    EXPECT_TRUE(came) << (place() - from).transpose() << " of " << moved_m.transpose();
    return came;
  }

  HeadsetHand lead_{kHandSilent_s, Eigen::Matrix3d::Identity()};
  Inbox topics_;
  DdsAdapter adapter_{dds::test_network(), {.joint_count = 7, .link_count = 8}, topics_};
  dds::Participant master_io_{"master_io", dds::test_network()};
  dds::Stamper stamper_{master_io_};
  dds::Writer<msg::HapticDeviceWrench> wrenches_{master_io_, dds::kHapticDeviceWrench};
  std::mutex mutex_;
  int let_go_ = 0;
  std::optional<msg::HapticDevice> state_;  // the newest
  // Takes the device as master_io does: what is ready is answered, and leads while its clutch is in.
  std::optional<dds::Reader<msg::HapticDevice>> states_{
      std::in_place, master_io_, dds::kHapticDevice,
      [this](const msg::HapticDevice& m, const dds::SampleInfo&) {
        msg::HapticDeviceWrench wrench;
        wrench.stamp(stamper_.next());
        wrench.device_echo(dds::echo_of(dds::id_of(m.stamp())));
        wrench.valid(m.ready());
        wrench.leads(m.clutch());
        wrench.time_to_live_s(1.0);
        wrench.fade_s(1.0);
        wrenches_.write(wrench);
        const std::lock_guard lock(mutex_);
        if (state_ && state_->ready() && !m.ready()) ++let_go_;
        state_ = m;
      }};
};

// Tries synthetic_viewer: the page of a controller that leads goes
TEST_F(HandInHeadset, AHandMovesTheHapticDeviceAndAPageThatGoesLetsGo) {
  enter_seen();
  right("c.updateButtonValue('b-button', 1)");
  ASSERT_TRUE(is("ready"));
  right("c.updateButtonValue('b-button', 0); c.updateButtonValue('squeeze', 1)");
  ASSERT_TRUE(is("leads"));
  const double shift = of("h.place.shift_m.x").get<double>();
  const char* const steps[] = {"c.position.x += 0.04", "c.position.y += 0.03", "c.position.z += 0.02"};
  Vector3d from = place();
  for (int axis = 0; axis < 3; ++axis) {
    right(steps[axis]);
    ASSERT_TRUE(comes_to(from, (0.04 - 0.01 * axis) * axis_of_room(axis)))
        << "x right, y up, z towards the user";
    from = place();
  }
  EXPECT_GT(axis_of_room(1).z(), 0.999) << "W is upright";
  EXPECT_NEAR(of("h.place.shift_m.x").get<double>(), shift, 1e-9) << "its squeeze does not carry the scene";
  const int before = let_go();
  browser_->run("phantomScene.connection.socket.close()");
  EXPECT_TRUE(eventually([&] { return let_go() > before; }));
  EXPECT_TRUE(is("free")) << "the page follows again, and leads nothing";
  EXPECT_TRUE(truth("phantomScene.hand.side === null"));
  frames(3);
  EXPECT_FALSE(state().clutch());
}

}  // namespace
}  // namespace phantom::synthetic_viewer
