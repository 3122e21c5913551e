#pragma once

#include <cstdint>
#include <map>

#include "phantom_contract/workspace_samples.hpp"

namespace phantom::messages {

/// What depth cameras have found of objects' poses: the newest finding of each object. Not thread-safe.
class PoseFindings {
 public:
  static constexpr std::size_t kMax = 4096;  ///< objects; further ones' are left out

  /// Returns false if there is no room for another object's.
  bool take(PoseFinding finding);
  /// Returns the finding by which an object that the model has at X_WO now stands elsewhere, is gone or is
  /// unclear; null: there is none. A finding is of the object where it stood then: one that was moved since
  /// may stand right.
  const PoseFinding* displacing(std::uint16_t id, const geometry::Pose& X_WO) const;
  /// Returns the finding of an object, whatever it says; null: there is none.
  const PoseFinding* of(std::uint16_t id) const;
  /// All of them, by their objects.
  const std::map<std::uint16_t, PoseFinding>& all() const { return findings_; }

 private:
  std::map<std::uint16_t, PoseFinding> findings_;
};

}  // namespace phantom::messages
