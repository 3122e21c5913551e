#pragma once
// The viewer on the cell with two plates, fed by hand instead of by topics: its drawing thread as a whole,
// and what that wires.

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <thread>

#include "common/runtime/cell/arm_model.hpp"
#include "components/synthetic_viewer/viewer_loop.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::synthetic_viewer::test {

using phantom::test::eventually;

class TwoPlates : public ::testing::Test {
 protected:
  /// `cell`: another of the shipped ones.
  explicit TwoPlates(const std::string& cell = "two_plates")
      : cell_(runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/" + cell + "/cell.yaml")) {
    config_.graphics = GraphicsPlatform::kSurfaceless;
    config_.frame_rate_hz = 30;
    config_.main_view.format = {320, 180, 1, false};
    config_.main_view.azimuth_rad = -0.9;
    config_.main_view.elevation_rad = 0.4;
    config_.main_view.field_of_view_rad = 0.6;
    config_.main_view.margin = 1.0;
    config_.hit_view.format = {320, 180, 1, false};
    config_.hit_view.field_of_view_rad = 0.7;
    config_.tool_view.format = {320, 180, 1, false};
    config_.tool_view.field_of_view_rad = 1.0;
    config_.tool_view.eye_m = {0.1, 0, 0.1};
    config_.tool_view.look_at_m = {0, 0, 0};
    folder_ = std::filesystem::path(::testing::TempDir()) / ("viewer_loop_" + std::to_string(getpid()));
    config_.recording.folder = folder_;
  }
  ~TwoPlates() override { std::filesystem::remove_all(folder_); }
  /// The slave's state as it would come, now; its first joint away from home.
  ArmSample pose(double turned_rad = 0.0) const {
    ArmSample arm;
    arm.received_ns = core::monotonic_ns();
    arm.state = LinkState::kCoupled;
    const auto& home = cell_.arm(config_.arm).home;
    std::copy(home.begin(), home.end(), arm.position.begin());
    arm.position[0] += turned_rad;
    return arm;
  }
  HitSample alert(std::uint32_t number, const Vector3& look_at_m) const {
    HitSample hit;
    hit.received_ns = core::monotonic_ns();
    hit.alert = number;
    hit.rule = HitRule::kVeryClose;
    hit.link = 2;
    hit.look_at_m = look_at_m;
    hit.pgv = {0, 0.02, 0};
    hit.arm = pose();
    return hit;
  }
  const runtime::CellConfig cell_;
  ViewerConfig config_;
  PageContent content_;
  std::filesystem::path folder_;
};

/// What the loop draws, without the loop.
class DrawnCell : public TwoPlates {
 protected:
  /// One round, `dt_s` after the last.
  void advance(double dt_s = 0.1) {
    now_ns_ += core::from_seconds(dt_s);
    drawing_.advance(now_ns_, dt_s);
  }
  void raise(const HitSample& hit) {
    state_.take(hit);
    drawing_.take(hit);
  }
  ViewerState state_;
  robot::SerialArm arm_ = runtime::load_arm(cell_.arm());
  Drawing drawing_{config_, cell_, arm_, load_arm_meshes(arm_, runtime::load_skin(cell_.arm(), arm_)),
                   state_};
  core::Nanoseconds now_ns_ = core::monotonic_ns();
};

class Loop : public TwoPlates {
 protected:
  ~Loop() override { loop_.reset(); }
  void start() {
    auto arm = runtime::load_arm(cell_.arm());
    auto meshes = load_arm_meshes(arm, runtime::load_skin(cell_.arm(), arm));
    loop_ = std::make_unique<ViewerLoop>(config_, cell_, std::move(arm), std::move(meshes), inbox_, content_,
                                         report_dir_);
    loop_->start();
  }
  void send_pose(double turned_rad = 0.0) { inbox_.arm.write(pose(turned_rad)); }
  double figure(const std::string& name) {
    for (const core::HealthFigure& figure : loop_->health().figures) {
      if (figure.name == name) return figure.value;
    }
    return -1.0;
  }

  Inbox inbox_;
  std::filesystem::path report_dir_;
  std::unique_ptr<ViewerLoop> loop_;
};

}  // namespace phantom::synthetic_viewer::test
