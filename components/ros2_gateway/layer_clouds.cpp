#include "components/ros2_gateway/layer_clouds.hpp"

#include <bit>
#include <cstring>
#include <limits>

namespace phantom::ros2_gateway {
namespace {

template <class T>
void append(std::vector<std::uint8_t>& to, T value) {
  static_assert(std::endian::native == std::endian::little, "the messages' data say so");
  const auto octets = std::bit_cast<std::array<std::uint8_t, sizeof(T)>>(value);
  to.insert(to.end(), octets.begin(), octets.end());
}

void append_point(std::vector<std::uint8_t>& to, const Eigen::Vector3f& p_W_m, std::uint32_t brick,
                  std::uint16_t object, std::int8_t order) {
  for (const float x : p_W_m) append(to, x);
  append(to, brick);
  append(to, object);
  append(to, static_cast<std::int16_t>(order));
}

std::vector<std::uint8_t> points_of(const workspace::Workspace& from, workspace::BrickKey key,
                                    std::uint32_t number, std::int8_t order) {
  std::vector<std::uint8_t> points;
  const workspace::Workspace::BrickView brick = from.brick(key);
  if (std::memchr(brick.order, static_cast<unsigned char>(order), workspace::kBrickVoxels) == nullptr)
    return points;
  const workspace::Index3 corner = workspace::corner_of(key);
  constexpr auto kEdge = static_cast<std::int32_t>(workspace::kBrickEdge);
  for (std::int32_t z = 0; z < kEdge; ++z)
    for (std::int32_t y = 0; y < kEdge; ++y)
      for (std::int32_t x = 0; x < kEdge; ++x) {
        const workspace::Index3 v = corner + workspace::Index3{x, y, z};
        const std::size_t at = workspace::brick_offset(v);
        if (brick.order[at] == order && from.grid().contains(v))
          append_point(points, from.grid().centre_of(v).cast<float>(), number, brick.object_of(at), order);
      }
  return points;
}

bool same(const workspace::GridSpec& a, const workspace::GridSpec& b) {
  return a.origin_m == b.origin_m && a.voxel_size_m == b.voxel_size_m && a.size_vox == b.size_vox;
}

}  // namespace

std::vector<std::uint8_t> LayerCloud::update(const workspace::Workspace& workspace) {
  std::map<std::uint32_t, Points> before = std::move(bricks_);
  const bool comparable = same(grid_, workspace.grid());
  grid_ = workspace.grid();
  bricks_.clear();
  octets_ = 0;
  std::vector<std::uint8_t> changed;
  for (const workspace::BrickKey& key : workspace.bricks()) {
    const auto number = static_cast<std::uint32_t>(workspace.directory_index(key));
    Points points = points_of(workspace, key, number, order_);
    if (points.empty()) continue;
    octets_ += points.size();
    const auto old = before.find(number);
    if (!comparable || old == before.end() || old->second != points)
      changed.insert(changed.end(), points.begin(), points.end());
    bricks_.emplace(number, std::move(points));
  }
  for (const auto& [number, points] : before)
    if (!bricks_.contains(number))
      append_point(changed, Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()), number, 0,
                   order_);
  return changed;
}

std::vector<std::uint8_t> LayerCloud::whole() const {
  std::vector<std::uint8_t> all;
  all.reserve(octets_);
  for (const auto& [number, points] : bricks_) all.insert(all.end(), points.begin(), points.end());
  return all;
}

}  // namespace phantom::ros2_gateway
