#include "common/geometry/implicit/implicit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/geometry/implicit/primitives.hpp"

namespace phantom::geometry {
namespace {

// The same formula serves numbers and intervals.
using std::abs, std::max, std::min, std::sqrt;

template <class T>
T length(const T& a, const T& b) {
  return sqrt(square(a) + square(b));
}

/// Returns the signed distance to a quarter plane: how far (a, b) lies beyond its corner or edges, or
/// (negative) how far within.
template <class T>
T corner_distance(const T& a, const T& b) {
  return length(max(a, T(0.0)), max(b, T(0.0))) + min(max(a, b), T(0.0));
}

Box box_around(const Eigen::Vector3d& half_m) { return {-half_m, half_m}; }

/// A shape whose value changes by at most the distance between two points (1-Lipschitz). It is written as
/// `template <class T> T f(T x, T y, T z) const`.
template <class Shape>
class Primitive final : public ImplicitSolid {
 public:
  explicit Primitive(Shape shape) : shape_(std::move(shape)) {}

  double value(const Eigen::Vector3d& p) const override { return shape_.f(p.x(), p.y(), p.z()); }
  Interval bounds(const Region& region) const override {
    const Interval by_box = shape_.f(region.axis(0), region.axis(1), region.axis(2));
    const double middle = value(region.centre_m);
    const double reach = region.radius_m * (1.0 + 1e-12) + 1e-12 * abs(middle);
    return {max(by_box.lo, middle - reach), min(by_box.hi, middle + reach)};
  }
  Box bounding_box() const override { return shape_.box(); }
  std::optional<TriangleMesh> tessellation() const override { return shape_.mesh(); }

 private:
  Shape shape_;
};

struct Sphere {
  double r;
  template <class T>
  T f(const T& x, const T& y, const T& z) const {
    return sqrt(square(x) + square(y) + square(z)) - T(r);
  }
  Box box() const { return box_around(Eigen::Vector3d::Constant(r)); }
  TriangleMesh mesh() const { return make_sphere(r, 4); }
};

struct Cylinder {
  double r, h;
  template <class T>
  T f(const T& x, const T& y, const T& z) const {
    return corner_distance<T>(length<T>(x, y) - T(r), abs(z) - T(0.5 * h));
  }
  Box box() const { return box_around({r, r, 0.5 * h}); }
  TriangleMesh mesh() const { return make_cylinder(r, h, 96); }
};

struct Cone {
  double r, top, h;
  template <class T>
  T f(const T& x, const T& y, const T& z) const {
    // Distance to the line of the slanted side in the plane of (radius, z), whose normal is (h, r − top) /
    // norm.
    const double norm = std::hypot(h, r - top);
    const T side = length<T>(x, y) * T(h / norm) + z * T((r - top) / norm) - T(0.5 * h * (r + top) / norm);
    return max(side, abs(z) - T(0.5 * h));
  }
  Box box() const { return box_around({max(r, top), max(r, top), 0.5 * h}); }
  TriangleMesh mesh() const { return make_cone(r, top, h, 96); }
};

struct Cuboid {
  Eigen::Vector3d half;
  template <class T>
  T f(const T& x, const T& y, const T& z) const {
    const T a = abs(x) - T(half.x()), b = abs(y) - T(half.y()), c = abs(z) - T(half.z());
    const T zero(0.0);
    return sqrt(square(max(a, zero)) + square(max(b, zero)) + square(max(c, zero))) +
           min(max(a, max(b, c)), zero);
  }
  Box box() const { return box_around(half); }
  TriangleMesh mesh() const { return make_box(2.0 * half); }
};

struct Torus {
  double ring, tube;
  template <class T>
  T f(const T& x, const T& y, const T& z) const {
    return length<T>(length<T>(x, y) - T(ring), z) - T(tube);
  }
  Box box() const { return box_around({ring + tube, ring + tube, tube}); }
  TriangleMesh mesh() const { return make_torus(ring, tube, 96, 48); }
};

struct Prism {
  std::array<Eigen::Vector2d, 3> corners;  // counter-clockwise
  double h;
  template <class T>
  T f(const T& x, const T& y, const T& z) const {
    T found = abs(z) - T(0.5 * h);
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector2d along = (corners[(i + 1) % 3] - corners[i]).normalized();
      const Eigen::Vector2d out(along.y(), -along.x());
      found = max(found, x * T(out.x()) + y * T(out.y()) - T(out.dot(corners[i])));
    }
    return found;
  }
  Box box() const {
    const Eigen::Vector2d low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
    const Eigen::Vector2d high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
    return {{low.x(), low.y(), -0.5 * h}, {high.x(), high.y(), 0.5 * h}};
  }
  TriangleMesh mesh() const { return make_prism(corners, h); }
};

class FormulaSolid final : public ImplicitSolid {
 public:
  FormulaSolid(Formula f, const Box& within)
      : f_(std::move(f)), within_(within), hull_{0.5 * within.size_m()}, middle_m_(within.centre_m()) {}

  double value(const Eigen::Vector3d& p) const override {
    const Eigen::Vector3d q = p - middle_m_;
    const double hull = hull_.f(q.x(), q.y(), q.z());
    const double variables[3] = {p.x(), p.y(), p.z()};
    const double found = f_.value(variables);
    return std::isnan(found) ? kInf : max(found, hull);
  }
  Interval bounds(const Region& region) const override {
    Interval moved[3], variables[3];
    for (int i = 0; i < 3; ++i) {
      variables[i] = region.axis(i);
      moved[i] = variables[i] - Interval(middle_m_[i]);
    }
    const Interval hull = hull_.f(moved[0], moved[1], moved[2]);
    if (hull.lo > 0.0) return {hull.lo, kInf};
    const Interval found = f_.bounds(variables);
    if (found.empty()) return {kInf, kInf};
    return {max(found.lo, hull.lo), found.defined ? max(found.hi, hull.hi) : kInf};
  }
  std::size_t steps() const override { return kShapeSteps + f_.work(); }
  Box bounding_box() const override { return within_; }

 private:
  Formula f_;
  Box within_;
  Cuboid hull_;
  Eigen::Vector3d middle_m_;
};

class Placed final : public ImplicitSolid {
 public:
  Placed(ImplicitPtr solid, const Pose& X_AB, double scale)
      : solid_(std::move(solid)),
        X_AB_(X_AB),
        X_BA_(X_AB.inverse()),
        absolute_rotation_(X_BA_.rotation.cwiseAbs()),
        scale_(scale) {}

  double value(const Eigen::Vector3d& p) const override {
    return scale_ * solid_->value((X_BA_ * p) / scale_);
  }
  Interval bounds(const Region& region) const override {
    return solid_->bounds(in_solid_frame(region)) * Interval(scale_);
  }
  std::size_t steps() const override { return 4 + solid_->steps(); }
  ImplicitPtr within(const Region& region) const override {
    ImplicitPtr fewer = solid_->within(in_solid_frame(region));
    return fewer ? implicit_placed(std::move(fewer), X_AB_, scale_) : nullptr;
  }
  Box bounding_box() const override {
    const Box box = solid_->bounding_box();
    const Eigen::Vector3d centre = X_AB_ * (scale_ * box.centre_m());
    const Eigen::Vector3d half = X_AB_.rotation.cwiseAbs() * (0.5 * scale_ * box.size_m());
    return {centre - half, centre + half};
  }
  std::optional<TriangleMesh> tessellation() const override {
    auto mesh = solid_->tessellation();
    if (!mesh) return mesh;
    for (auto& vertex : mesh->vertices_m) vertex *= static_cast<float>(scale_);
    return mesh->transformed(X_AB_);
  }

 private:
  /// Returns the region in the solid's frame, enlarged a little because the transform rounds.
  Region in_solid_frame(const Region& region) const {
    const double slack = 1e-14 * (region.centre_m.cwiseAbs().sum() + X_AB_.translation_m.cwiseAbs().sum());
    return {(X_BA_ * region.centre_m) / scale_,
            (absolute_rotation_ * region.half_m + Eigen::Vector3d::Constant(slack)) / scale_,
            (region.radius_m + slack) / scale_};
  }

  ImplicitPtr solid_;
  Pose X_AB_, X_BA_;
  Eigen::Matrix3d absolute_rotation_;
  double scale_;
};

}  // namespace

ImplicitPtr implicit_sphere(double radius_m) { return std::make_shared<Primitive<Sphere>>(Sphere{radius_m}); }

ImplicitPtr implicit_cylinder(double radius_m, double height_m) {
  return std::make_shared<Primitive<Cylinder>>(Cylinder{radius_m, height_m});
}

ImplicitPtr implicit_cone(double radius_m, double top_radius_m, double height_m) {
  return std::make_shared<Primitive<Cone>>(Cone{radius_m, top_radius_m, height_m});
}

ImplicitPtr implicit_box(const Eigen::Vector3d& size_m) {
  return std::make_shared<Primitive<Cuboid>>(Cuboid{0.5 * size_m});
}

ImplicitPtr implicit_prism(const std::array<Eigen::Vector2d, 3>& corners_m, double height_m) {
  Prism prism{corners_m, height_m};
  const Eigen::Vector2d a = corners_m[1] - corners_m[0], b = corners_m[2] - corners_m[0];
  if (a.x() * b.y() - a.y() * b.x() < 0.0) std::swap(prism.corners[1], prism.corners[2]);
  return std::make_shared<Primitive<Prism>>(prism);
}

ImplicitPtr implicit_torus(double ring_radius_m, double tube_radius_m) {
  return std::make_shared<Primitive<Torus>>(Torus{ring_radius_m, tube_radius_m});
}

ImplicitPtr implicit_formula(Formula f, const Box& within) {
  return std::make_shared<FormulaSolid>(std::move(f), within);
}

ImplicitPtr implicit_placed(ImplicitPtr solid, const Pose& X_AB, double scale) {
  return std::make_shared<Placed>(std::move(solid), X_AB, scale);
}

}  // namespace phantom::geometry
