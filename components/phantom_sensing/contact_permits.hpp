#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/core/clock.hpp"
#include "common/percept/allowed_contact.hpp"

namespace phantom::phantom_sensing {

/// An intended contact: `link` may touch `object` until a given time.
struct ContactPermit {
  std::uint16_t object = 0;
  std::size_t link = percept::AllowedContact::kWholeArm;
  core::Nanoseconds until_ns = kForever;
  static constexpr core::Nanoseconds kForever = std::numeric_limits<core::Nanoseconds>::max();
};

/// The permits in force, with their ends. Bounded; copying uses no heap.
class ContactPermits {
 public:
  static constexpr std::size_t kMax = percept::AllowedContact::kMax;

  /// Adds a permit, or replaces the one for the same object and link. Returns false if the list is full.
  bool allow(const ContactPermit& permit) noexcept {
    for (std::size_t i = 0; i < count_; ++i) {
      if (permits_[i].object != permit.object || permits_[i].link != permit.link) continue;
      permits_[i] = permit;
      return true;
    }
    if (count_ == kMax) return false;
    permits_[count_++] = permit;
    return true;
  }
  /// Removes the permit for exactly this object and link. Returns false if there is none.
  bool forbid(std::uint16_t object, std::size_t link) noexcept {
    return remove_if([&](const ContactPermit& p) { return p.object == object && p.link == link; }) > 0;
  }
  void forbid_all() noexcept { count_ = 0; }
  /// Removes the permits that have expired and returns them.
  std::vector<ContactPermit> take_ended(core::Nanoseconds now_ns) {
    std::vector<ContactPermit> ended;
    remove_if([&](const ContactPermit& p) {
      if (p.until_ns > now_ns) return false;
      ended.push_back(p);
      return true;
    });
    return ended;
  }
  /// Returns the contacts allowed at `now_ns`. Real-time safe: yes.
  percept::AllowedContact at(core::Nanoseconds now_ns) const noexcept {
    percept::AllowedContact allowed;
    for (std::size_t i = 0; i < count_; ++i) {
      if (permits_[i].until_ns > now_ns) allowed.add(permits_[i].object, permits_[i].link);
    }
    return allowed;
  }
  std::size_t size() const noexcept { return count_; }
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (std::size_t i = 0; i < count_; ++i) visit(permits_[i]);
  }

 private:
  template <class Condition>
  std::size_t remove_if(Condition condition) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      if (!condition(permits_[i])) permits_[kept++] = permits_[i];
    }
    const std::size_t removed = count_ - kept;
    count_ = kept;
    return removed;
  }
  std::array<ContactPermit, kMax> permits_{};
  std::size_t count_ = 0;
};

}  // namespace phantom::phantom_sensing
