#include "components/synthetic_viewer/render/renderer.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <opencv2/core.hpp>
#include <thread>

#include "common/geometry/implicit/primitives.hpp"
#include "components/synthetic_viewer/output/publisher.hpp"
#include "components/synthetic_viewer/render/tests/project.hpp"
#include "components/synthetic_viewer/scene/cell_scene.hpp"
#include "components/synthetic_viewer/scene/compositor.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr PictureFormat kFormat{320, 240, 1, false};

bool is_red(const Image& image, int x, int y) {
  const std::uint8_t* p = image.ptr(y, x);
  return p[2] > 150 && p[1] < 60 && p[0] < 60;
}

/// A red thing that shines by itself, seen in plain colour.
DrawItem red_item(MeshHandle mesh, const geometry::Pose& X_WM) {
  return {mesh, matrix_of(X_WM), {0.9F, 0.0F, 0.0F}, 1.0F, 1.0F, false};
}

class Rendering : public ::testing::Test {
 protected:
  Renderer renderer_{GraphicsPlatform::kSurfaceless};
};

// The picture and the projection tell the same story: a box covers exactly the pixels between its projected
// corners.
TEST_F(Rendering, ABoxCoversThePixelsBetweenItsProjectedCorners) {
  const Eigen::Vector3d size(0.4, 0.2, 0.3);
  const geometry::Pose X_WB{geometry::rotation_from_rpy(0.3, -0.2, 0.5), {0.1, 0.2, 0.3}};
  Frame frame;
  frame.camera = {{1.0, -1.2, 0.9}, {0.05, 0.15, 0.25}, 0.6, 0.05, 10};
  frame.items = {red_item(renderer_.upload(geometry::make_box(size)), X_WB)};
  const Image image = renderer_.render(frame, kFormat);
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p((corner & 1 ? 0.5 : -0.5) * size.x(), (corner & 2 ? 0.5 : -0.5) * size.y(),
                            (corner & 4 ? 0.5 : -0.5) * size.z());
    const auto pixel = project(frame.camera, image.cols, image.rows, X_WB * p);
    ASSERT_TRUE(pixel);
    low = low.cwiseMin(*pixel);
    high = high.cwiseMax(*pixel);
  }
  Eigen::Vector2d drawn_low(1e9, 1e9), drawn_high(-1e9, -1e9);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      if (!is_red(image, x, y)) continue;
      drawn_low = drawn_low.cwiseMin(Eigen::Vector2d(x, y));
      drawn_high = drawn_high.cwiseMax(Eigen::Vector2d(x + 1, y + 1));
    }
  }
  EXPECT_LE((drawn_low - low).cwiseAbs().maxCoeff(), 1.0);
  EXPECT_LE((drawn_high - high).cwiseAbs().maxCoeff(), 1.0);
}

// A fine mesh is drawn coarser from afar; its outline stays where it is.
TEST_F(Rendering, LevelsOfDetailKeepTheOutline) {
  const double radius_m = 0.15;
  const MeshHandle fine = renderer_.upload(geometry::make_sphere(radius_m, 6));  // 81,920 triangles
  for (const double distance_m : {0.5, 2.0, 8.0}) {
    Frame frame;
    frame.camera = {{0, -distance_m, 0}, {0, 0, 0}, 2.4 * radius_m / distance_m, 0.05, 20};
    frame.items = {red_item(fine, {})};
    const Image image = renderer_.render(frame, kFormat);
    int top = 240, bottom = 0;
    for (int y = 0; y < 240; ++y) {
      if (!is_red(image, 160, y)) continue;
      top = std::min(top, y);
      bottom = std::max(bottom, y + 1);
    }
    // The outline of a ball: where a ray from the eye touches it.
    const double touch = std::asin(radius_m / distance_m);
    const double half_px = 120 * std::tan(touch) / std::tan(frame.camera.vertical_fov_rad / 2);
    EXPECT_NEAR(top, 120 - half_px, 1.5) << distance_m;
    EXPECT_NEAR(bottom, 120 + half_px, 1.5) << distance_m;
  }
}

TEST_F(Rendering, TheNearerOfTwoHidesTheOther) {
  const MeshHandle ball = renderer_.upload(geometry::make_sphere(0.1, 3));
  Frame frame;
  frame.camera = {{0, -2, 0}, {0, 0, 0}, 0.6, 0.05, 10};
  DrawItem green = red_item(ball, {Eigen::Matrix3d::Identity(), {0, 0.5, 0}});
  green.colour = {0, 0.9F, 0};
  frame.items = {red_item(ball, {}), green};
  EXPECT_TRUE(is_red(renderer_.render(frame, kFormat), 160, 120));
  std::swap(frame.items[0], frame.items[1]);
  EXPECT_TRUE(is_red(renderer_.render(frame, kFormat), 160, 120));
}

TEST_F(Rendering, WhatIsSeeThroughShowsWhatIsBehindIt) {
  const MeshHandle ball = renderer_.upload(geometry::make_sphere(0.1, 3));
  Frame frame;
  frame.camera = {{0, -2, 0}, {0, 0, 0}, 0.6, 0.05, 10};
  frame.items = {red_item(ball, {Eigen::Matrix3d::Identity(), {0, 0.5, 0}}), red_item(ball, {})};
  frame.items[1].colour = {0, 0, 0.9F};
  frame.items[1].opacity = 0.4F;
  const Image image = renderer_.render(frame, kFormat);
  EXPECT_GT(image.ptr(120, 160)[2], 80);  // red from behind
  EXPECT_GT(image.ptr(120, 160)[0], 60);  // blue from the front
}

TEST_F(Rendering, LitFromTheKeyLightsSideBodiesAreBrighterThere) {
  Frame frame;
  frame.camera = {{0, -2, 0.5}, {0, 0, 0}, 0.3, 0.05, 10};
  frame.items = {{renderer_.upload(geometry::make_sphere(0.25, 4)), Eigen::Matrix4f::Identity()}};
  const Image image = renderer_.render(frame, kFormat);
  EXPECT_GT(image.ptr(60, 160)[1], image.ptr(180, 160)[1] + 30);
}

TEST_F(Rendering, SamplesSmoothTheEdges) {
  Frame frame;
  frame.camera = {{0, -2, 0}, {0, 0, 0}, 0.3, 0.05, 10};
  frame.items = {red_item(renderer_.upload(geometry::make_sphere(0.2, 4)), {})};
  const auto between = [](const Image& image) {  // pixels that are neither red nor background
    int count = 0;
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) count += image.ptr(y, x)[2] > 110 && image.ptr(y, x)[2] < 200;
    }
    return count;
  };
  PictureFormat fine = kFormat;
  fine.samples = 4;
  EXPECT_GT(between(renderer_.render(frame, fine)), between(renderer_.render(frame, kFormat)) + 50);
}

TEST_F(Rendering, AShadowFallsOnTheFloorOnly) {
  Frame frame;
  frame.camera = {{0, -3, 3}, {0, 0, 0}, 0.6, 0.05, 20};
  frame.floor_min_m = {-1, -1, 0};
  frame.floor_max_m = {1, 1, 1};
  DrawItem ball{renderer_.upload(geometry::make_sphere(0.15, 3)),
                matrix_of({Eigen::Matrix3d::Identity(), {0, 0, 0.6}})};
  ball.casts_shadow = true;
  frame.items = {ball};
  // Where the light from (0.348, −0.464, 0.815) puts it.
  const Eigen::Vector3d place(-0.6 * 0.348 / 0.815, 0.6 * 0.464 / 0.815, 0);
  const auto pixel = project(frame.camera, 320, 240, place);
  ASSERT_TRUE(pixel);
  PictureFormat with = kFormat;
  with.shadows = true;
  const int x = static_cast<int>(pixel->x()), y = static_cast<int>(pixel->y());
  EXPECT_LT(renderer_.render(frame, with).ptr(y, x)[1] + 10, renderer_.render(frame, kFormat).ptr(y, x)[1]);
}

TEST_F(Rendering, ADroppedMeshIsNotDrawn) {
  const MeshHandle ball = renderer_.upload(geometry::make_sphere(0.2, 3));
  Frame frame;
  frame.camera = {{0, -2, 0}, {0, 0, 0}, 0.6, 0.05, 10};
  frame.items = {red_item(ball, {})};
  EXPECT_TRUE(is_red(renderer_.render(frame, kFormat), 160, 120));
  renderer_.drop(ball);
  EXPECT_FALSE(is_red(renderer_.render(frame, kFormat), 160, 120));
}

// A picture may be given up at any of its questions, and leaves nothing behind for the next one.
TEST_F(Rendering, APictureThatIsGivenUpLeavesNothingBehind) {
  const MeshHandle fine = renderer_.upload(geometry::make_sphere(0.1, 5));
  Frame frame;
  frame.camera = {{0, -2, 0.4}, {0, 0, 0}, 0.6, 0.05, 10};
  frame.floor_min_m = {-0.5F, -0.5F, -0.2F};
  frame.floor_max_m = {0.5F, 0.5F, 0.5F};
  for (int k = 0; k < 6; ++k)
    frame.items.push_back(red_item(fine, {Eigen::Matrix3d::Identity(), {0.12 * k - 0.3, 0.05 * k, 0}}));
  frame.items.back().opacity = 0.5F;
  PictureFormat format = kFormat;
  format.shadows = true;
  const Image undisturbed = renderer_.render(frame, format);
  int questions = 0;
  const auto asked = renderer_.render_unless(frame, format, [&] {
    ++questions;
    return false;
  });
  ASSERT_TRUE(asked);
  EXPECT_EQ(cv::norm(*asked, undisturbed), 0);
  ASSERT_GE(questions, 3);
  for (int yes = 1; yes <= questions; ++yes) {
    int count = 0;
    EXPECT_FALSE(renderer_.render_unless(frame, format, [&] { return ++count == yes; })) << yes;
    EXPECT_EQ(cv::norm(renderer_.render(frame, format), undisturbed), 0) << yes;
  }
}

// Contexts of one process share a display; the end of one is not that of the others.
TEST_F(Rendering, AnotherRendererMayComeAndGo) {
  Frame frame;
  frame.camera = {{0, -2, 0}, {0, 0, 0}, 0.6, 0.05, 10};
  frame.items = {red_item(renderer_.upload(geometry::make_sphere(0.2, 3)), {})};
  const Image before = renderer_.render(frame, kFormat);
  ASSERT_TRUE(is_red(before, 160, 120));
  std::thread([] {
    Renderer other(GraphicsPlatform::kSurfaceless);
    Frame empty;
    other.render(empty, kFormat);
  }).join();
  EXPECT_EQ(cv::norm(renderer_.render(frame, kFormat), before), 0);
}

// A two-link arm from a file of its own, so that the test stands by itself.
robot::SerialArm make_arm() {
  const std::filesystem::path file =
      std::filesystem::path(::testing::TempDir()) / ("viewer_test_arm_" + std::to_string(getpid()) + ".urdf");
  std::ofstream(file) << R"(<robot name="a"><link name="base"/><link name="one"/>
    <joint name="j1" type="revolute"><parent link="base"/><child link="one"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" velocity="1" effort="1"/></joint></robot>)";
  auto arm = robot::SerialArm::from_urdf(file, "one", {});
  if (!arm) throw std::runtime_error(arm.status().message());
  return std::move(arm).value();
}

class Scene : public Rendering {
 protected:
  Scene() {
    const geometry::TriangleMesh rod = geometry::make_box({0.05, 0.05, 0.4});
    scene_.links.push_back({1,
                            {Eigen::Matrix3d::Identity(), {0, 0, 0.2}},
                            {0.9F, 0, 0},
                            uploaded(rod, renderer_),
                            rod.bounding_box()});
    state_.arm.received_ns = kNow_ns - 1000;
  }
  Frame frame() const {
    Frame frame = scene_.frame(state_, {}, kNow_ns);
    frame.camera = {{0, -2.5, 0.3}, {0, 0, 0.3}, 0.5, 0.05, 10};
    for (DrawItem& item : frame.items) item.own_light = 1.0F;
    return frame;
  }
  static constexpr core::Nanoseconds kNow_ns = 5 * core::kNsPerSecond;
  CellScene scene_{make_arm(), {-0.5, -0.5, 0}, {0.5, 0.5, 1}};
  ViewerState state_;
};

TEST_F(Scene, TheArmMovesWithItsJoints) {
  const Image upright = renderer_.render(frame(), kFormat);
  const Frame before = frame();
  state_.arm.position[0] = 1.5707963;  // about +y: from up to +x
  const Image lying = renderer_.render(frame(), kFormat);
  const auto up = project(before.camera, 320, 240, {0, 0, 0.5}),
             side = project(before.camera, 320, 240, {0.3, 0, 0.2});
  ASSERT_TRUE(up && side);
  const auto red_at = [](const Image& image, const Eigen::Vector2d& p) {
    return is_red(image, static_cast<int>(p.x()), static_cast<int>(p.y()));
  };
  EXPECT_TRUE(red_at(upright, *up));
  EXPECT_FALSE(red_at(upright, *side));
  EXPECT_FALSE(red_at(lying, *up));
  EXPECT_TRUE(red_at(lying, *side));
}

// Tries synthetic_viewer: slave silent
TEST_F(Scene, AnUnknownArmIsNotDrawnAndAStaleOneIsSeeThrough) {
  EXPECT_EQ(frame().items.at(0).opacity, 1.0F);
  state_.arm.received_ns = kNow_ns - 2 * core::kNsPerSecond;
  EXPECT_LT(frame().items.at(0).opacity, 1.0F);
  state_.arm.received_ns = 0;
  EXPECT_TRUE(frame().items.empty());
}

// Seen from −y, the rod's lower end feels an object and its upper end does not.
TEST_F(Scene, TheSkinIsPaintedWhereItFeels) {
  const auto plain = frame();
  const auto at = [&](const Image& image, double z_m) {
    const auto pixel = project(plain.camera, 320, 240, {0, -0.025, z_m});
    return image.ptr(static_cast<int>(pixel->y()), static_cast<int>(pixel->x()));
  };
  state_.skin = {.received_ns = kNow_ns - 1000,
                 .valid = true,
                 .patch_m = 0.03,
                 .felt = {{1, {0.0F, -0.025F, 0.05F}, 0.5F}}};
  const auto box = scene_.link_boxes().at(1);
  EXPECT_NEAR(box.max_m.z(), 0.4, 1e-6);
  renderer_.paint(1, paint_link(box, state_.skin.patch_m, state_.skin.felt, 1));
  scene_.paint_number = 1;
  const Image painted = renderer_.render(frame(), kFormat);
  const std::uint8_t* low = at(painted, 0.25);  // the link's origin is at 0.2
  EXPECT_GT(low[1], 150) << "yellow: closeness 0.5";
  EXPECT_LT(low[0], 120);
  EXPECT_LT(at(painted, 0.5)[1], 60) << "the upper end is still plain red";
  state_.skin.received_ns = kNow_ns - 3 * core::kNsPerSecond;
  EXPECT_LT(at(renderer_.render(frame(), kFormat), 0.25)[1], 60)
      << "a stale percept is not shown as one that holds";
}

// The same picture is not drawn twice.
TEST_F(Scene, WhatStandsStillIsDrawnAndEncodedOnce) {
  ViewPainter painter;
  ViewOutput output;
  output.jpeg.followers = 1;
  const Compositor::Picture picture{frame(), {}};
  painter.draw(renderer_, picture, kFormat);
  painter.publish(output, 80);
  const auto first = output.jpeg.newest();
  ASSERT_TRUE(first);
  const auto drawn = painter.image();
  Compositor::Picture nearly = picture;
  nearly.frame.items.at(0).W_from_mesh(0, 3) += 1e-6F;
  painter.draw(renderer_, nearly, kFormat);
  EXPECT_EQ(painter.image(), drawn);
  painter.publish(output, 80);
  EXPECT_EQ(output.jpeg.newest(), first);
  for (int k = 0; k < 20; ++k) {  // small steps add up
    nearly.frame.items.at(0).W_from_mesh(0, 3) += 1e-6F;
    painter.draw(renderer_, nearly, kFormat);
  }
  EXPECT_NE(painter.image(), drawn);
  painter.publish(output, 80);
  EXPECT_NE(output.jpeg.newest(), first);
  const auto shown = painter.image();
  Compositor::Picture moved = nearly;
  moved.frame.items.at(0).W_from_mesh(0, 3) += 0.1F;
  EXPECT_FALSE(painter.draw(renderer_, moved, kFormat, [] { return true; }));
  EXPECT_EQ(painter.image(), shown) << "a picture that was given up changes nothing";
  Compositor::Picture written = nearly;
  written.hud.title = "MAIN";
  painter.draw(renderer_, written, kFormat);
  EXPECT_NE(painter.image(), shown);
}

TEST_F(Scene, AnObjectIsDrawnOnceItsMeshIsThere) {
  state_.objects[4] = {4, "box", 77, {}, {0, 0.5F, 0}};
  EXPECT_FALSE(scene_.complete(state_));
  EXPECT_EQ(frame().items.size(), 1U);
  const geometry::TriangleMesh box = geometry::make_box({0.1, 0.1, 0.1});
  scene_.meshes[77] = {renderer_.upload(box), std::make_shared<RayMesh>(box)};
  EXPECT_TRUE(scene_.complete(state_));
  EXPECT_EQ(frame().items.size(), 2U);
  EXPECT_EQ(scene_.obstacles(state_, true).bodies.size(), 2U);
}

// Tries synthetic_viewer: no slave yet
// Tries synthetic_viewer: slave silent
// Tries synthetic_viewer: phantom silent; without a model
TEST(Banner, SaysWhatIsWorst) {
  constexpr core::Nanoseconds kNow_ns = 10 * core::kNsPerSecond;
  ViewerState state;
  EXPECT_NE(banner_text(state, {}, kNow_ns).find("NO SLAVE"), std::string::npos);
  state.arm.received_ns = kNow_ns - core::kNsPerSecond;
  EXPECT_NE(banner_text(state, {}, kNow_ns).find("LINK LOST: the arm's pose is 1.0 s old"),
            std::string::npos);
  state.arm.received_ns = kNow_ns;
  EXPECT_NE(banner_text(state, {}, kNow_ns).find("phantom is silent"), std::string::npos);
  state.percept.received_ns = kNow_ns;
  EXPECT_NE(banner_text(state, {}, kNow_ns).find("no valid model"), std::string::npos);
  state.percept.valid = true;
  EXPECT_EQ(banner_text(state, {}, kNow_ns), "");
  for (bool* permitted : {&state.arm.motion_permitted, &state.master.motion_permitted}) {
    state.master.received_ns = kNow_ns;
    *permitted = false;
    EXPECT_EQ(banner_text(state, {}, kNow_ns), "ENABLING SWITCH RELEASED: the arm holds");
    state.master.received_ns = kNow_ns - 10 * core::kNsPerSecond;  // a master that is gone says nothing
    EXPECT_EQ(banner_text(state, {}, kNow_ns).empty(), permitted == &state.master.motion_permitted);
    *permitted = true;
  }
  state.stops.in_force = true;
  state.stops.headline_words = {"stop_headline.stopped", {}};
  state.arm.received_ns = 0;
  EXPECT_EQ(banner_text(state, {}, kNow_ns).rfind("EMERGENCY STOP\n", 0), 0U) << "before all else";
}

TEST(Hud, IsWrittenInTheLanguageOfTheConfiguration) {
  const auto picture = [](Language language) {
    Image image(720, 1280, CV_8UC3, cv::Scalar::all(90));
    Hud hud;
    hud.language = language;
    hud.gauges = hud.closeness_known = true;
    hud.motion = MotionClass::kDangerous;
    draw_hud(image, hud);
    return image;
  };
  const Image german = picture(Language::kGerman);
  if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS"))
    std::ofstream(std::string(folder) + "/hud_de.png", std::ios::binary) << encode_png(german);
  EXPECT_GT(cv::norm(german, picture(Language::kEnglish), cv::NORM_L1), 0);
  // A letter that the font lacks is spelled.
  Image umlaut(100, 640, CV_8UC3, cv::Scalar::all(90)), spelled = umlaut.clone();
  draw_hud(umlaut, {.title = "Nähe – GEFÄHRLICH"});
  draw_hud(spelled, {.title = "Naehe - GEFAEHRLICH"});
  EXPECT_EQ(cv::norm(umlaut, spelled, cv::NORM_L1), 0);
}

// However long the words are: a side that has not confirmed must not be cut off.
TEST(Hud, ABannersWordsFitThePicture) {
  Image image(360, 640, CV_8UC3, cv::Scalar::all(0));
  Hud hud;
  hud.banner = "STOP NOT CONFIRMED\nmaster: " + std::string(60, 'M') + " | slave: " + std::string(60, 'W');
  draw_hud(image, hud);
  const auto white_in_column = [&](int x) {
    int count = 0;
    for (int y = 0; y < image.rows; ++y) {
      const std::size_t at = static_cast<std::size_t>(3 * (y * image.cols + x));
      count += image.data[at] > 200 && image.data[at + 1] > 200 ? 1 : 0;
    }
    return count;
  };
  int widest = 0;
  for (int x = 4; x < 636; ++x) widest += white_in_column(x) > 0 ? 1 : 0;
  EXPECT_GT(widest, 300);
  for (const int x : {0, 1, 2, 637, 638, 639}) EXPECT_EQ(white_in_column(x), 0) << x;
}

TEST(Hud, WritesOnThePictureAndEncodes) {
  Image image(360, 640, CV_8UC3, cv::Scalar::all(40));
  const Image before = image.clone();
  Hud hud;
  hud.title = "HIT ZONE";
  hud.banner = "LINK LOST";
  hud.gauges = true;
  hud.closeness_known = true;
  hud.closeness = 0.8;
  draw_hud(image, hud);
  EXPECT_NE(cv::norm(image, before), 0);
  EXPECT_EQ(encode_png(image).substr(1, 3), "PNG");
  EXPECT_EQ(encode_jpeg(image, 80).substr(0, 2), "\xFF\xD8");
}

// On a machine without a graphics card, and beside one that cannot be used, software draws.
TEST(GlContext, WithoutACardSoftwareRenders) {
  EXPECT_FALSE(GlContext(GraphicsPlatform::kAuto).description().empty());
}

TEST(GlContext, MissingGraphicsNameWhatWasTried) {
  // No machine has a display server for tests; a graphics card may be there.
  try {
    GlContext context(GraphicsPlatform::kDevice);
    EXPECT_FALSE(context.description().empty());
  } catch (const std::exception& problem) {
    EXPECT_NE(std::string(problem.what()).find("no OpenGL"), std::string::npos);
  }
}

}  // namespace
}  // namespace phantom::synthetic_viewer
