#include <algorithm>

#include "common/geometry/implicit/implicit.hpp"

namespace phantom::geometry {
namespace {

/// The union of its parts, whose value is the least of theirs; or (if kMax) their intersection.
template <bool kMax>
class Combination final : public ImplicitSolid {
 public:
  explicit Combination(std::vector<ImplicitPtr> parts) : parts_(std::move(parts)) {
    for (const ImplicitPtr& part : parts_) steps_ += 1 + part->steps();
  }

  double value(const Eigen::Vector3d& p) const override {
    double found = kNothing;
    for (const auto& part : parts_) found = decisive(found, part->value(p));
    return found;
  }
  Interval bounds(const Region& region) const override {
    Interval found{kNothing, kNothing};
    for (const auto& part : parts_) found = decisive(found, part->bounds(region));
    return found;
  }
  std::size_t steps() const override { return steps_; }
  Box bounding_box() const override {
    Box box{Eigen::Vector3d::Constant(kNothing), Eigen::Vector3d::Constant(-kNothing)};
    for (const auto& part : parts_) {
      const Box other = part->bounding_box();
      if (kMax) {
        box = {box.min_m.cwiseMax(other.min_m), box.max_m.cwiseMin(other.max_m)};
      } else if (!other.empty()) {
        box = {box.min_m.cwiseMin(other.min_m), box.max_m.cwiseMax(other.max_m)};
      }
    }
    return box;
  }
  /// Keeps the parts that can decide the value in the region, simplified in the same way.
  ImplicitPtr within(const Region& region) const override {
    std::vector<Interval> bounds;
    double decides = kNothing;
    for (const ImplicitPtr& part : parts_) {
      bounds.push_back(part->bounds(region));
      decides = decisive(decides, kMax ? bounds.back().lo : bounds.back().hi);
    }
    std::vector<ImplicitPtr> kept;
    bool changed = false;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const bool matters = kMax ? bounds[i].hi >= decides : bounds[i].lo <= decides;
      ImplicitPtr fewer = matters ? parts_[i]->within(region) : nullptr;
      changed = changed || !matters || fewer;
      if (matters) kept.push_back(fewer ? std::move(fewer) : parts_[i]);
    }
    if (!changed || kept.empty()) return nullptr;
    return kept.size() == 1 ? kept.front() : std::make_shared<Combination>(std::move(kept));
  }

 private:
  static constexpr double kNothing = kMax ? -kInf : kInf;
  template <class T>
  static T decisive(const T& a, const T& b) {
    using std::max, std::min;
    return kMax ? max(a, b) : min(a, b);
  }

  std::vector<ImplicitPtr> parts_;
  std::size_t steps_ = 0;
};

/// The complement of a solid, for differences only: it has no bounding box of its own.
class Complement final : public ImplicitSolid {
 public:
  explicit Complement(ImplicitPtr solid) : solid_(std::move(solid)) {}

  double value(const Eigen::Vector3d& p) const override { return -solid_->value(p); }
  Interval bounds(const Region& region) const override { return -solid_->bounds(region); }
  std::size_t steps() const override { return solid_->steps(); }
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

// One part is the whole, whose own tessellation is exact and costs nothing.
template <bool kMax>
ImplicitPtr combination(std::vector<ImplicitPtr> parts) {
  if (parts.size() == 1) return std::move(parts.front());
  return std::make_shared<Combination<kMax>>(std::move(parts));
}

}  // namespace

ImplicitPtr implicit_union(std::vector<ImplicitPtr> parts) { return combination<false>(std::move(parts)); }
ImplicitPtr implicit_intersection(std::vector<ImplicitPtr> parts) {
  return combination<true>(std::move(parts));
}
ImplicitPtr implicit_difference(std::vector<ImplicitPtr> parts) {
  for (std::size_t i = 1; i < parts.size(); ++i) parts[i] = std::make_shared<Complement>(std::move(parts[i]));
  return combination<true>(std::move(parts));
}

}  // namespace phantom::geometry
