#pragma once

#include <atomic>
#include <memory>

#include "components/slave_io/arm_driver.hpp"
#include "components/slave_io/contact_log.hpp"
#include "components/slave_io/model.hpp"

namespace phantom::slave_io {

/// Simulates drives, arm and contact, and records the contacts of the session.
class SimulatedArm final : public ArmDriver {
 public:
  /// `model` and `world` must outlive the arm. `loose`: what else is in the cell, for it to move; `yielding`:
  /// what gives way.
  SimulatedArm(const ArmModel& model, const Config& config, const simulation::ContactWorld& world,
               std::vector<simulation::LooseObject> loose = {},
               std::unique_ptr<simulation::Yielding> yielding = nullptr);

  const ArmSense& sense() noexcept override;
  void move(const ArmDemand& demand, double dt_s, core::Nanoseconds now_ns) noexcept override;
  void end(core::Nanoseconds) noexcept override {}  // its time ends with the loop's
  void carry(const robot::Payload& payload) noexcept override { plant_.carry(payload); }
  void fill(messages::SlaveState& state) const noexcept override;
  bool makes_up_periods() const noexcept override { return true; }
  core::ActuatorHealth health() override;

  simulation::SlavePlant& plant() noexcept { return plant_; }
  const simulation::SlavePlant& plant() const noexcept { return plant_; }
  const ContactLog& contacts() const noexcept { return contacts_; }  ///< after the servo thread has ended
  std::size_t contact_point_count() const noexcept { return plant_.contact_point_count(); }

 private:
  bool force_sensor_;
  simulation::SlavePlant plant_;
  ContactLog contacts_;
  ArmSense sense_;
  std::atomic<double> clearance_m_{-1.0};
};

}  // namespace phantom::slave_io
