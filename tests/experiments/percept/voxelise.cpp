// A wedge block with a V groove and a cone become voxels (thesis 4.3.3c): is the volume right, are the
// sections the shape's?

#include "common/voxelise/voxelise.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/mesh/stl.hpp"
#include "tests/experiments/rig.hpp"
#include "tests/experiments/specimens.hpp"
#include "tests/support/child_process.hpp"

namespace phantom::experiments {
namespace in_voxelise {
namespace {

const Eigen::Vector3d kWedge_m{0.20, 0.14, 0.12};
const Eigen::Vector2d kGroove_m{0.07, 0.12};  // depth, width at the top
constexpr double kTaper_m = 0.02, kConeRadius_m = 0.08, kConeHeight_m = 0.16;
constexpr int kConeSides = 192;

struct Solid {
  const char* name;
  geometry::TriangleMesh mesh;
  double volume_m3;
};

/// Both off the lattice of every voxel size used.
std::vector<Solid> solids() {
  const Eigen::Vector3d off{0.00113, -0.00071, 0.00089};
  const auto cone = geometry::make_cone(kConeRadius_m, 0.0, kConeHeight_m, kConeSides);
  return {{"wedge", placed(wedge_block(kWedge_m, kGroove_m, kTaper_m), off),
           wedge_volume_m3(kWedge_m, kGroove_m, kTaper_m)},
          {"cone", placed(cone, off), geometry::enclosed_volume_m3(cone)}};
}

struct Voxels {
  workspace::GridSpec grid;
  voxelise::SolidVoxels solid;
};

Voxels voxels_of(const geometry::TriangleMesh& mesh, double voxel_m, const Settings& settings) {
  Voxels result{layers::grid_over({-0.13, -0.11, -0.11}, {0.13, 0.11, 0.11}, voxel_m), {}};
  result.solid = must(voxelise::voxelise(sabotaged(mesh, voxel_m, settings.sabotage), result.grid,
                                         workspace::VoxelBox::of(result.grid)));
  return result;
}

/// Boundary and interior voxels that the shipped `wva_server activate` makes of a mesh.
std::array<std::size_t, 2> by_executable(const geometry::TriangleMesh& mesh, double voxel_m,
                                         const std::filesystem::path& folder, const Settings& settings) {
  const auto stl = folder / "solid.stl";
  const auto bytes = geometry::binary_stl(mesh);
  std::ofstream(stl, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  const auto said = test::run_line((settings.bin_dir / "wva_server").string() + " activate --mesh " +
                                   stl.string() + " --scale 1 --up-axis z --layers 1 --mu 1 --voxel-size-m " +
                                   std::to_string(voxel_m) + " --export " + (folder / "solid.nrrd").string());
  std::filesystem::remove(folder / "solid.nrrd");
  std::filesystem::remove(stl);
  const auto json = said.output.find('{');
  if (said.exit_code != 0 || json == std::string::npos) throw std::runtime_error("voxelise: " + said.output);
  const auto object = nlohmann::json::parse(said.output.substr(json)).at("objects").at(0);
  return {object.at("boundary_voxels"), object.at("interior_voxels")};
}

/// 0 free, 1 interior, 2 boundary.
double kind_of(const voxelise::SolidVoxels& solid, std::array<std::int32_t, 3> v) {
  const std::array<std::int32_t, 3> at{v[0] - solid.box.min.x, v[1] - solid.box.min.y,
                                       v[2] - solid.box.min.z};
  for (std::size_t i = 0; i < 3; ++i) {
    if (at[i] < 0 || at[i] >= solid.box.size[i]) return 0.0;
  }
  if (solid.boundary.get(at[0], at[1], at[2])) return 2.0;
  return solid.is_interior(at[0], at[1], at[2]) ? 1.0 : 0.0;
}

void draw_section(Report& report, Plot& plot, const std::string& title, const std::string& name,
                  const Voxels& voxels, int normal, double at_m) {
  const std::array<std::string, 3> axes{"x [mm]", "y [mm]", "z [mm]"};
  const auto u = static_cast<std::size_t>(normal == 0 ? 1 : 0),
             v = static_cast<std::size_t>(normal == 2 ? 1 : 2);
  Table& table = report.table(name, {axes[u], axes[v], "kind"});
  Eigen::Vector3d through = voxels.grid.origin_m;
  through[normal] = at_m;
  const workspace::Index3 first = voxels.grid.index_of(through);
  std::array<std::int32_t, 3> at{first.x, first.y, first.z};
  for (at[v] = 0; at[v] < voxels.grid.size_vox[v]; ++at[v]) {
    for (at[u] = 0; at[u] < voxels.grid.size_vox[u]; ++at[u]) {
      const Eigen::Vector3d centre_mm = 1e3 * voxels.grid.centre_of({at[0], at[1], at[2]});
      table.row({centre_mm[static_cast<int>(u)], centre_mm[static_cast<int>(v)], kind_of(voxels.solid, at)});
    }
  }
  plot.panel(title, axes[u], axes[v])
      .map(table, axes[u], axes[v], "kind", "0 free, 1 interior, 2 boundary")
      .equal_axes();
}

/// Area of the section that the wedge's outline has at a height above its middle.
double wedge_width_m(double z_m) {
  const double half_height_m = 0.5 * kWedge_m.z(), up = (z_m + half_height_m) / kWedge_m.z();
  const double into_groove_m = z_m - (half_height_m - kGroove_m.x());
  const double groove_m = into_groove_m > 0.0 ? into_groove_m / kGroove_m.x() * kGroove_m.y() : 0.0;
  return kWedge_m.x() - 2.0 * kTaper_m * up - groove_m;
}

/// Cone and wedge height by height: the section's size by voxels whose centres are inside, and by the shape's
/// formula. The greatest difference, in voxels.
double compare_sections(Table& table, const Voxels& cone, const Voxels& wedge) {
  const double s = cone.grid.voxel_size_m.reference_m(), z0 = 0.00089;  // where solids() put them
  double worst = 0.0;
  for (std::int32_t k = 0; k < cone.grid.size_vox[2]; ++k) {
    const double z_m = cone.grid.centre_of({0, 0, k}).z() - z0;
    const auto area = [&](const voxelise::SolidVoxels& solid) {
      const std::int32_t z = k - solid.box.min.z;
      if (z < 0 || z >= solid.box.size[2]) return 0.0;
      double voxels = 0.0;
      for (std::int32_t y = 0; y < solid.box.size[1]; ++y) {
        for (std::int32_t x = 0; x < solid.box.size[0]; ++x) voxels += solid.inside.get(x, y, z) ? 1.0 : 0.0;
      }
      return voxels * s * s;
    };
    const bool in_cone = std::abs(z_m) < 0.5 * kConeHeight_m, in_wedge = std::abs(z_m) < 0.5 * kWedge_m.z();
    const double radius = in_cone ? kConeRadius_m * (0.5 - z_m / kConeHeight_m) : 0.0;
    const double width = in_wedge ? wedge_width_m(z_m) : 0.0;
    const double radius_vox = std::sqrt(area(cone.solid) / std::numbers::pi);
    // The wedge's rows along y are all alike: its length in whole voxels.
    const double width_vox = area(wedge.solid) / kWedge_m.y();
    table.row({1e3 * z_m, 1e3 * radius, 1e3 * radius_vox, 1e3 * width, 1e3 * width_vox});
    worst = std::max({worst, std::abs(radius - radius_vox) / s, std::abs(width - width_vox) / s});
  }
  return worst;
}

void run(Report& report, const Settings& settings) {
  const std::vector<double> sizes_mm =
      settings.fast ? std::vector<double>{10, 5, 4} : std::vector<double>{10, 5, 4, 2.5, 2, 1};
  Table& volumes = report.table(
      "volumes", {"solid", "voxel [mm]", "exact [cm³]", "interior [cm³]", "interior and boundary [cm³]",
                  "centres inside [cm³]", "place between [fraction]"});
  double lowest = 1.0, highest = 0.0, worst_centres = 0.0, by_executable_differs = 0.0;
  std::size_t turned = 0;
  Plot& plot = report.plot(
      "volume",
      "Volume of the voxels against the exact one: the shell of boundary voxels holds the difference", 2);
  for (const Solid& solid : solids()) {
    Table& drawn = report.table(std::string("volume_") + solid.name,
                                {"voxel [mm]", "interior", "with boundary", "centres inside"});
    for (const double size_mm : sizes_mm) {
      const Voxels voxels = voxels_of(solid.mesh, 1e-3 * size_mm, settings);
      const double cell_m3 = std::pow(1e-3 * size_mm, 3);
      const double interior = cell_m3 * static_cast<double>(voxels.solid.interior().count());
      const double boundary = cell_m3 * static_cast<double>(voxels.solid.boundary.count());
      const double centres = cell_m3 * static_cast<double>(voxels.solid.inside.count());
      const double place = (solid.volume_m3 - interior) / boundary;
      volumes.row({solid.name[0] == 'w' ? 0.0 : 1.0, size_mm, 1e6 * solid.volume_m3, 1e6 * interior,
                   1e6 * (interior + boundary), 1e6 * centres, place});
      drawn.row({size_mm, interior / solid.volume_m3, (interior + boundary) / solid.volume_m3,
                 centres / solid.volume_m3});
      if (size_mm == 5.0 ||
          size_mm == 10.0) {  // of which the grid's corner is a multiple, as the executable's is
        const auto [outer, inner] = by_executable(sabotaged(solid.mesh, 1e-3 * size_mm, settings.sabotage),
                                                  1e-3 * size_mm, report.folder(), settings);
        by_executable_differs += static_cast<double>(outer != voxels.solid.boundary.count()) +
                                 static_cast<double>(inner != voxels.solid.interior().count());
      }
      lowest = std::min(lowest, place);
      highest = std::max(highest, place);
      if (size_mm <= 5.0) worst_centres = std::max(worst_centres, std::abs(centres / solid.volume_m3 - 1.0));
      turned += voxels.solid.report.turned_triangles + (voxels.solid.report.closed ? 0U : 1U);
    }
    Panel& panel = plot.panel(solid.name[0] == 'w' ? "wedge block with a V groove" : "cone",
                              "voxel size [mm]", "ratio to the exact volume");
    panel.series(drawn, "voxel [mm]", "interior", "interior")
        .series(drawn, "voxel [mm]", "with boundary", "interior and boundary")
        .series(drawn, "voxel [mm]", "centres inside", "voxels whose centres are inside", Style::kPoints)
        .horizontal(1.0, "exact");
  }
  const auto all = solids();
  const double voxel_m = 0.004;
  const Voxels wedge = voxels_of(all[0].mesh, voxel_m, settings),
               cone = voxels_of(all[1].mesh, voxel_m, settings);
  Plot& drawn = report.plot("sections",
                            "Voxels of 4 mm: wedge block 200 × 140 × 120 mm with a groove 70 mm deep; "
                            "cone of radius 80 mm, height 160 mm",
                            2);
  draw_section(report, drawn, "wedge, across the groove (figure 4.13)", "wedge_xz", wedge, 1, 0.0);
  draw_section(report, drawn, "wedge, above the groove's bottom", "wedge_xy", wedge, 2, 0.03);
  draw_section(report, drawn, "cone, through its apex (figure 4.14 a)", "cone_xz", cone, 1, 0.0);
  draw_section(report, drawn, "cone, near its base (b)", "cone_xy_1", cone, 2, -0.07);
  draw_section(report, drawn, "cone, at half its height (c)", "cone_xy_2", cone, 2, 0.0);
  draw_section(report, drawn, "cone, near its apex (d)", "cone_xy_3", cone, 2, 0.06);
  Table& table =
      report.table("section_sizes", {"height [mm]", "cone radius, exact [mm]", "cone radius, voxels [mm]",
                                     "wedge width, exact [mm]", "wedge width, voxels [mm]"});
  const double section_error_vox = compare_sections(table, cone, wedge);
  report
      .plot("section_sizes",
            "Size of horizontal sections by the voxels of 4 mm whose centres are inside, "
            "against the shape's formula")
      .panel("", "height above the middle [mm]", "size [mm]")
      .series(table, "height [mm]", "cone radius, exact [mm]", "cone radius, exact")
      .series(table, "height [mm]", "cone radius, voxels [mm]", "cone radius, voxels", Style::kPoints)
      .series(table, "height [mm]", "wedge width, exact [mm]", "wedge width without groove, exact")
      .series(table, "height [mm]", "wedge width, voxels [mm]", "wedge width, voxels", Style::kPoints);

  report.prints_no_more(
      "figures 4.13 and 4.14 (pages 91 and 92) are pictures of voxels; the text states neither sizes nor counts of them, nor volumes or times. "
      "The exact volumes and sections are the shapes' own formulas.");
  // The statement itself: interior ≤ exact ≤ interior and boundary, for every size.
  report.check("exact volume between interior (0) and interior and boundary (1), lowest", lowest, 0, 1, "");
  report.check("exact volume between interior (0) and interior and boundary (1), highest", highest, 0, 1, "");
  // Along each axis a row of voxels is right to half a voxel, one way or the other; on the wedge.s 24 voxels
  // of height 2 %.
  report.check("volume of voxels whose centres are inside, greatest error at ≤ 5 mm", worst_centres, 0, 0.03,
               "");
  // A row of voxels begins and ends within half a voxel of the surface; the wedge's ends along y and z add as
  // much.
  report.check("size of sections: greatest error", section_error_vox, 0, 1.5, "voxels");
  report.check("wva_server activate: counts of voxels that differ from these", by_executable_differs, 0, 0,
               "");
  report.check("triangles that had to be mended", static_cast<double>(turned), 0, 0, "");
}

}  // namespace
}  // namespace in_voxelise

Experiment voxelise() {
  return {"voxelise",
          "Voxels of a wedge block and a cone",
          "figures 4.13, 4.14",
          "A wedge block and a cone become voxels correctly: the sections have the shape's form, and the "
          "cone's diameter "
          "changes from bottom to top as it should.",
          {Sabotage::kGrownBodies},
          in_voxelise::run};
}

}  // namespace phantom::experiments
