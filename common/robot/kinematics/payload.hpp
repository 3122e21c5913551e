#pragma once

#include <Eigen/Core>
#include <array>

#include "common/core/joints.hpp"

namespace phantom::robot {

/// A rigid body in the frame of the link to which it is fixed. Trivially copyable.
struct LoadBody {
  double mass_kg = 0.0;
  std::array<double, 3> centre_m{};        ///< of mass
  std::array<double, 9> inertia_kg_m2{};   ///< about that centre, along the link's axes; row by row
  double displaced_m3 = 0.0;               ///< what it takes up of a fluid; 0: unknown
  std::array<double, 3> displaced_at_m{};  ///< centre of that volume

  Eigen::Vector3d centre() const noexcept { return Eigen::Vector3d::Map(centre_m.data()); }
  Eigen::Matrix3d inertia() const noexcept { return Eigen::Matrix3d::Map(inertia_kg_m2.data()); }
  friend bool operator==(const LoadBody&, const LoadBody&) = default;
};

/// What an arm carries, besides its own links: by link index, all bodies of a link as one.
struct Payload {
  std::array<LoadBody, core::kMaxJoints + 1> on_link{};

  double mass_kg() const noexcept {
    double sum = 0.0;
    for (const LoadBody& body : on_link) sum += body.mass_kg;
    return sum;
  }
  double displaced_m3() const noexcept {
    double sum = 0.0;
    for (const LoadBody& body : on_link) sum += body.displaced_m3;
    return sum;
  }
  friend bool operator==(const Payload&, const Payload&) = default;
};

}  // namespace phantom::robot
