// The same track past a cone at several speeds (thesis 4.8.1, figure 4.34).

#include <algorithm>
#include <cmath>
#include <set>

#include "common/geometry/implicit/primitives.hpp"
#include "tests/experiments/percept/tracks.hpp"
#include "tests/experiments/specimens.hpp"

namespace phantom::experiments {
namespace in_speed {
namespace {

constexpr int kThickness_vox = 3;
constexpr double kRadius_vox = 30.0, kHeight_vox = 40.0;
const Eigen::Vector3d kCentre_vox{60.3, 60.2, 40.1};  // of the cone's axis, at half its height
constexpr double kY_vox = 34.0, kZ_vox = 32.0;

workspace::Workspace cone(const Settings& settings) {
  const auto mesh = geometry::make_cone(kTrackVoxel_m * kRadius_vox, 0.0, kTrackVoxel_m * kHeight_vox, 96);
  return activate({{.name = "cone",
                    .mesh_W = placed(mesh, kTrackVoxel_m * kCentre_vox),
                    .profile = layers({32, 25, 20, 17, 15, 13}, kThickness_vox)}},
                  track_grid({0, 0, 0}, {120, 120, 90}), settings);
}

/// Distance of a place on the track from the cone's lateral surface, in voxels; the nearest point is not on
/// its base or rim where the track runs.
double distance_vox(double x_vox) {
  const Eigen::Vector3d p = Eigen::Vector3d(x_vox, kY_vox + 0.5, kZ_vox + 0.5) - kCentre_vox;
  const double r = p.head<2>().norm(), below_apex = 0.5 * kHeight_vox - p.z();
  return (r * kHeight_vox - below_apex * kRadius_vox) / std::hypot(kHeight_vox, kRadius_vox);
}

void run(Report& report, const Settings& settings) {
  const auto workspace = cone(settings);
  const std::vector<double> speeds{0.05, 0.1, 0.2, 0.4};
  Plot& plot =
      report.plot("speeds",
                  "Drag on a point that grazes past a cone at z = 32, y = 34 (voxels of 5 mm)\nμ = 32, 25, "
                  "20, 17, 15, 13 in layers of 3 voxels; cone of radius 30, height 40 voxels");
  Panel& panel = plot.panel("", "position x [voxels]", "drag F [N]");
  std::vector<Walk> walks;
  std::vector<double> onsets;
  double deviation = 0.0;
  for (const double speed : speeds) {
    Probe probe(workspace, settings);
    const Walk walked = walk(probe, kY_vox, kZ_vox, 5.0, 115.0, speed, settings.fast ? 4 : 20);
    Table& table = report.table("speed_" + std::to_string(static_cast<int>(1000 * speed)) + "_mm_s",
                                {"x [voxels]", "F [N]", "mu [Pa·s/m]"});
    for (std::size_t i = 0; i < walked.x_vox.size(); ++i)
      table.row({walked.x_vox[i], walked.force_N[i], walked.mu_Pa_s_per_m[i]});
    std::array<char, 32> label{};
    std::snprintf(label.data(), label.size(), "%.2f m/s", speed);
    panel.series(table, "x [voxels]", "F [N]", label.data(), Style::kStep);
    const auto onset =
        std::find_if(walked.force_N.begin(), walked.force_N.end(), [](double force) { return force > 0.0; });
    onsets.push_back(onset == walked.force_N.end()
                         ? std::nan("")
                         : walked.x_vox[static_cast<std::size_t>(onset - walked.force_N.begin())]);
    walks.push_back(walked);
    for (std::size_t i = 0; i < walked.force_N.size(); ++i) {
      const double expected = walks.front().force_N[i] * speed / speeds.front();
      if (expected > 0.0) deviation = std::max(deviation, std::abs(walked.force_N[i] / expected - 1.0));
    }
  }
  const auto [first, last] = std::minmax_element(onsets.begin(), onsets.end());
  std::set<int> levels;
  for (const double mu : walks.front().mu_Pa_s_per_m) levels.insert(static_cast<int>(std::lround(mu)));
  panel.vertical(*first, "onset");
  const double deepest_vox = distance_vox(kCentre_vox.x());
  const auto met = static_cast<double>(6 - static_cast<int>(std::ceil(deepest_vox / kThickness_vox)) + 1);

  report.prints_no_more(
      "figure 4.34 (page 114) shows the relative drag over the position, without the speeds or a scale of F, and the text states no figure. "
      "Taken from it are the cone's six layers of μ = 32, 25, 20, 17, 15, 13 (section 4.8, page 111).");
  report.check("F ∝ v at every place: greatest deviation of F(v)/v from that at 0.05 m/s", deviation, 0, 1e-9,
               "");
  report.check("onset position over all speeds: spread", *last - *first, 0, 0, "voxels");
  // A voxel that the surface only cuts is body: its centre may lie half a voxel's diagonal outside, and the
  // track enters a voxel half a voxel before its centre.
  report.check("onset: distance from the cone beyond six layers", distance_vox(*first) - 6.0 * kThickness_vox,
               -0.3, 0.5 * std::sqrt(3.0) + 0.5, "voxels");
  report.check(
      "different drags met at one speed, one a layer: difference from the layers that the track crosses",
      static_cast<double>(levels.size()) - 1.0 - met, 0, 0, "");
}

}  // namespace
}  // namespace in_speed

Experiment speed() {
  return {"speed",
          "Drag and speed",
          "figure 4.34",
          "In the same neighbourhood and on the same path the drag grows with the speed; "
          "where it begins and where it steps does not depend on the speed.",
          {Sabotage::kConstantMu, Sabotage::kLayersOffByOne, Sabotage::kIgnoredSpeed},
          in_speed::run};
}

}  // namespace phantom::experiments
