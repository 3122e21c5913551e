#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/messages/percept.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "components/phantom_sensing/contact_permits.hpp"

namespace phantom::phantom_sensing {

struct Answer {
  bool done = false;
  std::string message;
};

/// Keeps the list of allowed contacts, and reports them by object and link name. Not thread-safe.
class ContactRegister {
 public:
  /// The arm must outlive this.
  explicit ContactRegister(const robot::SerialArm& arm) : arm_(arm) {}
  /// Sets the known objects' names, by id. Replaces all names set before.
  void know_objects(std::map<std::uint16_t, std::string> names) { names_ = std::move(names); }

  /// Allows or forbids a contact.
  Answer handle(const messages::SensingCommand& request, core::Nanoseconds now_ns);
  /// Reports which contacts are allowed, and for how much longer.
  Answer list(core::Nanoseconds now_ns) const;
  /// Removes the expired permits. Returns a sentence for each.
  std::vector<std::string> end_old(core::Nanoseconds now_ns);
  const ContactPermits& permits() const noexcept { return permits_; }
  std::string object_name(std::uint16_t id) const;

 private:
  Answer allow(const messages::SensingCommand& request, std::uint16_t id, std::size_t link,
               core::Nanoseconds now_ns);
  std::string describe(const ContactPermit& permit) const;

  const robot::SerialArm& arm_;
  std::map<std::uint16_t, std::string> names_;
  ContactPermits permits_;
};

}  // namespace phantom::phantom_sensing
