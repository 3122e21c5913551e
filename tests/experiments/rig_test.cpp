#include "tests/experiments/rig.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/geometry/implicit/primitives.hpp"
#include "tests/experiments/specimens.hpp"
#include "tests/support/files.hpp"

namespace phantom::experiments {
namespace {

/// Whether each edge belongs to two triangles that run along it in opposite senses.
bool closed(const geometry::TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      const auto a = t[static_cast<std::size_t>(i)], b = t[static_cast<std::size_t>((i + 1) % 3)];
      edges[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : 1000;
    }
  }
  for (const auto& [edge, uses] : edges) {
    if (uses != 1001) return false;
  }
  return true;
}

double area(const std::vector<Eigen::Vector2d>& corners) {
  double twice = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto &a = corners[i], &b = corners[(i + 1) % corners.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * twice;
}

TEST(Specimens, ComplexCylinderHasTheThesissTrianglesAndBays) {
  const auto mesh = complex_cylinder(0.1, 0.2);
  EXPECT_EQ(mesh.triangles.size(), 220U);
  EXPECT_TRUE(closed(mesh));
  const auto section = complex_section(0.1);
  ASSERT_EQ(section.size(), 56U);
  EXPECT_NEAR(geometry::enclosed_volume_m3(mesh), 0.2 * area(section), 1e-8);
  int concave = 0;
  for (std::size_t i = 0; i < section.size(); ++i) {
    const Eigen::Vector2d a = section[i], b = section[(i + 1) % 56], c = section[(i + 2) % 56];
    concave += (b - a).x() * (c - b).y() - (b - a).y() * (c - b).x() < 0.0 ? 1 : 0;
  }
  EXPECT_GE(concave, 8);
}

TEST(Specimens, WedgeAndTubeAreClosedWithTheVolumesOfTheirFormulas) {
  const auto wedge = wedge_block({0.2, 0.15, 0.1}, {0.05, 0.08}, 0.02);
  EXPECT_TRUE(closed(wedge));
  EXPECT_NEAR(geometry::enclosed_volume_m3(wedge), wedge_volume_m3({0.2, 0.15, 0.1}, {0.05, 0.08}, 0.02),
              1e-8);
  EXPECT_NEAR(wedge.bounding_box().max_m.z(), 0.05F, 1e-6F);
  EXPECT_NEAR(wedge.bounding_box().max_m.y(), 0.075F, 1e-6F);
  const auto tube = hollow_cylinder(0.1, 0.06, 0.2, 360);
  EXPECT_TRUE(closed(tube));
  EXPECT_NEAR(geometry::enclosed_volume_m3(tube), M_PI * (0.01 - 0.0036) * 0.2, 1e-6);
}

/// A wall at x ≥ 0 with two layers of two voxels of 1 cm.
workspace::Workspace wall(Sabotage sabotage) {
  const geometry::Pose X_WB{Eigen::Matrix3d::Identity(), {0.1, 0.0, 0.0}};
  const layers::Body body{.name = "wall",
                          .mesh_W = geometry::make_box({0.2, 1.0, 1.0}).transformed(X_WB),
                          .profile = layers({20.0F, 10.0F}, 2)};
  return activate({body}, layers::grid_over({-0.2, -0.2, -0.2}, {0.2, 0.2, 0.2}, 0.01),
                  {.sabotage = sabotage});
}

Eigen::Vector3d force_at(double x_m, const Eigen::Vector3d& v, Sabotage sabotage = Sabotage::kNone) {
  const auto workspace = wall(sabotage);
  return Probe(workspace, {.sabotage = sabotage}).at({x_m, 0.005, 0.005}, v).force_N;
}

TEST(Probe, FeelsEachAxisWhereItIs) {
  EXPECT_TRUE(force_at(-0.005, {0.1, 0.2, -0.3}).isApprox(Eigen::Vector3d(-2.0, -4.0, 6.0), 1e-9));
  EXPECT_TRUE(force_at(-0.035, {0.1, 0.2, -0.3}).isApprox(Eigen::Vector3d(-1.0, -2.0, 3.0), 1e-9));
  EXPECT_TRUE(force_at(-0.045, {0.1, 0.2, -0.3}).isZero());
  EXPECT_TRUE(force_at(0.105, {0.1, 0.0, 0.0}).isApprox(Eigen::Vector3d(-10.0, 0.0, 0.0), 1e-9));
}

TEST(Sabotage, BreaksTheLawThatItNames) {
  EXPECT_NEAR(force_at(-0.035, {0.1, 0.0, 0.0}, Sabotage::kConstantMu).x(), -2.0, 1e-5);
  EXPECT_NEAR(force_at(-0.025, {0.1, 0.0, 0.0}, Sabotage::kLayersOffByOne).x(), -2.0, 1e-9);
  EXPECT_NEAR(force_at(-0.045, {0.1, 0.0, 0.0}, Sabotage::kLayersOffByOne).x(), -1.0, 1e-9);
  EXPECT_NEAR(force_at(-0.005, {0.1, 0.0, 0.0}, Sabotage::kIgnoredSpeed).x(), -20.0 * kIgnoredSpeed, 1e-9);
  EXPECT_EQ(sabotaged(-0.7, Sabotage::kIgnoredSpeed), -kIgnoredSpeed);
  EXPECT_EQ(sabotaged(0.0, Sabotage::kIgnoredSpeed), 0.0);
  EXPECT_EQ(force_at(-0.025, {0.1, 0.0, 0.0}, Sabotage::kGrownBodies).x(),
            force_at(-0.025, {0.1, 0.0, 0.0}, Sabotage::kLayersOffByOne).x());
  EXPECT_LT(force_at(-0.005, {0.1, 0.0, 0.0}, Sabotage::kGrownBodies).x(),
            force_at(-0.005, {0.1, 0.0, 0.0}, Sabotage::kLayersOffByOne).x())
      << "the body's own voxels move as well";
  EXPECT_EQ(sabotaged(survey::RangeHead{.beam_offset_m = 0.06}, Sabotage::kIgnoredOffset).beam_offset_m, 0.0);
  EXPECT_EQ(sabotaged(workspace::ShapingElement::kSphere, Sabotage::kCubicElements),
            workspace::ShapingElement::kCube);
  EXPECT_EQ(sabotaged(layers({20.0F}, 2), Sabotage::kCubicElements).element,
            workspace::ShapingElement::kCube);
  EXPECT_EQ(sabotaged(workspace::ShapingElement::kSphere, Sabotage::kNone),
            workspace::ShapingElement::kSphere);
  EXPECT_EQ(sabotaged(survey::RangeHead{.beam_offset_m = 0.06}, Sabotage::kNone).beam_offset_m, 0.06);
}

TEST(Report, WritesWhatItWasGivenAndRefusesWhatDoesNotFit) {
  const auto folder = test::new_folder() / "report";
  Report report(folder);
  EXPECT_FALSE(report.passed()) << "nothing was checked";
  Table& table = report.table("a", {"x [m]", "F [N]"});
  table.row({0.1, std::nan("")});
  EXPECT_THROW(table.row({0.1}), std::logic_error);
  EXPECT_THROW(report.table("a", {"x [m]"}), std::logic_error);
  Panel& panel = report.plot("p", "title").panel("", "x [m]", "F [N]");
  EXPECT_THROW(panel.series(table, "x [m]", "F [mN]", "F"), std::logic_error);
  panel.series(table, "x [m]", "F [N]", "F");
  report.check("in", 1.0, 0.0, 1.0, "N");
  EXPECT_TRUE(report.passed());
  report.check("not a number", std::nan(""), 0.0, 1.0, "N");
  EXPECT_FALSE(report.passed());
  report.write();
  std::ifstream csv(folder / "a.csv");
  std::string header, row;
  std::getline(csv, header);
  std::getline(csv, row);
  EXPECT_EQ(header, "x [m],F [N]");
  EXPECT_EQ(row, "0.1,");
  EXPECT_TRUE(std::filesystem::exists(folder / "plots.json"));
  EXPECT_TRUE(std::filesystem::exists(folder / "checks.json"));
}

TEST(Report, AFigureOfTheThesisOutOfItsBandFailsTheExperiment) {
  Report report(test::new_folder());
  report.check("a check", 1.0, 0.0, 2.0, "");
  report.beside("slope", "figure 1.1, page 1", 2.0, 1.95, 1.9, 2.1, "N");
  EXPECT_TRUE(report.passed());
  report.beside("step", "figure 1.1, page 1", 2.0, 2.2, 1.9, 2.1, "N");
  report.beside("nothing measured", "figure 1.1, page 1", 2.0, std::nan(""), 1.9, 2.1, "N");
  EXPECT_FALSE(report.passed());
  ASSERT_EQ(report.failed().size(), 2U);
  EXPECT_EQ(report.failed()[0].what, "step");
  report.write();
  const auto checks = nlohmann::json::parse(std::ifstream(report.folder() / "checks.json"));
  ASSERT_EQ(checks.size(), 4U);
  EXPECT_FALSE(checks[0].contains("thesis"));
  EXPECT_EQ(checks[2]["thesis"], 2.0);
  EXPECT_EQ(checks[2]["place"], "figure 1.1, page 1");
  EXPECT_EQ(checks[2]["passed"], false);
}

TEST(Report, RefusesAFigureOfTheThesisWithoutABand) {
  Report report(test::new_folder());
  EXPECT_THROW(report.beside("all", "figure 1.1, page 1", 2.0, 2.0, -INFINITY, INFINITY, ""),
               std::logic_error);
  EXPECT_THROW(report.beside("none", "figure 1.1, page 1", 2.0, 2.0, 2.1, 1.9, ""), std::logic_error);
  EXPECT_THROW(report.beside("no number", "figure 1.1, page 1", 2.0, 2.0, std::nan(""), 1.9, ""),
               std::logic_error);
  report.beside("fewer than", "figure 1.1, page 1", 2.0, 1.0, -INFINITY, 2.0, "");
  EXPECT_TRUE(report.passed());
}

}  // namespace
}  // namespace phantom::experiments
