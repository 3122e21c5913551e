#include <algorithm>

#include "common/geometry/implicit.hpp"

namespace phantom::geometry {
namespace {

/// The solid's value is the least value of its parts (the greatest if `greatest` is set). Returns the parts
/// that can decide this value in the region, simplified in the same way; empty if nothing can be simplified.
std::vector<ImplicitPtr> parts_within(const std::vector<ImplicitPtr>& parts, const Region& region,
                                      bool greatest) {
  std::vector<Interval> bounds;
  double decides = greatest ? -kInf : kInf;
  for (const ImplicitPtr& part : parts) {
    bounds.push_back(part->bounds(region));
    decides = greatest ? std::max(decides, bounds.back().lo) : std::min(decides, bounds.back().hi);
  }
  std::vector<ImplicitPtr> kept;
  bool changed = false;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const bool matters = greatest ? bounds[i].hi >= decides : bounds[i].lo <= decides;
    ImplicitPtr fewer = matters ? parts[i]->within(region) : nullptr;
    changed = changed || !matters || fewer;
    if (matters) kept.push_back(fewer ? std::move(fewer) : parts[i]);
  }
  if (!changed) kept.clear();
  return kept;
}

template <class Combination>
ImplicitPtr combined(std::vector<ImplicitPtr> parts) {
  if (parts.empty()) return nullptr;
  return parts.size() == 1 ? parts.front() : std::make_shared<Combination>(std::move(parts));
}

class Union final : public ImplicitSolid {
 public:
  explicit Union(std::vector<ImplicitPtr> parts) : parts_(std::move(parts)) {}

  double value(const Eigen::Vector3d& p) const override {
    double least = kInf;
    for (const auto& part : parts_) least = std::min(least, part->value(p));
    return least;
  }
  Interval bounds(const Region& region) const override {
    Interval found{kInf, kInf};
    for (const auto& part : parts_) found = min(found, part->bounds(region));
    return found;
  }
  ImplicitPtr within(const Region& region) const override {
    return combined<Union>(parts_within(parts_, region, false));
  }
  Box bounding_box() const override {
    Box box{Eigen::Vector3d::Constant(kInf), Eigen::Vector3d::Constant(-kInf)};
    for (const auto& part : parts_) {
      const Box other = part->bounding_box();
      if (other.empty()) continue;
      box = {box.min_m.cwiseMin(other.min_m), box.max_m.cwiseMax(other.max_m)};
    }
    return box;
  }

 private:
  std::vector<ImplicitPtr> parts_;
};

class Intersection final : public ImplicitSolid {
 public:
  explicit Intersection(std::vector<ImplicitPtr> parts) : parts_(std::move(parts)) {}

  double value(const Eigen::Vector3d& p) const override {
    double most = -kInf;
    for (const auto& part : parts_) most = std::max(most, part->value(p));
    return most;
  }
  Interval bounds(const Region& region) const override {
    Interval found{-kInf, -kInf};
    for (const auto& part : parts_) found = max(found, part->bounds(region));
    return found;
  }
  ImplicitPtr within(const Region& region) const override {
    return combined<Intersection>(parts_within(parts_, region, true));
  }
  Box bounding_box() const override {
    Box box = parts_.front()->bounding_box();
    for (const auto& part : parts_) {
      const Box other = part->bounding_box();
      box = {box.min_m.cwiseMax(other.min_m), box.max_m.cwiseMin(other.max_m)};
    }
    return box;
  }

 private:
  std::vector<ImplicitPtr> parts_;
};

/// The complement of a solid, for differences only: it has no bounding box of its own.
class Complement final : public ImplicitSolid {
 public:
  explicit Complement(ImplicitPtr solid) : solid_(std::move(solid)) {}

  double value(const Eigen::Vector3d& p) const override { return -solid_->value(p); }
  Interval bounds(const Region& region) const override { return -solid_->bounds(region); }
  ImplicitPtr within(const Region& region) const override {
    ImplicitPtr fewer = solid_->within(region);
    return fewer ? std::make_shared<Complement>(std::move(fewer)) : nullptr;
  }
  Box bounding_box() const override {
    return {Eigen::Vector3d::Constant(-kInf), Eigen::Vector3d::Constant(kInf)};
  }

 private:
  ImplicitPtr solid_;
};

}  // namespace

ImplicitPtr implicit_union(std::vector<ImplicitPtr> parts) {
  return std::make_shared<Union>(std::move(parts));
}
ImplicitPtr implicit_intersection(std::vector<ImplicitPtr> parts) {
  return std::make_shared<Intersection>(std::move(parts));
}
ImplicitPtr implicit_difference(std::vector<ImplicitPtr> parts) {
  for (std::size_t i = 1; i < parts.size(); ++i) parts[i] = std::make_shared<Complement>(std::move(parts[i]));
  return std::make_shared<Intersection>(std::move(parts));
}

}  // namespace phantom::geometry
