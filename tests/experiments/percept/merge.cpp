// Two objects' voxels merged into one workspace (thesis 5.2.2, figures 5.7–5.11): which μ prevails, and what
// a point feels along the paths AA1 and BB1.

#include <algorithm>
#include <cmath>

#include "common/geometry/implicit/primitives.hpp"
#include "tests/experiments/percept/sections.hpp"
#include "tests/experiments/percept/tracks.hpp"
#include "tests/experiments/specimens.hpp"

namespace phantom::experiments {
namespace in_merge {
namespace {

constexpr int kThickness_vox = 4;
const std::vector<float> kMu{32, 20, 13, 11, 10, 9};
const Eigen::Vector3d kLow_vox{0, -5, 5}, kHigh_vox{200, 110, 75};
constexpr double kZ_vox = 40.0, kA_vox = 80.0, kB_vox = 20.0;  // heights of AA1 and BB1 in the plan

layers::Body body(const char* name, geometry::TriangleMesh mesh) {
  return {.name = name, .mesh_W = std::move(mesh), .profile = layers(kMu, kThickness_vox)};
}

/// The complex cylinder and, to the right of it, a round one (figures 5.8, 5.9).
std::vector<layers::Body> pair_of_cylinders() {
  const auto round = geometry::make_cylinder(26 * kTrackVoxel_m, 40 * kTrackVoxel_m, 96);
  return {body("complex cylinder", track_cylinder()),
          body("round cylinder", placed(round, kTrackVoxel_m * Eigen::Vector3d(122.2, 50.3, 40.0)))};
}

/// A cylinder beside the wedge block, its groove up (figure 5.7).
std::vector<layers::Body> cylinder_and_wedge() {
  const auto wedge = wedge_block(kTrackVoxel_m * Eigen::Vector3d(60, 50, 40),
                                 kTrackVoxel_m * Eigen::Vector2d(30, 50), 4 * kTrackVoxel_m);
  const auto round = geometry::make_cylinder(20 * kTrackVoxel_m, 40 * kTrackVoxel_m, 96);
  return {body("cylinder", placed(round, kTrackVoxel_m * Eigen::Vector3d(50.2, 50.1, 40.0))),
          body("wedge block", placed(wedge, kTrackVoxel_m * Eigen::Vector3d(122.3, 50.2, 40.0)))};
}

workspace::Workspace merged(const std::vector<layers::Body>& bodies, const Settings& settings) {
  const auto law = settings.sabotage == Sabotage::kLatestObject ? layers::MergeLaw::kObjectPriority
                                                                : layers::MergeLaw::kHighestViscosity;
  return activate(bodies, track_grid(kLow_vox, kHigh_vox), settings, law);
}

/// Voxels in which the merged μ is not the greater of the two, or the object named is not the one that has
/// it.
double wrong_voxels(const std::vector<layers::Body>& bodies, const workspace::Workspace& both,
                    const Settings& settings) {
  const auto a = merged({bodies[0]}, settings), b = merged({bodies[1]}, settings);
  double wrong = 0.0;
  const auto& size = both.grid().size_vox;
  for (std::int32_t z = 0; z < size[2]; ++z) {
    for (std::int32_t y = 0; y < size[1]; ++y) {
      for (std::int32_t x = 0; x < size[0]; ++x) {
        const workspace::Index3 v{x, y, z};
        const float mu_a = a.mu(v), mu_b = b.mu(v);
        const std::uint16_t expected = mu_a == 0.0F && mu_b == 0.0F ? 0 : mu_a >= mu_b ? 1 : 2;
        if (both.mu(v) != std::max(mu_a, mu_b) || both.object(v) != expected) ++wrong;
      }
    }
  }
  return wrong;
}

/// Fluid between the wedge's legs at a height, as the width of the free or layered part on its middle line.
double split_width_vox(const workspace::Workspace& workspace, double z_vox) {
  double width = 0.0;
  for (double x_vox = 95.5; x_vox < 150.0; x_vox += 1.0) {
    const auto v = workspace.grid().index_of(kTrackVoxel_m * Eigen::Vector3d(x_vox, 50.5, z_vox + 0.5));
    if (workspace.order(v) > 0 && workspace.order(v) < workspace::kOrderBoundary) ++width;
  }
  return width;
}

int count_saddles(std::vector<double> values) {
  for (double& value : values) value = -value;
  return count_peaks(values);
}

void run(Report& report, const Settings& settings) {
  const auto pair = pair_of_cylinders(), beside = cylinder_and_wedge();
  const auto workspace = merged(pair, settings), with_wedge = merged(beside, settings);
  Plot& plot = report.plot("paths",
                           "Two objects, \"higher μ prevails\": "
                           "μ = 32, 20, 13, 11, 10, 9 in layers of 4 voxels of 5 mm; F at 0.1 m/s, z = 40",
                           2);
  Panel& plan = section_panel(report, plot, "μ at z = 40 and both paths (figure 5.9)", "plan", workspace, 2,
                              (kZ_vox + 0.5) * kTrackVoxel_m, Shown::kMu);
  section_panel(report, plot, "μ across the gap, y = 50", "across", workspace, 1, 50.5 * kTrackVoxel_m,
                Shown::kMu);
  Probe probe(workspace, settings);
  struct Path {
    const char *name, *title;
    double y_vox;
  };
  std::array<int, 2> saddles{};
  std::size_t next = 0;
  for (const Path& path :
       {Path{"AA1", "AA1, y = 80 (figure 5.10)", kA_vox}, Path{"BB1", "BB1, y = 20 (figure 5.11)", kB_vox}}) {
    const Walk walked = walk(probe, path.y_vox, kZ_vox, 0.0, 180.0, 0.1);
    Table& table = report.table(path.name, {"x [voxels]", "F [N]"});
    for (std::size_t i = 0; i < walked.x_vox.size(); ++i) table.row({walked.x_vox[i], walked.force_N[i]});
    plot.panel(path.title, "x [voxels]", "percept parameter F [N]")
        .series(table, "x [voxels]", "F [N]", "F", Style::kStep);
    plan.horizontal(1e3 * kTrackVoxel_m * (path.y_vox + 0.5), "AA1 (above), BB1");
    saddles[next++] = count_saddles(walked.force_N);
  }
  Plot& heights = report.plot("heights",
                              "A cylinder and the wedge block merged: "
                              "sections at rising height (figure 5.7); layers of 4 voxels of 5 mm",
                              3);
  Table& split = report.table("split", {"z [voxels]", "width between the legs [voxels]"});
  double least_widening = INFINITY, before = -INFINITY;
  for (const double z_vox : {33.0, 43.0, 55.0}) {
    const std::string name = "wedge_z" + std::to_string(static_cast<int>(z_vox));
    section_panel(report, heights, "z = " + std::to_string(static_cast<int>(z_vox)), name, with_wedge, 2,
                  (z_vox + 0.5) * kTrackVoxel_m, Shown::kLayer);
    const double width = split_width_vox(with_wedge, z_vox);
    split.row({z_vox, width});
    least_widening = std::min(least_widening, width - before);
    before = width;
  }

  report.beside("saddles along AA1 (from the merger)", "section 5.2.2 c, page 136", 1, saddles[0], 1, 1, "");
  report.beside("saddles along BB1 (from the merger and from a concavity)", "section 5.2.2 c, page 136", 2,
                saddles[1], 2, 2, "");
  report.prints_no_more(
      "figures 5.7–5.11 (pages 135–137) show slices and curves without values on which a reading to a few percent could rest; "
      "sizes of the objects, of the voxels and the layers' μ are not stated.");
  report.check("voxels in which not the higher μ prevails, cylinders",
               wrong_voxels(pair, workspace, settings), 0, 0, "");
  report.check("voxels in which not the higher μ prevails, cylinder and wedge",
               wrong_voxels(beside, with_wedge, settings), 0, 0, "");
  // The groove is 50 voxels wide over 30 of depth: 1.7 voxels wider with each of the 10 and 12 of height
  // between the sections.
  report.check("split of the wedge: least widening from one section to the next higher", least_widening, 10,
               25, "voxels");
}

}  // namespace
}  // namespace in_merge

Experiment merge() {
  return {"merge",
          "Two objects in one workspace",
          "figures 5.7–5.11",
          "Where two objects' layers meet the higher μ prevails; "
          "the drag along AA1 has one saddle, along BB1 two: "
          "one from the merger and one from the object's concavity.",
          {Sabotage::kConstantMu, Sabotage::kLatestObject},
          in_merge::run};
}

}  // namespace phantom::experiments
