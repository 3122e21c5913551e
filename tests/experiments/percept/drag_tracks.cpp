// Drag along three straight tracks past and through the complex cylinder (thesis 4.8, figure 4.33).

#include <algorithm>
#include <cmath>

#include "tests/experiments/percept/sections.hpp"
#include "tests/experiments/percept/tracks.hpp"

namespace phantom::experiments {
namespace in_drag_tracks {
namespace {

const std::vector<float> kMu{32, 20, 13, 11, 10, 9};
constexpr float kSkin = 100.0F;
constexpr int kThickness_vox = 4;  // FAZ of 9 × 9 × 9: m = 4
constexpr double kSpeed_m_per_s = 0.1, kFrom_vox = 0.0, kTo_vox = 120.0, kHeight_vox = 40.0;

workspace::Workspace workspace_of(workspace::LayerMethod method, const Settings& settings) {
  workspace::LayerProfile profile = layers(kMu, kThickness_vox, kSkin);
  profile.method = method;
  profile.element = workspace::ShapingElement::kSphereContained;
  return activate({{.name = "complex cylinder", .mesh_W = track_cylinder(), .profile = profile}},
                  track_grid({0, -16, 0}, {120, 110, 80}), settings);
}

double greatest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

/// Mean of how far outwards of its place a layer's outer border is met, in voxels, over all steps of the
/// walk.
double outwards_vox(const Walk& walked, double y_vox) {
  double sum = 0.0;
  int steps = 0;
  for (std::size_t i = 1; i < walked.x_vox.size(); ++i) {
    const double before = walked.mu_Pa_s_per_m[i - 1], now = walked.mu_Pa_s_per_m[i];
    const double low = std::min(before, now), high = std::max(before, now);
    const auto inner = std::find_if(
        kMu.begin(), kMu.end(), [&](float mu) { return std::abs(static_cast<double>(mu) - high) < 0.01; });
    if (low == high || inner == kMu.end()) continue;
    const double place_vox = kThickness_vox * static_cast<double>(inner - kMu.begin() + 1);
    const double x_vox = 0.5 * (walked.x_vox[i - 1] + walked.x_vox[i]);
    sum += distance_to_track_cylinder_vox(x_vox, y_vox + 0.5) - place_vox;
    ++steps;
  }
  return steps == 0 ? std::nan("") : sum / steps;
}

/// Greatest distance, in voxels, from the true border of the body at which a sample has the skin's μ outside
/// of it or has not inside; 0 if there is none.
double skin_error_vox(const Walk& walked, double y_vox) {
  double worst = 0.0;
  for (std::size_t i = 0; i < walked.x_vox.size(); ++i) {
    const double distance = distance_to_track_cylinder_vox(walked.x_vox[i], y_vox + 0.5);
    const bool skin = walked.mu_Pa_s_per_m[i] > 0.99 * static_cast<double>(kSkin);
    if (skin != (distance < 0.0)) worst = std::max(worst, std::abs(distance));
  }
  return worst;
}

void run(Report& report, const Settings& settings) {
  const auto thesis = workspace_of(workspace::LayerMethod::kDilation, settings),
             ours = workspace_of(workspace::LayerMethod::kDistance, settings);
  Plot& plot = report.plot("tracks",
                           "Drag on a point at 0.1 m/s past the complex cylinder, z = 40\nμ = 32, 20, 13, "
                           "11, 10, 9, skin 100; six layers of 4 voxels of 5 mm",
                           2);
  Panel& plan = section_panel(report, plot, "μ at z = 40, sphere of m = 4 by dilation", "plan", thesis, 2,
                              (kHeight_vox + 0.5) * kTrackVoxel_m, Shown::kMu);
  struct Track {
    double y_vox;
    const char *name, *title;
  };
  double skin_error = 0.0, skin_off_track = 0.0;
  std::array<Walk, 3> by_dilation, by_distance;
  const std::array<Track, 3> tracks{
      {{20.0, "y20", "y = 20 (b)"}, {80.0, "y80", "y = 80 (c)"}, {50.0, "y50", "y = 50 (d)"}}};
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    const double y_vox = tracks[t].y_vox;
    Probe probe(thesis, settings), exact(ours, settings);
    by_dilation[t] = walk(probe, y_vox, kHeight_vox, kFrom_vox, kTo_vox, kSpeed_m_per_s);
    by_distance[t] = walk(exact, y_vox, kHeight_vox, kFrom_vox, kTo_vox, kSpeed_m_per_s);
    Table& table = report.table(
        tracks[t].name, {"x [voxels]", "F, dilation [N]", "F, distance [N]", "true distance [voxels]"});
    for (std::size_t i = 0; i < by_dilation[t].x_vox.size(); ++i) {
      table.row({by_dilation[t].x_vox[i], by_dilation[t].force_N[i], by_distance[t].force_N[i],
                 distance_to_track_cylinder_vox(by_dilation[t].x_vox[i], y_vox + 0.5)});
    }
    plot.panel(tracks[t].title, "x [voxels]", "drag F [N]")
        .series(table, "x [voxels]", "F, dilation [N]", "sphere of m = 4 by dilation (thesis)", Style::kStep)
        .series(table, "x [voxels]", "F, distance [N]", "layers by distance (ours)", Style::kStep);
    plan.horizontal(1e3 * kTrackVoxel_m * (y_vox + 0.5), "tracks");
    for (const Walk* walked : {&by_dilation[t], &by_distance[t]}) {
      skin_error = std::max(skin_error, skin_error_vox(*walked, y_vox));
      if (y_vox != 50.0) skin_off_track = std::max(skin_off_track, greatest(walked->mu_Pa_s_per_m));
    }
  }
  const double nearest = greatest(by_dilation[0].mu_Pa_s_per_m);
  report.beside("peaks on y = 20 (\"mark the two peaks\")", "figure 4.33 b, page 113", 2,
                count_peaks(by_dilation[0].force_N), 2, 2, "");
  report.prints_no_more(
      "figure 4.33 (page 113) draws F over x without a scale or a speed. Taken from the text are the tracks and the layers' μ "
      "(pages 111 and 113).");
  report.check("peaks on y = 20, layers by distance", count_peaks(by_distance[0].force_N), 2, 2, "");
  report.check("peaks on y = 80", count_peaks(by_dilation[1].force_N), 1, 1, "");
  report.check("greatest drag on y = 20: layer 1 at 0.1 m/s", greatest(by_dilation[0].force_N), 3.2 - 1e-6,
               3.2 + 1e-6, "N");
  report.check("greatest drag on y = 50: the skin at 0.1 m/s", greatest(by_dilation[2].force_N), 10.0 - 1e-6,
               10.0 + 1e-6, "N");
  report.check("greatest μ on y = 20 and 80: never the skin's", skin_off_track, 9, 32, "Pa·s/m");
  // A voxel that the surface cuts is body: the skin begins up to a voxel's diagonal in the plane before the
  // surface.
  report.check(
      "skin's μ where the track is not in the body, or not where it is: at most this far from its border",
      skin_error, 0, std::sqrt(2.0), "voxels");
  // The same: about half a voxel outwards of the true place on the average, never a whole one.
  report.check("layers by distance on y = 80: borders outwards of their true place, mean",
               outwards_vox(by_distance[1], 80.0), -0.25, 0.9, "voxels");
  report.difference(
      "The section of the thesis's cylinder is not printed; "
      "ours has two lobes towards y = 20, one nearer than the other, and one towards y = 80, "
      "so that the tracks meet what the figure shows. The greatest μ met outside the body is " +
      std::to_string(static_cast<int>(nearest)) + " Pa·s/m.");
}

}  // namespace
}  // namespace in_drag_tracks

Experiment drag_tracks() {
  return {"drag-tracks",
          "Drag along tracks past an object",
          "figure 4.33",
          "On y = 20, close to the object without touching it, the drag has two peaks; on y = 80 it rises "
          "and falls in steps; "
          "on y = 50 it assumes the skin's value where the track is inside the body, and only there.",
          {Sabotage::kConstantMu, Sabotage::kLayersOffByOne, Sabotage::kIgnoredSpeed, Sabotage::kGrownBodies},
          in_drag_tracks::run};
}

}  // namespace phantom::experiments
