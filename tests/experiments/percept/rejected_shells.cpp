// The ways of coding a body's neighbourhood that the thesis tries and rejects before it dilates voxels (4.4,
// 4.5.1): bars on its faces, scaled copies of it, its faces moved outwards. Where do they fail, and do layers
// by distance hold there? All on level sections at half the height of tall bodies.

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

#include "tests/experiments/percept/outlines.hpp"
#include "tests/experiments/percept/tracks.hpp"
#include "tests/experiments/specimens.hpp"

namespace phantom::experiments {
namespace in_rejected_shells {
namespace {

using Point = Eigen::Vector2d;

// Lengths are in voxels of 5 mm.
constexpr int kLayers = 6, kThickness_vox = 2;
constexpr double kReach_vox = kLayers * kThickness_vox, kHeight_vox = 32.0;
constexpr double kFrom_vox = 1.0;  // nearer places lie in voxels that the surface passes through
const Point kOff_vox{0.22, 0.14};  // off the lattice

struct Body {
  std::string name;
  Outline outline;
  geometry::TriangleMesh mesh_W;
};

/// A body drawn out of one polygon.
Body drawn(const std::string& name, std::vector<Point> corners_vox) {
  for (Point& corner : corners_vox) corner += kOff_vox;
  std::vector<Point> corners_m;
  for (const Point& corner : corners_vox) corners_m.push_back(kTrackVoxel_m * corner);
  return {name, {corners_vox}, drawn_polygon(corners_m, kTrackVoxel_m * kHeight_vox)};
}

Body tube(double outer_vox, double bore_vox) {
  Body body{"tube", {circle(outer_vox, 96), circle(bore_vox, 96)}, {}};
  std::reverse(body.outline[1].begin(), body.outline[1].end());
  for (auto& loop : body.outline) {
    for (Point& corner : loop) corner += kOff_vox;
  }
  body.mesh_W = placed(
      hollow_cylinder(kTrackVoxel_m * outer_vox, kTrackVoxel_m * bore_vox, kTrackVoxel_m * kHeight_vox),
      kTrackVoxel_m * Eigen::Vector3d(kOff_vox.x(), kOff_vox.y(), 0.0));
  return body;
}

/// An isosceles prism; its tip has the angle `theta_deg` and points along x.
Body sharp(double theta_deg) {
  const double half = 0.5 * theta_deg * std::numbers::pi / 180.0, flank_vox = 24.0;
  const Point low(-flank_vox * std::cos(half), -flank_vox * std::sin(half));
  return drawn("prism of " + std::to_string(static_cast<int>(theta_deg)) + "°",
               {Point(0.0, 0.0), Point(low.x(), -low.y()), low});
}

std::vector<Body> bodies() {
  return {drawn("circular cylinder", circle(16.0, 96)),
          drawn("cube", {{-16, -16}, {16, -16}, {16, 16}, {-16, 16}}),
          drawn("block of 2 : 1", {{-20, -10}, {20, -10}, {20, 10}, {-20, 10}}),
          drawn("angle", {{-20, -20}, {20, -20}, {20, -8}, {-8, -8}, {-8, 20}, {-20, 20}}),
          tube(26.0, 18.0),
          drawn("complex cylinder", complex_section(28.0))};
}

/// The layers at a place that a way of coding gives: none, one, or several that contradict each other.
using Coding = std::function<std::set<int>(const Point&)>;

int layer_of(double distance_vox) { return static_cast<int>(std::ceil(distance_vox / kThickness_vox)); }

/// Figure 4.16: a graded bar stands on every face, as wide as the face.
Coding bars_on(const Outline& outline) {
  return [outline](const Point& p) {
    std::set<int> layers;
    for_each_edge(outline, [&](const Point& a, const Point& b) {
      const double along = (p - a).dot((b - a).normalized()), height = (p - a).dot(outward(a, b));
      if (along >= 0.0 && along <= (b - a).norm() && height > 0.0 && height <= kReach_vox)
        layers.insert(layer_of(height));
    });
    return layers;
  };
}

/// Of nested bodies, each a layer larger, the first that holds the place.
Coding nested(std::vector<Outline> shells) {
  return [shells = std::move(shells)](const Point& p) -> std::set<int> {
    for (std::size_t n = 0; n < shells.size(); ++n) {
      if (is_inside(shells[n], p)) return {static_cast<int>(n) + 1};
    }
    return {};
  };
}

std::vector<Outline> shells_of(const Outline& outline, Outline (*one)(Outline, double)) {
  std::vector<Outline> shells;
  for (int n = 1; n <= kLayers; ++n) shells.push_back(one(outline, n * kThickness_vox));
  return shells;
}

/// Ours: by distance from the surface, as the product lays them.
struct Ours {
  workspace::Workspace workspace;
  std::int32_t z = 0;  // of the section

  Ours(const Body& body, const Settings& settings) {
    workspace::LayerProfile profile = layers({32, 25, 20, 17, 15, 13}, kThickness_vox);
    profile.method = workspace::LayerMethod::kSurface;
    const geometry::BoundingBox box = body.mesh_W.bounding_box();
    const Eigen::Array3d low_vox = (box.min_m.cast<double>() / kTrackVoxel_m).array().floor() - 16.0,
                         high_vox = (box.max_m.cast<double>() / kTrackVoxel_m).array().ceil() + 16.0;
    workspace = activate({{.name = body.name, .mesh_W = body.mesh_W, .profile = profile}},
                         track_grid(low_vox.matrix(), high_vox.matrix()), settings);
    z = workspace.grid().index_of(Eigen::Vector3d::Zero()).z;
  }
  /// Calls f(middle of the voxel, its order) for the section's voxels.
  template <class F>
  void for_each_place(F f) const {
    const auto& grid = workspace.grid();
    for (std::int32_t y = 0; y < grid.size_vox[1]; ++y) {
      for (std::int32_t x = 0; x < grid.size_vox[0]; ++x)
        f(Point(grid.centre_of({x, y, z}).head<2>() / kTrackVoxel_m), int{workspace.order({x, y, z})});
    }
  }
  Coding coding() const {
    return [this](const Point& p) -> std::set<int> {
      const Eigen::Vector3d p_m = kTrackVoxel_m * Eigen::Vector3d(p.x(), p.y(), 0.5);
      const int order = workspace.order(workspace.grid().index_of(p_m));
      return order > 0 && order <= kLayers ? std::set<int>{order} : std::set<int>{};
    };
  }
};

/// How far a distance lies outside of a layer, voxels.
double off_vox(int layer, double distance_vox) {
  return std::max({0.0, distance_vox - layer * kThickness_vox, (layer - 1) * kThickness_vox - distance_vox});
}

/// What a coding says of the places that truly lie within six layers; all shares of these.
struct Verdict {
  double none = 0.0, several = 0.0, wrong = 0.0;  // wrong: a layer more than half a voxel off
  double farthest_vox = 0.0;                      // true distance of what it codes
  double off_vox = 0.0;                           // greatest
};

Verdict judge(const Outline& outline, const Ours& section, const Coding& coding) {
  Verdict verdict;
  double places = 0.0;
  section.for_each_place([&](const Point& p, int) {
    if (is_inside(outline, p)) return;
    const double distance = distance_to(outline, p);
    if (distance < kFrom_vox) return;
    const std::set<int> layers = coding(p);
    if (!layers.empty()) verdict.farthest_vox = std::max(verdict.farthest_vox, distance);
    if (distance > kReach_vox) return;
    places += 1.0;
    if (layers.empty()) {
      verdict.none += 1.0;
    } else if (layers.size() > 1) {
      verdict.several += 1.0;
    } else {
      const double off = off_vox(*layers.begin(), distance);
      verdict.off_vox = std::max(verdict.off_vox, off);
      verdict.wrong += off > 0.5 ? 1.0 : 0.0;
    }
  });
  for (double* share : {&verdict.none, &verdict.several, &verdict.wrong}) *share /= places;
  return verdict;
}

/// The coding of a section as a panel: the layer, −1 in the body, 7 where layers contradict each other.
void draw(Report& report, Plot& plot, const std::string& title, const std::string& name, const Body& body,
          const Ours& section, const Coding& coding) {
  Table& table = report.table(name, {"x [voxels]", "y [voxels]", "layer"});
  section.for_each_place([&](const Point& p, int) {
    const auto layers = is_inside(body.outline, p) ? std::set<int>{-1} : coding(p);
    table.row({p.x(), p.y(), layers.empty() ? 0.0 : layers.size() > 1 ? kLayers + 1.0 : *layers.begin()});
  });
  plot.panel(title, "x [voxels]", "y [voxels]")
      .map(table, "x [voxels]", "y [voxels]", "layer", "layer (−1: body, 7: several)")
      .equal_axes();
}

/// Thickness of all shells together over the middle of every face, least and greatest, as a share of six
/// layers.
std::array<double, 2> thickness_share(const Outline& outline, const Coding& shells) {
  std::array<double, 2> share{INFINITY, 0.0};
  for_each_edge(outline, [&](const Point& a, const Point& b) {
    double s = 0.01;
    while (s < 3.0 * kReach_vox && !shells(0.5 * (a + b) + s * outward(a, b)).empty()) s += 0.01;
    const double thickness = s > 0.015 ? s / kReach_vox : 0.0;
    share = {std::min(share[0], thickness), std::max(share[1], thickness)};
  });
  return share;
}

/// Figure 4.16: beyond convex edges stands no bar, in hollows they cross.
void judge_bars(Report& report, const Body& cube, const Verdict& of_cube, const Body& angle,
                const Verdict& of_angle) {
  const double wide = kReach_vox - kFrom_vox,
               sector = 0.25 * std::numbers::pi * (kReach_vox * kReach_vox - kFrom_vox * kFrom_vox);
  // Steiner's formula: bars cover perimeter × width, and a quarter of a ring is bare at each corner.
  const double cube_none = 4.0 * sector / (perimeter_of(cube.outline) * wide + 4.0 * sector);
  // Five such corners. At the sixth two bars overlap in width × width, and agree on the squares of its
  // diagonal: what is left of layer 1, and five whole layers.
  const double angle_all =
      perimeter_of(angle.outline) * wide - 2.0 * kFrom_vox * wide - wide * wide + 5.0 * sector;
  const double agreed = std::pow(kThickness_vox - kFrom_vox, 2) + (kLayers - 1) * std::pow(kThickness_vox, 2);
  const double contradict = (wide * wide - agreed) / angle_all;
  report.check("bars: share of the places around a cube without a bar, less that by Steiner's formula",
               of_cube.none - cube_none, -0.02, 0.02, "");
  report.check("bars: share of the places around an angle where they contradict, less that by its area",
               of_angle.several - contradict, -0.01, 0.01, "");
  report.check("bars: share of the places around a cube without a bar", of_cube.none, 0.1, 0.5, "");
  report.check("bars: share of the places around an angle where they contradict", of_angle.several, 0.03, 0.2,
               "");
}

/// Figure 4.18: scaling serves bodies that are as far from their middle on all sides.
void judge_scaling(Report& report, const std::vector<Body>& all) {
  std::vector<double> least;
  Table& table = report.table("scaled", {"body", "least", "greatest"});
  Panel& panel = report
                     .plot("scaled_thickness",
                           "Thickness of a shell by scaling over the middles of a body's faces, least and "
                           "greatest (figure 4.18)")
                     .panel("", "body", "ratio of the thickness to 12 voxels");
  std::vector<std::string> names;
  for (const Body& body : all) {
    const auto share = thickness_share(body.outline, nested(shells_of(body.outline, scaled_up)));
    table.row({double(least.size()), share[0], share[1]});
    least.push_back(share[0]);
    names.push_back(body.name);
  }
  panel.series(table, "body", "least", "least", Style::kBars)
      .series(table, "body", "greatest", "greatest", Style::kBars)
      .names_x(names);
  report.check("scaling: least thickness ÷ wanted, of circular cylinder and cube (it works)",
               std::min(least[0], least[1]), 0.98, 1.02, "");
  report.check("scaling: the same of a block twice as long as wide", least[2], 0.48, 0.52, "");
  report.check("scaling: the same of an angle, whose inner faces look at its middle", least[3], 0.0, 0.01,
               "");
  report.check("scaling: the same in a tube's bore", least[4], 0.0, 0.01, "");
  // A face moves by its distance from the middle, n·p: at the flanks of the bays, r² ÷ √(r² + r′²) is at
  // least 0.33 of the lobes' r. A shell over a hollow is thinner yet, as it narrows outwards.
  report.check("scaling: the same in the bays of the complex cylinder", least[5], 0.0, 0.34, "");
}

/// Figure 4.20: over an edge of angle θ the moved faces meet at t ÷ sin(θ/2).
void judge_corners(Report& report, Plot& plot, const Settings& settings) {
  Table& table = report.table("corners", {"angle [°]", "moved faces", "ours", "t ÷ sin(θ/2)"});
  double off_law = 0.0, ours_vox = 0.0;
  for (const double theta_deg : {150.0, 120.0, 90.0, 60.0, 40.0, 25.0}) {
    const Body body = sharp(theta_deg);
    const Ours ours(body, settings);
    const double law = 1.0 / std::sin(0.5 * theta_deg * std::numbers::pi / 180.0);
    const Outline shell = moved_out(body.outline, kReach_vox);
    // Of the corner at the tip: the farthest that the shell reaches from the body along the tip's axis.
    double reach = 0.0;
    while (is_inside(shell, body.outline[0][0] + Point(reach + 0.01, 0.0))) reach += 0.01;
    const double by_ours = judge(body.outline, ours, ours.coding()).farthest_vox;
    table.row({theta_deg, reach / kReach_vox, by_ours / kReach_vox, law});
    off_law = std::max(off_law, std::abs(reach / kReach_vox / law - 1.0));
    ours_vox = std::max(ours_vox, by_ours - kReach_vox);
  }
  plot.panel("reach over an edge (figure 4.20)", "angle θ of the edge [°]", "ratio of the reach to 12 voxels")
      .series(table, "angle [°]", "moved faces", "moved faces", Style::kPoints)
      .series(table, "angle [°]", "t ÷ sin(θ/2)", "1 ÷ sin(θ/2)")
      .series(table, "angle [°]", "ours", "ours", Style::kPoints);
  report.check("moved faces: reach over an edge, 150° to 25°, greatest deviation from t ÷ sin(θ/2)", off_law,
               0.0, 0.01, "");
  report.check("ours: greatest reach over these edges beyond six layers", ours_vox, -0.5, 0.01, "voxels");
}

/// Section 4.5.1c: "residual error increases further as new approximating triangles are larger".
void judge_residual(Report& report) {
  const double R = 16.0;
  const int sides = 12;
  const auto residual = [R](const Outline& outline, double by_vox) {
    double greatest = -INFINITY, least = INFINITY;
    for_each_edge(outline, [&](const Point& a, const Point& b) {
      for (const double r : {a.norm(), (0.5 * (a + b)).norm()}) {
        greatest = std::max(greatest, r - R - by_vox);
        least = std::min(least, r - R - by_vox);
      }
    });
    return greatest - least;
  };
  const Outline polygon{circle(R, sides)};
  const double law = 1.0 + kReach_vox / (R * std::cos(std::numbers::pi / sides));
  const double grown = residual(moved_out(polygon, kReach_vox), kReach_vox) / residual(polygon, 0.0);
  report.check("moved faces: residual of a 12-gon against its circle, moved ÷ original, less 1 + t ÷ r",
               grown - law, -0.01, 0.01, "");
  report.check("the same, moved ÷ original", grown, 1.5, 2.0, "");
}

/// Edges of a moved outline that run against their originals: the shell is turned inside out there.
int turned_over(const Outline& outline, const Outline& shell) {
  int count = 0;
  for (std::size_t l = 0; l < outline.size(); ++l) {
    for (std::size_t i = 0; i < outline[l].size(); ++i) {
      const std::size_t j = (i + 1) % outline[l].size();
      count += (outline[l][j] - outline[l][i]).dot(shell[l][j] - shell[l][i]) < 0.0 ? 1 : 0;
    }
  }
  return count;
}

void run(Report& report, const Settings& settings) {
  const auto all = bodies();
  Plot& shares = report.plot(
      "failures",
      "Places within six layers of a body that get no layer, several, or one more than half a voxel off; and how far "
      "faces moved out reach over an edge");
  Table& table = report.table("failures", {"body", "bars [%]", "scaled [%]", "moved [%]", "ours [%]"});
  Plot& maps = report.plot("sections",
                           "Six layers of two voxels by the rejected ways and by ours: bars on the faces "
                           "(figure 4.16), scaled copies (4.18), moved faces (4.19, 4.20)",
                           3);
  std::vector<Verdict> bars;
  std::vector<std::string> names;
  double ours_off_vox = 0.0, ours_none = 0.0, least_bars = INFINITY, least_scaled = INFINITY;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Body& body = all[i];
    const Ours ours(body, settings);
    const std::array<Coding, 4> codings{bars_on(body.outline), nested(shells_of(body.outline, scaled_up)),
                                        nested(shells_of(body.outline, moved_out)), ours.coding()};
    std::vector<double> row{double(i)};
    for (const Coding& coding : codings) {
      const Verdict v = judge(body.outline, ours, coding);
      row.push_back(100.0 * (v.none + v.several + v.wrong));
      if (row.size() == 2) bars.push_back(v);
      if (row.size() < 5) continue;
      ours_off_vox = std::max(ours_off_vox, v.off_vox);
      ours_none = std::max(ours_none, v.none);
    }
    least_bars = std::min(least_bars, row[1]);
    if (i >= 3) least_scaled = std::min(least_scaled, row[2]);
    table.row(row);
    names.push_back(body.name);
    const auto panel = [&](std::size_t way, const char* words) {
      draw(report, maps, body.name + "\n" + words, "section_" + std::to_string(i) + "_" + std::to_string(way),
           body, ours, codings[way]);
    };
    if (i == 1 || i == 3) panel(0, "bars");
    if (i == 1 || i >= 3) panel(1, "scaled");
    if (i == 3 || i == 5) panel(2, "faces moved out");
    if (i == 3 || i == 5) panel(3, "ours");
  }
  const Body tip = sharp(25.0);
  const Ours around_tip(tip, settings);
  draw(report, maps, tip.name + "\nfaces moved out", "section_tip", tip, around_tip,
       nested(shells_of(tip.outline, moved_out)));
  shares.panel("by body", "body", "share of the places [%]")
      .series(table, "body", "bars [%]", "bars on the faces", Style::kBars)
      .series(table, "body", "scaled [%]", "scaled copies", Style::kBars)
      .series(table, "body", "moved [%]", "faces moved out", Style::kBars)
      .series(table, "body", "ours [%]", "ours, by distance", Style::kBars)
      .names_x(names);

  // A voxel's layer is that of its middle's distance, but for the single precision of the mesh.
  report.check("ours: greatest distance of a place from the layer it is given", ours_off_vox, 0.0, 1e-3,
               "voxels");
  report.check("ours: share of the places without a layer", ours_none, 0.0, 0.0, "");
  report.check("bars: places that they fail, least of the six bodies", least_bars, 5.0, 100.0, "%");
  // "Asymmetric and concave parts fail."
  report.check("scaling: places that it fails, least of angle, tube and complex cylinder", least_scaled, 10.0,
               100.0, "%");
  judge_bars(report, all[1], bars[1], all[3], bars[3]);
  judge_scaling(report, all);
  judge_corners(report, shares, settings);
  judge_residual(report);
  report.check("moved faces: edges of the complex cylinder that are turned over in its bays, of 56",
               turned_over(all[5].outline, moved_out(all[5].outline, kReach_vox)), 1, 40, "");
  report.prints_no_more(
      "sections 4.4 and 4.5.1 (pages 92 to 97) judge these ways in words and draw them without measures.");
  report.difference(
      "The thesis calls scaling right for bodies that are symmetric about their middle. Over a cube's edges a scaled "
      "shell is thicker by up to √2, which it does not say: those places count as wrong here. Our sections are two-dimensional: at a "
      "body's corners all three ways err more.");
}

}  // namespace
}  // namespace in_rejected_shells

Experiment rejected_shells() {
  return {
      "rejected-shells",
      "Rejected ways of forming layers",
      "figures 4.16, 4.18–4.20",
      "Bars on a body's faces leave gaps over edges and cross in hollows; scaled copies serve symmetric convex "
      "bodies alone; faces moved out reach too far over edges, the farther the sharper, and enlarge the "
      "mesh's error. Layers by distance have none of these faults.",
      {Sabotage::kLayersOffByOne, Sabotage::kGrownBodies},
      in_rejected_shells::run};
}

}  // namespace phantom::experiments
