#include "common/simulation/bus_model.hpp"

#include <algorithm>
#include <limits>

#include "common/can/bus_load.hpp"

namespace phantom::simulation {
namespace {

constexpr core::Nanoseconds kNever = std::numeric_limits<core::Nanoseconds>::max();
constexpr std::size_t kReserved = 16384;

core::Nanoseconds bits_ns(double bit_rate, std::uint32_t bits) {
  return bit_rate > 0.0 ? core::from_seconds(bits / bit_rate) : 0;
}

}  // namespace

BusModel::BusModel(const BusModelOptions& options) : options_(options), random_(options.seed) {
  deliveries_.reserve(kReserved);
}

BusModel::NodeId BusModel::attach() {
  const auto place = std::find_if(nodes_.begin(), nodes_.end(), [](const Node& n) { return !n.attached; });
  Node fresh;
  fresh.ring.resize(options_.queue_frames);
  if (place == nodes_.end()) {
    nodes_.push_back(std::move(fresh));
    return nodes_.size() - 1;
  }
  *place = std::move(fresh);
  return static_cast<NodeId>(place - nodes_.begin());
}

void BusModel::detach(NodeId node) {
  nodes_[node].attached = false;
  nodes_[node].count = 0;
  std::erase_if(deliveries_, [node](const Delivery& d) { return d.to == node; });
  std::make_heap(deliveries_.begin(), deliveries_.end(), later);
}

void BusModel::set_plugged(NodeId node, bool plugged) { nodes_[node].plugged = plugged; }

void BusModel::set_faults(std::vector<FaultRule> rules) { rules_ = std::move(rules); }

void BusModel::set_bus_off(NodeId node, core::Nanoseconds now_ns) {
  Node& n = nodes_[node];
  n.bus_off = true;
  n.back_ns = -1;
  n.count = 0;
  push_event(node, can::kErrorBusOff, can::BusState::kBusOff, now_ns);
}

void BusModel::restart(NodeId node, core::Nanoseconds now_ns) {
  constexpr std::uint32_t kRecoveryBits = 128 * 11;
  if (nodes_[node].bus_off) nodes_[node].back_ns = now_ns + bits_ns(options_.bit_rate, kRecoveryBits);
}

bool BusModel::submit(NodeId node, const can::CanFrame& frame, core::Nanoseconds now_ns) {
  Node& n = nodes_[node];
  if (!n.attached || n.bus_off || !is_valid(frame) || n.count == n.ring.size()) return false;
  n.ring[(n.first + n.count++) % n.ring.size()] = {frame, now_ns};
  return true;
}

bool BusModel::later(const Delivery& a, const Delivery& b) noexcept {
  return a.time_ns != b.time_ns ? a.time_ns > b.time_ns : a.order > b.order;
}

void BusModel::push(core::Nanoseconds time_ns, NodeId to, const can::Received& received) {
  deliveries_.push_back({time_ns, order_++, to, received});
  deliveries_.back().received.time_ns = time_ns;
  std::push_heap(deliveries_.begin(), deliveries_.end(), later);
}

void BusModel::push_event(NodeId to, std::uint16_t errors, can::BusState state, core::Nanoseconds time_ns) {
  push(time_ns, to, {.frame = {}, .errors = errors, .state = state});
}

bool BusModel::someone_acknowledges(NodeId sender) const noexcept {
  for (NodeId i = 0; i < nodes_.size(); ++i) {
    if (i != sender && nodes_[i].speaks()) return true;
  }
  return false;
}

core::Nanoseconds BusModel::earliest_submitted() const noexcept {
  core::Nanoseconds earliest = kNever;
  for (NodeId i = 0; i < nodes_.size(); ++i) {
    const Node& n = nodes_[i];
    if (n.speaks() && n.count > 0 && !(n.unacknowledged && !someone_acknowledges(i)))
      earliest = std::min(earliest, n.ring[n.first].submitted_ns);
  }
  return earliest;
}

BusModel::NodeId BusModel::winner(core::Nanoseconds at_ns) const noexcept {
  NodeId best = nodes_.size();
  for (NodeId i = 0; i < nodes_.size(); ++i) {
    const Node& n = nodes_[i];
    if (!n.speaks() || n.count == 0 || n.ring[n.first].submitted_ns > at_ns) continue;
    if (best == nodes_.size() || arbitration_rank(n.ring[n.first].frame) <
                                     arbitration_rank(nodes_[best].ring[nodes_[best].first].frame))
      best = i;
  }
  return best;
}

// Sends the next frame if it begins by now_ns. All nodes with a frame queued when the bus becomes idle take
// part in the arbitration.
bool BusModel::transmit_one(core::Nanoseconds now_ns) {
  const core::Nanoseconds submitted_ns = earliest_submitted();
  if (submitted_ns == kNever) return false;
  const core::Nanoseconds begin_ns = std::max(free_ns_, submitted_ns);
  if (begin_ns > now_ns) return false;
  const NodeId sender = winner(begin_ns);
  Node& n = nodes_[sender];
  if (!someone_acknowledges(sender)) {
    if (!n.unacknowledged)
      push_event(sender, can::kErrorNoAck | can::kErrorState, can::BusState::kPassive, begin_ns);
    n.unacknowledged = true;  // the node keeps trying
    return true;
  }
  const can::CanFrame frame = n.ring[n.first].frame;
  n.first = (n.first + 1) % n.ring.size();
  --n.count;
  free_ns_ = begin_ns + bits_ns(options_.bit_rate, worst_case_bits(frame));
  if (n.unacknowledged) push_event(sender, can::kErrorState, can::BusState::kActive, free_ns_);
  n.unacknowledged = false;
  put_on_bus(sender, frame, free_ns_);
  return true;
}

void BusModel::put_on_bus(NodeId sender, const can::CanFrame& frame, core::Nanoseconds end_ns) {
  ++frames_;
  int copies = 1;
  core::Nanoseconds delays_ns[2] = {0, 0};
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (const FaultRule& rule : rules_) {
    if ((frame.id & rule.mask) != (rule.id & rule.mask)) continue;
    if (rule.drop > 0.0 && share(random_) < rule.drop) return;
    if (rule.duplicate > 0.0 && share(random_) < rule.duplicate) copies = 2;
    for (core::Nanoseconds& delay_ns : delays_ns)
      delay_ns += rule.delay_ns +
                  static_cast<core::Nanoseconds>(share(random_) * static_cast<double>(rule.jitter_ns));
  }
  for (int copy = 0; copy < copies; ++copy) {
    for (NodeId to = 0; to < nodes_.size(); ++to) {
      if (to != sender && nodes_[to].speaks()) push(end_ns + delays_ns[copy], to, {.frame = frame});
    }
  }
}

void BusModel::finish_restarts(core::Nanoseconds now_ns) {
  for (NodeId i = 0; i < nodes_.size(); ++i) {
    Node& n = nodes_[i];
    if (!n.bus_off || n.back_ns < 0 || n.back_ns > now_ns) continue;
    n.bus_off = false;
    push_event(i, can::kErrorRestarted | can::kErrorState, can::BusState::kActive, n.back_ns);
    n.back_ns = -1;
  }
}

void BusModel::advance(core::Nanoseconds now_ns, const Deliver& deliver) {
  finish_restarts(now_ns);
  while (transmit_one(now_ns)) {
  }
  while (!deliveries_.empty() && deliveries_.front().time_ns <= now_ns) {
    std::pop_heap(deliveries_.begin(), deliveries_.end(), later);
    const Delivery next = deliveries_.back();
    deliveries_.pop_back();
    if (nodes_[next.to].attached) deliver(next.to, next.received);
  }
}

core::Nanoseconds BusModel::next_event_ns() const noexcept {
  core::Nanoseconds next_ns = deliveries_.empty() ? kNever : deliveries_.front().time_ns;
  const core::Nanoseconds submitted_ns = earliest_submitted();
  if (submitted_ns != kNever) next_ns = std::min(next_ns, std::max(submitted_ns, free_ns_));
  for (const Node& n : nodes_) {
    if (n.bus_off && n.back_ns >= 0) next_ns = std::min(next_ns, n.back_ns);
  }
  return next_ns;
}

}  // namespace phantom::simulation
