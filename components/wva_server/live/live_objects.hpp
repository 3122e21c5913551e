#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/core/status.hpp"
#include "common/messages/living.hpp"
#include "components/wva_server/live/live_part.hpp"
#include "phantom_contract/workspace_samples.hpp"

namespace phantom::wva_server {

using messages::LiveStanding;

/// A thing that cameras see and the model lacks.
struct TrackedObject {
  std::string name;
  LiveStanding standing = LiveStanding::kTracked;
  LivePart part;  ///< as it was seen last
  /// Of a lost one: when it was seen last. Of a discarded one: when something was seen there last.
  core::Nanoseconds seen_ns = 0;

  /// Returns whether its voxels are in the workspace.
  bool is_there() const { return standing == LiveStanding::kTracked || standing == LiveStanding::kFrozen; }
  /// Returns whether a person has decided about its voxels, so that what cameras see there is not asked.
  bool is_fixed() const { return standing == LiveStanding::kFrozen || standing == LiveStanding::kDiscarded; }
};

/// Follows what cameras see from sight to sight, so that a thing keeps its id and name. A part is the object
/// with which it shares most voxels; else the one that was seen last within kMaxStep_m of it and is not more
/// than four times as large or small; else a new one. Of a thing that falls apart the part that shares most
/// keeps the id. An id is given again kLost_s after its object was seen last, those that were free for
/// longest first. Deterministic; not thread-safe; not real-time safe.
class LiveObjects {
 public:
  static constexpr double kMaxStep_m = 0.25;  ///< a hand at 2.5 m/s, ten times a second
  static constexpr double kLost_s = 2.0;
  static constexpr double kForgotten_s = 10.0;  ///< of a discarded one, after something was seen there

  explicit LiveObjects(double voxel_m);

  /// Takes all parts that are seen now. Returns those for which no id is left, put together.
  LivePart follow(std::vector<LivePart> parts, core::Nanoseconds now_ns);
  /// Forgets what was lost for too long, and what was discarded where nothing is seen any more. Returns
  /// whether one of them was discarded.
  bool expire(core::Nanoseconds now_ns);

  const std::map<std::uint16_t, TrackedObject>& all() const { return objects_; }
  /// Returns the id of the object of this name; 0: there is none.
  std::uint16_t find(const std::string& name) const;

  // Each of these says why not, and what is allowed, and changes nothing then.
  core::Status freeze(std::uint16_t id);
  core::Status discard(std::uint16_t id, core::Nanoseconds now_ns);
  /// Lets cameras decide again about what was frozen or discarded.
  core::Status restore(std::uint16_t id, core::Nanoseconds now_ns);
  /// Gives it a name until it is forgotten. Who calls knows that no object of the model has it.
  core::Status rename(std::uint16_t id, const std::string& name);
  /// Gives a known object the name again that it had at first.
  void drop_name(std::uint16_t id) { objects_.at(id).name = messages::live_name(id); }
  /// Something was seen where this one was discarded.
  void see_discarded(std::uint16_t id, core::Nanoseconds now_ns) { objects_.at(id).seen_ns = now_ns; }

 private:
  std::uint16_t new_id(core::Nanoseconds now_ns);
  core::Expected<TrackedObject*> look_up(std::uint16_t id);
  void forget(std::uint16_t id);

  double voxel_m_;
  std::map<std::uint16_t, TrackedObject> objects_;
  std::deque<std::uint16_t> free_ids_;
};

}  // namespace phantom::wva_server
