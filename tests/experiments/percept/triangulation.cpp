// The same cylinder in few large triangles, twice and eight times as many (thesis figure 3.24): what does a
// search for what is near cost, and does it find the same?

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/experiments/percept/intersection_filter.hpp"
#include "tests/experiments/rig.hpp"
#include "tests/experiments/specimens.hpp"

namespace phantom::experiments {
namespace in_triangulation {
namespace {

constexpr double kVoxel_m = 0.005, kReach_m = 0.06;  // L6, as in filter-cost
constexpr std::array kNames{"a, 220 triangles", "b, twice as many", "c, eight times as many"};

/// Every triangle cut in two at the middle of its longest edge: the same surface.
geometry::TriangleMesh halved(const geometry::TriangleMesh& mesh) {
  geometry::TriangleMesh halves{mesh.vertices_m, {}};
  for (const auto& t : mesh.triangles) {
    const auto length = [&](std::size_t k) {
      return (mesh.vertices_m[t[(k + 1) % 3]] - mesh.vertices_m[t[k]]).norm();
    };
    const std::size_t k = length(0) >= length(1) && length(0) >= length(2) ? 0
                          : length(1) >= length(2)                         ? 1
                                                                           : 2;
    const std::uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
    const auto middle = static_cast<std::uint32_t>(halves.vertices_m.size());
    halves.vertices_m.push_back(0.5F * (mesh.vertices_m[a] + mesh.vertices_m[b]));
    halves.triangles.push_back({a, middle, c});
    halves.triangles.push_back({middle, b, c});
  }
  return halves;
}

/// The distance ahead at which the first voxel of the body lies; infinite beyond the reach.
double first_voxel_m(const workspace::Workspace& workspace, const Eigen::Vector3d& p) {
  for (double s = 0.0; s <= kReach_m; s += 0.02 * kVoxel_m) {
    if (workspace.order(workspace.grid().index_of(p + s * Eigen::Vector3d::UnitX())) >=
        workspace::kOrderBoundary)
      return s;
  }
  return INFINITY;
}

/// What one triangulation costs, summed over all approaches at one distance.
struct Cost {
  FilterQueries queries;
  double hits = 0.0;
};

void run(Report& report, const Settings& settings) {
  const geometry::TriangleMesh few = complex_cylinder(0.1, 0.08), twice = halved(few),
                               many = halved(halved(twice));
  const std::array<IntersectionScene, 3> scenes{IntersectionScene({few}), IntersectionScene({twice}),
                                                IntersectionScene({many})};
  const workspace::Workspace workspace =
      activate({{.name = "cylinder", .mesh_W = few, .profile = layers({32, 20, 13, 11, 10, 9}, 2)}},
               layers::grid_over({-0.25, -0.2, -0.15}, {0.25, 0.2, 0.15}, kVoxel_m), settings);

  const int approaches = settings.fast ? 40 : 200;
  const std::vector<double> distances_mm{75, 70, 65, 59, 55, 50, 45, 40, 35, 30, 25, 20, 15, 10, 5, 2};
  std::array<std::vector<Cost>, 3> costs;
  for (auto& cost : costs) cost.resize(distances_mm.size());
  int disagreements = 0;
  double voxels_before = 0.0, met = 0.0;
  for (int i = 0; i < approaches; ++i) {
    // Spread over the wall's bays and lobes, and over the voxels.
    const double y = -0.05 + 0.1 * (i + 0.5) / approaches, z = 0.03 * std::sin(1.7 * i);
    FilterQueries unused;
    const auto wall =
        scenes[0].probe({-0.2, y, z}, Eigen::Vector3d::UnitX(), 0.3, FilterForm::kOptimised, unused);
    if (!wall) throw std::runtime_error("triangulation: an approach meets nothing");
    for (std::size_t d = 0; d < distances_mm.size(); ++d) {
      const Eigen::Vector3d p(-0.2 + wall->distance_m - 1e-3 * distances_mm[d], y, z);
      std::array<double, 3> found{};
      for (std::size_t k = 0; k < scenes.size(); ++k) {
        Cost& cost = costs[k][d];
        const auto hit =
            scenes[k].probe(p, Eigen::Vector3d::UnitX(), kReach_m, FilterForm::kOptimised, cost.queries);
        found[k] = hit ? hit->distance_m : INFINITY;
        cost.hits += hit ? 1.0 : 0.0;
        if (found[k] != found[0] && !(std::abs(found[k] - found[0]) < 1e-6)) ++disagreements;
      }
      if (d + 1 < distances_mm.size() || !std::isfinite(found[0])) continue;
      // From the last place: where do the voxels begin before the triangles?
      const Eigen::Vector3d back = p - 0.03 * Eigen::Vector3d::UnitX();
      voxels_before += (found[0] + 0.03 - first_voxel_m(workspace, back)) / kVoxel_m;
      met += 1.0;
    }
  }

  Plot& plot = report.plot(
      "cost",
      "A probe of 60 mm straight at a complex cylinder of radius 100 mm, its surface the same in 220, "
      "440 and 1760 triangles; mean of " +
          std::to_string(approaches) + " approaches, filters optimised",
      2);
  Panel& load =
      plot.panel("computing load", "distance from the wall [mm]", "load, units of table 3.2 [U]").log_y();
  Panel& share = plot.panel("triangles near enough for the later tests", "distance from the wall [mm]",
                            "share of all [%]");
  std::array<double, 3> sess{}, later{}, sum{}, rays{};
  for (std::size_t k = 0; k < costs.size(); ++k) {
    Table& table = report.table(std::string("triangulation_") + kNames[k][0],
                                {"distance [mm]", "SESS", "SDT", "IDP", "VIT", "load [U]", "share [%]"});
    for (std::size_t d = 0; d < distances_mm.size(); ++d) {
      const FilterQueries& q = costs[k][d].queries;
      const double n = approaches;
      const auto units = static_cast<double>(filter_load(q, FilterForm::kOptimised));
      const auto spheres = static_cast<double>(q.sess), facing = static_cast<double>(q.sdt);
      table.row({distances_mm[d], spheres / n, facing / n, static_cast<double>(q.idp) / n,
                 static_cast<double>(q.vit) / n, units / n, spheres > 0 ? 100.0 * facing / spheres : 0.0});
      sess[k] += spheres;
      later[k] += facing;
      sum[k] += units;
      rays[k] += static_cast<double>(q.idp);
    }
    load.series(table, "distance [mm]", "load [U]", kNames[k]);
    share.series(table, "distance [mm]", "share [%]", kNames[k]);
  }
  // Each triangle of an object in reach is asked.
  report.beside("triangles asked by SESS, c over a", "section 3.2.6 b, page 74", 8.0, sess[2] / sess[0], 8.0,
                8.0, "");
  report.beside("triangles of b over those of a", "section 3.2.6 b, page 74", 2.0,
                static_cast<double>(twice.triangles.size()) / static_cast<double>(few.triangles.size()), 2.0,
                2.0, "");

  report.check("the three triangulations find the same surface: probes that differ", disagreements, 0, 0, "");
  // Smaller spheres reach less far beyond their triangles.
  report.check("share of triangles that pass SESS, c over a", (later[2] / sess[2]) / (later[0] / sess[0]),
               0.05, 0.9, "");
  report.check("share of triangles that reach the ray's intersection, c over a",
               (rays[2] / sess[2]) / (rays[0] / sess[0]), 0.05, 0.9, "");
  // "does not definitely yield overall advantage": what SESS costs more is not won back by the later tests.
  report.check("load of all tests, c over a", sum[2] / sum[0], 1.0, 8.0, "");
  report.check("load of all tests, b over a", sum[1] / sum[0], 0.8, 2.0, "");
  // Voxels that the surface passes through are body: they begin up to a voxel before it, half a voxel in the
  // mean, and somewhat more where the wall lies across.
  report.check("voxels begin before the triangles, mean", voxels_before / met, 0.2, 1.1, "voxels");
  report.difference(
      "The figure's meshes are not printed; ours are the same surface with every triangle halved at its longest edge, "
      "once and three times. The voxel method's cost is the same for all three: it never sees a triangle.");
}

}  // namespace
}  // namespace in_triangulation

Experiment triangulation() {
  return {
      "triangulation",
      "Triangulation against the cost of a search",
      "figure 3.24",
      "Eight times as many, homogeneous triangles are all asked by the first filter; a smaller share of them "
      "qualifies for the costly tests; altogether their number gives no advantage.",
      {Sabotage::kGrownBodies},
      in_triangulation::run};
}

}  // namespace phantom::experiments
