#include "components/slave_io/payload.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "common/robot/kinematics/arm_dynamics.hpp"

namespace phantom::slave_io {
namespace {

Eigen::Matrix3d inertia_of(const messages::CarriedObject& object) {
  const Eigen::Vector3d &m = object.moments_kg_m2, &p = object.products_kg_m2;
  Eigen::Matrix3d inertia;
  inertia << m.x(), p.x(), p.y(), p.x(), m.y(), p.z(), p.y(), p.z(), m.z();
  return inertia;
}

}  // namespace

core::Expected<robot::Payload> payload_of(const std::vector<messages::CarriedObject>& carried,
                                          const PayloadRule& rule) {
  robot::Payload payload;
  const auto refusal = [](const std::string& what) {
    return core::Status::invalid_argument("what the arm carries is not counted with: " + what);
  };
  for (const messages::CarriedObject& object : carried) {
    if (object.arm != rule.name || object.mass_kg <= 0.0 || std::ranges::count(rule.weighed, object.id) > 0)
      continue;
    const auto frame = rule.arm->find_frame(object.frame);
    if (!frame || frame->first == 0)
      return refusal(fmt::format("object {} is on '{}', which is no moving link", object.id, object.frame));
    if (!robot::is_inertia(inertia_of(object)))
      return refusal(fmt::format("object {} has an inertia that no body has", object.id));
    const geometry::Pose X_LO = frame->second * object.X_FO;
    robot::add_body(payload, frame->first, object.mass_kg, X_LO * object.centre_of_mass_m,
                    X_LO.rotation * inertia_of(object) * X_LO.rotation.transpose());
    // Of uniform density, as its moments are: the volume has the mass's centre.
    if (const auto known = rule.volumes_m3.find(object.id); known != rule.volumes_m3.end())
      robot::add_displaced(payload, frame->first, known->second, X_LO * object.centre_of_mass_m);
  }
  if (payload.mass_kg() > rule.limit_kg)
    return refusal(fmt::format("it weighs {:.3g} kg; allowed: {:.3g} kg (max_payload_kg)", payload.mass_kg(),
                               rule.limit_kg));
  return payload;
}

}  // namespace phantom::slave_io
