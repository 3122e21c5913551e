#include "components/wva_server/live/live_intake.hpp"

#include <algorithm>

namespace phantom::wva_server {

bool LiveIntake::put(messages::OccupancyChange sample, core::Nanoseconds received_ns) {
  received_ns_ = received_ns;
  cameras_ = std::move(sample.cameras);
  const bool is_next =
      sample.stamp.session == newest_.session && sample.stamp.sequence_number == newest_.sequence_number + 1;
  newest_ = sample.stamp;
  if (sample.whole) {
    blocks_.clear();
    exposed_ns_.reset();
    follows_ = waiting_ = whole_ = true;
  } else if (!follows_ || !is_next) {
    missed_ += follows_ ? 1 : 0;
    restart();
    return false;
  }
  for (const messages::OccupancyBlock& block : sample.blocks)
    blocks_.insert_or_assign({block.x, block.y, block.z}, block);
  waiting_ = waiting_ || !sample.blocks.empty();
  if (!sample.blocks.empty() && sample.image_age_s >= 0.0) {
    const core::Nanoseconds exposed_ns = received_ns - core::from_seconds(sample.image_age_s);
    exposed_ns_ = std::min(exposed_ns_.value_or(exposed_ns), exposed_ns);
  }
  // Nobody takes them: what waits is bounded all the same, and comes whole again.
  if (blocks_.size() > 4 * messages::kMaxOccupancyBlocks) {
    restart();
    return false;
  }
  return true;
}

void LiveIntake::restart() {
  follows_ = waiting_ = whole_ = false;
  blocks_.clear();
  exposed_ns_.reset();
}

std::optional<LiveIntake::Taken> LiveIntake::take() {
  if (!waiting_) return std::nullopt;
  Taken taken{whole_, {}, exposed_ns_};
  taken.blocks.reserve(blocks_.size());
  for (const auto& [place, block] : blocks_) taken.blocks.push_back(block);
  waiting_ = whole_ = false;
  blocks_.clear();
  exposed_ns_.reset();
  return taken;
}

}  // namespace phantom::wva_server
