// Arbitrary triangles, coordinates of any bits: the mesh's bytes, the report about it, its voxels and its
// layers.

#include <fuzzer/FuzzedDataProvider.h>

#include <bit>
#include <cstdlib>

#include "common/geometry/mesh/mesh.hpp"
#include "common/geometry/mesh/mesh_report.hpp"
#include "common/layers/activation.hpp"
#include "common/voxelise/voxelise.hpp"

namespace {

using namespace phantom;

void demand(bool holds) {
  if (!holds) std::abort();
}

float coordinate(FuzzedDataProvider& data, int kind) {
  switch (kind) {
    case 0:
      return std::bit_cast<float>(data.ConsumeIntegral<std::uint32_t>());  // anything, NaN too
    case 1:
      return static_cast<float>(data.ConsumeIntegralInRange<int>(-8, 40)) * 0.5F;  // corners that coincide
    case 2:
      return data.ConsumeFloatingPointInRange<float>(-50, 50);
    default:
      return data.ConsumeFloatingPointInRange<float>(-30000, 30000);  // far outside the grid
  }
}

geometry::TriangleMesh any_mesh(FuzzedDataProvider& data) {
  geometry::TriangleMesh mesh;
  const int kind = data.ConsumeIntegralInRange<int>(0, 3);
  const auto vertices = data.ConsumeIntegralInRange<std::uint32_t>(0, 24);
  const auto triangles = vertices == 0 ? 0U : data.ConsumeIntegralInRange<std::uint32_t>(0, 48);
  for (std::uint32_t i = 0; i < vertices; ++i) {
    const float x = coordinate(data, kind), y = coordinate(data, kind), z = coordinate(data, kind);
    mesh.vertices_m.emplace_back(x, y, z);
  }
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const auto any = [&] { return data.ConsumeIntegralInRange<std::uint32_t>(0, vertices - 1); };
    const std::uint32_t a = any(), b = any(), c = any();
    mesh.triangles.push_back({a, b, c});
  }
  return mesh;
}

void check_voxels(const geometry::TriangleMesh& mesh, const workspace::GridSpec& grid) {
  const auto clip = workspace::VoxelBox::of(grid);
  const auto one = voxelise::voxelise(mesh, grid, clip),
             two = voxelise::voxelise(mesh, grid, clip, {2, nullptr});
  demand(one.has_value() == two.has_value());
  demand(one.has_value() || !one.status().message().empty());
  if (!one) return;
  demand(one->boundary.words() == two->boundary.words() && one->inside.words() == two->inside.words());
  demand(one->box.intersection(clip).voxel_count() == one->box.voxel_count());
}

void check_layers(FuzzedDataProvider& data, const geometry::TriangleMesh& mesh,
                  const workspace::GridSpec& grid) {
  layers::Body body{"body", 1, mesh, {}};
  body.profile.thickness_vox = {data.ConsumeIntegralInRange<int>(1, 4), 2};
  body.profile.mu_Pa_s_per_m = {30.0F, 20.0F};
  body.profile.guard_vox = data.ConsumeIntegralInRange<int>(0, 2);
  const auto active = layers::activate_object(body, grid);
  demand(active.has_value() || !active.status().message().empty());
  if (!mesh.all_finite()) demand(!active.has_value());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  FuzzedDataProvider data(bytes, size);
  const auto edge = data.ConsumeIntegralInRange<std::int32_t>(1, 40);
  const double sizes[] = {1.0, 0.5, 0.037, 5.0, 1e-4, 1e4};
  const workspace::GridSpec grid{{data.ConsumeIntegralInRange<int>(-20, 20) * 0.25, -3.0, 0.1},
                                 data.PickValueInArray(sizes),
                                 {edge, 1 + edge / 2, edge}};
  const geometry::TriangleMesh mesh = any_mesh(data);

  const auto packed = geometry::mesh_bytes(mesh);
  geometry::TriangleMesh again;
  const bool read = geometry::mesh_from_bytes(packed.data(), packed.size(),
                                              static_cast<std::uint32_t>(mesh.vertices_m.size()),
                                              static_cast<std::uint32_t>(mesh.triangles.size()), again);
  demand(read == mesh.all_finite());
  if (mesh.all_finite()) {
    const auto report = geometry::inspect_mesh(mesh, {.max_pairs = 2000});
    demand(report.degenerate_triangles + report.duplicate_triangles <= 2 * report.triangles);
    demand(report.closed_shells <= report.shells && report.shells <= report.triangles);
    (void)geometry::describe(report);
  }
  check_voxels(mesh, grid);
  check_layers(data, mesh, grid);
  return 0;
}
