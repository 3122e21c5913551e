// Sections through layers made by shaping elements, as the thesis draws them (figures 4.26–4.32): how far
// layers reach between the axes, what stays open, how wide layers are, and which of them lie above a body.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/geometry/implicit/primitives.hpp"
#include "tests/experiments/percept/sections.hpp"
#include "tests/experiments/percept/tracks.hpp"
#include "tests/experiments/specimens.hpp"

namespace phantom::experiments {
namespace in_layer_sections {
namespace {

using workspace::ShapingElement;
constexpr ShapingElement kCube = ShapingElement::kCube, kSphere = ShapingElement::kSphereContained;

const std::vector<float> kMu{32, 25, 20, 17, 15, 13};
// Off the lattice, so that no face lies on a border of voxels.
const Eigen::Vector3d kOff_vox{0.22, 0.14, -0.18};
// Axis of all upright bodies, at half the height of the cylinders: z = 20 to 60 (figure 4.28).
const Eigen::Vector3d kMiddle_vox = Eigen::Vector3d{60, 44, 40} + kOff_vox;
constexpr int kTop_vox = 59;  // index of the cylinders' uppermost voxels
constexpr double kRadius_vox = 24.0, kBore_vox = 20.0;

geometry::TriangleMesh at_middle(const geometry::TriangleMesh& mesh) {
  return placed(mesh, kTrackVoxel_m * kMiddle_vox);
}

geometry::TriangleMesh circular() {
  return at_middle(geometry::make_cylinder(kTrackVoxel_m * kRadius_vox, kTrackVoxel_m * 40.0, 96));
}

geometry::TriangleMesh lobed() { return placed(track_cylinder(), kTrackVoxel_m * kOff_vox); }

workspace::Workspace layered(const geometry::TriangleMesh& mesh, ShapingElement element, int m,
                             const Settings& settings, int count = 6) {
  workspace::LayerProfile profile = layers({kMu.begin(), kMu.begin() + count}, m);
  profile.method = workspace::LayerMethod::kDilation;
  profile.element = element;
  const geometry::BoundingBox box = mesh.bounding_box();
  const Eigen::Array3d low_vox = (box.min_m.cast<double>() / kTrackVoxel_m).array().floor(),
                       high_vox = (box.max_m.cast<double>() / kTrackVoxel_m).array().ceil();
  const double margin_vox = count * m + 3.0;
  return activate({{.name = "body", .mesh_W = mesh, .profile = profile}},
                  track_grid((low_vox - margin_vox).matrix(), (high_vox + margin_vox).matrix()), settings);
}

int order_at(const workspace::Workspace& workspace, const Eigen::Vector3d& p_vox) {
  return workspace.order(workspace.grid().index_of(kTrackVoxel_m * p_vox));
}

/// Distance from the upright axis, at height `z_vox`, to the outer face of the layers 1 to `order`.
double reach_vox(const workspace::Workspace& workspace, double z_vox, double heading_rad, int order = 6) {
  const Eigen::Vector3d direction(std::cos(heading_rad), std::sin(heading_rad), 0.0);
  double reach = 0.0;
  for (double s = 0.0; s < 80.0; s += 0.05) {
    const int found = order_at(
        workspace, {kMiddle_vox.x() + s * direction.x(), kMiddle_vox.y() + s * direction.y(), z_vox});
    if (found >= workspace::kOrderBoundary || (found > 0 && found <= order)) reach = s;
  }
  return reach;
}

/// Mean of reach_vox() around the four headings `heading_deg` + 0°, 90° …, less the circular cylinder's
/// radius. Over 6° the voxels' steps even out.
double beyond_circle_vox(const workspace::Workspace& workspace, double heading_deg, int order) {
  double sum = 0.0;
  int count = 0;
  for (double turn_deg = heading_deg; turn_deg < 360.0; turn_deg += 90.0) {
    for (double off_deg = -3.0; off_deg <= 3.0; off_deg += 0.5, ++count)
      sum += reach_vox(workspace, kMiddle_vox.z(), (turn_deg + off_deg) * std::numbers::pi / 180.0, order);
  }
  return sum / count - kRadius_vox;
}

std::string named(const char* shape, int m) { return std::string(shape) + ", m = " + std::to_string(m); }

/// Figure 4.26: cubes of m = 2, 3, 4 around both cylinders.
void cubes(Report& report, const Settings& settings) {
  Plot& plot = report.plot("cubes", "Six layers by cubes of 5³, 7³ and 9³ voxels (figure 4.26), z = 40", 3);
  double off_ratio = 0.0;
  for (const bool is_complex : {false, true}) {
    for (int m = 2; m <= 4; ++m) {
      const auto workspace = layered(is_complex ? lobed() : circular(), kCube, m, settings);
      section_panel(report, plot, named(is_complex ? "complex cylinder" : "circular cylinder", m),
                    (is_complex ? "cube_complex_" : "cube_circular_") + std::to_string(m), workspace, 2,
                    kTrackVoxel_m * kMiddle_vox.z(), Shown::kLayer);
      if (is_complex) continue;
      const double ratio = beyond_circle_vox(workspace, 45.0, 6) / beyond_circle_vox(workspace, 0.0, 6);
      off_ratio = std::max(off_ratio, std::abs(ratio - std::numbers::sqrt2));
    }
  }
  // Dilation by a square of half side h moves a circle's 45° place by (h, h). Voxels round by half of one in
  // the 12 of m = 2, on both ends of the ratio.
  report.check("cubes: layers' reach at 45° ÷ along an axis, greatest deviation from √2", off_ratio, 0.0,
               0.08, "");
}

/// Depth of the hollow that the outermost face has between two lobes of the complex cylinder.
double hollow_vox(const workspace::Workspace& workspace) {
  return reach_vox(workspace, kMiddle_vox.z(), kTrackLobe_rad) -
         reach_vox(workspace, kMiddle_vox.z(), kTrackBay_rad);
}

/// The same of the true offset surface.
double true_hollow_vox(double offset_vox) {
  const auto reach = [&](double heading_rad) {
    double s = 80.0;
    while (distance_to_track_cylinder_vox(60.0 + s * std::cos(heading_rad),
                                          44.0 + s * std::sin(heading_rad)) > offset_vox)
      s -= 0.01;
    return s;
  };
  return reach(kTrackLobe_rad) - reach(kTrackBay_rad);
}

/// Figures 4.27 and 4.28: cube and sphere of m = 2, then spheres of m = 3 and 4.
void spheres(Report& report, const Settings& settings) {
  Plot& plot = report.plot(
      "spheres",
      "Six layers by cube and sphere of m = 2 (figure 4.27), by larger spheres (figure 4.28), z = 40", 3);
  const auto add = [&](const char* body, const char* shape, int m, const workspace::Workspace& workspace) {
    section_panel(report, plot, std::string(body) + " cylinder\n" + named(shape, m),
                  std::string("compared_") + body + "_" + shape + std::to_string(m), workspace, 2,
                  kTrackVoxel_m * kMiddle_vox.z(), Shown::kLayer);
  };
  const auto by_cube = layered(circular(), kCube, 2, settings),
             by_sphere = layered(circular(), kSphere, 2, settings);
  add("circular", "cube", 2, by_cube);
  add("circular", "sphere", 2, by_sphere);
  add("complex", "cube", 2, layered(lobed(), kCube, 2, settings));
  Table& hollows =
      report.table("hollows", {"m [voxels]", "cube [voxels]", "sphere [voxels]", "true [voxels]"});
  double off_hollow_vox = 0.0, least_lost_vox = INFINITY;
  for (int m = 2; m <= 4; ++m) {
    const auto workspace = layered(lobed(), kSphere, m, settings);
    add("complex", "sphere", m, workspace);
    const double cube = hollow_vox(layered(lobed(), kCube, m, settings)), sphere = hollow_vox(workspace),
                 truth = true_hollow_vox(6.0 * m);
    hollows.row({double(m), cube, sphere, truth});
    off_hollow_vox = std::max(off_hollow_vox, std::abs(sphere - truth));
    least_lost_vox = std::min(least_lost_vox, truth - cube);
  }
  Table& table = report.table("between", {"layer", "cube [voxels]", "sphere [voxels]", "true [voxels]"});
  std::array<double, 7> gain_vox{};
  for (int order = 1; order <= 6; ++order) {
    const double cube = beyond_circle_vox(by_cube, 45.0, order),
                 sphere = beyond_circle_vox(by_sphere, 45.0, order);
    table.row({double(order), cube, sphere, 2.0 * order});
    gain_vox[static_cast<std::size_t>(order)] = cube - sphere;
  }
  plot.panel("circular cylinder, m = 2: reach at 45°", "number of the layer",
             "reach beyond the surface [voxels]")
      .series(table, "layer", "cube [voxels]", "cube", Style::kPoints)
      .series(table, "layer", "sphere [voxels]", "sphere", Style::kPoints)
      .series(table, "layer", "true [voxels]", "m voxels a layer");
  // "In low order μ layer difference is not appreciable": less than a voxel. A layer's cube reaches 2√2 along
  // the diagonal, its sphere, of which (2, 1, 0) is the farthest there, 3 ÷ √2: six times that is 4.2.
  report.check("cube beyond sphere at 45°, layer 1", gain_vox[1], 0.0, 1.0, "voxels");
  report.check("the same, layer 6", gain_vox[6], 3.5, 5.0, "voxels");
  // The boundary's last voxel reaches up to a voxel beyond the surface.
  report.check("sphere along the axes: reach of six layers beyond 6 m",
               beyond_circle_vox(by_sphere, 0.0, 6) - 12.0, 0.0, 1.0, "voxels");
  // By a sphere what is free between two lobes stays so, but for the rounding of two faces and for a layer's
  // reach of up to √20 − 4 too far (m = 4: the cell (4, 2, 0)), six times. By a cube, at 33° and 93° from x,
  // six layers reach 0.33 · 6 m farther in the bay than off the lobe: 4, 6 and 8 voxels.
  report.check(
      "hollow left between two lobes, spheres of m = 2, 3, 4: greatest deviation from the true offset",
      off_hollow_vox, 0.0, 3.0, "voxels");
  report.check("the same, cubes: least loss", least_lost_vox, 3.0, 12.0, "voxels");
}

/// Figure 4.29: a tube at half its height and above its top.
void tube(Report& report, const Settings& settings) {
  const auto workspace =
      layered(at_middle(hollow_cylinder(kTrackVoxel_m * (kBore_vox + 8.0), kTrackVoxel_m * kBore_vox, 0.2)),
              kSphere, 2, settings);
  const double above_vox = kTop_vox + 4.5;
  Plot& plot = report.plot("tube", "A hollow cylinder with six layers, sphere of m = 2 (figure 4.29)", 2);
  section_panel(report, plot, "at half its height", "tube_middle", workspace, 2,
                kTrackVoxel_m * kMiddle_vox.z(), Shown::kLayer);
  section_panel(report, plot, "four voxels above its top", "tube_above", workspace, 2,
                kTrackVoxel_m * above_vox, Shown::kLayer);
  double passage_vox = INFINITY, body = 0.0, fluid = 0.0;
  const auto& grid = workspace.grid();
  const std::int32_t above = grid.index_of(kTrackVoxel_m * Eigen::Vector3d(0.0, 0.0, above_vox)).z;
  for (std::int32_t z = 0; z < grid.size_vox[2]; ++z) {
    for (std::int32_t y = 0; y < grid.size_vox[1]; ++y) {
      for (std::int32_t x = 0; x < grid.size_vox[0]; ++x) {
        const int order = workspace.order({x, y, z});
        if (order == workspace::kOrderFree) continue;
        const Eigen::Vector3d off = grid.centre_of({x, y, z}) / kTrackVoxel_m - kMiddle_vox;
        passage_vox = std::min(passage_vox, off.head<2>().norm());
        if (z == above) (order >= workspace::kOrderBoundary ? body : fluid) += 1.0;
      }
    }
  }
  // The sphere's farthest cell in a level section, (2, 1, 0), is √5 away: six layers reach 1.4 voxels beyond
  // 6 m. The wall's voxels reach up to one into the bore.
  report.check("hollow cylinder: free radius along the whole axis, bore less 6 m = 8 voxels", passage_vox,
               5.5, 8.5, "voxels");
  report.check("above its top: share of the section's layered voxels that are body", body / (body + fluid),
               0.0, 0.0, "");
}

/// Voxels that a straight line through the layers spends in each of them: how many are not `m`.
int uneven_layers(const workspace::Workspace& workspace, const Eigen::Vector3d& inside_vox,
                  const Eigen::Vector3d& step_vox, int count, int m) {
  std::vector<int> width(static_cast<std::size_t>(count) + 1);
  for (int i = 0; i < 80; ++i) {
    const int order = order_at(workspace, inside_vox + i * step_vox);
    if (order > 0 && order <= count) ++width[static_cast<std::size_t>(order)];
  }
  return static_cast<int>(std::count_if(width.begin() + 1, width.end(), [m](int w) { return w != m; }));
}

/// Figure 4.30: the wedge, groove up, with five layers.
void wedge(Report& report, const Settings& settings) {
  constexpr int kM = 3, kCount = 5;
  const auto workspace = layered(at_middle(wedge_block(kTrackVoxel_m * Eigen::Vector3d(50, 36, 30),
                                                       kTrackVoxel_m * Eigen::Vector2d(15, 24))),
                                 kSphere, kM, settings, kCount);
  Plot& plot = report.plot("wedge", "The wedge with five layers, sphere of m = 3 (figure 4.30)", 3);
  const Eigen::Vector3d through = kMiddle_vox + Eigen::Vector3d(0.0, 0.0, 5.0);  // above the V's junction
  const std::array<const char*, 3> names{"as seen along x", "as seen along y", "as seen along z"};
  for (const int normal : {0, 2, 1})
    section_panel(report, plot, names[static_cast<std::size_t>(normal)], "wedge_" + std::to_string(normal),
                  workspace, normal, kTrackVoxel_m * through[normal], Shown::kLayer);
  const Eigen::Vector3d beside = kMiddle_vox + Eigen::Vector3d(18.0, 0.0, 0.0);  // below the upper flat
  int uneven = 0;
  for (const Eigen::Vector3d& out :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, -1, 0),
        Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1)})
    uneven += uneven_layers(workspace, beside, out, kCount, kM);
  // "Constant width layer creation has been met": to the voxel, on flat faces along the axes.
  report.check("wedge: layers of five faces that are not m voxels wide, of 25", uneven, 0, 0, "");
}

/// How far the outermost contour is from round: standard deviation of its radius as a share of 6 m.
double unroundness(const workspace::Workspace& workspace, double z_vox, int m) {
  double sum = 0.0, squares = 0.0;
  constexpr int kHeadings = 180;
  for (int i = 0; i < kHeadings; ++i) {
    const double r = reach_vox(workspace, z_vox, 2.0 * std::numbers::pi * i / kHeadings);
    sum += r;
    squares += r * r;
  }
  const double mean = sum / kHeadings;
  return std::sqrt(std::max(0.0, squares / kHeadings - mean * mean)) / (6.0 * m);
}

/// Figure 4.31: the cone, cut upright by its apex for m = 1, 3, 4, and level at four heights for 2 and 4.
void cone(Report& report, const Settings& settings) {
  const std::array<double, 4> heights_vox{20.5, 27.5, 33.5, 40.5};  // H1 and H4 as printed
  const std::array<const char*, 4> names{"H1", "H2", "H3", "H4"};
  const auto mesh = placed(geometry::make_cone(kTrackVoxel_m * 24.0, 0.0, kTrackVoxel_m * 44.0, 96),
                           kTrackVoxel_m * (kMiddle_vox - Eigen::Vector3d(0.0, 0.0, 8.0)));
  Plot& upright =
      report.plot("cone_upright", "A cone with six layers by spheres, cut by its apex (figure 4.31 a)", 3);
  Plot& level = report.plot(
      "cone_level",
      "The same cut at z = 20, 27, 33 and 40 voxels, m = 2 above, m = 4 below (figure 4.31 b, c)", 4);
  std::array<double, 5> mean{};
  for (int m = 1; m <= 4; ++m) {
    const auto workspace = layered(mesh, kSphere, m, settings);
    if (m != 2)
      section_panel(report, upright, named("upright", m), "cone_upright_" + std::to_string(m), workspace, 1,
                    kTrackVoxel_m * kMiddle_vox.y(), Shown::kLayer);
    for (std::size_t h = 0; h < heights_vox.size(); ++h) {
      mean[static_cast<std::size_t>(m)] += unroundness(workspace, heights_vox[h], m) / 4.0;
      if (m != 2 && m != 4) continue;
      section_panel(report, level, named(names[h], m), "cone_level_" + std::to_string(m) + "_" + names[h],
                    workspace, 2, kTrackVoxel_m * heights_vox[h], Shown::kLayer);
    }
  }
  Table& table = report.table("unroundness", {"m [voxels]", "share"});
  for (int m = 1; m <= 4; ++m) table.row({double(m), mean[static_cast<std::size_t>(m)]});
  upright.panel("outermost contour, mean of H1 to H4", "m [voxels]", "ratio of its radius' deviation to 6 m")
      .series(table, "m [voxels]", "share", "standard deviation", Style::kPoints)
      .range_y(0.0, 0.15);
  // "Fidelity of layer formation is better for higher m", by enough to be more than rounding.
  report.check("cone: unroundness with m = 4 ÷ that with m = 2", mean[4] / mean[2], 0.2, 0.9, "");
  report.check("cone: unroundness with m = 2 ÷ that with m = 1", mean[2] / mean[1], 0.2, 0.9, "");
}

/// The nearest layer to the body in a level section; 0 where the body itself is cut.
int nearest_layer(const workspace::Workspace& workspace, std::int32_t z) {
  const auto& grid = workspace.grid();
  int nearest = workspace::kMaxLayers;
  for (std::int32_t y = 0; y < grid.size_vox[1]; ++y) {
    for (std::int32_t x = 0; x < grid.size_vox[0]; ++x) {
      const int order = workspace.order({x, y, z});
      if (order >= workspace::kOrderBoundary) return 0;
      if (order > 0) nearest = std::min(nearest, order);
    }
  }
  return nearest;
}

/// Figure 4.32: μ at half height, and at two heights above the complex cylinder.
void elevated(Report& report, const Settings& settings) {
  constexpr int kM = 3;
  const auto workspace = layered(lobed(), kSphere, kM, settings);
  const auto& grid = workspace.grid();
  // The lowest voxels of layers 3 and 5 above the top.
  const std::array<double, 3> heights_vox{kMiddle_vox.z(), kTop_vox + 2 * kM + 1.5, kTop_vox + 4 * kM + 1.5};
  const std::array<const char*, 3> names{"half height", "above, in layer 3", "higher, in layer 5"};
  Plot& plot = report.plot("elevated",
                           "μ around the complex cylinder at three heights (figure 4.32), sphere of m = 3\n"
                           "μ = 32, 25, 20, 17, 15, 13 Pa·s/m, body 100",
                           2);
  Table& along = report.table("along_y", {"y [voxels]", "a [Pa·s/m]", "b [Pa·s/m]", "c [Pa·s/m]"});
  std::array<std::int32_t, 3> level{};
  for (std::size_t i = 0; i < 3; ++i) {
    section_panel(report, plot, names[i], std::string("mu_") + static_cast<char>('a' + i), workspace, 2,
                  kTrackVoxel_m * heights_vox[i], Shown::kMu);
    level[i] = grid.index_of(kTrackVoxel_m * Eigen::Vector3d(0.0, 0.0, heights_vox[i])).z;
  }
  // Through the tip of the lobe towards +y, where layers are stacked along an axis.
  workspace::Index3 tip{0, -1, level[0]};
  for (std::int32_t x = 0; x < grid.size_vox[0]; ++x) {
    for (std::int32_t y = 0; y < grid.size_vox[1]; ++y) {
      if (workspace.order({x, y, level[0]}) >= workspace::kOrderBoundary && y > tip.y) tip = {x, y, level[0]};
    }
  }
  int wrong = 0;
  for (std::int32_t i = 0; i < 6 * kM; ++i)
    wrong +=
        workspace.mu(tip + workspace::Index3{0, i + 1, 0}) == kMu[static_cast<std::size_t>(i / kM)] ? 0 : 1;
  for (std::int32_t y = 0; y < grid.size_vox[1]; ++y)
    along.row({grid.centre_of({0, y, 0}).y() / kTrackVoxel_m, workspace.mu({tip.x, y, level[0]}),
               workspace.mu({tip.x, y, level[1]}), workspace.mu({tip.x, y, level[2]})});
  plot.panel("along y, through a lobe's tip", "y [voxels]", "μ [Pa·s/m]")
      .series(along, "y [voxels]", "a [Pa·s/m]", names[0], Style::kStep)
      .series(along, "y [voxels]", "b [Pa·s/m]", names[1], Style::kStep)
      .series(along, "y [voxels]", "c [Pa·s/m]", names[2], Style::kStep);
  report.check("μ off a lobe's tip at half height: voxels of 18 without the μ of their layer", wrong, 0, 0,
               "");
  report.beside("b: layer nearest to the body that is seen", "figure 4.32, page 112", 3.0,
                nearest_layer(workspace, level[1]), 3.0, 3.0, "");
  report.beside("c: layer nearest to the body that is seen", "figure 4.32, page 112", 5.0,
                nearest_layer(workspace, level[2]), 5.0, 5.0, "");
}

void run(Report& report, const Settings& settings) {
  cubes(report, settings);
  spheres(report, settings);
  tube(report, settings);
  wedge(report, settings);
  cone(report, settings);
  elevated(report, settings);
  report.prints_no_more(
      "figures 4.26–4.31 (pages 106 to 110) are pictures of sections without scales. Taken from the text are m, the "
      "number of layers and the heights z = 20, 40 and 60.");
  report.difference(
      "\"Sphere\" is that of radius m + ½, whose size agrees with table 4.1. The thesis prints neither the sections "
      "of its bodies nor the heights of figure 4.32 b and c: ours are the lowest voxels of layers 3 and 5. Its "
      "cylinder has a narrow hollow A beside wider ones; ours has three of one width, and the bores of the "
      "experiment \"layers\" show that what is narrower than both sides' layers fills.");
}

}  // namespace
}  // namespace in_layer_sections

Experiment layer_sections() {
  return {
      "layer-sections",
      "Sections through layers",
      "figures 4.26–4.32",
      "By a cube outer layers depart from the body's shape, by a sphere hardly, the less the greater m; hollows "
      "and bores stay open; layers are of constant width; above a body its outer layers alone are met.",
      {Sabotage::kConstantMu, Sabotage::kLayersOffByOne, Sabotage::kGrownBodies, Sabotage::kCubicElements},
      in_layer_sections::run};
}

}  // namespace phantom::experiments
