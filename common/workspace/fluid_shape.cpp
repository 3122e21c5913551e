#include "common/workspace/fluid_shape.hpp"

#include <algorithm>
#include <string>

namespace phantom::workspace {
namespace {

/// Marks the voxels of a brick that are not free in the fluids of their objects.
void gather(const Workspace& workspace, BrickKey key, std::map<std::uint16_t, ObjectFluid>& fluids) {
  const Workspace::BrickView brick = workspace.brick(key);
  ObjectFluid* fluid = nullptr;  // of the voxel before
  box_of(key).intersection(VoxelBox::of(workspace.grid())).for_each([&](Index3 v) {
    const std::size_t at = brick_offset(v);
    if (brick.order[at] == kOrderFree) return;
    const std::uint16_t object = brick.object_of(at);
    if (fluid == nullptr || fluid->object != object) {
      fluid = &fluids[object];
      fluid->object = object;
    }
    fluid->box = fluid->box.hull({v, {1, 1, 1}});
    std::uint8_t& code = fluid->mu_code[brick.order[at]];
    code = std::max(code, brick.mu_code[at]);
  });
}

/// A plane of cells that are of no shell (0), or turn their face up (1) or down (2) the axis.
struct FacePlane {
  std::vector<std::uint8_t> cells;
  std::size_t width = 0, height = 0;

  std::uint8_t* row(std::size_t v) { return cells.data() + v * width; }

  /// Returns how many cells from (u, v) on are `kind` and, in the rows below, can be joined to them; takes
  /// them away.
  std::array<std::uint16_t, 2> take(std::size_t u, std::size_t v) {
    const std::uint8_t kind = row(v)[u];
    const auto alike = [kind](std::uint8_t cell) { return cell == kind; };
    std::uint8_t* const first = row(v) + u;
    std::uint8_t* const end = std::find_if_not(first, row(v) + width, alike);
    const auto wide = static_cast<std::size_t>(end - first);
    std::fill(first, end, std::uint8_t{0});
    std::size_t high = 1;
    for (; v + high < height; ++high) {
      std::uint8_t* const below = row(v + high) + u;
      if (!std::all_of(below, below + wide, alike)) break;
      std::fill(below, below + wide, std::uint8_t{0});
    }
    return {static_cast<std::uint16_t>(wide), static_cast<std::uint16_t>(high)};
  }
};

/// Appends the rectangles of a plane that lies at `at` along `axis`.
bool append_faces(FacePlane& plane, const VoxelBox& box, std::size_t axis, std::int32_t at, std::int8_t order,
                  std::size_t most_faces, std::vector<ShellFace>& to) {
  const std::size_t along = (axis + 1) % 3, across = (axis + 2) % 3;
  for (std::size_t v = 0; v < plane.height; ++v) {
    const std::uint8_t* const row = plane.row(v);
    for (std::size_t u = 0; u < plane.width; ++u) {
      if (row[u] == 0) continue;
      if (to.size() == most_faces) return false;
      ShellFace face;
      face.side = static_cast<std::uint8_t>(2 * axis + (row[u] == 2 ? 1 : 0));
      face.order = order;
      face.corner[axis] = static_cast<std::uint16_t>(at);
      face.corner[along] = static_cast<std::uint16_t>(box.min[along] + static_cast<std::int32_t>(u));
      face.corner[across] = static_cast<std::uint16_t>(box.min[across] + static_cast<std::int32_t>(v));
      face.size = plane.take(u, v);
      to.push_back(face);
    }
  }
  return true;
}

}  // namespace

std::vector<ObjectFluid> fluids_of(const Workspace& workspace) {
  std::map<std::uint16_t, ObjectFluid> fluids;
  for (const BrickKey& key : workspace.bricks()) gather(workspace, key, fluids);
  std::vector<ObjectFluid> sorted;
  for (auto& [object, fluid] : fluids) sorted.push_back(std::move(fluid));
  return sorted;
}

std::vector<std::int8_t> section_of(const Workspace& workspace, const VoxelBox& box, std::uint16_t object,
                                    std::size_t axis, std::int32_t at) {
  const std::size_t along = (axis + 1) % 3, across = (axis + 2) % 3;
  const auto width = static_cast<std::size_t>(box.size[along]);
  std::vector<std::int8_t> orders(width * static_cast<std::size_t>(box.size[across]), kOrderFree);
  VoxelBox plane = box;
  plane.min[axis] = at;
  plane.size[axis] = 1;
  const VoxelBox seen = plane.intersection(VoxelBox::of(workspace.grid()));
  if (seen.empty()) return orders;
  bricks_of(seen).for_each([&](Index3 brick_at) {
    const BrickKey key{brick_at};
    if (!workspace.has_brick(key)) return;
    const Workspace::BrickView brick = workspace.brick(key);
    const VoxelBox part = box_of(key).intersection(seen);
    const Index3 end = part.end();
    Index3 v = part.min;
    for (v[across] = part.min[across]; v[across] < end[across]; ++v[across]) {
      std::int8_t* const row = orders.data() + static_cast<std::size_t>(v[across] - box.min[across]) * width;
      for (v[along] = part.min[along]; v[along] < end[along]; ++v[along]) {
        const std::size_t offset = brick_offset(v);
        const std::int8_t order = brick.order[offset];
        if (order != kOrderFree && (object == kEveryObject || brick.object_of(offset) == object))
          row[v[along] - box.min[along]] = order;
      }
    }
  });
  return orders;
}

core::Expected<std::vector<ShellFace>> shell_of(const Workspace& workspace, const VoxelBox& box,
                                                std::uint16_t object, std::int8_t order,
                                                std::size_t most_faces) {
  std::array<std::uint8_t, 256> deep{};  // by the order's octet: whether it is of the shell
  for (int octet = 0; octet < 256; ++octet) {
    const auto of = static_cast<std::int8_t>(octet);
    deep[static_cast<std::size_t>(octet)] = of != kOrderFree && depth_of(of) >= depth_of(order) ? 1 : 0;
  }
  std::vector<ShellFace> faces;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    FacePlane plane{{},
                    static_cast<std::size_t>(box.size[(axis + 1) % 3]),
                    static_cast<std::size_t>(box.size[(axis + 2) % 3])};
    plane.cells.resize(plane.width * plane.height);
    std::vector<std::uint8_t> below(plane.cells.size()), here(plane.cells.size());
    const std::int32_t end = box.end()[axis];
    for (std::int32_t at = box.min[axis]; at <= end; ++at) {
      std::fill(here.begin(), here.end(), std::uint8_t{0});
      if (at < end) {
        const std::vector<std::int8_t> orders = section_of(workspace, box, object, axis, at);
        std::transform(orders.begin(), orders.end(), here.begin(),
                       [&deep](std::int8_t of) { return deep[static_cast<std::uint8_t>(of)]; });
      }
      bool any = false;
      for (std::size_t cell = 0; cell < here.size(); ++cell) {
        plane.cells[cell] = static_cast<std::uint8_t>(below[cell] == here[cell] ? 0
                                                      : below[cell] != 0        ? 1
                                                                                : 2);
        any = any || plane.cells[cell] != 0;
      }
      if (any && !append_faces(plane, box, axis, at, order, most_faces, faces))
        return core::Status(core::ErrorCode::kResourceExhausted,
                            "the shell has more than " + std::to_string(most_faces) + " rectangles");
      std::swap(below, here);
    }
  }
  return faces;
}

}  // namespace phantom::workspace
