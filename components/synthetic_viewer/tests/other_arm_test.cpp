// The shipped pair of arms: what a viewer of one shows of the other, in its pictures, in the scene stream and
// of recordings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "common/core/errors.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "components/synthetic_viewer/review/review.hpp"
#include "components/synthetic_viewer/review/tests/recorded_session.hpp"
#include "components/synthetic_viewer/scene/drawing.hpp"
#include "components/synthetic_viewer/stream/scene_encoder.hpp"
#include "components/synthetic_viewer/stream/tests/scene_decoder.hpp"
#include "tests/support/files.hpp"

namespace phantom::synthetic_viewer {
namespace {

using core::JointArray;

constexpr JointArray kOtherHome{0.9, 0.7, 0.05, 0.0}, kOtherOverChannel{-0.40, 1.41, 0.05, 0.0};

class PairOfArms : public testing::Test {
 protected:
  PairOfArms() {
    for (const auto& other : config_.other_arms) state_.others.push_back({other.arm, {}});
    state_.arm.received_ns = now_ns_;
    state_.arm.position = kOtherHome;
  }
  static ViewerConfig small_config() {
    ViewerConfig config = load_config(PHANTOM_SOURCE_DIR "/deploy/cells/scara_pair/viewer_a.yaml");
    config.graphics = GraphicsPlatform::kSurfaceless;
    config.main_view.format = {320, 180, 1, false};
    config.report_samples = 1;
    return config;
  }
  void other_at(const JointArray& q) {
    state_.others.at(0).arm.received_ns = now_ns_;
    state_.others[0].arm.position = q;
  }
  Frame frame() const { return drawing_.scene().frame(state_, config_.staleness, now_ns_); }
  /// What is drawn of the other arm: all that is behind this arm's parts.
  std::vector<DrawItem> drawn_of_other() const {
    const Frame whole = frame();
    const auto own = static_cast<std::ptrdiff_t>(drawing_.scene().links.size());
    EXPECT_GE(static_cast<std::ptrdiff_t>(whole.items.size()), own);
    return {whole.items.begin() + own, whole.items.end()};
  }
  Image picture() {
    drawing_.advance(now_ns_, 0.1);
    return drawing_.report_picture(drawing_.picture(View::kMain), {}).value();
  }
  static std::size_t pixels_apart(const Image& a, const Image& b) {
    EXPECT_EQ(a.size(), b.size());
    std::size_t apart = 0;
    for (std::size_t i = 0; i < a.total(); ++i) {
      int off = 0;
      for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) off += std::abs(int{a.data[c]} - int{b.data[c]});
      apart += off > 30 ? 1 : 0;
    }
    return apart;
  }

  const ViewerConfig config_ = small_config();
  const runtime::CellConfig cell_ =
      runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/scara_pair/cell.yaml");
  const robot::SerialArm other_ = runtime::load_arm(cell_.arm("scara_b"));
  ViewerState state_;
  core::Nanoseconds now_ns_ = core::kNsPerSecond;
  robot::SerialArm arm_ = runtime::load_arm(cell_.arm("scara_a"));
  Drawing drawing_{config_, cell_, arm_, load_arm_meshes(arm_, {}), state_};
};

TEST_F(PairOfArms, TheOtherIsDrawnWhereItsStateHasItAsItMoves) {
  EXPECT_TRUE(drawn_of_other().empty()) << "where it is nobody knows yet";
  const auto meshes = load_arm_meshes(other_, {});
  ASSERT_FALSE(meshes.empty());
  for (const JointArray& q : {kOtherHome, kOtherOverChannel}) {
    other_at(q);
    robot::LinkPoses X_WL;
    other_.link_poses(q, X_WL);
    const auto drawn = drawn_of_other();
    ASSERT_EQ(drawn.size(), meshes.size());
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      const geometry::Pose X_WM = X_WL[meshes[i].link] * meshes[i].X_link_mesh;
      EXPECT_LT((drawn[i].W_from_mesh - matrix_of(X_WM)).cwiseAbs().maxCoeff(), 1e-6F) << i;
      EXPECT_EQ(drawn[i].opacity, 1.0F);
      EXPECT_EQ(drawn[i].paint, kNoPaint);
    }
  }
  now_ns_ += core::from_seconds(config_.staleness.slave_s + 0.01);
  state_.arm.received_ns = now_ns_;
  for (const DrawItem& part : drawn_of_other()) EXPECT_LT(part.opacity, 0.5F) << "silent: where it was last";
  state_.arm = {};
  EXPECT_TRUE(frame().items.empty()) << "without this arm's pose there is no view to draw it in";
}

TEST_F(PairOfArms, ThePictureShowsIt) {
  const Image without = picture();
  other_at(kOtherHome);
  const Image at_home = picture();
  other_at(kOtherOverChannel);
  const Image over_channel = picture();
  EXPECT_GT(pixels_apart(without, at_home), 300U);
  EXPECT_GT(pixels_apart(at_home, over_channel), 300U);
  EXPECT_LT(pixels_apart(over_channel, picture()), 10U);
}

TEST_F(PairOfArms, BrowsersGetItAsTheServerDrawsIt) {
  SceneEncoder encoder(config_, config_.page.scene_Hz, "pair");
  test::DecodedScene scene;
  std::uint64_t seen = 0;
  SceneMessageLog::Content poses;
  const auto pass_on = [&](const ArmSample& live_other) {
    drawing_.advance(now_ns_, 0.1);
    encoder.take(std::make_shared<const SceneBase>(drawing_.scene_base()));
    LiveSamples live;
    live.arm = state_.arm;
    live.others[0] = live_other;
    encoder.compose(live, now_ns_);
    while (const auto next = encoder.board().next(seen))
      next->binary ? scene.take_binary(next->octets) : scene.take_text(next->octets);
    poses = encoder.poses();
    scene.take_binary(poses->octets);
  };
  const auto others = [&] {
    return std::ranges::count_if(scene.items,
                                 [](const auto& item) { return item.first.starts_with("other:"); });
  };
  pass_on({});
  EXPECT_EQ(others(), 0);
  ASSERT_EQ(scene.cell.at("bodies").size(), arm_.links().size() + other_.links().size());
  EXPECT_EQ(scene.cell.at("bodies").back().at("name"), "scara_b: " + other_.links().back().name);
  EXPECT_FALSE(scene.cell.at("bodies").back().contains("link")) << "it takes no paint";

  other_at(kOtherHome);
  ArmSample moved = state_.others[0].arm;  // newer than what the drawing thread knows
  moved.position = kOtherOverChannel;
  pass_on(moved);
  other_at(kOtherOverChannel);
  const auto drawn = drawn_of_other();
  ASSERT_EQ(others(), static_cast<std::ptrdiff_t>(drawn.size()));
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    const auto& item = scene.items.at("other:" + std::to_string(i));
    EXPECT_LT((scene.X_WM(item).matrix() - drawn[i].W_from_mesh.cast<double>()).cwiseAbs().maxCoeff(), 1e-4);
    EXPECT_TRUE(item.at("paint").is_null());
    EXPECT_TRUE(item.at("name").get<std::string>().starts_with("scara_b: "));
  }
}

TEST_F(PairOfArms, ItStandsInTheWayAndAnAlertSaysItsName) {
  EXPECT_EQ(object_name(state_, runtime::kFirstOtherArmId), "scara_b");
  EXPECT_THAT(object_name(state_, runtime::kFirstOtherArmId + 1), testing::HasSubstr("65001"));
  const std::size_t before = drawing_.scene().obstacles(state_, true).bodies.size();
  other_at(kOtherOverChannel);
  const RayScene among = drawing_.scene().obstacles(state_, true);
  ASSERT_EQ(among.bodies.size(), before + load_arm_meshes(other_, {}).size());
  std::size_t named = 0;
  for (const RayScene::Body& body : among.bodies)
    named += drawing_.scene().body_name(state_, body.name) == "scara_b" ? 1 : 0;
  EXPECT_EQ(named, among.bodies.size() - before);
  EXPECT_EQ(drawing_.scene().obstacles(state_, false).bodies.size(), 0U);
}

// Both sessions of ten seconds, in one file or each in its own; the other arm goes from home over the
// channel.
class RecordedPair : public PairOfArms {
 protected:
  static JointArray other_then(double t_s) {
    JointArray q;
    for (std::size_t j = 0; j < q.size(); ++j)
      q[j] = kOtherHome[j] + 0.1 * t_s * (kOtherOverChannel[j] - kOtherHome[j]);
    return q;
  }
  void write(test::RecordingWriter& a, test::RecordingWriter& b) {
    a.partitions[1] = "scara_pair/a";
    b.partitions[2] = "scara_pair/b";
    messages::SlaveState state;
    state.joint_count = 4;
    for (int i = 0; i <= 100; ++i) {
      const double t_s = 0.1 * i;
      state.position = kOtherHome;
      state.state = teleop::LinkState::kCoupled;
      a.put(dds::kSlaveState, messages::to_idl(state), t_s, 1);
      state.position = other_then(t_s);
      state.state = teleop::LinkState::kStopped;
      state.stop = {.id = 5, .cause = teleop::StopCause::kEmergency};
      b.put(dds::kSlaveState, messages::to_idl(state), t_s + 0.001, 2);
      state.stop = {};
    }
    messages::HitAlert hit;
    hit.alert = 1;
    hit.rule = percept::HitRule::kVeryClose;
    hit.object = runtime::kFirstOtherArmId;
    a.put(dds::kHitAlert, messages::to_idl(hit), 5.0, 1);
    hit.alert = 7;
    b.put(dds::kHitAlert, messages::to_idl(hit), 6.0, 2);
    b.put(dds::kHitAlert, messages::to_idl(hit), 20.0, 2);
  }
  std::unique_ptr<Review> open(const std::vector<std::filesystem::path>& files,
                               bool with_other = true) const {
    const auto others = load_other_arms(cell_, config_.arm, config_.other_arms);
    return std::make_unique<Review>(
        recording::open_recordings(files, Review::kLimits), arm_, Review::OnProgress(),
        with_other ? sources_of(others, config_.other_arms) : std::vector<OtherArmSource>());
  }
  /// Shows a moment, and returns the picture of it.
  Image shown(Review& review, double t_s) {
    EXPECT_TRUE(review.control({.t_s = t_s}, core::kNsPerSecond));
    now_ns_ = review.advance(core::kNsPerSecond, state_).at_ns;
    return picture();
  }
  const std::filesystem::path folder_ = phantom::test::new_folder();
};

TEST_F(RecordedPair, TheOtherIsShownAsItWasOfOneFileAndOfTwo) {
  {
    test::RecordingWriter both(folder_ / "both.mcap"), a(folder_ / "a.mcap"), b(folder_ / "b.mcap");
    write(both, both);
    write(a, b);
    for (test::RecordingWriter* writer : {&both, &a, &b}) writer->finish();
  }
  for (const auto& files : {std::vector{folder_ / "both.mcap"}, {folder_ / "b.mcap", folder_ / "a.mcap"}}) {
    const auto review = open(files);
    EXPECT_TRUE(review->problems().empty()) << review->problems().front();
    EXPECT_NEAR(review->duration_s(), 10.0, 1e-6) << "this arm's session";
    ASSERT_EQ(review->marks().size(), 1U) << "the other operator's alerts are not this one's";
    EXPECT_EQ(review->marks()[0].object, "scara_b");
    Image before;
    for (const double t_s : {9.05, 1.05, 5.05}) {  // there and back
      const Image now = shown(*review, t_s);
      ASSERT_EQ(state_.others.size(), 1U);
      for (std::size_t j = 0; j < 4; ++j) {
        EXPECT_NEAR(state_.others[0].arm.position[j], other_then(t_s - 0.05)[j], 1e-9);
        EXPECT_EQ(state_.arm.position[j], kOtherHome[j]);
      }
      EXPECT_FALSE(state_.stops.in_force) << "that the other arm is stopped is not this one's stop";
      EXPECT_EQ(drawn_of_other().size(), load_arm_meshes(other_, {}).size());
      if (!before.empty()) {
        EXPECT_GT(pixels_apart(before, now), 300U) << t_s;
      }
      before = now;
      if (const char* pictures = std::getenv("PHANTOM_PICTURES_DIR"))
        cv::imwrite(std::string(pictures) + "/review_pair_" + std::to_string(t_s) + ".png", now);
    }
  }
}

TEST_F(RecordedPair, WithoutTheOthersSessionItIsNotDrawnAndAloneThatIsNoRecordingOfThisArm) {
  {
    test::RecordingWriter a(folder_ / "a.mcap"), b(folder_ / "b.mcap");
    write(a, b);
    a.finish(), b.finish();
  }
  const auto review = open({folder_ / "a.mcap"});
  shown(*review, 5.0);
  EXPECT_TRUE(drawn_of_other().empty());
  EXPECT_THROW(open({folder_ / "b.mcap"}), core::ConfigError);
  const auto mixed = open({folder_ / "a.mcap", folder_ / "b.mcap"}, false);
  EXPECT_FALSE(mixed->problems().empty()) << "which process is the arm's is not known then";
}

TEST_F(PairOfArms, OtherArmsAreThoseOfTheCellEachOnce) {
  const auto refusal = [&](const std::vector<runtime::OtherArmConfig>& others) -> std::string {
    try {
      load_other_arms(cell_, "scara_a", others);
    } catch (const core::ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal({{"scara_b", ""}}), "");
  EXPECT_THAT(refusal({{"scara_a", ""}}), testing::HasSubstr("is this arm, or stands twice"));
  EXPECT_THAT(refusal({{"scara_b", ""}, {"scara_b", ""}}), testing::HasSubstr("each once"));
  EXPECT_THAT(refusal({{"scara_c", ""}}), testing::HasSubstr("scara_c"));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
