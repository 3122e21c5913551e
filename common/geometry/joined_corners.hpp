#pragma once

// Private to this library: corners of triangles in one place become one vertex.

#include <bit>
#include <cstdint>
#include <vector>

#include "common/geometry/mesh.hpp"

namespace phantom::geometry::detail {

/// Collects triangles given by their corners' positions, and gives equal positions one vertex.
class JoinedCorners {
 public:
  explicit JoinedCorners(TriangleMesh& mesh) : mesh_(mesh) {}

  /// Makes room for a closed mesh of so many triangles.
  void expect(std::size_t triangles) {
    mesh_.triangles.reserve(triangles);
    mesh_.vertices_m.reserve(triangles / 2 + 2);
    grow(std::bit_ceil(triangles + 4));
  }
  std::uint32_t vertex(const Eigen::Vector3f& position_m) {
    const Eigen::Vector3f p = position_m + Eigen::Vector3f::Zero();  // −0 and 0 are one place
    if (2 * mesh_.vertices_m.size() >= table_.size()) grow(std::max<std::size_t>(64, 2 * table_.size()));
    std::size_t at = place_of(p);
    for (; table_[at] != kNone; at = (at + 1) & (table_.size() - 1)) {
      if (mesh_.vertices_m[table_[at]] == p) return table_[at];
    }
    table_[at] = static_cast<std::uint32_t>(mesh_.vertices_m.size());
    mesh_.vertices_m.push_back(p);
    finite_ = finite_ && p.allFinite();
    return table_[at];
  }
  /// Asks the memory for where vertex() will look. (Where it is not inlined, GCC takes it for a function
  /// without effect.)
  [[gnu::always_inline]] void prefetch(const Eigen::Vector3f& position_m) const {
    __builtin_prefetch(&table_[place_of(position_m + Eigen::Vector3f::Zero())]);
  }
  void triangle(const std::array<std::uint32_t, 3>& corners) {
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
      ++collapsed_;
    } else {
      mesh_.triangles.push_back(corners);
    }
  }

  bool finite() const { return finite_; }
  /// Triangles that were left out because they have two corners in one place.
  std::size_t collapsed() const { return collapsed_; }

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  std::size_t place_of(const Eigen::Vector3f& p) const {
    std::uint64_t h = std::bit_cast<std::uint32_t>(p.x()) * 0x9e3779b97f4a7c15ULL;
    h = (h ^ (h >> 32) ^ std::bit_cast<std::uint32_t>(p.y())) * 0xff51afd7ed558ccdULL;
    h = (h ^ (h >> 32) ^ std::bit_cast<std::uint32_t>(p.z())) * 0xc4ceb9fe1a85ec53ULL;
    return (h >> 29 ^ h) & (table_.size() - 1);
  }
  void grow(std::size_t size) {
    table_.assign(size, kNone);
    for (std::uint32_t i = 0; i < mesh_.vertices_m.size(); ++i) {
      std::size_t at = place_of(mesh_.vertices_m[i]);
      while (table_[at] != kNone) at = (at + 1) & (size - 1);
      table_[at] = i;
    }
  }

  TriangleMesh& mesh_;
  std::vector<std::uint32_t> table_;  // vertices by place; a power of two
  bool finite_ = true;
  std::size_t collapsed_ = 0;
};

}  // namespace phantom::geometry::detail
