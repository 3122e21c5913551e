#include "components/synthetic_viewer/sheet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <fstream>

#include "common/core/errors.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "common/runtime/process/process.hpp"
#include "components/synthetic_viewer/scene/compositor.hpp"
#include "components/synthetic_viewer/scene/hud.hpp"
#include "components/synthetic_viewer/state/synthetic_viewer.hpp"
#include "components/synthetic_viewer/state/view_direction.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr int kColumns = 4, kRows = 4, kGap_px = 4;

}  // namespace

runtime::Command add_sheet_command(runtime::Command app, SheetRequest& request) {
  runtime::Command sheet =
      app.subcommand("sheet", "draw a hit zone from all fourteen nodes on one sheet, without DDS");
  sheet.option("--cell", request.cell, "cell file").required();
  sheet.option("--arm", request.pose.arm, "arm of the cell, if it has several");
  sheet.option("--joints", request.pose.position,
               "joint positions in rad or m, e.g. 0 0.6 -1.2 0 0.6 0; default: home");
  sheet.option("--velocity", request.pose.velocity, "joint velocities in rad/s or m/s; default: at rest");
  sheet.option("--tile-width", request.tile_width_px, "pixels").between(160, 1920);
  sheet.option("--out", request.out, "PNG to write").required();
  return sheet;
}

int run_sheet(const SheetRequest& request, const ViewerConfig& config) {
  const runtime::CellConfig cell = runtime::load_checked_cell(request.cell);
  Renderer renderer(config.graphics, scene_scale(cell.min_m, cell.max_m));
  const StillScene still = make_still_scene(cell, request.pose, renderer);
  const HitSample hit = still.hit();
  if (hit.object == 0)
    throw core::ConfigError(
        request.pose.position.empty()
            ? "no object is near the arm's skin in its home pose, so nothing is shown; --joints gives another"
            : "--joints: no object is near the arm's skin in this pose; nothing to show");
  ViewerConfig views = config;
  views.main_view.format.width_px = views.hit_view.format.width_px = request.tile_width_px;
  views.main_view.format.height_px = views.hit_view.format.height_px = request.tile_width_px * 9 / 16;
  PictureFormat format = views.hit_view.format;
  format.samples = config.report_samples;
  const Compositor compositor(views, cell.name, still.scene);
  const RayScene objects = still.scene.obstacles(still.state, false),
                 bodies = still.scene.obstacles(still.state, true);
  const Compositor::Moment moment{still.state, objects, bodies, StillScene::kNow_ns};
  const VisibleShare seen_from = visible_among(bodies, still.scene.scale());
  const Eigen::Vector3d look_at_m = eigen(hit.look_at_m), pgv = eigen(hit.pgv), towards = pgv.normalized();
  std::printf("%s near %s at %.3f %.3f %.3f m, object towards %.2f %.2f %.2f, closeness %.2f\n",
              hit.link_name.c_str(), object_name(still.state, hit.object).c_str(), look_at_m.x(),
              look_at_m.y(), look_at_m.z(), towards.x(), towards.y(), towards.z(),
              still.state.percept.closeness);
  const int step_x = format.width_px + kGap_px, step_y = format.height_px + kGap_px;
  Image sheet(kRows * step_y - kGap_px, kColumns * step_x - kGap_px, CV_8UC3, cv::Scalar::all(16));
  int tiles = 0;
  const auto add = [&](const Compositor::Picture& picture) {
    Image image = renderer.render(picture.frame, format);
    draw_hud(image, picture.hud);
    image.copyTo(sheet({tiles % kColumns * step_x, tiles / kColumns * step_y, image.cols, image.rows}));
    ++tiles;
  };
  Compositor::Picture whole = compositor.main_picture(moment, {});
  whole.hud.gauges = false;
  add(whole);
  for (int number = 0; number <= percept::kNodeCount; ++number) {
    SyntheticViewer viewer(at_scale(config.hit_view.rule, still.scene.scale()));
    viewer.take({hit.alert, false, look_at_m, pgv});
    const auto chosen = static_cast<ViewNode>(number);
    const HitView view = viewer.step(false, chosen, seen_from, 0.0);
    Compositor::Picture picture = compositor.hit_picture(moment, view);
    const LocalizedText from{number == 0 ? "hud.automatic" : "hud.from",
                             {{"direction", direction_words(view.node, config.main_view.azimuth_rad)}}},
        seen{"hud.sees", {{"percent", 100 * seen_from(view.situation, view.eye_m)}}};
    picture.hud.title = in(config.language, from);
    picture.hud.subtitle = in(config.language, seen);
    picture.hud.alarm = number == 0;
    std::printf("%-4s %s %s\n", number == 0 ? "auto" : percept::node_name(chosen),
                number == 0 ? percept::node_name(view.node) : "", english_text(seen).c_str());
    add(picture);
  }
  std::ofstream file(request.out, std::ios::binary);
  file << encode_png(sheet);
  if (!file.flush()) throw core::MissingError(request.out.string() + ": cannot be written");
  return runtime::kExitDone;
}

}  // namespace phantom::synthetic_viewer
