#include "components/synthetic_viewer/scene/camera_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "common/core/errors.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "components/synthetic_viewer/tests/camera_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

using ::testing::HasSubstr;

class OverlayOfACamera : public test::CameraRig {
 protected:
  using CameraRig::CameraRig;
  /// Holds the lines of what moves, drawn for the picture's time and for now, against the picture.
  void expect_lines_of_then();
};

// The arm of the shipped pair that rests, with the other one, which moves.
class OverlayOfAPair : public OverlayOfACamera {
 protected:
  OverlayOfAPair() : OverlayOfACamera("scara_pair") {
    config_.arm = "scara_a";
    config_.other_arms = {{"scara_b", "scara_pair/b"}};
    const Eigen::Vector3d eye(1.1, -1.5, 1.5), z = (Eigen::Vector3d(0.25, 0.0, 0.65) - eye).normalized();
    const Eigen::Vector3d x = z.cross(Eigen::Vector3d(0.05, 0.1, 1.0)).normalized();
    camera().calibration.X_WC->rotation << x, z.cross(x), z;
    camera().calibration.X_WC->translation_m = eye;
  }
};

// The picture comes from the simulated camera, distorted, noisy and late; the lines from the model, and what
// is compared is where the picture's brightness changes.
TEST_F(OverlayOfACamera, AtRestItsLinesLieOnTheEdgesOfThePicture) {
  open();
  take_picture();
  const Frame frame = drawing_->picture(View::kCamera).frame;
  ASSERT_TRUE(frame.backdrop);
  const auto off = distances(frame);
  if (const char* folder = std::getenv("PHANTOM_PICTURES_DIR")) {
    Image drawn = drawing_->renderer().render(frame, config_.camera_view.format);
    draw_hud(drawn, drawing_->picture(View::kCamera).hud);
    cv::imwrite(std::string(folder) + "/camera_rest.png", drawn);
    cv::imwrite(std::string(folder) + "/camera_raw.png", feed_->status().newest->image);
  }
  ASSERT_GT(off.size(), 150U) << "enough of it is seen";
  EXPECT_LT(off[off.size() / 2], 0.5) << "median";
  EXPECT_GT(test::share_within(off, 1.0), 0.85) << "the rest are edges without contrast";
}

TEST_F(OverlayOfACamera, ACameraThatStandsElsewhereIsSeenToDoSo) {
  camera().simulated.X_CS.translation_m.x() = 0.02;  // 20 mm: 7 px at 1.4 m
  open();
  take_picture();
  EXPECT_LT(test::share_within(distances(drawing_->picture(View::kCamera).frame), 1.0), 0.3);
}

void OverlayOfACamera::expect_lines_of_then() {
  speed_rad_s_ = 1.2;
  open();
  std::vector<double> then, now;
  for (int k = 0; k < 4; ++k) {
    take_picture();
    Compositor::Picture picture = drawing_->picture(View::kCamera);
    EXPECT_THAT(picture.hud.subtitle, HasSubstr("ms old, drawn over as of then"));
    // The arms alone: what stands still looks the same at all times.
    ViewerState moving = state_;
    moving.objects.clear();
    Frame alone = picture.frame;
    const auto drawn_at = [&](core::Nanoseconds time_ns) {
      moving.arm = arm_at(time_ns);
      for (OtherArmSample& other : moving.others) other.arm = other_at(time_ns);
      return drawing_->scene().frame_over_video(moving, config_.staleness, time_ns, alone.camera.eye_m);
    };
    const Frame of_then = drawn_at(exposed_ns_), of_now = drawn_at(now_ns_);
    for (const Frame* frame : {&of_then, &of_now}) {
      alone.items = frame->items;
      alone.lines = frame->lines;
      // The arm's base does not move.
      std::erase_if(alone.lines, [&](const Line& line) {
        return std::ranges::any_of((frame == &of_then ? of_now : of_then).lines, [&](const Line& other) {
          return (line.from_m - other.from_m).norm() + (line.to_m - other.to_m).norm() < 1e-3F;
        });
      });
      for (const double d : distances(alone)) (frame == &of_then ? then : now).push_back(d);
    }
    // And those that the view really draws are those of then.
    const Frame wanted =
        drawing_->scene().frame_over_video(view_->state_at(state_, exposed_ns_, config_.staleness),
                                           config_.staleness, exposed_ns_, alone.camera.eye_m);
    ASSERT_EQ(picture.frame.lines.size(), wanted.lines.size());
    for (std::size_t i = 0; i < wanted.lines.size(); ++i)
      EXPECT_LT((picture.frame.lines[i].from_m - wanted.lines[i].from_m).norm(), 1e-5F);
  }
  std::ranges::sort(then);
  std::ranges::sort(now);
  if (const char* folder = std::getenv("PHANTOM_PICTURES_DIR")) {
    const Compositor::Picture picture = drawing_->picture(View::kCamera);
    Image drawn = drawing_->renderer().render(picture.frame, config_.camera_view.format);
    draw_hud(drawn, picture.hud);
    cv::imwrite(std::string(folder) + "/camera_moving_" + cell_.name + ".png", drawn);
  }
  ASSERT_GT(then.size(), 60U);
  RecordProperty("share_then", std::to_string(test::share_within(then, 1.0)));
  RecordProperty("share_now", std::to_string(test::share_within(now, 1.0)));
  EXPECT_LT(then[then.size() / 2], 0.7);
  // Few pictures, exposed when this host has time: 0.75 to 0.87 of the lines, and 0.22 to 0.32 if drawn for
  // now.
  EXPECT_GT(test::share_within(then, 1.0), 0.65);
  EXPECT_LT(test::share_within(now, 1.0), 0.4) << "drawn for now, it would lie beside";
}

TEST_F(OverlayOfACamera, InMotionItIsDrawnForThePicturesTimeAndNotForNow) { expect_lines_of_then(); }

TEST_F(OverlayOfAPair, TheOtherArmIsDrawnForThePicturesTimeAndNotForNow) {
  expect_lines_of_then();
  // One that was silent then is not drawn.
  const auto lines = [&](core::Nanoseconds time_ns) {
    ViewerState then = view_->state_at(state_, time_ns, config_.staleness);
    then.arm = arm_at(time_ns);
    return drawing_->scene()
        .frame_over_video(then, config_.staleness, time_ns, camera().calibration.X_WC->translation_m)
        .lines.size();
  };
  EXPECT_LT(lines(filled_ns_ + core::kNsPerSecond), lines(now_ns_));
}

// A camera whose pictures a test makes.
class VideoByHand : public VideoSource {
 public:
  struct Hand {
    std::mutex mutex;
    std::optional<VideoPicture> picture;
    bool lost = false;
  };
  explicit VideoByHand(Hand& hand) : hand_(hand) {}
  core::Expected<std::optional<VideoPicture>> next() override {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const std::lock_guard lock(hand_.mutex);
    if (hand_.lost) throw core::MissingError("the cable is out");
    return std::exchange(hand_.picture, {});
  }

 private:
  Hand& hand_;
};

class AgeOfVideo : public ::testing::Test {
 protected:
  AgeOfVideo() {
    camera_.latency_s = 0.2;
    feed_ = std::make_unique<VideoFeed>([this] { return std::make_unique<VideoByHand>(hand_); }, 1000000);
    view_ = std::make_unique<CameraView>(camera_, PictureFormat{320, 240, 1, false}, VideoStaleness{0.5, 2.0},
                                         *feed_, past_);
  }
  /// A picture that arrives at a time, all of one grey.
  void send(core::Nanoseconds arrived_ns, double grey, std::optional<core::Nanoseconds> exposed_ns = {}) {
    const std::uint64_t before = feed_->status().number;
    {
      const std::lock_guard lock(hand_.mutex);
      hand_.picture = VideoPicture{Image(480, 640, CV_8UC3, cv::Scalar::all(grey)), exposed_ns, arrived_ns};
    }
    ASSERT_TRUE(test::eventually([&] { return feed_->status().number > before; }));
  }
  VideoByHand::Hand hand_;
  RecentSamples past_;
  VideoCamera camera_ = test::bent_camera();
  std::unique_ptr<VideoFeed> feed_;
  std::unique_ptr<CameraView> view_;
};

constexpr core::Nanoseconds kS = core::kNsPerSecond;

TEST_F(AgeOfVideo, IsThatOfTheExposureByTheStampOrByTheKnownLatency) {
  EXPECT_FALSE(view_->at(10 * kS).live);
  EXPECT_EQ(english_text(view_->at(10 * kS).problem), "NO VIDEO from gate: no picture has come");
  send(10 * kS, 90);
  VideoMoment moment = view_->at(10 * kS + kS / 10);
  EXPECT_TRUE(moment.live);
  EXPECT_TRUE(moment.latency_known);
  EXPECT_EQ(moment.exposed_ns, 10 * kS - kS / 5);
  EXPECT_NEAR(moment.age_s, 0.3, 1e-9);
  send(11 * kS, 91, 11 * kS - kS / 2);
  EXPECT_EQ(view_->at(11 * kS).exposed_ns, 11 * kS - kS / 2) << "the stamp is more certain";
  EXPECT_NEAR(view_->at(11 * kS - kS / 3).age_s, 0.5, 1e-9) << "it has come since the clock was looked at";
  camera_.latency_s.reset();
  send(12 * kS, 92);
  moment = view_->at(12 * kS);
  EXPECT_FALSE(moment.latency_known);
  EXPECT_EQ(moment.exposed_ns, 12 * kS);
}

// Tries synthetic_viewer: video that stops; a picture that stays the same
TEST_F(AgeOfVideo, OverAnOldPictureNothingIsDrawnAndItIsDarkAndSaid) {
  send(10 * kS, 100);
  const auto bright = view_->at(10 * kS).picture;
  EXPECT_TRUE(view_->at(10 * kS + kS / 2).live);
  VideoMoment moment = view_->at(10 * kS + 6 * kS / 10);
  EXPECT_FALSE(moment.live);
  EXPECT_EQ(english_text(moment.problem), "VIDEO LOST 1 s ago");
  EXPECT_LT(cv::mean(*moment.picture)[0], 0.5 * cv::mean(*bright)[0]);
  // Arm and objects are there, but nothing of them is drawn.
  ViewerConfig config;
  const auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/two_plates/cell.yaml");
  CellScene scene(runtime::load_arm(cell.arm()), cell.min_m, cell.max_m);
  scene.meshes[9] = {
      kSphere, nullptr, 0, 0, 9, std::make_shared<EdgeMesh>(edges_of(geometry::make_box({0.4, 0.4, 0.4})))};
  ViewerState state;
  state.objects[7] = {7, "box", 9, {}, {}};
  const RayScene bodies;
  const Compositor compositor(config, "cell", scene);
  const auto picture = [&](core::Nanoseconds now_ns) {
    const Compositor::Moment at{state, bodies, bodies, now_ns};
    return compositor.camera_picture(at, at, view_->at(now_ns), {});
  };
  EXPECT_TRUE(picture(10 * kS + 6 * kS / 10).frame.lines.empty());
  EXPECT_TRUE(picture(10 * kS + 6 * kS / 10).frame.items.empty());
  EXPECT_THAT(picture(10 * kS + 6 * kS / 10).hud.banner, HasSubstr("VIDEO LOST"));
  EXPECT_EQ(picture(10 * kS).frame.lines.size(), 12U) << "while it was live";
  EXPECT_THAT(picture(10 * kS).hud.subtitle, HasSubstr("where the arm was then is not known"));
  {
    const std::lock_guard lock(hand_.mutex);
    hand_.lost = true;
  }
  ASSERT_TRUE(test::eventually([&] { return !feed_->status().problem.empty(); }));
  EXPECT_EQ(english_text(view_->at(13 * kS).problem), "VIDEO LOST 3 s ago: the cable is out");
}

// Tries synthetic_viewer: video that stops; a picture that stays the same
TEST_F(AgeOfVideo, ACameraThatSendsOnePictureAgainAndAgainIsSeenToStandStill) {
  for (int k = 0; k < 5; ++k) {
    send(10 * kS + k * kS / 2, 100);
    EXPECT_TRUE(view_->at(10 * kS + k * kS / 2).live);
  }
  send(12 * kS + kS / 4, 100);
  EXPECT_EQ(english_text(view_->at(12 * kS + kS / 4).problem),
            "VIDEO STANDS STILL: the same picture for 2 s");
  send(12 * kS + kS / 2, 101);
  EXPECT_TRUE(view_->at(12 * kS + kS / 2).live);
}

TEST_F(AgeOfVideo, ThePaintIsThatOfThePicturesTime) {
  SkinSample skin;
  skin.valid = true;
  for (int k = 1; k <= 300; ++k) {
    skin.received_ns = k * kS / 20;
    skin.patch_m = k;
    view_->take(skin);
  }
  EXPECT_EQ(view_->state_at({}, 14 * kS + kS / 100, {}).skin.patch_m, 280);
  EXPECT_EQ(view_->state_at({}, 1 * kS, {}).skin.patch_m, 0) << "no longer known";
}

}  // namespace
}  // namespace phantom::synthetic_viewer
