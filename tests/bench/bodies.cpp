#include "tests/bench/bodies.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "common/geometry/implicit/primitives.hpp"

namespace phantom::bench {
namespace {

constexpr double kVoxel_m = 0.005;

/// A pose turned at random about two axes.
geometry::Pose turned(std::mt19937& random, const Eigen::Vector3d& place_m) {
  const auto share = [&] { return static_cast<double>(random()) / 4294967296.0; };
  const double yaw = 6.28 * share(), pitch = 6.28 * share();
  Eigen::Matrix3d turn_z, turn_x;
  turn_z << std::cos(yaw), -std::sin(yaw), 0, std::sin(yaw), std::cos(yaw), 0, 0, 0, 1;
  turn_x << 1, 0, 0, 0, std::cos(pitch), -std::sin(pitch), 0, std::sin(pitch), std::cos(pitch);
  return {turn_z * turn_x, place_m};
}

/// Plates, tubes, tanks and rings in turn.
geometry::TriangleMesh thing(std::size_t i, double unit_m) {
  return i % 4 == 0   ? geometry::make_box({0.5 * unit_m, 0.3 * unit_m, 0.05 * unit_m})
         : i % 4 == 1 ? geometry::make_cylinder(0.05 * unit_m, 0.6 * unit_m, 64)
         : i % 4 == 2 ? geometry::make_sphere(0.12 * unit_m, 5)
                      : geometry::make_torus(0.2 * unit_m, 0.04 * unit_m, 96, 48);
}

layers::Body body_of(std::size_t i, geometry::TriangleMesh mesh_W) {
  layers::Body body;
  body.name = "object " + std::to_string(i + 1);
  body.id = static_cast<std::uint16_t>(i + 1);
  body.mesh_W = std::move(mesh_W);
  body.profile = six_layers();
  return body;
}

}  // namespace

geometry::TriangleMesh fine_sphere(double radius_m, std::uint32_t rings) {
  geometry::TriangleMesh mesh;
  const std::uint32_t around = rings;
  const auto add = [&](double theta, double phi) {
    mesh.vertices_m.emplace_back(static_cast<float>(radius_m * std::sin(theta) * std::cos(phi)),
                                 static_cast<float>(radius_m * std::sin(theta) * std::sin(phi)),
                                 static_cast<float>(radius_m * std::cos(theta)));
  };
  add(0, 0);
  for (std::uint32_t i = 1; i < rings; ++i) {
    for (std::uint32_t j = 0; j < around; ++j) {
      add(std::numbers::pi * i / rings, 2 * std::numbers::pi * j / around);
    }
  }
  add(std::numbers::pi, 0);
  const auto at = [&](std::uint32_t ring, std::uint32_t j) { return 1 + (ring - 1) * around + j % around; };
  const auto last = static_cast<std::uint32_t>(mesh.vertices_m.size() - 1);
  for (std::uint32_t j = 0; j < around; ++j) {
    mesh.triangles.push_back({0, at(1, j), at(1, j + 1)});
    for (std::uint32_t i = 1; i + 1 < rings; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
    mesh.triangles.push_back({at(rings - 1, j), last, at(rings - 1, j + 1)});
  }
  return mesh;
}

workspace::LayerProfile six_layers() {
  return {{4, 4, 4, 4, 4, 4}, {32.0F, 20.0F, 13.0F, 11.0F, 10.0F, 9.0F}, 100.0F, 0};
}

workspace::GridSpec sphere_grid(int edge_vox) {
  return {Eigen::Vector3d::Zero(), kVoxel_m, {edge_vox, edge_vox, edge_vox}};
}

layers::Body sphere_in_box(int edge_vox, std::uint32_t rings) {
  const workspace::LayerProfile profile = six_layers();
  const double middle_m = 0.5 * kVoxel_m * edge_vox;
  const double radius_m = middle_m - kVoxel_m * (profile.reach_vox() + 0.6);
  return {"sphere", 1,
          fine_sphere(radius_m, rings)
              .transformed({Eigen::Matrix3d::Identity(), Eigen::Vector3d::Constant(middle_m)}),
          profile};
}

std::vector<layers::Body> cell_of(std::size_t count, const Eigen::Vector3d& size_m) {
  std::mt19937 random(20);
  const auto share = [&] { return 0.12 + 0.76 * static_cast<double>(random()) / 4294967296.0; };
  std::vector<layers::Body> bodies;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d place_m(share() * size_m.x(), share() * size_m.y(), share() * size_m.z());
    bodies.push_back(body_of(i, thing(i, size_m.minCoeff() / 1.5).transformed(turned(random, place_m))));
  }
  return bodies;
}

std::vector<layers::Body> large_cell() {
  std::mt19937 random(21);
  std::vector<layers::Body> bodies;
  for (std::size_t i = 0; i < 80; ++i) {
    const Eigen::Vector3d place_m(static_cast<double>(i % 5) + 0.5, static_cast<double>(i / 5 % 4) + 0.5,
                                  static_cast<double>(i / 20) + 0.5);
    bodies.push_back(body_of(i, thing(i + i / 5, 1.4).transformed(turned(random, place_m))));
  }
  return bodies;
}

std::vector<layers::MergeEntry> Activated::entries(const std::vector<layers::Body>& bodies) const {
  std::vector<layers::MergeEntry> entries;
  for (std::size_t i = 0; i < bodies.size(); ++i) entries.push_back({&bricks[i], bodies[i].id, &codes[i]});
  return entries;
}

Activated activate_all(const std::vector<layers::Body>& bodies, const workspace::GridSpec& grid,
                       int threads) {
  std::vector<workspace::LayerProfile> profiles;
  for (const layers::Body& body : bodies) profiles.push_back(body.profile);
  Activated cell;
  cell.workspace = workspace::Workspace(grid, *workspace::make_palette(profiles));
  layers::ActivationOptions options;
  options.threads = threads;
  for (const layers::Body& body : bodies) {
    auto object = layers::activate_object(body, grid, options);
    if (!object) throw std::runtime_error(object.status().message());
    cell.bricks.push_back(std::move(object->bricks));
    cell.codes.push_back(workspace::code_table(body.profile, cell.workspace.palette()));
  }
  const std::vector<layers::MergeEntry> entries = cell.entries(bodies);
  layers::merge_bricks(layers::MergeLaw::kHighestViscosity, entries, layers::keys_of(entries), cell.workspace,
                       threads);
  return cell;
}

}  // namespace phantom::bench
