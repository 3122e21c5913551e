#pragma once

#include <semaphore.h>

#include <array>
#include <bitset>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/core/snapshot.hpp"
#include "common/messages/percept.hpp"
#include "components/phantom_sensing/config.hpp"
#include "components/phantom_sensing/phantom_sensing.hpp"

namespace phantom::phantom_sensing {

/// Returns the DDS partitions in which the shares of the skin are published, in the model's order; none
/// without shares. They hold a hash of the parameters file, of the whole skin, its permanent contacts and the
/// soft bodies, or, of a share with a workspace of its own, of that one's cell file instead of the skin:
/// processes that would not sense the same do not meet. `cell_partition`: of everything else.
std::vector<std::string> share_partitions(const std::string& cell_partition, const Config& config,
                                          const PhantomModel& model, const percept::AllowedContact& contacts);

/// What a tick rests on; what others have sensed counts if it rests on the same.
struct ShareBasis {
  core::SampleId slave, gripper;  ///< gripper 0: the fingers are at their widest
  std::uint64_t workspace_version = 0;
  robot::DragMode mode = robot::DragMode::kSeparable;
};

/// Collects what the processes of the shares publish, and hands the arm's process what belongs to its tick.
/// A share with a workspace of its own has versions of its own; in their place its process tells by
/// SensedWorkspace::carried_key what the arm carries there. It may also say that it has sensed nothing: then
/// it is not waited for any longer, and counts as in time. A share that fails to come in time for
/// kMissesToRest ticks is no longer waited for, except at every kRetryEvery-th tick, until it comes in time
/// again.
class ShareInbox {
 public:
  static constexpr std::uint32_t kMissesToRest = 10, kRetryEvery = 100;

  ShareInbox(std::span<const SkinShare> shares, double wait_s);
  ~ShareInbox();
  ShareInbox(const ShareInbox&) = delete;
  ShareInbox& operator=(const ShareInbox&) = delete;

  // Of one share on one thread. Real-time safe: yes.
  void offer(std::size_t share, const messages::DragField& field) noexcept;
  void offer(std::size_t share, const messages::Percept& percept) noexcept;

  /// Returns what the shares have sensed on that basis, null for those that have not come after `wait_s`.
  /// Valid until the next call. One thread. Real-time safe: no lock, no heap; waits that long at most.
  SensedShares await(const ShareBasis& basis) noexcept;
  /// Returns which shares are no longer waited for. The thread of await().
  std::bitset<kMaxShares> resting() const noexcept;

 private:
  struct Share {
    core::Snapshot<messages::DragField> fields;
    core::Snapshot<messages::Percept> percepts;
    // Used in await() only.
    messages::DragField field;
    messages::Percept percept;
    SensedShare sensed;
    std::uint32_t misses = kMissesToRest;  // until the first has come
    bool own_workspace = false;
    bool rests() const noexcept { return misses >= kMissesToRest; }
    void read() noexcept;
    bool take(const ShareBasis& basis) noexcept;
    bool declines(const ShareBasis& basis) const noexcept;
  };

  std::array<Share, kMaxShares> shares_;
  const std::size_t count_;
  const core::Nanoseconds wait_ns_;
  std::uint32_t ticks_ = 0;
  sem_t wake_;
};

}  // namespace phantom::phantom_sensing
