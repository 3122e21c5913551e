// A cell and its arm at a tenth of the size, in voxels of a tenth, look as they do at full size: the same
// views, aids, paint, shadows and floor.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "common/runtime/cell/cell.hpp"
#include "components/synthetic_viewer/scene/compositor.hpp"
#include "components/synthetic_viewer/scene/still_scene.hpp"
#include "tests/support/files.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr PictureFormat kSmallCellFormat{640, 360, 1, true};

/// The cell file of an arm between a post, a ball and a protected zone; all lengths are `size` times those of
/// a cell with a diagonal of 1.5 m.
std::string cell_text(double size) {
  const auto m = [size](double length_m) { return fmt::format("{:.9g}", size * length_m); };
  const auto at = [&m](double x, double y, double z) {
    return fmt::format("[{}, {}, {}]", m(x), m(y), m(z));
  };
  return "name: scaled\nworkspace: {min_m: " + at(-0.5, -0.5, 0.0) + ", max_m: " + at(0.5, 0.5, 0.5) +
         ", voxel_size_m: " + m(0.005) +
         "}\nprofile: {set: nonlinear_short, layer_vox: 4}\n"
         "objects:\n"
         "  - {name: post, primitive: {cylinder: {radius_m: " +
         m(0.0312) + ", height_m: " + m(0.41) + "}}, pose: {xyz_m: " + at(0.2513, 0.1217, 0.2061) +
         "}, colour: [0.6, 0.2, 0.2]}\n"
         "  - {name: ball, primitive: {sphere: {radius_m: " +
         m(0.083) + "}}, pose: {xyz_m: " + at(-0.2117, 0.2239, 0.0973) +
         "}}\n"
         "  - {name: keep_out, kind: protected_zone, primitive: {box: {size_m: " +
         at(0.151, 0.152, 0.203) + "}}, pose: {xyz_m: " + at(0.1113, -0.3017, 0.1031) +
         "}, colour: [0.9, 0.5, 0.1]}\n"
         "arms:\n"
         "  - name: arm\n"
         "    dh:\n"
         "      convention: classic\n"
         "      rows:\n"
         "        - {link: column, joint: turn, d_m: " +
         m(0.3037) +
         ", alpha_deg: 90, range_deg: [-180, 180], max_speed_deg_s: 60, max_torque_Nm: 100}\n"
         "        - {link: forearm, joint: lift, a_m: " +
         m(0.2519) +
         ", range_deg: [-90, 90], max_speed_deg_s: 60, max_torque_Nm: 100}\n"
         "    home: [0.03, -0.1]\n"
         "    skin:\n"
         "      - link: forearm\n"
         "        segments: [{from_m: " +
         at(-0.2419, 0, 0) + ", to_m: [0, 0, 0], from_radius_m: " + m(0.0213) + "}]\n";
}

struct Pictures {
  Image main, hit;
  ViewNode node = ViewNode::kAutomatic;
  double scale = 0.0;
  std::size_t aids = 0;  // items beside the bodies
};

Pictures drawn(double size) {
  const runtime::CellConfig cell = runtime::load_cell(phantom::test::new_file(cell_text(size)));
  SceneConfig config;
  Renderer renderer(GraphicsPlatform::kSurfaceless, scene_scale(cell.min_m, cell.max_m));
  const StillScene still = make_still_scene(cell, {"", {}, {0.6, 0.2}}, renderer);
  const Compositor compositor(config, cell.name, still.scene);
  const RayScene objects = still.scene.obstacles(still.state, false),
                 bodies = still.scene.obstacles(still.state, true);
  const Compositor::Moment moment{still.state, objects, bodies, StillScene::kNow_ns};
  const HitSample hit = still.hit();
  SyntheticViewer viewer(at_scale(config.hit_view.rule, still.scene.scale()));
  viewer.take({hit.alert, false, eigen(hit.look_at_m), eigen(hit.pgv), hit.link, hit.object});
  const HitView view =
      viewer.step(false, ViewNode::kAutomatic, visible_among(bodies, still.scene.scale()), 0.0);
  const auto main = compositor.main_picture(moment, view), zone = compositor.hit_picture(moment, view);
  Pictures pictures{renderer.render(main.frame, kSmallCellFormat),
                    renderer.render(zone.frame, kSmallCellFormat), view.node, still.scene.scale(),
                    zone.frame.items.size() - still.scene.items(still.state, {}, StillScene::kNow_ns).size()};
  if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS")) {
    const std::string name = fmt::format("{}/small_cell_{:g}", folder, size);
    cv::imwrite(name + "_main.png", pictures.main);
    cv::imwrite(name + "_hit.png", pictures.hit);
  }
  return pictures;
}

struct Difference {
  double mean = 0.0;   // of a channel, of 255
  double share = 0.0;  // of the pixels of which a channel differs by more than kSeen
};

Difference difference(const Image& a, const Image& b) {
  constexpr int kSeen = 24;
  Difference found;
  for (int y = 0; y < a.rows; ++y) {
    for (int x = 0; x < a.cols; ++x) {
      int most = 0;
      for (int channel = 0; channel < 3; ++channel) {
        const int off = std::abs(a.at<cv::Vec3b>(y, x)[channel] - b.at<cv::Vec3b>(y, x)[channel]);
        found.mean += off;
        most = std::max(most, off);
      }
      found.share += most > kSeen ? 1.0 : 0.0;
    }
  }
  const double pixels = static_cast<double>(a.rows) * a.cols;
  return {found.mean / (3.0 * pixels), found.share / pixels};
}

TEST(SmallCell, LooksAsTheSameCellAtTenTimesTheSize) {
  const Pictures large = drawn(1.0), small = drawn(0.1);
  EXPECT_DOUBLE_EQ(large.scale, 1.0);
  EXPECT_NEAR(small.scale, 0.1, 1e-12);
  EXPECT_EQ(small.node, large.node) << "the automatic choice is the same";
  EXPECT_GE(large.aids, 8U) << "two arrows, cone, plane and mark";
  EXPECT_EQ(small.aids, large.aids);
  const Difference main = difference(large.main, small.main), hit = difference(large.hit, small.hit);
  EXPECT_LT(main.mean, 0.3);
  EXPECT_LT(main.share, 0.003);
  EXPECT_LT(hit.mean, 0.3);
  EXPECT_LT(hit.share, 0.003);
  EXPECT_GT(difference(large.main, large.hit).share, 0.2) << "what differs is seen to";
}

}  // namespace
}  // namespace phantom::synthetic_viewer
