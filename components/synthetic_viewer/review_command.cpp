#include "components/synthetic_viewer/review_command.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <optional>

#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/process/line_writer.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr double kTurn_s = 0.1;

/// Warns if the recording was made with another cell file than the one that is used.
void compare_cells(const std::vector<recording::OpenedRecording>& recordings,
                   const std::filesystem::path& cell) {
  constexpr std::uint64_t kMax = 16U << 20;
  std::ifstream stream(cell, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(stream)), {});
  for (const recording::OpenedRecording& opened : recordings) {
    for (const auto& index : opened.reader.attachment_indexes()) {
      if (index.name != cell.filename().string() || index.data_size > kMax) continue;
      const auto recorded = opened.reader.read(index);
      if (recorded && !std::ranges::equal(text, recorded->data, {}, {},
                                          [](std::uint8_t byte) { return static_cast<char>(byte); }))
        spdlog::warn("{}: was made with another {} than {}; allowed: its own, by --cell",
                     opened.path.string(), index.name, cell.string());
    }
  }
}

/// Says now and then how far a long recording is read.
class ProgressLog {
 public:
  void at(double share) {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    if (now_ns - told_ns_ < kPeriod_ns) return;
    told_ns_ = now_ns;
    spdlog::info("{:.0f} % of the recording are read", 100 * share);
  }

 private:
  static constexpr core::Nanoseconds kPeriod_ns = 2 * core::kNsPerSecond;
  core::Nanoseconds told_ns_ = core::monotonic_ns();
};

}  // namespace

PageContent& ReviewedSession::wired(Review& review) {
  content_.review = &review;
  content_.wake = [this] { inbox_.wake(); };
  content_.stops = [&review] { return review.stops(); };
  return content_;
}

ReviewedSession::ReviewedSession(Review& review, const ViewerConfig& config, const runtime::CellConfig& cell,
                                 robot::SerialArm arm, std::vector<LinkMeshData> arm_meshes)
    : viewer_(config, cell, std::move(arm), std::move(arm_meshes), inbox_, wired(review), {}, &review),
      scene_(config, config.page.scene_Hz, cell.name, inbox_, content_),
      server_(
          config.page, content_,
          [this, &review](const Command& command) {
            review.choose(command);
            inbox_.wake();
            return CommandOutcome{CommandOutcome::Kind::kDone, "done"};
          },
          [this](const ViewRequest& request) {
            return inbox_.put(request)
                       ? core::Status::ok()
                       : core::Status(core::ErrorCode::kUnavailable, "the viewer is too busy to take this");
          },
          {}, &scene_) {
  scene_.start();
  viewer_.start();
}

runtime::Command add_review_command(runtime::Command app, ReviewArguments& arguments) {
  runtime::Command review = app.subcommand(
      "review", "show a recording of dds_recorder on the page, at any of its moments, without DDS");
  review.option("files", arguments.files, "MCAP files, or folders of them").required();
  review.option("--cell", arguments.cell,
                "cell file, as it was when the recording was made; default: the topology's");
  review.option("--port", arguments.port, "of the page; 0: any free one").between(0, 65535);
  return review;
}

int run_review(const ReviewArguments& arguments, ViewerConfig config,
               const runtime::ProcessOptions& options) {
  std::optional<runtime::EndsAtOnce> reading(std::in_place, runtime::kExitFailed);
  const std::filesystem::path cell_file =
      arguments.cell.empty() ? runtime::load_deployment(options).cell : arguments.cell;
  const runtime::CellConfig cell = runtime::load_checked_cell(cell_file);
  const runtime::ArmConfig& arm_config = cell.arm(config.arm);
  robot::SerialArm arm = runtime::load_arm(arm_config);
  std::vector<LinkMeshData> arm_meshes = load_arm_meshes(arm, runtime::load_skin(arm_config, arm));
  if (!arm_config.gripper_closed.empty())
    set_closing(runtime::load_arm_with_closed_gripper(arm_config), arm_meshes);
  if (arguments.port >= 0) config.page.port = arguments.port;
  const auto others = sources_of(load_other_arms(cell, config.arm, config.other_arms), config.other_arms);
  auto recordings = recording::open_recordings(recording::recordings_in(arguments.files), Review::kLimits);
  compare_cells(recordings, cell_file);
  ProgressLog progress;
  Review review(
      std::move(recordings), arm, [&progress](double share) { progress.at(share); }, others);
  for (const std::string& problem : review.problems()) spdlog::warn("{}", problem);
  reading.reset();
  ReviewedSession session(review, config, cell, std::move(arm), std::move(arm_meshes));
  runtime::LineWriter(STDOUT_FILENO)
      .put(fmt::format("review of {:.1f} s with {} alerts: {}\n", review.duration_s(), review.marks().size(),
                       session.url()));
  while (session.running() && runtime::sleep_unless_stopped(kTurn_s)) {
  }
  session.finish();
  return runtime::kExitDone;
}

}  // namespace phantom::synthetic_viewer
