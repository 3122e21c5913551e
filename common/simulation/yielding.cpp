#include "common/simulation/yielding.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "common/geometry/cross_matrix.hpp"
#include "common/robot/kinematics/jacobian.hpp"
#include "common/simulation/mesh_world.hpp"

namespace phantom::simulation {
namespace {

using robot::Spatial;

constexpr double kAnywhere_m = 1e3;

robot::SkinLayout weighted_by_area(robot::SkinLayout skin) {
  skin.normalisation = robot::Normalisation::kArea;
  skin.weight = skin.area_m2;
  return skin;
}

}  // namespace

std::vector<SoftLayer> soft_layers(const workspace::LayerProfile& profile, double reference_m) {
  std::vector<SoftLayer> layers;
  for (std::size_t i = 0; i < profile.stiffness_inside_Pa_per_m.size(); ++i)
    layers.push_back({profile.inside_thickness_vox[i] * reference_m, profile.stiffness_inside_Pa_per_m[i],
                      static_cast<double>(profile.mu_inside_Pa_s_per_m[i])});
  if (!layers.empty())
    layers.push_back(
        {reference_m, layers.back().stiffness_Pa_per_m, static_cast<double>(profile.mu_skin_Pa_s_per_m)});
  return layers;
}

core::JointArray JointYield::torque(const core::JointArray& q, const core::JointArray& v) const noexcept {
  core::JointArray sum{};
  if (!some) return sum;
  for (Eigen::Index i = 0; i < damping.rows(); ++i) {
    double& t = sum[static_cast<std::size_t>(i)];
    t = at_rest[static_cast<std::size_t>(i)];
    for (Eigen::Index k = 0; k < damping.cols(); ++k) {
      const auto joint = static_cast<std::size_t>(k);
      t -= stiffness(i, k) * (q[joint] - q0[joint]) + damping(i, k) * v[joint];
    }
  }
  return sum;
}

Yielding::Yielding(robot::SkinLayout skin, const robot::Medium& medium, const std::vector<SoftSolid>& bodies)
    : skin_(weighted_by_area(std::move(skin))), medium_(skin_, medium), fluids_(!medium.empty()) {
  for (const SoftSolid& solid : bodies) {
    Body body{solid.id, {}, solid.layers, {}};
    for (const geometry::TriangleMesh& shell : closed_shells(solid.mesh_W))
      if (!shell.triangles.empty()) body.shells.emplace_back(shell);
    double above_Pa = 0.0;
    for (const SoftLayer& layer : body.layers) {
      body.above_Pa.push_back(above_Pa);
      above_Pa += layer.stiffness_Pa_per_m * layer.thickness_m;
    }
    shell_count_ += body.shells.size();
    bodies_.push_back(std::move(body));
  }
  seen_.resize(skin_.size() * shell_count_);
}

Yielding::Pressed Yielding::pressed_at(std::size_t sensor, const Eigen::Vector3d& p_W_m) noexcept {
  Pressed pressed;
  std::size_t shell_index = sensor * shell_count_;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Body& body = bodies_[b];
    for (const MeshSurface& shell : body.shells) {
      Seen& seen = seen_[shell_index++];
      if (shell.square_to_box(p_W_m) > 0.0) continue;
      if ((p_W_m - seen.p_W_m).squaredNorm() < seen.distance_m * seen.distance_m) continue;
      const MeshSurface::Nearest nearest = shell.nearest(p_W_m, kAnywhere_m);
      seen = {p_W_m, std::max(0.0, nearest.distance_m)};
      if (nearest.distance_m >= 0.0) continue;
      double left_m = -nearest.distance_m;
      std::size_t layer = 0;
      for (; layer + 1 < body.layers.size() && left_m > body.layers[layer].thickness_m; ++layer)
        left_m -= body.layers[layer].thickness_m;
      const double pressure_Pa = body.above_Pa[layer] + body.layers[layer].stiffness_Pa_per_m * left_m;
      if (pressed.layer == nullptr || pressure_Pa > pressed.pressure_Pa)
        pressed = {pressure_Pa, &body.layers[layer], nearest.normal, b};
    }
  }
  return pressed;
}

Yielding::LinkYield Yielding::in_fluid(std::size_t link) const noexcept {
  const robot::MediumSums& sums = medium_.sums()[link];
  LinkYield yield;
  yield.some = sums.fluid.mu > 0.0;
  if (!yield.some) return yield;
  const Eigen::Matrix3d cross = geometry::cross_matrix(sums.fluid.mu_d);
  yield.damping << sums.fluid.mu * Eigen::Matrix3d::Identity(), -cross, cross,
      sums.fluid.mu_dd.trace() * Eigen::Matrix3d::Identity() - sums.fluid.mu_dd;
  yield.at_rest << sums.push, sums.push_moment;
  return yield;
}

// Adds what soft bodies do to a link that moves with `twist`.
void Yielding::press(std::size_t link, const geometry::Pose& X_WL, const Spatial& twist, double closed,
                     LinkYield& yield) noexcept {
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero(), centre = Eigen::Vector3d::Zero();
  double weight_N = 0.0, greatest_N = 0.0;
  std::uint16_t object = 0;
  for (std::size_t i = skin_.first[link]; i < skin_.first[link + 1]; ++i) {
    const double area_m2 = skin_.area_m2[i];
    if (!(area_m2 > 0.0)) continue;
    const Eigen::Vector3d p_W_m = X_WL * skin_.position(i, closed);
    const Pressed pressed = pressed_at(i, p_W_m);
    if (pressed.layer == nullptr) continue;
    const Eigen::Vector3d d_m = p_W_m - X_WL.translation_m, &out = pressed.out_W;
    Eigen::Matrix<double, 3, 6> point;  // the sensor's velocity per twist
    point << Eigen::Matrix3d::Identity(), -geometry::cross_matrix(d_m);
    const double mu = pressed.layer->viscosity_Pa_s_per_m;
    const bool lets_go = pressed.pressure_Pa < mu * out.dot(point * twist);
    const double push_N = lets_go ? 0.0 : area_m2 * pressed.pressure_Pa;
    Eigen::Matrix3d brake = area_m2 * mu * Eigen::Matrix3d::Identity();
    if (lets_go) brake -= area_m2 * mu * out * out.transpose();
    yield.damping += point.transpose() * brake * point;
    yield.some = true;
    if (lets_go) continue;
    const Spatial along = point.transpose() * out;
    yield.at_rest += push_N * along;
    yield.stiffness += area_m2 * pressed.layer->stiffness_Pa_per_m * along * along.transpose();
    force_N += push_N * out;
    centre += push_N * p_W_m;
    weight_N += push_N;
    if (push_N > greatest_N) greatest_N = push_N, object = bodies_[pressed.body].id;
  }
  if (force_N.norm() > touch_.force_N) touch_ = {force_N.norm(), object, centre / weight_N};
}

void Yielding::sense(const robot::SerialArm& arm, const robot::LinkPoses& X_WL, const core::JointArray& q,
                     const core::JointArray& v, double closed) noexcept {
  const std::size_t count = arm.joint_count();
  const auto n = static_cast<Eigen::Index>(count);
  joints_.some = false;
  touch_ = {};
  joints_.damping.setZero(n, n);
  joints_.stiffness.setZero(n, n);
  joints_.at_rest = {};
  joints_.q0 = q;
  if (fluids_) medium_.sense(X_WL, count, closed);
  const Eigen::Map<const Eigen::VectorXd> speed(v.data(), n);
  for (std::size_t link = 1; link <= count; ++link) {
    if (skin_.first[link] == skin_.first[link + 1]) continue;
    const robot::Jacobian all = robot::point_jacobian(arm, X_WL, link, X_WL[link].translation_m);
    const auto columns = all.leftCols(n);
    LinkYield yield = fluids_ ? in_fluid(link) : LinkYield();
    if (!bodies_.empty()) press(link, X_WL[link], columns * speed, closed, yield);
    if (!yield.some) continue;
    joints_.some = true;
    Eigen::Map<Eigen::VectorXd>(joints_.at_rest.data(), n).noalias() += columns.transpose() * yield.at_rest;
    const Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, static_cast<int>(core::kMaxJoints)>
        braked = yield.damping * columns,
        pressed = yield.stiffness * columns;
    joints_.damping.noalias() += columns.transpose() * braked;
    joints_.stiffness.noalias() += columns.transpose() * pressed;
  }
}

}  // namespace phantom::simulation
