// Renders the shipped cell without any topic: frame times for the bench, pictures to look at.
//   synthetic_viewer_pictures OUT_FOLDER [frames]

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <vector>

#include "common/geometry/mesh_io.hpp"
#include "common/runtime/arm_model.hpp"
#include "common/runtime/cell.hpp"
#include "components/synthetic_viewer/arm_meshes.hpp"
#include "components/synthetic_viewer/compositor.hpp"

namespace {

using namespace phantom;
using namespace phantom::synthetic_viewer;

double cpu_ms() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto ms = [](const timeval& t) {
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_usec);
  };
  return ms(used.ru_utime) + ms(used.ru_stime);
}

/// Median time of a frame, and processor time per frame over all threads: the latter does not depend on who
/// else runs.
void measure(const char* what, Renderer& renderer, const Frame& frame, const PictureFormat& format,
             int frames) {
  renderer.render(frame, format);  // buffers are made with the first one
  std::vector<double> times;
  const double cpu_before_ms = cpu_ms();
  for (int i = 0; i < frames; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    renderer.render(frame, format);
    times.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  }
  const double cpu_per_frame_ms = (cpu_ms() - cpu_before_ms) / frames;
  std::sort(times.begin(), times.end());
  std::printf("%-28s best %6.1f ms, median %6.1f ms, processor %6.1f ms\n", what, times.front(),
              times[times.size() / 2], cpu_per_frame_ms);
}

void save(const std::string& path, const Image& image) {
  std::ofstream(path, std::ios::binary) << encode_png(image);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const std::string out = argv[1];
  const int frames = argc > 2 ? std::atoi(argv[2]) : 20;
  const std::string source = PHANTOM_SOURCE_DIR;
  const ViewerConfig config = load_config(source + "/components/synthetic_viewer/synthetic_viewer.yaml");
  const runtime::CellConfig cell = runtime::load_cell(source + "/deploy/cells/hot_cell/cell.yaml");
  robot::SerialArm arm = runtime::load_arm(cell.arm());
  auto arm_meshes = load_arm_meshes(arm);
  Renderer renderer;
  CellScene scene(std::move(arm), cell.min_m, cell.max_m);
  std::size_t triangles = 0;
  for (const LinkMeshData& part : arm_meshes) {
    triangles += part.mesh.triangles.size();
    scene.links.push_back({part.link,
                           part.X_link_mesh,
                           part.colour,
                           {renderer.upload(part.mesh), std::make_shared<RayMesh>(part.mesh)}});
  }
  ViewerState state;
  for (std::size_t i = 0; i < cell.objects.size(); ++i) {
    const runtime::ObjectConfig& object = cell.objects[i];
    geometry::MeshImportOptions options;
    options.scale = object.mesh_scale;
    options.y_up = object.y_up;
    const auto mesh = geometry::load_mesh(object.mesh, options);
    if (!mesh) {
      std::fprintf(stderr, "%s\n", mesh.status().message().c_str());
      return 3;
    }
    triangles += mesh->triangles.size();
    scene.meshes[i + 1] = {renderer.upload(*mesh), std::make_shared<RayMesh>(*mesh)};
    const auto id = static_cast<std::uint16_t>(i + 1);
    state.objects[id] = {id, object.name, i + 1, object.X_WO, object.colour};
  }
  const core::Nanoseconds now_ns = 1'000'000'000;
  state.arm.received_ns = state.percept.received_ns = now_ns - 12'000'000;
  state.arm.state = LinkState::kCoupled;
  const core::JointArray reach{0.12, 0.6, 0.75, -1.35, 0.3, 0.55, 0.0};
  for (std::size_t i = 0; i < scene.arm().joint_count(); ++i) state.arm.position[i] = reach[i];
  robot::LinkPoses X_WL;
  scene.arm().link_poses(state.arm.position, X_WL);
  const std::size_t tip = scene.arm().joint_count();
  const Eigen::Vector3d tool = X_WL[tip] * Eigen::Vector3d(0, 0, -0.16);
  std::printf("tip at %.3f %.3f %.3f\n", tool.x(), tool.y(), tool.z());
  state.percept.valid = true;
  state.percept.closeness = 0.62;
  state.percept.speed_m_s = 0.18;
  state.percept.position_m = {tool.x(), tool.y(), tool.z()};
  state.percept.velocity_m_s = {0.05, 0.02, -0.15};
  state.percept.pgv = {0.0, 0.0, -0.02};
  state.percept.motion = MotionClass::kDangerous;
  state.percept.link = static_cast<std::uint32_t>(tip);
  state.percept.object = 1;
  state.hits.push_back({{now_ns, 0, 1, HitRule::kVeryClose, static_cast<std::uint32_t>(tip), "gripper", 1,
                         state.percept.position_m, state.percept.pgv, 0.18, 20, false}});
  const Compositor compositor(config, cell.name, scene);
  const RayScene objects = scene.obstacles(state, false), obstacles = scene.obstacles(state, true);
  SyntheticViewer viewer(config.hit_view.rule);
  viewer.take({1, false, tool, {0, 0, -0.02}});
  const VisibleShare visible = [&](const ViewSituation& s, const Eigen::Vector3d& eye_m) {
    return obstacles.visible_share(s.look_at_m, s.pgv, 0.02, eye_m);
  };
  const auto begin = std::chrono::steady_clock::now();
  const HitView hit = viewer.step(false, ViewNode::kAutomatic, visible, 0.0);
  const double choice_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  const Compositor::Moment moment{state, objects, now_ns};
  const Frame main_frame = compositor.main_frame(moment, hit), hit_frame = compositor.hit_frame(moment, hit);

  PictureFormat format{1280, 720, 1, true}, plain = format, fine = format;
  plain.shadows = false;
  fine.samples = 4;
  std::printf("%s\n%zu triangles; node %s chosen in %.2f ms\n", renderer.description().c_str(), triangles,
              node_name(hit.node), choice_ms);
  measure("main 1280x720", renderer, main_frame, format, frames);
  measure("main 1280x720, no shadows", renderer, main_frame, plain, frames);
  measure("main 1280x720, 4 samples", renderer, main_frame, fine, frames);
  measure("hit 640x360", renderer, hit_frame, config.hit_view.format, frames);
  measure("hit 1280x720", renderer, hit_frame, format, frames);
  const auto hud_begin = std::chrono::steady_clock::now();
  Image image = renderer.render(main_frame, format);
  const auto drawn = std::chrono::steady_clock::now();
  draw_hud(image, compositor.main_hud(moment));
  const std::string jpeg = encode_jpeg(image, config.jpeg_quality);
  std::printf("hud and jpeg: %.1f ms, %zu bytes (render %.1f ms)\n",
              std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - drawn).count(),
              jpeg.size(), std::chrono::duration<double, std::milli>(drawn - hud_begin).count());
  save(out + "/main.png", image);
  image = renderer.render(main_frame, fine);
  draw_hud(image, compositor.main_hud(moment));
  save(out + "/main_fine.png", image);
  image = renderer.render(hit_frame, fine);
  draw_hud(image, compositor.hit_hud(moment, hit));
  save(out + "/hit.png", image);
  image = renderer.render(hit_frame, config.hit_view.format);
  draw_hud(image, compositor.hit_hud(moment, hit));
  save(out + "/hit_small.png", image);
  image = renderer.render(compositor.tool_frame(moment), config.tool_view.format);
  draw_hud(image, compositor.tool_hud(moment));
  save(out + "/tool.png", image);
  return 0;
}
