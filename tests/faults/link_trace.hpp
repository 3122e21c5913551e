#pragma once

// What master and slave say, as lines of JSON that scripts/checks/link_trace judges by the model of the link.

#include <array>
#include <cmath>
#include <ostream>

#include "phantom_idl/teleoperation.hpp"

namespace phantom::faults {

class LinkTrace {
 public:
  explicit LinkTrace(std::ostream& out) : out_(out) {}

  void put(const msg::MasterState& m) {
    begin("master_state", m);
    joints("percept_torque_Nm", m.percept_torque_Nm(), m.joint_count());
    joints("feedback_torque_Nm", m.feedback_torque_Nm(), m.joint_count());
    end("slave_echo", m.slave_echo());
  }
  void put(const msg::SlaveState& s) {
    begin("slave_state", s);
    joints("position_rad", s.position_rad(), s.joint_count());
    end("master_echo", s.master_echo());
  }
  /// A person's reset, as both sides receive it.
  void put_reset(std::uint64_t master_stop, std::uint64_t slave_stop) {
    out_ << R"({"topic":"operator_command","sample":{"kind":"COMMAND_RESET","master_stop":)" << master_stop
         << R"(,"slave_stop":)" << slave_stop << "}}\n";
  }
  void put_event(const std::string& members) { out_ << R"({"event":)" << members << "}\n"; }

 private:
  template <class Message>
  void begin(const char* topic, const Message& m) {
    constexpr std::array kStates{"INIT", "READY", "ALIGNED", "COUPLED", "DEGRADED", "STOPPED"};
    constexpr std::array kCauses{"NONE", "EMERGENCY", "DRIVE_FAULT", "PARTNER"};
    out_ << R"({"topic":")" << topic << R"(","sample":{"stamp":{"session":)" << m.stamp().session()
         << R"(,"sequence_number":)" << m.stamp().sequence_number() << R"(,"monotonic_ns":)"
         << m.stamp().monotonic_ns() << R"(},"state":"LINK_)"
         << kStates.at(static_cast<std::size_t>(m.state())) << R"(","stop_cause":"STOP_)"
         << kCauses.at(static_cast<std::size_t>(m.stop_cause())) << R"(","stop":)" << m.stop()
         << R"(,"joint_count":)" << m.joint_count();
  }
  void joints(const char* name, const std::array<double, 16>& values, std::size_t count) {
    out_ << ",\"" << name << "\":[";
    for (std::size_t j = 0; j < count; ++j) {
      out_ << (j == 0 ? "" : ",");
      std::isfinite(values[j]) ? out_ << values[j] : out_ << "\"NaN\"";
    }
    out_ << ']';
  }
  void end(const char* name, const msg::Echo& echo) {
    out_ << ",\"" << name << R"(":{"session":)" << echo.session() << R"(,"sequence_number":)"
         << echo.sequence_number() << "}}}\n";
  }

  std::ostream& out_;
};

}  // namespace phantom::faults
