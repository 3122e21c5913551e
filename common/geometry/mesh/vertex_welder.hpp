#pragma once

// Private to this library: merges triangle corners at the same position into one vertex.

#include <cstdint>

#include "common/geometry/mesh/mesh.hpp"
#include "common/geometry/mesh/weld.hpp"

namespace phantom::geometry::detail {

/// Collects triangles given by their corners' positions. Equal positions become one vertex.
class VertexWelder {
 public:
  explicit VertexWelder(TriangleMesh& mesh) : mesh_(mesh), places_(mesh.vertices_m) {}

  /// Reserves room for a closed mesh with this many triangles.
  void expect(std::size_t triangles) {
    mesh_.triangles.reserve(triangles);
    places_.expect(triangles / 2 + 2);
  }
  std::uint32_t vertex(const Eigen::Vector3f& position_m) {
    const std::size_t known = mesh_.vertices_m.size();
    const std::uint32_t number = places_.number_of(position_m);
    if (number == known) finite_ = finite_ && position_m.allFinite();
    return number;
  }
  [[gnu::always_inline]] void prefetch(const Eigen::Vector3f& position_m) const {
    places_.prefetch(position_m);
  }
  void triangle(const std::array<std::uint32_t, 3>& corners) {
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
      ++collapsed_;
    } else {
      mesh_.triangles.push_back(corners);
    }
  }

  bool finite() const { return finite_; }
  /// Returns how many triangles were left out because two of their corners have the same position.
  std::size_t collapsed() const { return collapsed_; }

 private:
  TriangleMesh& mesh_;
  Places<Eigen::Vector3f> places_;
  bool finite_ = true;
  std::size_t collapsed_ = 0;
};

}  // namespace phantom::geometry::detail
