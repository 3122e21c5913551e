// Drawing the shipped cell, encoding and serving it, and how soon an alert has its picture.
#include <benchmark/benchmark.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <thread>
#include <vector>

#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "components/synthetic_viewer/output/publisher.hpp"
#include "components/synthetic_viewer/page/web_server.hpp"
#include "components/synthetic_viewer/samples/tests/mesh_chunks.hpp"
#include "components/synthetic_viewer/scene/compositor.hpp"
#include "components/synthetic_viewer/scene/still_scene.hpp"
#include "components/synthetic_viewer/viewer_loop.hpp"
#include "tests/bench/repetitions.hpp"

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
    Image image = bare.clone();
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
      page, content, [](const Command&) { return CommandOutcome(); },
      [](const ViewRequest&) { return core::Status::ok(); });
  const Browsers browsers(server.stream_port());
  auto& jpeg = content.view(View::kMain).jpeg;
  while (jpeg.followers < kBrowsers) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  double used_s = 0;
  int frames = 0;
  for (auto _ : state) {
    const double before_s = cpu_s();
    auto due = std::chrono::steady_clock::now();
    for (int frame = 0; frame < static_cast<int>(kFrameRate_hz); ++frame, ++frames) {
      due += std::chrono::nanoseconds(core::from_seconds(1 / kFrameRate_hz));
      Image image = bare.clone();
      draw_hud(image, picture.hud);
      jpeg.publish(encode_jpeg(image, here.views.jpeg_quality));
      std::this_thread::sleep_until(due);
    }
    used_s += cpu_s() - before_s;
  }
  state.counters["core_share"] = used_s / frames * kFrameRate_hz;
}
BENCHMARK(serve)->Name("serve/6_browsers")->Iterations(1)->Repetitions(bench::repetitions(4))->UseRealTime();

/// A viewer's drawing thread as it runs in a session: the shipped cell by its topics' samples, an arm that
/// moves all the time, 30 pictures a second, every view followed, a report.
class RunningViewer {
 public:
  RunningViewer() {
    config_.frame_rate_hz = kFrameRate_hz;
    for (const View view : kViews) content_.view(view).jpeg.followers = 1;
    robot::SerialArm arm = runtime::load_arm(cell_.arm());
    auto meshes = load_arm_meshes(arm, runtime::load_skin(cell_.arm(), arm));
    loop_ = std::make_unique<ViewerLoop>(config_, cell_, std::move(arm), std::move(meshes), inbox_, content_,
                                         folder_);
    loop_->start();
    for (const runtime::CellBody& body : runtime::load_bodies(cell_)) {
      ObjectSample object = still_.state.objects.at(body.body.id);
      object.mesh_hash = body.mesh_O.content_hash();
      inbox_.put(object);
      for (MeshChunkSample& chunk : synthetic_viewer::test::chunks_of(body.mesh_O, 64 * 1024))
        inbox_.put(std::move(chunk));
    }
    while (figure("objects") < 1 || figure("meshes") < figure("objects")) rest_ms(5);
    mover_ = std::thread([this] {
      while (!stop_) {
        inbox_.arm.write(pose());
        rest_ms(10);
      }
    });
  }
  ~RunningViewer() {
    stop_ = true;
    mover_.join();
    loop_.reset();
    std::filesystem::remove_all(folder_);
  }
  static void rest_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }
  double figure(const std::string& name) {
    for (const core::HealthFigure& each : loop_->health().figures) {
      if (each.name == name) return each.value;
    }
    return 0.0;
  }
  /// Raises an alert and waits for its picture.
  void alert() {
    HitSample hit = still_.hit();
    hit.alert = ++alerts_;
    hit.received_ns = core::monotonic_ns();
    hit.arm = pose();
    inbox_.put(hit);
    while (content_.hit_picture(alerts_).empty()) rest_ms(1);
  }
  double last_alert_ms() {
    while (figure("alerts_pictured") < alerts_) rest_ms(1);
    return figure("alert_to_picture_last");
  }

 private:
  ArmSample pose() const {
    ArmSample arm = still_.state.arm;
    arm.received_ns = core::monotonic_ns();
    arm.position[0] += 0.1 * std::sin(core::seconds(arm.received_ns));
    return arm;
  }

  const StillScene& still_ = studio().still;
  runtime::CellConfig cell_ = cell();
  ViewerConfig config_ = config();
  Inbox inbox_;
  PageContent content_;
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("viewer_bench_" + std::to_string(getpid()));
  std::unique_ptr<ViewerLoop> loop_;
  std::atomic<bool> stop_{false};
  std::thread mover_;
  std::uint32_t alerts_ = 0;
};

/// Alerts that come at any moment: time from an alert's arrival to its picture, and the processor time of all
/// threads that went by (which holds on a busy machine, too).
void alert(benchmark::State& state) {
  constexpr int kAlerts = 24;
  RunningViewer viewer;
  std::vector<double> ms, work_ms;
  for (auto _ : state) {
    for (int k = 0; k < kAlerts; ++k) {
      RunningViewer::rest_ms(61 + 37 * (k % 7));
      const double before_s = cpu_s();
      viewer.alert();
      work_ms.push_back(1e3 * (cpu_s() - before_s));
      ms.push_back(viewer.last_alert_ms());
    }
  }
  for (auto* times : {&ms, &work_ms}) std::sort(times->begin(), times->end());
  state.counters["max_ms"] = ms.back();
  state.counters["p50_ms"] = ms[ms.size() / 2];
  state.counters["work_max_ms"] = work_ms.back();
  state.counters["work_p50_ms"] = work_ms[work_ms.size() / 2];
  double load = 0;  // how many others wanted the processors
  if (getloadavg(&load, 1) == 1) state.counters["load"] = load;
}
BENCHMARK(alert)
    ->Name("alert/first_picture")
    ->Iterations(1)
    ->Repetitions(bench::repetitions(4))
    ->UseRealTime();

}  // namespace
