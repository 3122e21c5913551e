#include <algorithm>
#include <limits>

#include "common/geometry/implicit.hpp"

namespace phantom::geometry {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

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

class Difference final : public ImplicitSolid {
 public:
  explicit Difference(std::vector<ImplicitPtr> parts) : parts_(std::move(parts)) {}

  double value(const Eigen::Vector3d& p) const override {
    double most = parts_.front()->value(p);
    for (std::size_t i = 1; i < parts_.size(); ++i) most = std::max(most, -parts_[i]->value(p));
    return most;
  }
  Interval bounds(const Region& region) const override {
    Interval found = parts_.front()->bounds(region);
    for (std::size_t i = 1; i < parts_.size(); ++i) found = max(found, -parts_[i]->bounds(region));
    return found;
  }
  Box bounding_box() const override { return parts_.front()->bounding_box(); }

 private:
  std::vector<ImplicitPtr> parts_;
};

}  // namespace

ImplicitPtr implicit_union(std::vector<ImplicitPtr> parts) { return std::make_shared<Union>(std::move(parts)); }
ImplicitPtr implicit_intersection(std::vector<ImplicitPtr> parts) {
  return std::make_shared<Intersection>(std::move(parts));
}
ImplicitPtr implicit_difference(std::vector<ImplicitPtr> parts) {
  return std::make_shared<Difference>(std::move(parts));
}

}  // namespace phantom::geometry
