#pragma once

#include "common/simulation/contact_world.hpp"

namespace phantom::simulation {

/// A wall for tests: free where normal·p > offset; distances are exact.
class HalfSpace final : public ContactWorld {
 public:
  static constexpr std::uint16_t kObject = 3;

  HalfSpace(const Eigen::Vector3d& normal, double offset_m) : normal_(normal), offset_m_(offset_m) {}
  double distance_m(const Eigen::Vector3d& p_W_m) const noexcept override {
    return normal_.dot(p_W_m) - offset_m_;
  }
  ContactQuery query(const Eigen::Vector3d& p_W_m) const noexcept override {
    return {distance_m(p_W_m), normal_, kObject};
  }
  double range_m() const noexcept override { return 0.3; }

 private:
  Eigen::Vector3d normal_;
  double offset_m_;
};

}  // namespace phantom::simulation
