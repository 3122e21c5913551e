// The thesis's lean computation of where an arm's sensors are (appendix B) and how far from a joint's axis
// (C.17 to C.21): are the places and the torque those of the product, and what does the computation cost?

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "common/runtime/cell/arm_model.hpp"
#include "components/phantom_sensing/model.hpp"
#include "tests/experiments/arms/bar_rig.hpp"
#include "tests/experiments/rig.hpp"

namespace phantom::experiments {
namespace in_lean_sensors {
namespace {

constexpr int kSides = 12, kRings = 58;  // of the link's skin: K + 1 rings, below a voxel apart
constexpr double kSwing_deg_s = 5.0;

/// Operations, in the thesis's units (appendix B, "Calculations involved").
struct Counts {
  int add = 0, multiply = 0, divide = 0, root = 0;
  double fpc() const { return add + 2.0 * multiply + 23.0 * divide + 23.0 * root; }
};

/// A number that counts what is done with it.
struct Counted {
  double value = 0.0;
  static Counts done;
  friend Counted operator+(Counted a, Counted b) { return ++done.add, Counted{a.value + b.value}; }
  friend Counted operator-(Counted a, Counted b) { return ++done.add, Counted{a.value - b.value}; }
  friend Counted operator*(Counted a, Counted b) { return ++done.multiply, Counted{a.value * b.value}; }
  friend Counted operator/(Counted a, Counted b) { return ++done.divide, Counted{a.value / b.value}; }
  friend Counted root(Counted a) { return ++done.root, Counted{std::sqrt(a.value)}; }
};
Counts Counted::done;

using Triple = std::array<Counted, 3>;

Triple triple(const Eigen::Vector3d& p) { return {{{p.x()}, {p.y()}, {p.z()}}}; }
Triple operator+(const Triple& a, const Triple& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Triple operator-(const Triple& a, const Triple& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Counted dot(const Triple& a, const Triple& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

enum class Spin { kRecovered, kAsPrinted };

/// A segment's pose from three of its points (appendix B, steps 1 to 3): P1 and P2 are the ends of its axis,
/// P3 the first corner of the section at P2. At home P2 is the origin, the axis from P1 to P2 lies along x
/// and P3 along y.
class RecoveredPose {
 public:
  RecoveredPose(const Triple& P1, const Triple& P2, const Triple& P3, Spin spin) : shift_(P2) {
    const auto [u, v, w] = P2 - P1;
    const Counted across2 = u * u + w * w, across = root(across2), length = root(across2 + v * v);
    const Counted c = u / across, s = w / across, cz = across / length, sz = v / length;
    const Counted none{0.0}, minus_sz{-sz.value}, minus_s{-s.value};  // a sign costs nothing
    const Triple x{cz * c, sz, cz * s}, y{minus_sz * c, cz, minus_sz * s}, z{minus_s, none, c};
    const Triple first = P3 - P2;
    const Counted v2 = dot(y, first), w2 = dot(z, first), radius = root(v2 * v2 + w2 * w2);
    Counted a = v2 / radius, b = w2 / radius;
    if (spin == Spin::kAsPrinted) {  // cos ψ = √(v2² + w2²) / √(u2² + v2² + w2²)
      const Counted u2 = dot(x, first), whole = root(u2 * u2 + v2 * v2 + w2 * w2);
      a = radius / whole, b = u2 / whole;
    }
    const Counted minus_b{-b.value};
    axes_ = {x, Triple{a * y[0] + b * z[0], a * y[1] + b * z[1], a * y[2] + b * z[2]},
             Triple{minus_b * y[0] + a * z[0], minus_b * y[1] + a * z[1], minus_b * y[2] + a * z[2]}};
  }
  /// Where a point at (0, y, z) of home is now.
  Triple of_section(Counted y, Counted z) const {
    Triple p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = axes_[1][i] * y + axes_[2][i] * z + shift_[i];
    return p;
  }

 private:
  Triple shift_;
  std::array<Triple, 3> axes_;
};

struct Section {
  double radius_m = kSkinRadius_m;
  /// Corners at home, which are known beforehand.
  std::array<Eigen::Vector2d, kSides> corners() const {
    std::array<Eigen::Vector2d, kSides> all;
    for (int p = 0; p < kSides; ++p) {
      const double psi = 2.0 * std::numbers::pi * p / kSides;
      all[static_cast<std::size_t>(p)] = radius_m * Eigen::Vector2d(std::cos(psi), std::sin(psi));
    }
    return all;
  }
};

/// Every sensor of a segment of one section (type 1): corners at P2 by the pose, those at P1 by a shift,
/// those between by interpolation. Line by line, from P1 to P2.
std::vector<Eigen::Vector3d> lean_places(const Eigen::Vector3d& P1, const Eigen::Vector3d& P2,
                                         const Eigen::Vector3d& P3, int rings, Spin spin,
                                         Counts* recovery = nullptr, Counts* all = nullptr) {
  Counted::done = {};
  const RecoveredPose pose(triple(P1), triple(P2), triple(P3), spin);
  if (recovery != nullptr) *recovery = Counted::done;
  const Triple along = triple(P2) - triple(P1);
  const Counted share{1.0 / (rings - 1)};
  const Triple step{along[0] * share, along[1] * share, along[2] * share};
  std::vector<Eigen::Vector3d> places;
  for (const Eigen::Vector2d& corner : Section{}.corners()) {
    const Triple bottom = pose.of_section({corner.x()}, {corner.y()});
    Triple place = bottom - along;
    for (int k = 0; k < rings; ++k) {
      places.emplace_back(place[0].value, place[1].value, place[2].value);
      if (k + 1 < rings) place = place + step;
    }
  }
  if (all != nullptr) *all = Counted::done;
  return places;
}

/// The link's skin by the product: rings of twelve sensors.
phantom_sensing::PhantomModel ringed(const runtime::ArmConfig& config, double voxel_size_m) {
  auto arm = runtime::load_arm(config);
  robot::SkinSegment segment;
  segment.from_m = {-kLink_m, 0.0, 0.0};
  segment.from_radius_m = segment.to_radius_m = kSkinRadius_m;
  segment.sides = kSides;
  segment.rings = kRings;
  auto skin = must(
      robot::lay_out_skin(arm, {{.link = "link_under_test", .segments = {segment}, .axes = {}, .meshes = {}}},
                          {.voxel_size_m = voxel_size_m, .pitch_vox = 2.0}));
  return {std::move(arm), std::move(skin), {}};
}

/// The three points of the link from which its pose is recovered, in W.
struct ThreePoints {
  Eigen::Vector3d P1, P2, P3;
};
ThreePoints points_of(const phantom_sensing::PhantomModel& model, const robot::LinkPoses& X_WL) {
  const auto [link, X_LF] = model.arm.find_frame("link_under_test").value();
  const geometry::Pose X_WF = X_WL[link] * X_LF;
  return {X_WF * Eigen::Vector3d(-kLink_m, 0.0, 0.0), X_WF * Eigen::Vector3d::Zero(),
          X_WF * Eigen::Vector3d(0.0, kSkinRadius_m, 0.0)};
}

/// Greatest distance of a recovered place from the nearest of the product's.
double greatest_off_m(const phantom_sensing::PhantomModel& model, const robot::LinkPoses& X_WL,
                      const std::vector<Eigen::Vector3d>& places) {
  double off_m = places.size() == model.skin.size() ? 0.0 : 1.0;
  for (const Eigen::Vector3d& place : places) {
    double nearest_m = 1.0;
    for (std::size_t i = 0; i < model.skin.size(); ++i)
      nearest_m = std::min(nearest_m, (X_WL[model.skin.link_of(i)] * model.skin.position(i) - place).norm());
    off_m = std::max(off_m, nearest_m);
  }
  return off_m;
}

/// Appendix B: the same places as the product's at random poses, also of the base.
void recover(Report& report, const Settings& settings) {
  const auto cell = bar_cell(settings);
  std::mt19937_64 random(27);
  std::uniform_real_distribution<double> turn(-std::numbers::pi, std::numbers::pi), swing_rad(0.0, 1.2);
  double off_m = 0.0, printed_off_m = 0.0;
  Counts recovery, all;
  for (int i = 0; i < (settings.fast ? 10 : 40); ++i) {
    auto config = cell.arm();
    config.X_WB.rotation = geometry::rotation_from_rpy(turn(random), 0.5 * turn(random), turn(random));
    const auto model = ringed(config, cell.voxel_size_m.reference_m());
    core::JointArray q{turn(random), swing_rad(random), 0.0};
    robot::LinkPoses X_WL;
    model.arm.link_poses(q, X_WL);
    const auto [P1, P2, P3] = points_of(model, X_WL);
    off_m = std::max(
        off_m,
        greatest_off_m(model, X_WL, lean_places(P1, P2, P3, kRings, Spin::kRecovered, &recovery, &all)));
    // By one line of sensors: corners of a ring turned by any angle come near one another again.
    const auto printed = lean_places(P1, P2, P3, kRings, Spin::kAsPrinted);
    printed_off_m = std::max(printed_off_m, (printed[kRings - 1] - P3).norm());
  }
  Table& costs = report.table("cost", {"rings", "sensors", "every sensor by a matrix [FPC]", "lean [FPC]"});
  double least_gain = 1e9;
  for (int rings = 2; rings <= 90; rings += 4) {
    Counts of_rings;
    lean_places({0, 0, 0}, {0.3, 0.4, 0.2}, {0.3, 0.4, 0.23}, rings, Spin::kRecovered, nullptr, &of_rings);
    const double sensors = rings * kSides, by_matrix = 27.0 * sensors;  // 9 products, 9 sums each
    costs.row({static_cast<double>(rings), sensors, by_matrix, of_rings.fpc()});
    if (rings >= 30) least_gain = std::min(least_gain, by_matrix / of_rings.fpc());
  }
  report
      .plot("cost", "Cost of placing a link's sensors, twelve around each ring, in the units of appendix B",
            1)
      .panel("", "number of sensors", "computing load [FPC]")
      .series(costs, "sensors", "every sensor by a matrix [FPC]", "every sensor by the link's matrix")
      .series(costs, "sensors", "lean [FPC]", "pose recovered, corners, interpolation (appendix B)");
  report.beside("recovery of a link's pose", "section \"Calculations involved\", appendix B", 223.0,
                recovery.fpc(), 0.8 * 223.0, 1.3 * 223.0, "FPC");
  report.check("places by appendix B: greatest distance from the product's sensors", off_m, 0.0, 1e-9, "m");
  report.check("every sensor by a matrix: its cost over the lean one's, from 30 rings on", least_gain, 3.0,
               9.0, "");
  report.check("step 3 as it is printed loses the spin: greatest distance of the first corner, in radii",
               printed_off_m / kSkinRadius_m, 1.0, 2.0, "");
}

/// Drag coefficient of theta by places and lengths without roots or products per sensor, N·m·s/rad.
struct LeanCoefficients {
  double linear = 0.0;   ///< lengths by C.17
  double squared = 0.0;  ///< their squares interpolated, C.20 and C.21
};
LeanCoefficients lean_coefficients(const phantom_sensing::PhantomModel& model,
                                   const workspace::Workspace& workspace, double theta_rad) {
  core::JointArray q{};
  q[kTheta] = theta_rad;
  robot::LinkPoses X_WL;
  model.arm.link_poses(q, X_WL);
  const auto [P1, P2, P3] = points_of(model, X_WL);
  const auto places = lean_places(P1, P2, P3, kRings, Spin::kRecovered);
  const Eigen::Vector3d axis = model.arm.axis_W(kTheta, X_WL), on_axis = model.arm.axis_point_W(kTheta, X_WL);
  const auto length_m = [&](const Eigen::Vector3d& p) { return axis.cross(p - on_axis).norm(); };
  const double area_m2 = 2.0 * std::numbers::pi * kSkinRadius_m * kLink_m / (kSides * (kRings - 1));
  LeanCoefficients sum;
  for (std::size_t line = 0; line < kSides; ++line) {
    const std::size_t first = line * kRings;
    const double from_m = length_m(places[first]), to_m = length_m(places[first + kRings - 1]);
    for (std::size_t k = 0; k < kRings; ++k) {
      const double share = static_cast<double>(k) / (kRings - 1), end = k == 0 || k + 1 == kRings ? 0.5 : 1.0;
      const double mu = static_cast<double>(workspace.mu(workspace.grid().index_of(places[first + k])));
      sum.linear += end * area_m2 * mu * std::pow(from_m + share * (to_m - from_m), 2);
      sum.squared += end * area_m2 * mu * (from_m * from_m + share * (to_m * to_m - from_m * from_m));
    }
  }
  return sum;
}

/// N·m·s/rad of a skin without gaps in fluid without voxels.
double ideal_of_link(const workspace::LayerProfile& profile, double voxel_m, double theta_rad) {
  constexpr int kAlong = 570, kAround = 72;
  double sum = 0.0;
  for (int i = 0; i < kAlong; ++i) {
    const double r = (i + 0.5) * kLink_m / kAlong;
    for (int k = 0; k < kAround; ++k) {
      const double across = kSkinRadius_m * std::cos(2.0 * std::numbers::pi * (k + 0.5) / kAround);
      sum += ideal_mu(profile, voxel_m, bar_distance_m(r, theta_rad, across)) * (r * r + across * across);
    }
  }
  return sum * 2.0 * std::numbers::pi * kSkinRadius_m * kLink_m / kAlong / kAround;
}

double rms_of_peak(const std::vector<double>& a, const std::vector<double>& b) {
  double square = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) square += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(square / static_cast<double>(a.size())) / *std::max_element(b.begin(), b.end());
}

/// C.17: the link swings towards the bar.
void swing_lean(Report& report, const Settings& settings) {
  const auto cell = bar_cell(settings);
  const auto workspace = phantom_sensing::build_workspace(cell);
  const auto profile = bar_cell({.source_dir = settings.source_dir}).objects.front().profile;
  const auto model = ringed(cell.arm(), cell.voxel_size_m.reference_m());
  std::vector<double> angles_deg, linear, squared, ideal;
  for (double angle_deg = 0.0; angle_deg <= 36.0; angle_deg += settings.fast ? 1.0 : 0.5)
    angles_deg.push_back(angle_deg);
  const double speed = sabotaged(rad(kSwing_deg_s), settings.sabotage);
  const auto product = swing(model, workspace, angles_deg, speed);
  Table& table =
      report.table("torque", {"θ [°]", "product [N·m]", "C.17 [N·m]", "C.20 [N·m]", "ideal [N·m]"});
  for (std::size_t i = 0; i < angles_deg.size(); ++i) {
    const auto lean = lean_coefficients(model, workspace, rad(angles_deg[i]));
    linear.push_back(lean.linear * speed), squared.push_back(lean.squared * speed);
    ideal.push_back(ideal_of_link(profile, cell.voxel_size_m.reference_m(), rad(angles_deg[i])) *
                    rad(kSwing_deg_s));
    table.row({angles_deg[i], product[i], linear[i], squared[i], ideal[i]});
  }
  double over = 0.0;
  for (std::size_t i = 0; i < angles_deg.size(); ++i) {
    if (product[i] > 0.1 * product.back()) over = std::max(over, squared[i] / product[i] - 1.0);
  }
  report
      .plot(
          "torque",
          "Torque on θ by lean lengths and by the product, 5 °/s; link of 57 cm and 3 cm radius before the bar\n"
          "voxel 1 cm, six layers of 4 cm with μ = 32, 20, 13, 11, 10, 8 Pa·s/m, skin 100",
          1)
      .panel("", "θ [°]", "torque on θ [N·m]")
      .series(table, "θ [°]", "product [N·m]", "product")
      .series(table, "θ [°]", "C.17 [N·m]", "lengths interpolated (C.17)", Style::kDashed)
      .series(table, "θ [°]", "C.20 [N·m]", "their squares interpolated (C.20, C.21)")
      .series(table, "θ [°]", "ideal [N·m]", "skin without gaps, fluid without voxels", Style::kDashed);
  // A line of the skin passes the axis 3 cm off: its true length is not linear near there.
  report.check("lengths by C.17: rms deviation of the torque from the product's, share of the peak",
               rms_of_peak(linear, product), 0.0, 0.02, "");
  report.check("lengths by C.17: rms deviation from the skin without gaps, share of the peak",
               rms_of_peak(linear, ideal), 0.0, 0.03, "");
  // Along a line from the axis, ∫ r² is L³/3; with r² interpolated from 0 to L² it is L³/2.
  report.check("squares interpolated (C.20, C.21): greatest excess of the torque over the product's", over,
               0.1, 0.55, "");
}

/// C.17 where the link passes the joint's axis: a distance is convex along a line, so interpolation never
/// falls short.
void pass_the_axis(Report& report) {
  constexpr int kSteps = 200;
  Panel& panel =
      report.plot("skew", "Distance from a joint's axis along a link of 57 cm that starts beside it", 1)
          .panel("", "along the link [mm]", "torque-exerting length [mm]");
  double least_m = 1.0, worst = 0.0, at_axis = 0.0;
  for (const double beside_m : {0.0, 0.05, 0.1, 0.2}) {
    Table& table = report.table("beside_" + std::to_string(static_cast<int>(1e3 * beside_m)),
                                {"along [mm]", "true [mm]", "C.17 [mm]"});
    double of_true = 0.0, of_linear = 0.0;
    for (int i = 0; i <= kSteps; ++i) {
      const double share = static_cast<double>(i) / kSteps, along_m = kLink_m * share;
      const double true_m = std::hypot(beside_m, along_m),
                   linear_m = beside_m + share * (std::hypot(beside_m, kLink_m) - beside_m);
      table.row({1e3 * along_m, 1e3 * true_m, 1e3 * linear_m});
      least_m = std::min(least_m, linear_m - true_m);
      of_true += true_m * true_m, of_linear += linear_m * linear_m;
    }
    panel
        .series(table, "along [mm]", "true [mm]",
                "true, " + std::to_string(static_cast<int>(1e3 * beside_m)) + " mm beside")
        .series(table, "along [mm]", "C.17 [mm]", "C.17", Style::kDashed);
    if (beside_m == 0.0) at_axis = of_linear / of_true - 1.0;
    worst = std::max(worst, of_linear / of_true - 1.0);
  }
  report.check("C.17 from the axis itself: excess of the torque in even fluid", at_axis, -1e-9, 1e-9, "");
  report.check("C.17 beside the axis: greatest excess of the torque in even fluid", worst, 0.1, 0.5, "");
  report.check("C.17: least excess of a length", least_m, -1e-12, 0.0, "m");
}

void run(Report& report, const Settings& settings) {
  recover(report, settings);
  swing_lean(report, settings);
  pass_the_axis(report);
  report.difference(
      "Step 3 is printed with u2 in ψ, which is 0 once steps 1 and 2 are done: the spin would be lost; ours takes v2 and w2. "
      "Steps 1 and 2 are printed one for rows, one for columns. A link along y has no angle θ: the recovery divides by zero. "
      "The thesis counts neither the two rotations of P3 that step 3 needs nor the sines; it counts arc cosines, ours has none. "
      "The product does without all of this: its forward kinematics yields each link's matrix, places are computed several "
      "at a time by SIMD, and drag by moments costs no length per sensor, so nothing is interpolated.");
}

}  // namespace
}  // namespace in_lean_sensors

Experiment lean_sensors() {
  return {
      "lean-sensors",
      "Lean computation of sensors' places and lengths",
      "appendices B and C (C.17–C.21)",
      "Three points recover a link's pose at a stated cost; a ring of corners and interpolation yield every sensor; "
      "lengths from a joint's axis may be interpolated (C.17).",
      {Sabotage::kConstantMu, Sabotage::kLayersOffByOne, Sabotage::kIgnoredSpeed},
      in_lean_sensors::run};
}

}  // namespace phantom::experiments
