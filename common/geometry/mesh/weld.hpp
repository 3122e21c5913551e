#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

namespace phantom::geometry {

/// Numbers distinct points in the order of their first occurrence. Equal points get the same number. A point
/// is a Vector3f (−0 and 0 are equal, NaN equals nothing) or an array of integers whose first three elements
/// are compared.
template <class Point>
class Places {
 public:
  /// `points`: receives the distinct points. It must be empty, and only this object may change it during this
  /// object's lifetime.
  explicit Places(std::vector<Point>& points) : points_(points) {}

  /// Reserves room for this many distinct points.
  void expect(std::size_t places) {
    points_.reserve(places);
    grow(std::bit_ceil(2 * places));
  }
  std::uint32_t number_of(const Point& point) {
    const Point p = plain(point);
    if (2 * points_.size() >= table_.size()) grow(std::max<std::size_t>(64, 2 * table_.size()));
    std::size_t at = slot_of(p);
    for (; table_[at] != kNone; at = (at + 1) & (table_.size() - 1)) {
      if (points_[table_[at]] == p) return table_[at];
    }
    table_[at] = static_cast<std::uint32_t>(points_.size());
    points_.push_back(p);
    return table_[at];
  }
  /// Prefetches the memory that number_of() will read. (Unless it is inlined, GCC treats it as a function
  /// without effect.)
  [[gnu::always_inline]] void prefetch(const Point& point) const {
    __builtin_prefetch(&table_[slot_of(plain(point))]);
  }

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  static Point plain(const Point& point) {
    if constexpr (std::is_same_v<Point, Eigen::Vector3f>) {
      return point + Eigen::Vector3f::Zero();  // −0 becomes 0
    } else {
      return point;
    }
  }
  std::size_t slot_of(const Point& p) const {
    std::uint64_t h = std::bit_cast<std::uint32_t>(p[0]) * 0x9e3779b97f4a7c15ULL;
    h = (h ^ (h >> 32) ^ std::bit_cast<std::uint32_t>(p[1])) * 0xff51afd7ed558ccdULL;
    h = (h ^ (h >> 32) ^ std::bit_cast<std::uint32_t>(p[2])) * 0xc4ceb9fe1a85ec53ULL;
    return (h >> 29 ^ h) & (table_.size() - 1);
  }
  void grow(std::size_t size) {
    table_.assign(size, kNone);
    for (std::uint32_t i = 0; i < points_.size(); ++i) {
      std::size_t at = slot_of(points_[i]);
      while (table_[at] != kNone) at = (at + 1) & (size - 1);
      table_[at] = i;
    }
  }

  std::vector<Point>& points_;
  std::vector<std::uint32_t> table_;  // numbers by hash; the size is a power of two
};

/// Returns for each point the index of the first equal point, compared as in Places. O(n).
template <class Point>
std::vector<std::uint32_t> weld(const std::vector<Point>& points) {
  std::vector<Point> distinct;
  Places<Point> places(distinct);
  places.expect(points.size());
  std::vector<std::uint32_t> first_there, first;
  first.reserve(points.size());
  for (const Point& point : points) {
    const std::uint32_t place = places.number_of(point);
    if (place == first_there.size()) first_there.push_back(static_cast<std::uint32_t>(first.size()));
    first.push_back(first_there[place]);
  }
  return first;
}

/// Stores points in a grid, to find the nearest one.
class PointGrid {
 public:
  struct Near {
    std::uint32_t index;
    double square_m2;  ///< square of the distance
  };
  /// `radius_m`: greatest distance of a match; greater than 0.
  explicit PointGrid(double radius_m) : radius_m_(radius_m) {}

  void add(const Eigen::Vector3d& p_m, std::uint32_t index);
  /// Returns the nearest point within the radius. Of points at the same distance it is the one with the
  /// lowest index.
  std::optional<Near> nearest(const Eigen::Vector3d& p_m) const;

 private:
  std::array<std::int64_t, 3> cell_of(const Eigen::Vector3d& p_m) const;

  double radius_m_;
  /// Points by cubes with edges of twice the radius, so that all near points lie in eight of them. Distant
  /// cubes may share a key.
  std::unordered_map<std::uint64_t, std::vector<std::pair<Eigen::Vector3d, std::uint32_t>>> cells_;
};

/// Returns for each point the index of its representative: the nearest earlier representative within
/// `tolerance_m`, or else the point itself.
std::vector<std::uint32_t> weld(std::span<const Eigen::Vector3d> points_m, double tolerance_m);

}  // namespace phantom::geometry
