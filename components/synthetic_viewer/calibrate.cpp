#include "components/synthetic_viewer/calibrate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/camera/board.hpp"
#include "common/camera/pose_fit.hpp"
#include "common/core/errors.hpp"
#include "common/core/units.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "common/runtime/process/process.hpp"
#include "components/synthetic_viewer/scene/hud.hpp"
#include "components/synthetic_viewer/scene/picks.hpp"
#include "components/synthetic_viewer/scene/simulated_camera.hpp"

namespace phantom::synthetic_viewer {
namespace {

using core::ConfigError;

constexpr core::Nanoseconds kPatience_ns = 10 * core::kNsPerSecond;
constexpr core::Nanoseconds kBetweenBoards_ns = core::kNsPerSecond;

template <class T>
T found_or_throw(core::Expected<T> expected, const std::string& place) {
  if (!expected) throw ConfigError(place + expected.status().message());
  return std::move(expected).value();
}

camera::Board board_of(const CalibrateRequest& request) {
  camera::Board board;
  char end = 0;
  if (std::sscanf(request.board.c_str(), "%dx%d%c", &board.columns, &board.rows, &end) != 2 ||
      board.columns < 3 || board.rows < 3 || board.columns > 60 || board.rows > 60)
    throw ConfigError("--board " + request.board +
                      ": allowed: COLUMNSxROWS of inner corners, each 3 to 60, such as 9x6");
  board.square_m = request.square_mm * 1e-3;
  return board;
}

std::optional<std::vector<Eigen::Vector2d>> corners_in(const Image& picture, const camera::Board& board) {
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  return camera::find_corners({grey.cols, grey.rows, grey.data}, board);
}

/// A camera's source for this command; that of a simulated one sees the cell with its arm at home.
class Live {
 public:
  Live(const CalibrateRequest& request, const VideoCamera& camera, const ViewerConfig& config)
      : camera_(camera) {
    if (!camera.calibration.lens)
      throw ConfigError(
          "--camera: has no lens, whose size_px says which pictures to ask for; give a rough one");
    if (camera.kind == VideoKind::kTopic)
      throw ConfigError(
          "--camera: its pictures come over a topic, which this command does not hear; allowed: --pictures, or "
          "the pose by picks on the page of a viewer that shows it");
    const camera::Lens& lens = *camera.calibration.lens;
    if (camera.kind != VideoKind::kSimulated) {
      source_ = open_video(camera, lens.width_px, lens.height_px);
      return;
    }
    if (request.cell.empty()) throw ConfigError("--camera: a simulated one needs --cell");
    const runtime::CellConfig cell = runtime::load_checked_cell(request.cell);
    const runtime::ArmConfig& arm_config = cell.arm(config.arm);
    robot::SerialArm arm = runtime::load_arm(arm_config);
    std::vector<LinkMeshData> meshes = load_arm_meshes(arm, runtime::load_skin(arm_config, arm));
    home_.state = LinkState::kCoupled;
    std::ranges::copy(arm_config.home, home_.position.begin());
    world_ = std::make_unique<SimulatedWorld>(SimulatedWorld{cell, std::move(arm), std::move(meshes)});
    keep_home();
    source_ = open_simulated_camera(camera, config.graphics, *world_, past_);
  }
  /// Waits for the next picture. Throws core::MissingError if none comes.
  Image next() {
    std::string why = "no picture came within 10 s";
    for (const core::Nanoseconds begin_ns = core::monotonic_ns();
         core::monotonic_ns() - begin_ns < kPatience_ns;) {
      keep_home();
      auto picture = source_->next();
      if (picture && picture->has_value()) return (*picture)->image;
      if (!picture) why = picture.status().message();
    }
    throw core::MissingError("camera " + camera_.name + ": " + why);
  }

 private:
  void keep_home() {
    home_.received_ns = core::monotonic_ns() - core::kNsPerSecond / 10;
    past_.arms.take(home_);
    home_.received_ns += core::kNsPerSecond / 5;
    past_.arms.take(home_);
  }
  const VideoCamera& camera_;
  ArmSample home_;
  RecentSamples past_;
  std::unique_ptr<SimulatedWorld> world_;
  std::unique_ptr<VideoSource> source_;
};

struct BoardPictures {
  int width_px = 0, height_px = 0;
  std::vector<std::vector<Eigen::Vector2d>> corners;

  /// Takes a picture; returns whether the board is in it.
  bool take(const Image& picture, const camera::Board& board, const std::string& place) {
    if (width_px == 0) width_px = picture.cols, height_px = picture.rows;
    if (const std::string refusal = size_refusal(picture.cols, picture.rows, width_px, height_px);
        !refusal.empty())
      throw ConfigError(place + ": " + refusal);
    if (auto found = corners_in(picture, board))
      corners.push_back(std::move(*found));
    else
      return false;
    return true;
  }
};

BoardPictures board_pictures(const CalibrateRequest& request, const camera::Board& board, Live* live) {
  BoardPictures pictures;
  for (const std::filesystem::path& path : request.pictures) {
    const Image picture = cv::imread(path.string(), cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
    if (picture.empty()) throw core::MissingError(path.string() + ": is no picture that can be read");
    const bool found = pictures.take(picture, board, path.string());
    std::printf("%s: %s\n", path.filename().c_str(),
                found ? "board found" : "no board of that size seen as a whole");
  }
  for (core::Nanoseconds last_ns = 0;
       live != nullptr && static_cast<int>(pictures.corners.size()) < request.take;) {
    const Image picture = live->next();
    if (core::monotonic_ns() - last_ns < kBetweenBoards_ns || !pictures.take(picture, board, "--camera"))
      continue;
    last_ns = core::monotonic_ns();
    std::printf("picture %zu of %d: board found; show it in another way\n", pictures.corners.size(),
                request.take);
    std::fflush(stdout);
  }
  return pictures;
}

void find_lens(const BoardPictures& pictures, const camera::Board& board, Calibration& result) {
  const camera::LensFit fit =
      found_or_throw(camera::fit_lens(pictures.width_px, pictures.height_px, board, pictures.corners), "");
  result.lens = fit.lens;
  result.lens_residual_px = fit.rms_px;
  std::printf(
      "lens: focal length %.1f x %.1f px (to %.1f px), middle %.1f, %.1f px (to %.1f px), residual %.2f px\n",
      fit.lens.fx_px, fit.lens.fy_px, fit.focal_sigma_px, fit.lens.cx_px, fit.lens.cy_px, fit.centre_sigma_px,
      fit.rms_px);
  if (fit.reach < 0.85)
    std::printf(
        "note: no corner was seen in the outer %.0f %% of the picture; there the lens is extrapolated\n",
        100 * (1 - fit.reach));
}

void find_pose(const std::vector<camera::SeenPoint>& points, const camera::PoseFitOptions& options,
               Calibration& result) {
  const camera::PoseFit fit =
      found_or_throw(camera::fit_pose(camera::LensModel(*result.lens), points, options), "pose: ");
  result.X_WC = fit.X_WC;
  result.pose_residual_px = fit.rms_px;
  result.pose_residual_mm = fit.rms_mm;
  result.pose_sigma_mm = 1e3 * fit.position_sigma_m();
  result.pose_sigma_deg = fit.orientation_sigma_rad() / core::kRadPerDegree;
  const Eigen::Vector3d& at = fit.X_WC.translation_m;
  std::printf("pose: at %.4f, %.4f, %.4f m; known to %.1f mm and %.2f degrees (standard deviation)\n", at.x(),
              at.y(), at.z(), result.pose_sigma_mm, result.pose_sigma_deg);
  std::printf(
      "residual: %.2f px, worst point %.2f px: what is drawn lies about %.1f mm beside the thing at %.2f m\n",
      fit.rms_px, *std::ranges::max_element(fit.residual_px), fit.rms_mm, fit.distance_m);
}

/// Returns the points by which the pose is to be found; empty: it is not.
std::vector<camera::SeenPoint> pose_points(const CalibrateRequest& request, const BoardPictures& pictures) {
  std::vector<camera::SeenPoint> points;
  if (!request.board_pose.empty()) {
    const camera::Board board = board_of(request);
    if (request.board_pose.size() != 6)
      throw ConfigError("--board-pose: allowed: six numbers, x y z in m and roll pitch yaw in degrees");
    if (!board.has_first_corner())
      throw ConfigError(
          "--board-pose: the board looks the same after half a turn; allowed: one with an odd and an even number of inner corners");
    if (pictures.corners.empty()) throw ConfigError("--board-pose: the board is in none of the pictures");
    const auto& p = request.board_pose;
    const geometry::Pose X_WB{
        geometry::rotation_from_rpy(p[3] * core::kRadPerDegree, p[4] * core::kRadPerDegree,
                                    p[5] * core::kRadPerDegree),
        {p[0], p[1], p[2]}};
    for (int i = 0; i < board.corners(); ++i)
      points.push_back({X_WB * board.corner_B_m(i), pictures.corners.front()[static_cast<std::size_t>(i)]});
    return points;
  }
  std::optional<runtime::CellConfig> cell;
  if (!request.cell.empty()) cell = runtime::load_checked_cell(request.cell, runtime::CellArms::kOptional);
  for (const std::string& pick : request.picks)
    points.push_back(found_or_throw(parse_pick(pick, cell ? &*cell : nullptr), ""));
  return points;
}

}  // namespace

runtime::Command add_calibrate_command(runtime::Command app, CalibrateRequest& request) {
  runtime::Command calibrate =
      app.subcommand("calibrate", "find a camera's lens and where it stands, and write them to a file");
  calibrate.option("--camera", request.camera,
                   "its file: the source for --take and --snapshot; its lens and pose are where to begin");
  calibrate.option("--pictures", request.pictures, "pictures of a checkerboard, PNG or JPEG");
  calibrate.option("--take", request.take, "take so many pictures of the board from the camera, one a second")
      .between(1, 200);
  calibrate.option("--snapshot", request.snapshot,
                   "write the camera's next picture as PNG, to pick corners in, and end");
  calibrate.option("--board", request.board, "inner corners of the board, e.g. 9x6");
  calibrate.option("--square-mm", request.square_mm, "edge of its squares").between(1.0, 1000.0);
  calibrate.option(
      "--board-pose", request.board_pose,
      "where the board of the first picture is in W: x y z in m, roll pitch yaw in degrees; its x along a row, "
      "y down, from the first corner (beyond which, outwards, a dark square lies)");
  calibrate.option(
      "--pick", request.picks,
      "u,v=x,y,z (a pixel and the point of W there), u,v=OBJECT:x,y,z (the mesh's corner nearest to there, in the "
      "object's frame) or u,v=OBJECT:+-+ (its corner there); four or more, or three with a pose in --camera");
  calibrate.option("--cell", request.cell, "cell file, for corners of its objects");
  calibrate.option("--pick-sigma-px", request.pixel_sigma_px, "how exactly was picked").between(0.01, 50.0);
  calibrate.option("--largest-residual-px", request.largest_residual_px, "a worse fit is refused")
      .between(0.1, 100.0);
  calibrate.text_flag("--help-camera", kVideoCameraKeys,
                      "print every key of a camera's file with range and meaning");
  calibrate.option("--out", request.out, "file to write; name it in the camera's file: calibration: FILE");
  return calibrate;
}

int run_calibrate(const CalibrateRequest& request, const ViewerConfig& config) {
  std::optional<VideoCamera> camera;
  if (!request.camera.empty()) camera = load_video_camera(request.camera);
  std::unique_ptr<Live> live;
  if (request.take > 0 || !request.snapshot.empty()) {
    if (!camera) throw ConfigError("--take and --snapshot need --camera");
    live = std::make_unique<Live>(request, *camera, config);
  }
  if (!request.snapshot.empty()) {
    std::ofstream file(request.snapshot, std::ios::binary);
    file << encode_png(live->next());
    if (!file.flush()) throw core::MissingError(request.snapshot.string() + ": cannot be written");
    return runtime::kExitDone;
  }
  if (request.out.empty()) throw ConfigError("--out: is missing");
  const bool with_board = !request.pictures.empty() || request.take > 0;
  if (!with_board && request.picks.empty())
    throw ConfigError("nothing to calibrate by; allowed: --pictures or --take with --board, and --pick");
  if (!request.picks.empty() && !request.board_pose.empty())
    throw ConfigError("--pick stands beside --board-pose; allowed: one of the two");
  Calibration result = camera ? camera->calibration : Calibration();
  const std::optional<geometry::Pose> prior = result.X_WC;
  BoardPictures pictures;
  if (with_board) {
    const camera::Board board = board_of(request);
    pictures = board_pictures(request, board, live.get());
    // One picture is enough for the pose of a camera whose lens is known.
    if (pictures.corners.size() >= 3 || !result.lens || request.board_pose.empty())
      find_lens(pictures, board, result);
  }
  if (!result.lens)
    throw ConfigError("--pick: the lens is not known; allowed: --camera with one, or --pictures of a board");
  const std::vector<camera::SeenPoint> points = pose_points(request, pictures);
  if (points.empty()) result.X_WC.reset();
  if (!points.empty())
    find_pose(points, {request.pixel_sigma_px, request.largest_residual_px, prior}, result);
  write_calibration(request.out, result);
  std::printf("written: %s\n", request.out.c_str());
  return runtime::kExitDone;
}

}  // namespace phantom::synthetic_viewer
