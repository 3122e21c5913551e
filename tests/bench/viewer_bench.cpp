// Drawing the shipped cell, encoding and serving it, and how soon an alert has its picture.
#include <benchmark/benchmark.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <memory>
#include <thread>

#include "common/runtime/arm_model.hpp"
#include "components/synthetic_viewer/compositor.hpp"
#include "components/synthetic_viewer/still_scene.hpp"
#include "components/synthetic_viewer/view_painter.hpp"
#include "components/synthetic_viewer/viewer_loop.hpp"

// Last: it brings a macro (_res) that Eigen's names do not survive.
#include <httplib.h>

namespace {

using namespace phantom;
using namespace phantom::synthetic_viewer;

constexpr int kBrowsers = 6;
constexpr double kFrameRate_hz = 30.0;

runtime::CellConfig cell() {
  return runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml");
}
ViewerConfig config() {
  ViewerConfig shipped = load_config(PHANTOM_SOURCE_DIR "/components/synthetic_viewer/synthetic_viewer.yaml");
  shipped.graphics = GraphicsPlatform::kSurfaceless;
  return shipped;
}

/// The shipped cell with its arm reaching for the table, ready to be drawn.
struct Studio {
  ViewerConfig views = config();
  Renderer renderer{GraphicsPlatform::kSurfaceless};
  StillScene still;
  RayScene objects, bodies;
  Compositor compositor;
  Studio(const runtime::CellConfig& hot_cell, const std::vector<double>& position)
      : still(make_still_scene(hot_cell, {{}, position, {}}, renderer)),
        objects(still.scene.obstacles(still.state, false)),
        bodies(still.scene.obstacles(still.state, true)),
        compositor(views, hot_cell.name, still.scene) {}
  Compositor::Picture picture() const {
    return compositor.main_picture({still.state, objects, bodies, StillScene::kNow_ns}, {});
  }
};

Studio& studio() {
  static Studio the_one(cell(), {0.12, 0.6, 0.75, -1.35, 0.3, 0.55, 0.0});
  return the_one;
}

double cpu_s() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

void draw(benchmark::State& state, int width_px, int height_px, int samples) {
  Studio& here = studio();
  const Compositor::Picture picture = here.picture();
  const PictureFormat format{width_px, height_px, samples, true};
  here.renderer.render(picture.frame, format);  // buffers are made with the first one
  const double before_s = cpu_s();
  for (auto _ : state) benchmark::DoNotOptimize(here.renderer.render(picture.frame, format));
  state.counters["cores"] = benchmark::Counter(cpu_s() - before_s, benchmark::Counter::kAvgIterations);
  state.counters["triangles"] = static_cast<double>(here.still.triangles);
}
BENCHMARK_CAPTURE(draw, main_720p, 1280, 720, 1)->Name("draw/1280x720")->UseRealTime();
BENCHMARK_CAPTURE(draw, main_720p_4, 1280, 720, 4)->Name("draw/1280x720/samples:4")->UseRealTime();
BENCHMARK_CAPTURE(draw, hit, 640, 360, 1)->Name("draw/640x360")->UseRealTime();

/// Writing on the picture and encoding it, once for all who look.
void encode(benchmark::State& state) {
  Studio& here = studio();
  const Compositor::Picture picture = here.picture();
  const Image bare = here.renderer.render(picture.frame, here.views.main_view.format);
  for (auto _ : state) {
    Image image = bare;
    draw_hud(image, picture.hud);
    benchmark::DoNotOptimize(encode_jpeg(image, here.views.jpeg_quality));
  }
}
BENCHMARK(encode)->Name("encode/1280x720");

/// Browsers in a process of their own, so that what they cost is not counted. They read all that comes.
class Browsers {
 public:
  explicit Browsers(int port) : pid_(fork()) {
    if (pid_ != 0) return;
    std::vector<std::thread> readers;
    for (int i = 0; i < kBrowsers; ++i) {
      readers.emplace_back([port] {
        httplib::Client client("127.0.0.1", port);
        client.set_read_timeout(60);
        client.Get("/stream/main", [](const char*, std::size_t) { return true; });
      });
    }
    for (auto& reader : readers) reader.join();
    _exit(0);
  }
  ~Browsers() {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }

 private:
  pid_t pid_;
};

/// A second of pictures encoded and served to six: share of one core that it takes.
void serve(benchmark::State& state) {
  Studio& here = studio();
  const Compositor::Picture picture = here.picture();
  const Image bare = here.renderer.render(picture.frame, here.views.main_view.format);
  PageContent content;
  PageConfig page;
  page.port = 0;
  WebServer server(
      page, content, [](const Command&) { return core::Status::ok(); },
      [](const ViewRequest&) { return core::Status::ok(); });
  const Browsers browsers(server.port());
  auto& jpeg = content.view(View::kMain).jpeg;
  while (jpeg.followers < kBrowsers) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  double used_s = 0;
  int frames = 0;
  for (auto _ : state) {
    const double before_s = cpu_s();
    auto due = std::chrono::steady_clock::now();
    for (int frame = 0; frame < static_cast<int>(kFrameRate_hz); ++frame, ++frames) {
      due += std::chrono::nanoseconds(core::from_seconds(1 / kFrameRate_hz));
      Image image = bare;
      draw_hud(image, picture.hud);
      jpeg.publish(encode_jpeg(image, here.views.jpeg_quality));
      std::this_thread::sleep_until(due);
    }
    used_s += cpu_s() - before_s;
  }
  state.counters["core_share"] = used_s / frames * kFrameRate_hz;
}
BENCHMARK(serve)->Name("serve/6_browsers")->Iterations(1)->Repetitions(4)->UseRealTime();

/// The drawing thread as it runs, every view followed, and alerts that come at any moment: the greatest time
/// from the alert's arrival to its picture.
void alert(benchmark::State& state) {
  const runtime::CellConfig hot_cell = cell();
  ViewerConfig views = config();
  Inbox inbox;
  PageContent content;
  for (const View view : kViews) content.view(view).jpeg.followers = 1;
  robot::SerialArm arm = runtime::load_arm(hot_cell.arm());
  auto meshes = load_arm_meshes(arm, runtime::load_skin(hot_cell.arm(), arm));
  const Studio& here = studio();
  ViewerLoop loop(views, hot_cell, std::move(arm), std::move(meshes), inbox, content, Report({}, 0));
  loop.start();
  std::uint32_t number = 0;
  const auto figure = [&loop](const std::string& name) {
    for (const core::HealthFigure& each : loop.health().figures) {
      if (each.name == name) return each.value;
    }
    return 0.0;
  };
  for (auto _ : state) {
    for (int k = 0; k < 12; ++k) {
      ArmSample pose = here.still.state.arm;
      pose.received_ns = core::monotonic_ns();
      pose.position[0] += 0.01 * k;
      inbox.arm.write(pose);
      std::this_thread::sleep_for(std::chrono::milliseconds(61 + 13 * k));
      HitSample hit = here.still.hit();
      hit.alert = ++number;
      hit.received_ns = core::monotonic_ns();
      inbox.put(hit);
      while (content.hit_picture(number).empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  state.counters["max_ms"] = figure("alert_to_picture_max");
  state.counters["p50_ms"] = figure("alert_to_picture_p50");
}
BENCHMARK(alert)->Name("alert/first_picture")->Iterations(1)->Repetitions(4)->UseRealTime();

}  // namespace
