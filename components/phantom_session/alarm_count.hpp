#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>

#include "common/messages/percept.hpp"

namespace phantom::phantom_session {

/// Counts the entries that the alarm list of the operator's page begins (synthetic_viewer/web/alarms.js). A
/// motion that threatens is one entry, whichever objects it threatens: an object that asks for an answer
/// joins the entry that stands, or ended less than kSameMotion_s ago. An object keeps its entry until
/// kStays_s after that has ended. Times are seconds since the session began. Pure. Not thread-safe.
class AlarmCount {
 public:
  static constexpr double kStays_s = 10.0;           ///< a threat that returns by then continues its entry
  static constexpr double kSameMotion_s = 2.0;       ///< so soon after, another object is of the same motion
  static constexpr double kSoon_s = 3.0;             ///< a contact that is nearer asks for an answer
  static constexpr std::size_t kMaxStanding = 4096;  ///< alerts at once; what comes beyond is not counted

  /// Returns whether a threat asks for an answer: the page's *soon* and *urgent*. Less is watched, and no
  /// alarm.
  static bool asks(percept::HitRule rule, double contact_s) noexcept;

  /// Returns how many entries begin now: 0 or 1. `asks`: it did so when it was raised.
  std::size_t on_raised(double t_s, std::uint32_t alert, int object, bool asks);
  void on_cleared(double t_s, std::uint32_t alert);
  /// Returns how many entries begin now. `threats`: those that stand, as the percept has them.
  std::size_t on_threats(double t_s, std::span<const messages::Threat> threats);

  std::size_t entries() const noexcept { return entries_; }

 private:
  /// An object that is threatened, or was.
  struct Object {
    std::set<std::uint32_t> standing;  // alerts that have not ended
    double ended_s = 0.0;              // when the last one did
    std::size_t entry = 0;             // the one that it has joined, from 1; 0: none
  };
  /// Returns the time since an entry's threats have all ended; 0 while one stands.
  double over_s(double t_s, std::size_t entry) const;
  std::size_t join(double t_s, Object& object);

  std::map<int, Object> objects_;
  std::map<std::uint32_t, int> object_of_;  // by standing alert
  std::size_t entries_ = 0;
};

}  // namespace phantom::phantom_session
